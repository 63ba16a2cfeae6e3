"""Where a head looks: it is turned to a place after the motion is generated, as far as a neck can."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.blending import smoothstep
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.retarget.anatomy import read_body

Array = NDArray[np.float64]

TURN, NOD = np.radians(70), np.radians(40)
"""Radians to either side, and up or down, that a head turns by against the chest at most."""
BEHIND = (np.radians(100), np.radians(160))
"""Radians to the side from which on the head begins to give up, and from which on it looks ahead as it did."""
FORWARD = np.array([0.0, 0.0, -1.0])
"""In the anatomical frame of the head and the spine: up, to the left, back."""


def looks(motion: Motion) -> Array:
    """Unit vectors (frames, 3) in the world: the direction of the face.

    Args:
        motion: one person on any humanoid skeleton.

    Raises:
        MotionloomError: for a skeleton without a head.
    """
    body = read_body(motion.skeleton)
    if (head := body.drivers[15]) is None:
        raise MotionloomError("the clip's skeleton has no head; take one with a head")
    return rot.rotate(rot.multiply(motion.world_rotations()[:, head], body.frames[15]), FORWARD)


def looking(motion: Motion, points: Array, weights: Array) -> Motion:
    """The motion with its head turned to places; half of the turn is the neck's.

    Args:
        motion: one person on any humanoid skeleton.
        points: (frames, 3) metres in the world, or (3,) for all frames.
        weights: (frames,) from 0, as it was, to 1.

    Raises:
        MotionloomError: for a skeleton without a head that turns.
    """
    head, _, chest = _neck(motion)
    side, rise = _angles(rot.rotate(rot.inverse(chest), points - motion.positions()[:, head]))
    share = 1 - smoothstep((np.abs(side) - BEHIND[0]) / (BEHIND[1] - BEHIND[0]))
    return _aimed(motion, np.clip(side, -TURN, TURN), np.clip(rise, -NOD, NOD), weights * share)


def turned(motion: Motion, left: Array, up: Array) -> Motion:
    """The motion with its head turned from where it looks, as far as a neck can; half of the turn is the neck's.

    Args:
        motion: one person on any humanoid skeleton.
        left: (frames,) radians to the left, about the axis of the chest.
        up: (frames,) radians up.

    Raises:
        MotionloomError: for a skeleton without a head that turns.
    """
    side, rise = _angles(rot.rotate(rot.inverse(_neck(motion)[2]), looks(motion)))
    side, rise = (
        np.clip(now + more, np.minimum(now, -most), np.maximum(now, most))
        for now, more, most in ((side, left, TURN), (rise, up, NOD))
    )
    return _aimed(motion, side, rise, np.any([left, up], axis=0).astype(float))


def _neck(motion: Motion) -> tuple[int, int | None, Array]:
    """The joints of the head and of a neck that turns it, and the frame (frames, 4) of the chest below them."""
    body = read_body(motion.skeleton)
    head, neck = body.drivers[15], body.drivers[12]
    chest, frame = next((driver, body.frames[j]) for j in (9, 6, 3, 0) if (driver := body.drivers[j]) is not None)
    if head is None or head == chest:
        raise MotionloomError("the clip's skeleton has no head that turns; take one with a head, or leave out the look")
    turns = neck in motion.skeleton.ancestors(head)[1:] and neck != chest
    return head, neck if turns else None, rot.multiply(motion.world_rotations()[:, chest], frame)


def _joint_turned(motion: Motion, joint: int, turn: Array) -> Motion:
    """The motion with a joint, and what hangs on it, turned by (frames, 4) about axes of the world."""
    world, rotations = motion.world_rotations(), motion.rotations.copy()
    above = world[:, motion.skeleton.parents[joint]]
    rotations[:, joint] = rot.multiply(rot.inverse(above), rot.multiply(turn, world[:, joint]))
    return replace(motion, rotations=rot.unroll(rotations))


def _angles(directions: Array) -> tuple[Array, Array]:
    """Radians to the left and up (frames,) of directions (frames, 3) in the frame of the chest."""
    up, left, back = np.moveaxis(directions, -1, 0)
    return np.arctan2(left, -back), np.arctan2(up, np.hypot(left, back))


def _aimed(motion: Motion, side: Array, rise: Array, weights: Array) -> Motion:
    """The motion with its head turned to so many radians to the left and up of the chest's front."""
    head, neck, chest = _neck(motion)
    aim = np.stack([np.sin(rise), np.cos(rise) * np.sin(side), -np.cos(rise) * np.cos(side)], axis=-1)
    turn = rot.quat_to_rotvec(rot.shortest_arc(looks(motion), rot.rotate(chest, aim))) * weights[:, None]
    parts = [head] if neck is None else [neck, head]
    for joint in parts:
        motion = _joint_turned(motion, joint, rot.rotvec_to_quat(turn / len(parts)))
    return motion
