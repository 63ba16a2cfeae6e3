"""Toes that bend on the ground: a tip beyond the toe joint stays out of the floor while the heel comes up."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.retarget.anatomy import FEET, TOES, Body

Array = NDArray[np.float64]
_ROUNDS = 3
"""Tips of several toes do not lie in one plane with the turn, which therefore takes several steps."""


def bend_toes(motion: Motion, body: Body) -> Motion:
    """The motion with toes turned up where what hangs on them would be under y = 0, or under a toe joint that is lower.

    ``motion`` is on the body's skeleton, +Y up. Nothing else moves. Left as they are: toes that turn with their ankle,
    and feet whose soles the skeleton knows, which `retarget` keeps out of the floor.
    """
    if body.skeleton.soles:
        return motion
    for foot, toe in zip(FEET, TOES):
        driver = body.drivers[toe]
        tips = [] if driver is None else body.skeleton.below(driver)[1:]
        if driver is not None and driver > 0 and driver != body.drivers[foot] and tips:
            left = rot.rotate(body.frames[toe], np.eye(3)[1])
            for _ in range(_ROUNDS):
                motion = _bent(motion, driver, tips, left=left)
    return motion


def _bent(motion: Motion, toe: int, tips: list[int], *, left: Array) -> Motion:
    """One step for one foot; ``left`` (3,) is the hinge in the frame of its joint."""
    places, world = motion.positions(), motion.world_rotations()
    bones = places[:, tips] - places[:, [toe]]
    lengths = np.maximum(np.linalg.norm(bones, axis=-1), 1e-9)
    lowest = np.minimum(-places[:, toe, 1], 0.0)[:, None]
    least = np.arcsin(np.clip(lowest / lengths, -1.0, 1.0))
    slopes = np.arcsin(np.clip(bones[..., 1] / lengths, -1.0, 1.0))
    lack = np.where(lengths > 1e-6, least - slopes, 0.0)
    angle = np.maximum(lack.max(axis=1), 0.0)
    if not angle.any():
        return motion
    turn = rot.rotvec_to_quat(-angle[:, None] * rot.rotate(world[:, toe], left[None]))
    above, rotations = world[:, motion.skeleton.parents[toe]], motion.rotations.copy()
    rotations[:, toe] = rot.multiply(rot.inverse(above), rot.multiply(turn, world[:, toe]))
    return replace(motion, rotations=rotations)
