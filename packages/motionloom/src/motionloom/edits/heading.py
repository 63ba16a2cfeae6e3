"""The way somebody goes, turned to a direction of the world: steps stay as they are sampled, pace and gait too.

Velocities and joints are given in the heading of the body, so that a change of the heading turns path and body
together. A foot that stands does not turn with them: legs are moved so that it stays in its place.
"""

import numpy as np
from numpy.typing import NDArray

from motionloom.core.blending import smoothstep
from motionloom.core.features import humanml
from motionloom.core.features.layout import LAYOUT
from motionloom.core.models.prior import Prior
from motionloom.edits.steering import Correction, product, standing
from motionloom.goals.goal import turn_between

Array = NDArray[np.float64]

SOONEST, LONGEST = 8, 22
"""Frames over which the way turns: by next to nothing, and by half a circle."""
_SWAY = 8.0
"""Frames (standard deviation) over which the way is averaged: a walk sways."""
_STANDING = 0.004
"""Metres a frame that the facing counts for in the way: all there is where nobody goes anywhere."""


def heading_for(direction: float, prior: Prior, *, first: int) -> Correction:
    """The correction of one row's estimate so that from frame ``first`` on the way goes to ``direction``.

    direction: radians, seen from where the person stands and faces at row frame ``first``. The turn begins there and
    takes `SOONEST` to `LONGEST` frames. How long, and which of two ways round, the first estimate decides.
    """
    mean, spread = prior.mean.astype(np.float64), prior.spread.astype(np.float64)
    before: list[float] = []  # the turn of the estimate before
    over: list[float] = []

    def correct(denoised: np.ndarray, level: int) -> np.ndarray:
        features = denoised * spread + mean
        way = _ways(features, first)
        lack = np.unwrap(np.asarray(turn_between(direction, np.angle(way))))
        middle = float(np.median(lack))
        near = before[0] if before else float(turn_between(middle, 0.0))
        lack += 2 * np.pi * round((near - middle) / (2 * np.pi))
        before[:] = [float(np.median(lack))]
        if not over:
            over.append(SOONEST + (LONGEST - SOONEST) * min(abs(before[0]) / np.pi, 1.0))
        turn = np.concatenate([np.zeros(first), lack * smoothstep(np.arange(len(lack)) / over[0])])
        changed = denoised.copy()
        changed[: len(turn) - 1, 0] -= (np.diff(turn) / 2 / spread[0]).astype(denoised.dtype)
        turned = _moved_along(denoised, changed, prior)
        features = standing(turned * spread + mean, first)
        return ((features - mean) / spread).astype(denoised.dtype)

    return correct


def _ways(features: Array, first: int) -> NDArray[np.complex128]:
    """The averaged way of the frames from ``first`` on as complex numbers whose angle is its direction."""
    facing = -2 * np.concatenate([[0.0], np.cumsum(features[:, 0])])
    steps = (features[:, 2] + 1j * features[:, 1]) * np.exp(1j * facing[1:])
    ahead = np.exp(1j * facing[:-1])
    frames = np.arange(len(features))
    lag = frames[first:, None] - frames[first:]
    kernel = np.exp(-0.5 * (lag / _SWAY) ** 2)
    kernel /= kernel.sum(1, keepdims=True)
    way = product(kernel, steps[first:] + _STANDING * ahead[first:])
    return way * np.exp(-1j * facing[first])


def _moved_along(old: np.ndarray, new: np.ndarray, prior: Prior) -> np.ndarray:
    """``new`` with the displacements of the joints changed as its root was."""
    before, after = (humanml.displacements(part * prior.spread + prior.mean) for part in (old, new))
    result, block = new.copy(), LAYOUT["joint_velocity"]
    result[:-1, block] += (after - before).reshape(len(new) - 1, -1) / prior.spread[block]
    return result
