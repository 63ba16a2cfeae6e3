"""Which numbers of a motion are given while control is trained: random, in the ways that users give them.

A path or a hand in all frames, at a few keyframes, on stretches, from the beginning, around a gap; whole poses; half
of the body. A joint's place is measured from the root, so a joint in the world needs the root as well: most rows that
give a joint give both.
"""

import numpy as np
from numpy.typing import NDArray

from motionloom.errors import MotionloomError
from motionloom.features.layout import LAYOUT, WIDTH, mask
from motionloom.skeleton import SMPL22

Flags = NDArray[np.bool_]

CONTROLS = ("trajectory", "left_wrist", "right_wrist", "left_foot", "right_foot", "head", "any")
"""The controls that ship. Names of `features.layout.mask` can be trained too."""
NOTHING = 0.05
"""Share of rows that give nothing, so that the prior stays what it was."""
WITH_ROOT = 0.75
"""Share of rows with a joint that give the root as well."""


def check_control(control: str) -> None:
    """Raise MotionloomError for a control that cannot be trained."""
    if not control:
        raise MotionloomError(
            f"the recipe does not say which control to train; control is one of {', '.join(CONTROLS)}"
        )
    if control not in ("any", "trajectory") and not mask(control).any():
        raise MotionloomError(f"the control {control!r} gives nothing to train; {', '.join(CONTROLS)} do")


def draw_masks(control: str, lengths: NDArray[np.int64], frames: int, *, rng: np.random.Generator) -> Flags:
    """(rows, frames, 263) True at the numbers that are given, one row for each of the valid ``lengths``."""
    draw = {"any": _anything, "trajectory": _trajectory}.get(control)
    rows = np.zeros((len(lengths), frames, WIDTH), dtype=bool)
    for row, length in zip(rows, lengths, strict=True):
        if rng.random() >= NOTHING:
            row |= draw(int(length), frames, rng) if draw else _joint(control, int(length), frames, rng)
    return rows


def some_frames(length: int, frames: int, dense: float, rng: np.random.Generator) -> Flags:
    """(frames,) when something is given: always with probability ``dense``, else at keys, in a rhythm, in a stretch,
    at the beginning, or at both ends."""
    chosen = np.zeros(frames, dtype=bool)
    if rng.random() < dense:
        return ~chosen  # padding too, as published
    kind, half = rng.integers(5), max(length // 2, 1)
    if kind == 0:
        chosen[rng.choice(length, size=min(int(rng.integers(1, 7)), length), replace=False)] = True
    elif kind == 1:
        beat = int(rng.integers(4, 31))
        chosen[int(rng.integers(beat)) % length : length : beat] = True
    elif kind == 2:
        first = int(rng.integers(length))
        chosen[first : int(rng.integers(first, length)) + 1] = True
    else:
        chosen[: int(rng.integers(1, half + 1))] = True
        if kind == 4:
            chosen[length - int(rng.integers(1, half + 1)) : length] = True
    return chosen


def _trajectory(length: int, frames: int, rng: np.random.Generator) -> Flags:
    return some_frames(length, frames, 0.7, rng)[:, None] & mask("root_horizontal")


def _joint(control: str, length: int, frames: int, rng: np.random.Generator) -> Flags:
    when = some_frames(length, frames, 0.55, rng)
    return (when[:, None] & mask(control)) | _root(when, rng)


def _root(when: Flags, rng: np.random.Generator) -> Flags:
    """The root's four numbers, in all frames or in those of the joint; or not at all."""
    numbers = np.arange(WIDTH) < 4
    if rng.random() >= WITH_ROOT:
        return np.zeros((len(when), WIDTH), dtype=bool)
    return np.ones_like(when)[:, None] & numbers if rng.random() < 0.7 else when[:, None] & numbers


def _anything(length: int, frames: int, rng: np.random.Generator) -> Flags:
    kind = rng.random()
    if kind < 0.2:  # whole poses: places alone, or every number
        numbers = np.arange(WIDTH) < (WIDTH if rng.random() < 0.5 else LAYOUT["ric"].stop)
        return some_frames(length, frames, 0.0, rng)[:, None] & numbers
    if kind < 0.3:
        return some_frames(length, frames, 0.7, rng)[:, None] & mask(str(rng.choice(["lower_body", "upper_body"])))
    if kind < 0.4:
        return _trajectory(length, frames, rng)
    when = some_frames(length, frames, 0.5, rng)
    given = _root(when, rng)
    for joint in rng.choice(np.arange(1, len(SMPL22)), size=int(rng.choice([1, 1, 2, 2, 3, 4, 8, 21])), replace=False):
        own = some_frames(length, frames, 0.5, rng) if rng.random() < 0.3 else when
        given |= own[:, None] & mask(SMPL22.names[joint])
    return given
