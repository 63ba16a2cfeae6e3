"""Write docs/rigs.md: what each command does with every file of a folder of characters and recordings.

python tools/make_rigs_table.py FOLDER          # such as ../shared/rigs
"""

import contextlib
import io
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

from motionloom.cli import main
from motionloom.io.bvh_writer import save_bvh
from motionloom.motion import Motion
from motionloom.retarget import to_smpl22
from motionloom.rotations import IDENTITY
from motionloom.skeleton import SMPL22

SUFFIXES = (".bvh", ".glb", ".gltf", ".vrm", ".vrma")
HEAD = """# Rigs that were tried

Each file of a folder of other people's characters and recordings, in the commands that read one:

- *in*: `motionloom export FILE person.bvh --skeleton smpl22`
- *size and axes*: `motionloom export FILE same.bvh`
- *character*: `motionloom export walk.bvh out --skeleton FILE`, a walk put on it

A sentence is what the command said. Made by `python tools/make_rigs_table.py FOLDER`.

| file | in | size and axes | character |
|---|---|---|---|
"""


def said(words: list[str], folder: str) -> str:
    """``works``, with what was remarked, or the sentence of the refusal."""
    errors = io.StringIO()
    with contextlib.redirect_stderr(errors), contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("always")
        code = main(words)
    text = " ".join(errors.getvalue().replace(folder + "/", "").replace("|", "/").split())
    text = text.removeprefix("motionloom: ")
    text = text if len(text) < 260 else text[:257] + "..."
    return ("works" + (f"; {text}" if text else "")) if code == 0 else f"refused: {text}"


def table(folder: Path) -> str:
    """The document."""
    rows = []
    with tempfile.TemporaryDirectory() as made:
        out = Path(made)
        turns = np.tile(IDENTITY, (30, 22, 1))
        turns[:, 1, 0], turns[:, 1, 1] = np.cos(0.2), np.sin(0.2)
        walk = Motion(SMPL22, 30.0, SMPL22.offsets[0] + np.linspace(0, 1, 30)[:, None] * [0, 0, 1.0], turns)
        save_bvh(to_smpl22(walk), out / "walk.bvh")
        for path in sorted(p for p in folder.iterdir() if p.suffix.lower() in SUFFIXES):
            name, where = str(path), str(folder)
            kind = path.suffix if path.suffix.lower() in (".glb", ".gltf", ".vrm") else ".bvh"
            cells = [
                said(["export", name, f"{made}/in.bvh", "--skeleton", "smpl22", "--force"], where),
                said(["export", name, f"{made}/same.bvh", "--force"], where),
                said(["export", f"{made}/walk.bvh", f"{made}/out{kind}", "--skeleton", name, "--force"], where),
            ]
            rows.append(f"| {path.name} | " + " | ".join(cells).replace(made + "/", "") + " |")
            print(rows[-1], flush=True)
    return HEAD + "\n".join(rows) + "\n"


if __name__ == "__main__":
    document = table(Path(sys.argv[1]))
    (Path(__file__).parents[1] / "docs" / "rigs.md").write_text(document, encoding="utf-8")
