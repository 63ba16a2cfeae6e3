"""Draw the README's pictures with the shipped weights, through the command line that a user has.

python tools/make_pictures.py [FOLDER]
"""

import sys
from pathlib import Path

from motionloom.cli import main

ROOT = Path(__file__).resolve().parents[1]

PICTURES: dict[str, list[str]] = {
    "walk": ["a person walks forward and waves"],
    "jump": ["a person jumps up and down"],
    "run": ["a person runs forward"],
    "punch": ["a person throws punches with both fists"],
    "seeds": ["a person dances", "--count", "3"],
}
"""File name -> words of `motionloom generate`. These are first draws of seed 1, not the best of many."""


def draw(folder: Path) -> list[Path]:
    """Generate every picture into ``folder`` and return the files; stops at the first command that fails."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = []
    for name, words in PICTURES.items():
        drawn.append(folder / f"{name}.png")
        if main(["generate", *words, "--seed", "1", "--out", str(drawn[-1])]):
            raise SystemExit(f"could not draw {name}")
    return drawn


if __name__ == "__main__":
    print(*draw(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "pictures"), sep="\n")
