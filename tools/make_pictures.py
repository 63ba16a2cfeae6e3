"""Draw the README's pictures with the shipped weights, through the command line that a user has.

python tools/make_pictures.py [FOLDER]
"""

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from PIL import Image, ImageDraw

from motionloom.cli import main
from motionloom.core.files.atomic import atomic_path
from motionloom.core.motion import Motion
from motionloom.goals.goal import Goal
from motionloom.goals.goal_file import read_goal
from motionloom.io import load
from motionloom.viz import draw
from motionloom.viz.figure import figure

ROOT = Path(__file__).resolve().parents[1]
CLIP, GOALS = str(ROOT / "examples" / "clips" / "walk.bvh"), ROOT / "examples" / "goals"

SHEETS: dict[str, list[list[str]]] = {
    "walk": [["generate", "a person walks forward and waves", "--seed", "1", "--out", "{out}"]],
    "long": [
        [
            "compose",
            "a person walks forward",
            "a person jumps up",
            "a person squats down",
            "a person dances",
            "--seconds",
            "4",
            "--seed",
            "1",
            "--out",
            "{out}",
        ]
    ],
    "edit": [
        [
            "edit",
            CLIP,
            "a person waves with both hands",
            "--keep",
            "lower_body",
            "--seed",
            "1",
            "--out",
            "{work}/waving.bvh",
        ],
        ["view", CLIP, "{work}/waving.bvh", "--out", "{out}"],
    ],
    "predict": [["predict", CLIP, "--end", "0.8", "--count", "5", "--seconds", "2", "--seed", "1", "--out", "{out}"]],
    "duet": [["duet", "two people dance salsa together", "--seconds", "6", "--seed", "1", "--out", "{out}"]],
}
"""File name -> commands; {out} is the picture. These are first draws of seed 1, not the best of many."""

ASKED: draw.Colour = (240, 196, 60)
"""The colour of what was asked for."""


def sheets(folder: Path, work: Path) -> list[Path]:
    """Contact sheets that the commands draw by themselves."""
    for name, commands in SHEETS.items():
        for command in commands:
            run([word.format(out=folder / f"{name}.png", work=work) for word in command])
    return [folder / f"{name}.png" for name in SHEETS]


def live(folder: Path, work: Path) -> list[Path]:
    """The scripted sessions of examples/live, as small sheets of few colours."""
    made = []
    for script in ("session", "two_people"):
        sheet, out = work / f"{script}.png", folder / f"live_{script}.png"
        run(["live", str(ROOT / "examples" / "live" / f"{script}.yaml"), "--out", str(sheet)])
        made.append(shrunk(sheet, out))
    return made


def shrunk(sheet: Path, out: Path) -> Path:
    """A sheet 900 pixels wide with 40 colours."""
    with Image.open(sheet) as picture, atomic_path(out) as temporary:
        size = 900, round(900 * picture.height / picture.width)
        small = picture.convert("RGB").resize(size, Image.Resampling.LANCZOS).quantize(40)
        small.save(temporary, format="PNG", optimize=True)
    return out


def controlled(folder: Path, work: Path) -> list[Path]:
    """A motion of `motionloom control` from above, with the path that was asked of it in yellow."""
    eight = GOALS / "figure_eight.json"
    motion = control("a person walks", eight, 14.0, work)
    goal = read_goal(eight, frames=len(motion), folder=GOALS)
    middle = motion.root.mean(axis=0) * [1, 0, 1] + [0, 0.62, 0]
    above = draw.Camera(middle, (960, 430), 4.3, 0.0, 0.6)
    return [strobe(motion, above, range(0, len(motion), 20), asked=goal, to=folder / "path.png")]


def control(prompt: str, goal: Path, seconds: float, work: Path) -> Motion:
    """What the command makes of a prompt and a goal file."""
    out = work / f"{goal.stem}.npz"
    run(["control", prompt, "--goal", str(goal), "--seconds", str(seconds), "--seed", "1", "--out", str(out)])
    return load(out)


def strobe(motion: Motion, camera: draw.Camera, frames: Sequence[int], *, asked: Goal, to: Path) -> Path:
    """One picture of a motion in several frames on its way along the floor: asked in yellow, made on top of it."""
    shape = figure(motion)
    wanted = asked.mask[:, 0].any(axis=-1)
    picture = Image.new("RGB", (camera.size[0] * draw.SMOOTH, camera.size[1] * draw.SMOOTH), draw.PAPER)
    pen = ImageDraw.Draw(picture)
    draw.paint_floor(pen, camera, shape.floor)
    for frame in frames:
        draw.paint_shadow(picture, camera, shape, frame)
    for places, colour, width in ((asked.positions, ASKED, 0.07), (motion.positions(), draw.PATH, 0.018)):
        draw.paint_path(pen, camera, places[wanted, 0] * [1.0, 0.0, 1.0], colour, width)
    for frame in sorted(frames, key=lambda frame: -float(camera.see(shape.path[frame])[1])):
        draw.paint_body(pen, camera, shape, frame)
    with atomic_path(to) as temporary:
        picture.reduce(draw.SMOOTH).save(temporary, format="PNG")
    return to


def run(command: list[str]) -> None:
    """One `motionloom` command; stops everything if it fails."""
    if main(command):
        raise SystemExit(f"this failed: motionloom {' '.join(command)}")


if __name__ == "__main__":
    into = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "pictures"
    into.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(temporary)
        print(*sheets(into, work), *controlled(into, work), *live(into, work), sep="\n")
