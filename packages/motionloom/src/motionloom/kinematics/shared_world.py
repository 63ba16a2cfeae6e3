"""Recordings of two people, of any skeletons, brought into one world as two uniform people."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.layout import FPS
from motionloom.core.motion import Motion
from motionloom.retarget import to_smpl22
from motionloom.retarget.anatomy import read_body

Array = NDArray[np.float64]
SHORTEST = 20
"""Frames (at 20 per second) of the shortest pair."""
FARTHEST = 10.0
"""Metres: people who are never nearer than this have nothing to do with one another."""
SAME = 1e-3
"""Metres: two motions that differ by less everywhere, but for their ground poses, are one."""


def together(first: Motion, second: Motion, *, name: str = "the pair") -> Array:
    """(2, frames, 22, 3) metres at 20 frames per second: two people's motions as uniform people in their one world.

    Args:
        first: A person of any humanoid skeleton.
        second: The other, as many frames at the same rate in the same world.
        name: What errors call them.

    Raises:
        MotionloomError: The rates, then the lengths differ, they are shorter than a second, the same motion twice, or
            the people are never nearer than `FARTHEST`.
    """
    if abs(first.fps - second.fps) > 1e-3 * first.fps:
        raise MotionloomError(
            f"{name}: the frame rates differ, {first.fps:g} and {second.fps:g} frames per second; a pair has one clock"
        )
    if len(first) != len(second):
        raise MotionloomError(
            f"{name}: the lengths differ, {len(first)} and {len(second)} frames; cut both to the same moments"
        )
    uniform = [to_smpl22(motion).positions() for motion in (first, second)]
    legs = [read_body(motion.skeleton).leg for motion in (first, second)]
    return checked(one_world(uniform, legs), first.fps, name=name)


def one_world(uniform: Sequence[np.ndarray], legs: Sequence[float]) -> Array:
    """(2, frames, 22, 3): each uniform person of `legs` (metres, before) moved on the ground to the common scale.

    ``uniform`` are two (frames, 22, 3) whose places are scaled by the uniform legs over each person's own.
    """
    mean = float(np.mean(legs))
    flat, pairs = np.array([1.0, 0.0, 1.0]), zip(uniform, legs, strict=True)
    return np.stack([p + (leg / mean - 1.0) * p[:, :1] * flat for p, leg in pairs])


def checked(positions: np.ndarray, fps: float, *, name: str) -> Array:
    """(2, frames, 22, 3) at ``fps`` to 20 frames per second with constant bones; raises for no pair, as `together`."""
    result = np.stack([humanml.uniform(humanml.resample_positions(one, fps)) for one in positions])
    if result.shape[1] < SHORTEST:
        raise MotionloomError(f"{name}: only {result.shape[1] / FPS:.2f} s long; at least 1 s is needed")
    apart = result[1] - result[0]
    if np.abs(apart - apart[0, 0] * np.array([1.0, 0.0, 1.0])).max() < SAME:
        raise MotionloomError(f"{name} are the same motion; a pair needs a recording of each person")
    nearest = float(np.linalg.norm(apart[:, 0, [0, 2]], axis=-1).min())
    if nearest > FARTHEST:
        raise MotionloomError(
            f"{name}: the two are never nearer than {nearest:.1f} m (at most {FARTHEST:g} m); export both in one world"
        )
    return result
