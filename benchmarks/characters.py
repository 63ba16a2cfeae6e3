"""How near every clip of every character of a folder comes back from the uniform person.

python benchmarks/characters.py FOLDER [--out FILE] [--only NAME]        # such as ../shared/rigs

Each clip is read, put on the uniform person, back onto the character, and its skinned vertices are compared with the
original's in at most 12 frames: percent of the character's height, mean over all and over those of head, hands and
feet; and degrees by which a limb bone is turned about its own axis, the largest.
"""

import argparse
import sys
import tempfile
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "packages/motionloom"))

from motionloom.core.errors import MotionloomError
from motionloom.io.gltf_read import open_glb
from tests.io.round_trip import errors, onto

COLUMNS = ("all", "head", "hands", "feet", "twist")
TARGETS = {"all": 4.0, "head": 6.0, "hands": 6.0, "feet": 6.0, "twist": 20.0}


def measured(path: Path) -> list[tuple[str, dict[str, float]]]:
    """Name and errors of each clip of a file."""
    found = []
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for number, name in enumerate(open_glb(path).clips, start=1):
            motion, out = onto(path, Path(folder) / "out.glb", clip=number)
            found.append((name, errors(path, out, number - 1, motion)))
    return found


def row(name: str, clip: str, values: dict[str, float]) -> str:
    """A line of the table; what misses its target has a star."""
    cells = [
        f"{values[c]:6.2f}{'*' if values[c] > TARGETS[c] else ' '}" if c in values else "      - " for c in COLUMNS
    ]
    return f"{name:22} {clip:36} " + " ".join(cells)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--only", default="")
    arguments = parser.parse_args()
    lines = [f"{'file':22} {'clip':36} " + " ".join(f"{c:>7}" for c in COLUMNS)]
    print(lines[0])
    missed = count = 0
    for path in sorted(p for p in arguments.folder.iterdir() if p.suffix == ".glb" and arguments.only in p.name):
        try:
            clips = measured(path)
        except MotionloomError as error:
            print(f"{path.name}: {error}", file=sys.stderr)
            continue
        for clip, values in clips:
            lines.append(row(path.name, clip, values))
            print(lines[-1], flush=True)
            missed += any(values.get(c, 0.0) > TARGETS[c] for c in COLUMNS)
            count += 1
    lines.append(f"{count} clips; {missed} miss a target (*)")
    print(lines[-1])
    if arguments.out:
        arguments.out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
