"""Where the ground is, by what planted feet say."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.retarget.anatomy import FEET, TOES

Array = NDArray[np.float64]

SLOW = 0.3
"""Metres per second below which a toe counts as planted."""
NEAR = 0.05
"""Metres above the lowest planted toe within which a slow toe counts as planted."""


@dataclass(frozen=True)
class Stance:
    """Heights in metres in the source's world."""

    toe: float
    """Height of planted toe joints."""
    ankle: float
    """Height of ankle joints above the toe joints on flat feet."""


def read_stance(places: Array, fps: float, *, ankle_height: float) -> Stance:
    """Measure planted feet in (frames, 22, 3); ``ankle_height`` is what the rest pose says, used where none is planted.

    A clip whose feet never come near the file's y = 0 from above (climbing, hanging) keeps y = 0 as its floor.
    """
    toes, ankles = places[:, TOES], places[:, FEET]
    speed = np.linalg.norm(np.gradient(toes, axis=0), axis=-1) * fps if len(toes) > 1 else np.zeros(toes.shape[:2])
    heights = toes[..., 1]
    lowest = float(np.percentile(heights.min(axis=1), 5))
    planted = (speed < SLOW) & (heights < lowest + NEAR)
    toe = float(np.median(heights[planted])) if planted.sum() >= 3 else lowest
    if toe > 0.25:
        return Stance(0.0, ankle_height)
    rises = (ankles[..., 1] - heights)[planted]
    flat = rises[np.abs(rises - ankle_height) < 0.05]
    return Stance(toe, float(np.median(flat)) if len(flat) >= 3 else ankle_height)
