"""A recording as the uniform person that everything is learned from: sizes, feet, floor, origin."""

import numpy as np

from motionloom.features import humanml as hml
from motionloom.features.layout import FPS
from motionloom.kinematics import physics as ph
from motionloom.kinematics.costs import LEGS, numbers
from motionloom.kinematics.physics import Array

_BODY = [k for k in range(22) if k not in (*numbers("ankle"), *numbers("foot"))]
FLAT = np.radians(-25.0)
"""Elevation of a flat foot's toe joint seen from its ankle."""
UPTURNED = np.radians(5.0)
"""Where the median elevation of both feet on the floor is above this, the skeleton is taken to have them turned up."""
PLANTED = 0.25
"""Metres per second: slower feet stand."""
SUNK = 0.04
"""Metres that somebody who lies or kneels may be in the floor before the clip is raised."""


def uniform_person(positions: Array, fps: float) -> Array:
    """Joints (frames, 22, 3) in metres, y up, at any rate, to those of the uniform person at 20 per second.

    From the origin, facing +Z. Feet that the recording's skeleton has turned up are levelled, and the floor stays where
    planted feet say it is, or where a body lies that would be in it.
    """
    person = hml.uniform(hml.resample_positions(positions, fps))
    return at_origin(out_of_floor(levelled_feet(person)))


def at_origin(positions: Array) -> Array:
    """The published canonical start (origin, facing +Z), with the floor left where it is (y = 0)."""
    return hml.canonical(positions) + np.array([0.0, positions[..., 1].min(), 0.0])


def levelled_feet(positions: Array) -> Array:
    """Feet turned so that planted ones are flat, where the median of the planted frames says that they are not.

    Some recordings hold feet whose rest direction is wrong by half a right angle (UI-PRMD, two of ten people): they
    stand on heels with the toes in the air. Each foot is turned about its own side axis, by the same angle in all
    frames; the toe joint then stands on y = 0. (frames, 22, 3) at 20 per second; as it is where no foot is planted.
    """
    seen = [_elevation(positions, *leg) for leg in LEGS]
    if any(angle is None or angle < UPTURNED for angle in seen):
        return positions
    result = positions.copy()
    for (knee, ankle, toe), angle in zip(LEGS, seen, strict=True):
        shin, foot = positions[:, knee] - positions[:, ankle], positions[:, toe] - positions[:, ankle]
        side = np.cross(shin, foot)
        side /= np.linalg.norm(side, axis=-1, keepdims=True).clip(1e-9)
        turn = angle - FLAT
        result[:, toe] = positions[:, ankle] + foot * np.cos(turn) + np.cross(side, foot) * np.sin(turn)
    toes = result[:, [10, 11]]
    still = np.linalg.norm(ph.velocity(toes, FPS), axis=-1) < PLANTED
    result[..., 1] -= np.median(toes[..., 1][still]) if still.any() else toes[..., 1].min()
    return result


def _elevation(positions: Array, knee: int, ankle: int, toe: int) -> float | None:
    """Radians that the toe joint is seen above its ankle while the foot stands (median); None where it never does."""
    foot, shin = positions[:, toe] - positions[:, ankle], positions[:, knee] - positions[:, ankle]
    speed = np.linalg.norm(ph.velocity(positions[:, [ankle, toe]], FPS), axis=-1).max(-1)
    upright = (shin[:, 1] > 0.8 * np.linalg.norm(shin, axis=-1)) & (positions[:, 0, 1] > positions[:, ankle, 1] + 0.5)
    still = upright & (speed < max(PLANTED, float(np.percentile(speed, 15))))
    angles = np.arcsin(np.clip(foot[still, 1] / np.linalg.norm(foot[still], axis=-1).clip(1e-9), -1, 1))
    return float(np.median(angles)) if len(angles) >= 5 else None


def out_of_floor(positions: Array) -> Array:
    """Raised where a body that lies or kneels would be in the floor by more than `SUNK` (feet do not count)."""
    low = float(np.percentile(positions[:, _BODY, 1].min(-1), 15))
    return positions - np.array([0.0, low, 0.0]) if low < -SUNK else positions
