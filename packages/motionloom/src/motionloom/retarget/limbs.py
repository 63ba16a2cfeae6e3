"""Two-bone inverse kinematics in closed form: where the knee (or elbow) goes, and a body's bones turned to it."""

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.retarget.anatomy import Body
from motionloom.skeleton import Skeleton

Array = NDArray[np.float64]


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
    out = pole - (pole * along).sum(-1, keepdims=True) * along
    out = out / np.maximum(np.linalg.norm(out, axis=-1, keepdims=True), 1e-9)
    forward = (upper**2 - lower**2 + reach**2) / (2 * reach)
    height = np.sqrt(np.maximum(upper**2 - forward**2, 0.0))
    return start + forward * along + height * out, start + reach * along


def placed(skeleton: Skeleton, world: Array) -> Array:
    """(frames, joints, 3) metres, with joint 0 at the origin, of world rotations (frames, joints, 4)."""
    places = np.zeros((*world.shape[:2], 3))
    for j, p in enumerate(skeleton.parents[1:], start=1):
        places[:, j] = places[:, p] + rot.rotate(world[:, p], np.broadcast_to(skeleton.offsets[j], (len(world), 3)))
    return places


def aim(world: Array, body: Body, joint: int, now: Array, wanted: Array) -> Array:
    """World rotations (frames, joints, 4) with one SMPL joint's bone turned from ``now`` to ``wanted`` (frames, 3).

    The turn has no twist; what follows the bone rigidly turns along.
    """
    driver = body.drivers[joint]
    assert driver is not None
    turned = world.copy()
    turn = rot.shortest_arc(now, wanted)
    stop = {d for j, d in enumerate(body.drivers) if d is not None and d != driver}
    follows = {driver}
    for k in range(driver + 1, len(body.skeleton)):
        if body.skeleton.parents[k] in follows and k not in stop:
            follows.add(k)
    for k in follows:
        turned[:, k] = rot.multiply(turn, world[:, k])
    return turned
