"""Two-bone inverse kinematics in closed form: where the knee (or elbow) goes, and a body's bones turned to it.

Where a rig has no collar bones, its shoulders stay on the chest, or an animator pulls the arms out of their sockets. On
a body of the other kind arms of the same directions would start elsewhere, and two hands on one sword would part. So
shoulders go as far from rest as the source's (`shrug`), or hands where they would be (`reach`), against the chest.
"""

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.skeleton import Skeleton
from motionloom.retarget.anatomy import Body
from motionloom.retarget.axes import ARM_JOINTS, CHEST, COLLARS, SHOULDERS, beside, unit

Array = NDArray[np.float64]
Limb = tuple[int, int, int]
"""The SMPL joints where its two bones begin, meet and end."""


def bend(start: Array, goal: Array, pole: Array, *, upper: float, lower: float) -> tuple[Array, Array]:
    """Middle joint and reached end of a two-bone limb, law of cosines.

    ``start``, ``goal`` (..., 3) metres: the limb's beginning and where its end should be; ``pole`` (..., 3): the
    way the middle joint points out (any length; its part along the limb is ignored). A goal out of reach is
    approached on the straight line to it; one too near is pushed out to the nearest distance the bones allow.
    """
    line = goal - start
    distance = np.linalg.norm(line, axis=-1, keepdims=True)
    along = line / np.maximum(distance, 1e-9)
    reach = np.clip(distance, abs(upper - lower) + 1e-9, upper + lower - 1e-9)
    out = unit(beside(pole, along))
    forward = (upper**2 - lower**2 + reach**2) / (2 * reach)
    height = np.sqrt(np.maximum(upper**2 - forward**2, 0.0))
    return start + forward * along + height * out, start + reach * along


def placed(skeleton: Skeleton, world: Array) -> Array:
    """(frames, joints, 3) metres, with joint 0 at the origin, of world rotations (frames, joints, 4)."""
    places = np.zeros((*world.shape[:2], 3))
    for j, p in enumerate(skeleton.parents[1:], start=1):
        places[:, j] = places[:, p] + rot.rotate(world[:, p], np.broadcast_to(skeleton.offsets[j], (len(world), 3)))
    return places


def aim(world: Array, body: Body, joint: int, now: Array, direction: Array) -> Array:
    """World rotations (frames, joints, 4) with one SMPL joint's bone turned from ``now`` to ``direction`` (frames, 3).

    The turn has no twist; what follows the bone rigidly turns along.
    """
    driver = body.drivers[joint]
    assert driver is not None
    turned = world.copy()
    turn = rot.shortest_arc(now, direction)
    stop = {d for j, d in enumerate(body.drivers) if d is not None and d != driver}
    follows = {driver}
    for k in range(driver + 1, len(body.skeleton)):
        if body.skeleton.parents[k] in follows and k not in stop:
            follows.add(k)
    for k in follows:
        turned[:, k] = rot.multiply(turn, world[:, k])
    return turned


def bend_limb(world: Array, body: Body, limb: Limb, places: Array, goal: Array, pole: Array) -> Array:
    """World rotations (frames, joints, 4) with a limb bent so that its end is at a goal, or as near as it reaches.

    places: (frames, 22, 3) metres, where joints are now; goal, pole: (frames, 3) as of `bend`.
    """
    start, middle, _ = limb
    first, second, third = (places[:, joint] for joint in limb)
    bent, reached = bend(first, goal, pole, upper=body.bone(start), lower=body.bone(middle))
    world = aim(world, body, start, second - first, bent - first)
    return aim(world, body, middle, third - second, reached - bent)


def read_shrug(positions: Array, world: Array, body: Body) -> Array:
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

    ``moved`` (frames, 2, 3) says where these are, as `read_shrug` of another body does. A hand out of reach goes
    as far as it can.
    """
    chest = body.drivers[CHEST]
    if chest is None:
        return world
    positions = placed(body.skeleton, world)
    lost = (moved - read_shrug(positions, world, body)) * body.arm
    lost = rot.rotate(rot.multiply(world[:, chest], body.frames[CHEST])[:, None], lost)
    places = body.places(positions, world)
    for side, arm in enumerate(ARM_JOINTS):
        shoulder, elbow, wrist = arm
        if len({body.drivers[shoulder], body.drivers[elbow], None}) < 3:
            continue  # no joint of its own bends this arm
        upper = places[:, elbow] - places[:, shoulder]
        lower = places[:, wrist] - places[:, elbow]
        out = beside(upper, unit(upper + lower))
        lack = (0.03 * body.arm - np.linalg.norm(out, axis=-1, keepdims=True)).clip(0)
        turned = rot.multiply(world[:, body.drivers[shoulder]], body.frames[shoulder])
        pole = out - lack * rot.rotate(turned, np.eye(3)[1])  # of a nearly straight arm, behind the plane it bends in
        goal = places[:, wrist] + lost[:, side]
        world = bend_limb(world, body, arm, places, goal, pole)
    return world
