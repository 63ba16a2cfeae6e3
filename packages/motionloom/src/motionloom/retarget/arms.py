"""Shoulders as far from rest as the source's, or hands where they would be, against the chest.

Where a rig has no collar bones, its shoulders stay on the chest, or an animator pulls the arms out of their sockets. On
a body of the other kind arms of the same directions would start elsewhere, and two hands on one sword would part.
"""

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.retarget.anatomy import Body
from motionloom.retarget.axes import CHEST, COLLARS, SHOULDERS
from motionloom.retarget.limbs import aim, bend, placed

Array = NDArray[np.float64]


def shoulders_moved(positions: Array, world: Array, body: Body) -> Array:
    """(frames, 2, 3) how far the shoulders are from their rest on the chest, in its frame and in lengths of the arm.

    ``positions`` (frames, joints, 3) metres and ``world`` (frames, joints, 4) are of the body's joints. Zero
    where no joint turns the chest or arms have no length.
    """
    chest = body.drivers[CHEST]
    if chest is None or body.arm < 1e-6:
        return np.zeros((len(world), 2, 3))
    now = np.einsum("sj,fjc->fsc", body.points[list(SHOULDERS)], positions) - positions[:, chest, None]
    turned = rot.inverse(rot.multiply(world[:, chest], body.frames[CHEST]))
    return np.asarray((rot.rotate(turned[:, None], now) - body.shoulders) / body.arm, dtype=np.float64)


def shrug(world: Array, chest: Array, moved: Array, body: Body) -> Array:
    """World rotations (frames, joints, 4) with collars aimed at where shoulders belong; arms keep their orientation.

    chest: (frames, 4) the anatomical frame of the chest as the source has it. moved: (frames, 2, 3) how far the
    shoulders are from their rest on it, in this frame and in breadths of the shoulders.
    """
    joint = body.drivers[CHEST]
    if joint is None:
        return world
    positions = placed(body.skeleton, world)
    places = body.places(positions, world)
    own = rot.inverse(rot.multiply(world[:, joint], body.frames[CHEST]))
    for side, (collar, shoulder) in enumerate(zip(COLLARS, SHOULDERS)):
        if body.drivers[collar] == body.drivers[shoulder]:
            continue
        start = rot.rotate(own, places[:, collar] - positions[:, joint])
        bone = rot.rotate(chest, body.shoulders[side] + moved[:, side] * body.breadth - start)
        world = aim(world, body, collar, places[:, shoulder] - places[:, collar], bone)
    return world


def reach(world: Array, moved: Array, body: Body) -> Array:
    """World rotations (frames, joints, 4) with arms bent so that hands are where other shoulders would put them.

    ``moved`` (frames, 2, 3) says where these are, as `shoulders_moved` of another body does. A hand out of reach goes
    as far as it can.
    """
    chest = body.drivers[CHEST]
    if chest is None:
        return world
    positions = placed(body.skeleton, world)
    lost = (moved - shoulders_moved(positions, world, body)) * body.arm
    lost = rot.rotate(rot.multiply(world[:, chest], body.frames[CHEST])[:, None], lost)
    places = body.places(positions, world)
    for side, (shoulder, elbow, wrist) in enumerate(((16, 18, 20), (17, 19, 21))):
        if len({body.drivers[shoulder], body.drivers[elbow], None}) < 3:
            continue  # no joint of its own bends this arm
        upper, lower = places[:, elbow] - places[:, shoulder], places[:, wrist] - places[:, elbow]
        pole = _elbow_pole(world, body, shoulder, arm=upper + lower, upper=upper)
        middle, end = bend(
            places[:, shoulder],
            places[:, wrist] + lost[:, side],
            pole,
            upper=body.bone(shoulder),
            lower=body.bone(elbow),
        )
        world = aim(world, body, shoulder, upper, middle - places[:, shoulder])
        world = aim(world, body, elbow, lower, end - middle)
    return world


def _elbow_pole(world: Array, body: Body, shoulder: int, *, arm: Array, upper: Array) -> Array:
    """(frames, 3) where the elbow stands out from the arm; of a nearly straight one, behind the plane it bends in."""
    line = arm / np.maximum(np.linalg.norm(arm, axis=-1, keepdims=True), 1e-9)
    out = upper - (upper * line).sum(-1, keepdims=True) * line
    driver = body.drivers[shoulder]
    assert driver is not None
    behind = -rot.rotate(rot.multiply(world[:, driver], body.frames[shoulder]), np.eye(3)[1])
    lack = (0.03 * body.arm - np.linalg.norm(out, axis=-1, keepdims=True)).clip(0)
    return out + lack * behind
