"""A recording as the uniform person that everything is learned from: size, floor, origin."""

import numpy as np

from motionloom.features import humanml as hml
from motionloom.kinematics.costs import numbers
from motionloom.kinematics.physics import Array

_BODY = [k for k in range(22) if k not in (*numbers("ankle"), *numbers("foot"))]
SUNK = 0.04
"""Metres that somebody who lies or kneels may be in the floor before the clip is raised."""


def uniform_person(positions: Array, fps: float) -> Array:
    """Joints (frames, 22, 3) in metres, y up, at any rate, to those of the uniform person at 20 per second.

    From the origin, facing +Z. The floor is under planted feet, or where a body lies that would be in it.
    """
    return at_origin(out_of_floor(hml.uniform(hml.resample_positions(positions, fps))))


def at_origin(positions: Array) -> Array:
    """The published canonical start (origin, facing +Z), with the floor left where it is (y = 0)."""
    return hml.canonical(positions) + np.array([0.0, positions[..., 1].min(), 0.0])


def out_of_floor(positions: Array) -> Array:
    """Raised where a body that lies or kneels would be in the floor by more than `SUNK` (feet do not count)."""
    low = float(np.percentile(positions[:, _BODY, 1].min(-1), 15))
    return positions - np.array([0.0, low, 0.0]) if low < -SUNK else positions
