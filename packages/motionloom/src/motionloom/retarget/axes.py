"""The 22 joints' bones, and the anatomical frames that places alone show.

What a pelvis, a spine, a head points along is read off several joints together (hips, shoulders), never off one short
bone: a skeleton may have its first spine joint behind the hips or its toes straight below the ankle.
"""

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.skeleton import SMPL22

Array = NDArray[np.float64]

CHILD: tuple[int | None, ...] = (
    3,
    4,
    5,
    6,
    7,
    8,
    9,
    10,
    11,
    12,
    None,
    None,
    15,
    16,
    17,
    None,
    18,
    19,
    20,
    21,
    None,
    None,
)
"""The SMPL joint each SMPL joint's bone runs to."""
LEGS, FEET, TOES = (1, 2, 4, 5), (7, 8), (10, 11)
ARMS = (13, 14, 16, 17, 18, 19, 20, 21)
CHEST, COLLARS, SHOULDERS = 9, (13, 14), (16, 17)
HEAD = 15
SPINE = (3, 6, 9)


def frame(first: Array, second: Array) -> Array:
    """(..., 4) the frame whose first axis is ``first`` and whose second lies nearest to ``second``."""
    x = unit(first)
    y = unit(second - (second * x).sum(-1, keepdims=True) * x)
    return rot.from_axes([x, y, np.cross(x, y)])


def unit(v: Array) -> Array:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)


def hips_line(places: Array) -> Array:
    """(..., 3) metres from the right hip joint to the left one, of places (..., 22, 3)."""
    return places[..., 1, :] - places[..., 2, :]


def shoulder_line(places: Array) -> Array:
    """(..., 3) metres from the right shoulder joint to the left one, of places (..., 22, 3)."""
    return places[..., 16, :] - places[..., 17, :]


def trunk(places: Array) -> Array:
    """(..., 3) metres from the middle of the hip joints to that of the shoulder joints, of places (..., 22, 3)."""
    return places[..., [16, 17], :].mean(axis=-2) - places[..., [1, 2], :].mean(axis=-2)


def trunk_frame(across: Array, along: Array) -> Array:
    """(..., 4) the frame "up the spine, to the left" of a pelvis, spine or head on an upright trunk.

    across: (..., 3) to the left; along: (..., 3) from the hips to the shoulders. On the uniform person at rest
    it is the world's up and left, though the shoulders of that person are a little behind the hips.
    """
    person = SMPL22.rest_positions()
    lean = rot.multiply(rot.inverse(frame(hips_line(person), trunk(person))), frame(np.eye(3)[1], np.eye(3)[0]))
    return rot.multiply(frame(across, along), lean)


def collar_frames(chest: Array) -> Array:
    """(..., 2, 4) the frames of both collars where shoulders rest on a chest (..., 4), as on the uniform person.

    A collar bone is short, and skeletons put its ends in different places: what counts is how far it is from rest.
    """
    person = SMPL22.rest_positions()
    upright = frame(np.eye(3)[1], np.eye(3)[0])
    bones = frame(person[list(SHOULDERS)] - person[list(COLLARS)], np.eye(3)[2])
    return rot.multiply(chest[..., None, :], rot.multiply(rot.inverse(upright), bones))
