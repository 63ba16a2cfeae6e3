"""A recording as the uniform person that everything is learned from: size, floor, origin."""

import numpy as np

from motionloom.core.features import humanml as hml
from motionloom.kinematics.costs import numbers
from motionloom.kinematics.physics import Array

_BODY = [k for k in range(22) if k not in (*numbers("ankle"), *numbers("foot"))]
SUNK = 0.04
"""Metres that somebody who lies or kneels may be in the floor before the clip is raised there."""
EASING = 10
"""Frames in which the floor comes and goes under a body that was in it."""


def uniform_person(positions: Array, fps: float) -> Array:
    """Joints (frames, 22, 3) in metres, y up, at any rate, to those of the uniform person at 20 per second.

    From the origin, facing +Z. The floor is under planted feet, or where a body lies that would be in it.
    """
    return at_origin(out_of_floor(hml.uniform(hml.resample_positions(positions, fps))))


def at_origin(positions: Array) -> Array:
    """The published canonical start (origin, facing +Z), with the floor left where it is (y = 0)."""
    return hml.canonical(positions) + np.array([0.0, positions[..., 1].min(), 0.0])


def out_of_floor(positions: Array) -> Array:
    """Raised where a body that lies or kneels would be in the floor by more than `SUNK` (feet do not count).

    Only the frames that are in it are raised, and `EASING` frames around them by and by: who falls stands on the floor
    before.
    """
    low = positions[:, _BODY, 1].min(-1)
    if float(np.percentile(low, 15)) >= -SUNK:
        return positions
    padded = np.pad(np.maximum(-low, 0.0), 2 * EASING, mode="edge")
    most = np.lib.stride_tricks.sliding_window_view(padded, 2 * EASING + 1).max(axis=1)
    lift = np.convolve(most, np.full(2 * EASING + 1, 1 / (2 * EASING + 1)), "valid")
    return positions + lift[:, None, None] * np.array([0.0, 1.0, 0.0])
