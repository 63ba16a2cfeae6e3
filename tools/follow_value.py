"""Follow a value through the code: through how many functions of the package it goes.

python tools/follow_value.py [past | partner | character | goal] [--list]

past: what `predict` goes on from; partner: the motion that `react` answers; character: a file that `export` writes with
a motion in it; goal: what `control` keeps to. Counted are different functions of the package that are handed the value:
those called with arrays or motions by a function that has it, beginning with the function that is given it; also where
what they are handed is made of the value and of what was sampled. Arithmetic (`INSIDE`) is not followed: of it, the
functions that are called from elsewhere are counted. A skeleton and weights alone are no value. Not counted are methods
of the forms that all tasks share (`FORMS`), functions within functions, and a network's own loop. Untrained networks
sample one step.
"""

import dataclasses
import inspect
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "packages/motionloom"))

from motionloom import Predictor, Prior, Skeleton, load, predict
from motionloom.core.diffusion import Schedule
from motionloom.core.models.networks.pair import PairSession
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.pair import PairBlock
from motionloom.goals.goal_file import read_goal
from motionloom.io.character import load_character
from motionloom.retarget import retarget
from motionloom.tasks.control import control
from motionloom.tasks.duet import react
from tests.io.rigged import Hero
from tests.recorded import tiny
from tests.tasks.small_predictor import small_predictor
from tests.tasks.two_people import block

ROOT = Path(__file__).resolve().parents[1]
SOURCE = str(ROOT / "packages" / "motionloom" / "src" / "motionloom")
CLIP = ROOT / "examples" / "clips" / "walk.bvh"
INSIDE = (
    "arrays.py",
    "blending.py",
    "rotations.py",
    "ground.py",
    "skeleton.py",
    "diffusion/",
    "edits/",
    "features/",
    "kinematics/",
    "retarget/",
    "runtime/",
    "tasks/splice.py",
    "tasks/text.py: finish",
)
"""Arithmetic, where nothing is followed: functions of numbers, places and bodies that know of no task. `edits` change
denoised estimates, `runtime` has the numbers of networks, `splice` and `finish` make bodies of places and features."""
FORMS = ("GroundPose", "Motion", "PairMotion", "PlacedMotion")
"""Frozen values that every task shares: calling their methods hands nothing on. They are arithmetic too."""
WEIGHTS = (PairBlock, PairSession, Predictor, Prior, PriorSession, Schedule)
LOOPS = ("complete", "run", "sample", "denoising")
"""Networks' own loops."""


def past() -> None:
    """A future of one window."""
    predict(small_predictor(), load(CLIP), count=1, seconds=0.5, steps=1)


def partner() -> None:
    """An answer to somebody."""
    prior = tiny.prior()
    react(prior, block(prior), load(CLIP), "two people hug", steps=1)


def character() -> None:
    """A motion in a character's own file."""
    with tempfile.TemporaryDirectory() as folder:
        hero = load_character(Hero().write(Path(folder) / "hero.glb"))
        hero.save(retarget(load(CLIP), hero.skeleton), Path(folder) / "moving.glb")


def goal() -> None:
    """A walk along a path."""
    asked = read_goal({"path": {"points": [[0, 0], [0, 1.5]]}}, frames=20, folder=ROOT)
    control(tiny.prior(), "a person walks", asked, steps=1)


VALUES: dict[str, tuple[Callable[[], None], str]] = {
    "past": (past, "tasks/predict.py"),
    "partner": (partner, "tasks/duet.py"),
    "character": (character, "io/character.py"),
    "goal": (goal, "tasks/control.py"),
}
"""What is called, and the file in which the value begins."""


def arrays(value: object, depth: int = 3) -> list[np.ndarray]:
    """The arrays in a value, its fields and its elements."""
    if isinstance(value, np.ndarray):
        return [value]
    if isinstance(value, (Skeleton, *WEIGHTS)):
        return []
    if depth and dataclasses.is_dataclass(value) and not isinstance(value, type):
        parts = [getattr(value, field.name, None) for field in dataclasses.fields(value)]
    elif depth and isinstance(value, tuple | list):
        parts = list(value[:4])
    else:
        return []
    return [array for part in parts for array in arrays(part, depth - 1)]


def follow(call: Callable[[], None], begin: str) -> tuple[Counter[tuple[str, str]], int]:
    """How often the value is handed to each (file, function), and how often it comes back to the file it begins in."""
    having: list[tuple[bool, str]] = []
    found: Counter[tuple[str, str]] = Counter()
    back = 0

    def entered(frame: FrameType, event: str, _: object) -> None:
        nonlocal back
        code = frame.f_code
        if event not in ("call", "return") or not code.co_filename.startswith(SOURCE):
            return
        if event == "return":
            having.pop()
            return
        file, form = code.co_filename[len(SOURCE) + 1 :], code.co_qualname.partition(".")[0] in FORMS
        names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount + bool(code.co_flags & inspect.CO_VARARGS)]
        plain = "<" not in code.co_qualname
        first = not any(had for had, _ in having)
        handed = not plain or any(arrays(frame.f_locals.get(name)) for name in names) or (first and file == begin)
        handed = handed and code.co_name not in LOOPS and (file == begin if first else having[-1][0])
        back += handed and plain and file == begin and bool(having) and having[-1][1] != begin and not first
        inside = form or f"{file}: {code.co_name}".startswith(INSIDE)
        having.append((handed and not inside, file))
        if handed and plain and not form and file != "motion.py":
            found[file, code.co_qualname] += 1

    sys.setprofile(entered)
    try:
        call()
    finally:
        sys.setprofile(None)
    return found, back


def main() -> None:
    """Print how many functions, files and rooms there are."""
    words = [word for word in sys.argv[1:] if word != "--list"]
    for name in words or VALUES:
        found, back = follow(*VALUES[name])
        if "--list" in sys.argv[1:]:
            print(*(f"{count:4} {file}: {function}" for (file, function), count in sorted(found.items())), sep="\n")
        files = {file for file, _ in found}
        rooms = {file.partition("/")[0] for file in files}
        print(
            f"{name}: {len(found)} functions in {len(files)} files of {len(rooms)} rooms; it comes back to "
            f"{VALUES[name][1]} {back} times"
        )


if __name__ == "__main__":
    main()
