"""What Khronos' glTF validator finds in a folder's characters, and in the same files with one more animation of ours.

python benchmarks/gltf_validator.py FOLDER VALIDATOR       # VALIDATOR: the folder that `npm install gltf-validator` was
                                                           # run in; Node must be there

A line per file: errors and warnings before and after. Exits with 1 where ours has more of any kind than the original.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import warnings
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "packages/motionloom"))

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.io.character import load_character
from motionloom.io.gltf import save_glb
from motionloom.retarget import retarget
from tests.io.rigged import Hero, wave

SUFFIXES = (".glb", ".gltf", ".vrm")
_SCRIPT = """
const validator = require("gltf-validator"), fs = require("fs");
(async () => {
  const found = [];
  for (const file of process.argv.slice(1)) {
    const bytes = new Uint8Array(fs.readFileSync(file));
    const format = file.endsWith(".gltf") ? "gltf" : "glb";
    const report = await validator.validateBytes(bytes, {maxIssues: 0, format});
    found.push(report.issues.messages.map((m) => [m.severity, m.code]));
  }
  console.log(JSON.stringify(found));
})().catch((error) => { console.error(error); process.exit(1); });
"""


def validated(files: list[Path], validator: Path) -> list[Counter[str]]:
    """How often each error and warning (the validator's severities 0 and 1) is found, for each file."""
    ended = subprocess.run(
        ["node", "-e", _SCRIPT, *(str(file.resolve()) for file in files)],
        cwd=validator,
        check=False,
        capture_output=True,
        text=True,
        timeout=600,
    )
    if ended.returncode:
        sys.exit(f"the validator does not run: {ended.stderr.strip()[-500:]}")
    kinds = ("error", "warning")
    return [Counter(f"{kinds[s]} {code}" for s, code in issues if s < 2) for issues in json.loads(ended.stdout)]


def waving() -> Motion:
    """Somebody who goes ahead and waves with everything."""
    way = np.arange(40)[:, None] * [0.002, 0.0, 0.02]
    return Motion(SMPL22, 30.0, SMPL22.offsets[0] + way, rot.rotvec_to_quat(wave()))


def pairs(folder: Path, made: Path) -> list[tuple[Path, Path]]:
    """Files as they were and with our animation: the folder's, a character of ours, and what is written without one."""
    hero = Hero().clip("wave", wave()).write(made / "hero.glb")
    found = []
    for path in [*sorted(p for p in folder.iterdir() if p.suffix.lower() in SUFFIXES), hero]:
        for replace in (False, True):
            try:
                character = load_character(path)
            except MotionloomError as error:
                print(f"{path.name:24} {str(error).replace(str(path), path.name)[:90]}")
                break
            out = made / f"{path.stem}_{'only' if replace else 'more'}{path.suffix}"
            motion = retarget(waving(), character.skeleton)
            found.append((path, character.save(motion, out, name="ours", replace=replace)))
    return [*found, (hero, save_glb([waving()], made / "ours.glb"))]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("validator", type=Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as made, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        both = pairs(arguments.folder, Path(made))
        before = validated([old for old, _ in both], arguments.validator)
        after = validated([new for _, new in both], arguments.validator)
    worse = 0
    for (_, new), old_issues, new_issues in zip(both, before, after):
        more = new_issues - old_issues
        worse += bool(more)
        print(f"{new.name:34} {old_issues.total():5} before {new_issues.total():5} after {dict(more) or ''}")
    print(f"{worse} of {len(both)} files have errors or warnings that the original has not")
    sys.exit(bool(worse))


if __name__ == "__main__":
    main()
