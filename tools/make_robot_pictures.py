"""Draw the picture of docs/robots.md with the shipped weights: a walk, a kick and a dance from words, on each robot.

python tools/make_robot_pictures.py G1.xml T1.xml [--seed 0] [--weights default] [--out docs/pictures/robots.png]

Models of robots are not part of the project; docs/robots.md says whose they are. One row of poses for each robot and
motion. What is over a limit of docs/robots.md is told on stderr by the command itself.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
MOTIONS = ("a person walks forward", "a person kicks with the right leg", "a person dances")


def run(*line: str) -> None:
    """A line of motionloom; its own error ends this program."""
    subprocess.run([sys.executable, "-m", "motionloom", *line], check=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="+", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--weights", default="default")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "pictures" / "robots.png")
    arguments = parser.parse_args()
    rows: list[Image.Image] = []
    with tempfile.TemporaryDirectory() as folder:
        for number, text in enumerate(MOTIONS):
            motion = f"{folder}/motion_{number}.npz"
            run("generate", text, "--seed", str(arguments.seed), "--weights", arguments.weights, "--out", motion)
            for robot in arguments.robots:
                row = f"{folder}/row_{len(rows)}.png"
                run("export", motion, row, "--robot", str(robot))
                with Image.open(row) as picture:
                    rows.append(picture.convert("RGB"))
    sheet = Image.new("RGB", (rows[0].width, sum(row.height for row in rows)))
    top = 0
    for row in rows:
        sheet.paste(row, (0, top))
        top += row.height
    sheet.quantize(256).save(arguments.out, optimize=True)  # a document's picture is small
    print(f"wrote {arguments.out}: {', '.join(MOTIONS)}, each on {', '.join(path.stem for path in arguments.robots)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
