"""Where a head looks: it is turned to a place after the motion is made, as far as a neck can."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.blending import smoothstep
from motionloom.errors import MotionloomError
from motionloom.motion import Motion
from motionloom.retarget.anatomy import read_body

Array = NDArray[np.float64]

TURN, NOD = np.radians(70), np.radians(40)
"""Radians to either side, and up or down, that a head turns by against the chest at most."""
BEHIND = (np.radians(100), np.radians(160))
"""Radians to the side from which on the head begins to give up, and from which on it looks ahead as it did."""
FORWARD = np.array([0.0, 0.0, -1.0])
"""In the anatomical frame of the head and the spine: up, to the left, back."""


def looking(motion: Motion, points: Array, weights: Array) -> Motion:
    """The motion with its head turned to places; half of the turn is the neck's.

    Args:
        motion: one person on any humanoid skeleton.
        points: (frames, 3) metres in the world, or (3,) for all frames.
        weights: (frames,) from 0, as it was, to 1.

    Raises:
        MotionloomError: for a skeleton without a head that turns.
    """
    body = read_body(motion.skeleton)
    head, neck = body.drivers[15], body.drivers[12]
    chest, frame = next((driver, body.frames[j]) for j in (9, 6, 3, 0) if (driver := body.drivers[j]) is not None)
    if head is None or head == chest:
        raise MotionloomError("the clip's skeleton has no head that turns; take one with a head, or leave out the look")
    world = motion.world_rotations()
    eyes, seen = motion.positions()[:, head], rot.multiply(world[:, chest], frame)
    aim, share = _bounded(rot.rotate(rot.inverse(seen), points - eyes))
    now = rot.rotate(rot.multiply(world[:, head], body.frames[15]), FORWARD)
    turn = rot.quat_to_rotvec(rot.shortest_arc(now, rot.rotate(seen, aim))) * (weights * share)[:, None]
    parts = [neck, head] if neck in motion.skeleton.ancestors(head)[1:] and neck != chest else [head]
    made = motion
    for joint in parts:
        made = _turned(made, joint, rot.rotvec_to_quat(turn / len(parts)))
    return made


def _turned(motion: Motion, joint: int, turn: Array) -> Motion:
    """The motion with a joint, and what hangs on it, turned by (frames, 4) about axes of the world."""
    world, rotations = motion.world_rotations(), motion.rotations.copy()
    above = world[:, motion.skeleton.parents[joint]]
    rotations[:, joint] = rot.multiply(rot.inverse(above), rot.multiply(turn, world[:, joint]))
    return replace(motion, rotations=rot.unroll(rotations))


def _bounded(wanted: Array) -> tuple[Array, Array]:
    """Directions (frames, 3) within what a neck can, seen from the chest, and how far they are followed (frames,)."""
    up, left, back = np.moveaxis(wanted, -1, 0)
    side, rise = np.arctan2(left, -back), np.arctan2(up, np.hypot(left, back))
    share = 1 - smoothstep((np.abs(side) - BEHIND[0]) / (BEHIND[1] - BEHIND[0]))
    side, rise = np.clip(side, -TURN, TURN), np.clip(rise, -NOD, NOD)
    aim = np.stack([np.sin(rise), np.cos(rise) * np.sin(side), -np.cos(rise) * np.cos(side)], axis=-1)
    return aim, share
