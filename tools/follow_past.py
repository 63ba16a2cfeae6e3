"""Follow the past of `predict` through the code: through how many functions of the package it goes.

python tools/follow_past.py [--list]

Counted are different functions of the package that are handed the past: those called with arrays or motions by a
function that has it, beginning with `predict`, which has the clip; also where what they are handed is made of the past
and of what was sampled. What `retarget`, `kinematics`, `rotations` and `skeleton` do inside is not followed, only the
entries to them are counted; a skeleton alone is no past; methods of `Motion` and functions within functions do not
count, nor does the network's own loop (`completion.complete`). `predict` is called with an untrained network, for one
future of one window.
"""

import dataclasses
import inspect
import sys
from collections import Counter
from pathlib import Path
from types import FrameType

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "packages/motionloom"))

from motionloom import Motion, Skeleton, load, predict
from tests.tasks.small_predictor import small_predictor

ROOT = Path(__file__).resolve().parents[1]
SOURCE = str(ROOT / "packages" / "motionloom" / "src" / "motionloom")
INSIDE = ("retarget/", "kinematics/", "rotations.py", "skeleton.py")
"""Where nothing is followed."""


def arrays(value: object, depth: int = 3) -> list[np.ndarray]:
    """The arrays in a value, its fields and its elements."""
    if isinstance(value, np.ndarray):
        return [value]
    if isinstance(value, Skeleton):
        return []
    if depth and dataclasses.is_dataclass(value) and not isinstance(value, type):
        parts = [getattr(value, field.name, None) for field in dataclasses.fields(value)]
    elif depth and isinstance(value, tuple | list):
        parts = list(value[:4])
    else:
        return []
    return [array for part in parts for array in arrays(part, depth - 1)]


def follow(clip: Motion) -> Counter[tuple[str, str]]:
    """How often the past is handed to each (file, function)."""
    having: list[bool] = []
    found: Counter[tuple[str, str]] = Counter()

    def entered(frame: FrameType, event: str, _: object) -> None:
        code = frame.f_code
        if event not in ("call", "return") or not code.co_filename.startswith(SOURCE):
            return
        if event == "return":
            having.pop()
            return
        names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount + bool(code.co_flags & inspect.CO_VARARGS)]
        plain = "<" not in code.co_qualname
        handed = not plain or any(arrays(frame.f_locals.get(name)) for name in names)
        handed = handed and code.co_name != "complete" and (not having or having[-1])
        file = code.co_filename[len(SOURCE) + 1 :]
        having.append(handed and not file.startswith(INSIDE))
        if handed and plain and file != "motion.py":
            found[file, code.co_qualname] += 1

    sys.setprofile(entered)
    try:
        predict(small_predictor(), clip, count=1, seconds=0.5, steps=1)
    finally:
        sys.setprofile(None)
    return found


def main() -> None:
    """Print how many functions and files there are."""
    found = follow(load(ROOT / "examples" / "clips" / "walk.bvh"))
    if "--list" in sys.argv[1:]:
        print(*(f"{count:4} {file}: {name}" for (file, name), count in sorted(found.items())), sep="\n")
    print(f"{len(found)} functions in {len({file for file, _ in found})} files, {found.total()} calls")


if __name__ == "__main__":
    main()
