"""End Sites that say where a last bone ends when nothing else does.

A hand, a head or a toe joint has no length of its own, and programs that draw bones from joint to joint want one. So
a joint at the tip of its branch is written with an End Site at `SHARE` of its own bone's length. The share is no round
number and is how a reader knows these End Sites again: they are no joints, and reading leaves them out.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SHARE = 0.41421356
SHORTEST = 1e-4
"""Bones below this, in the file's unit, give their ends no length."""
_SAME = 3e-6
"""What rounding to six digits, here and in the bone's own OFFSET, changes at most."""


def tip(offset: Array, *, level: bool) -> Array:
    """(3,) the End Site of a joint with this offset: straight on, or ``level`` with the ground for a toe."""
    length = float(np.linalg.norm(offset))
    if length < SHORTEST:
        return np.zeros(3)
    ahead = offset * np.array([1.0, 0.0, 1.0]) if level else offset
    if float(np.linalg.norm(ahead)) < 0.1 * length:
        ahead = offset
    return SHARE * length * ahead / float(np.linalg.norm(ahead))


def is_tip(offset: Sequence[float], end: Sequence[float]) -> bool:
    """Whether `tip` made the End Site ``end`` of a joint with this offset."""
    bone, there = np.array(offset, dtype=np.float64), np.array(end, dtype=np.float64)
    return float(np.linalg.norm(bone)) >= SHORTEST and any(
        float(np.abs(tip(bone, level=level) - there).max()) < _SAME for level in (False, True)
    )


def low_joints(parents: Sequence[int], offsets: Array) -> NDArray[np.bool_]:
    """(joints,) which joints are near the ground at rest: toes, whose tips must not point into it."""
    heights = np.array(offsets[:, 1])
    for j, parent in enumerate(parents[1:], start=1):
        heights[j] += heights[parent]
    low, high = float(heights.min()), float(heights.max())
    return np.asarray(heights < low + 0.1 * (high - low))
