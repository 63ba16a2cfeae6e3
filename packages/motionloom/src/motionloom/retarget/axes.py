"""The 22 joints' bones, and the anatomical frames that places alone show, of a rest pose or measured from a motion.

What a pelvis, a spine, a head points along is read off several joints together (hips, shoulders), never off one short
bone: a skeleton may have its first spine joint behind the hips or its toes straight below the ankle.
Skeletons whose rest pose is no pose (all bones along one axis, a person who lies or is folded) have frames measured
from a motion: bones, the trunk, and the planes in which knees and elbows bend.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.arrays import unit as unit
from motionloom.core.skeleton import SMPL22

Array = NDArray[np.float64]

_LINES = ((0, 3, 6, 9, 12, 15), (1, 4, 7, 10), (2, 5, 8, 11), (13, 16, 18, 20), (14, 17, 19, 21))
_NEXT = {upper: lower for line in _LINES for upper, lower in pairwise(line)}
CHILD: tuple[int | None, ...] = tuple(_NEXT.get(joint) for joint in range(22))
"""The SMPL joint each SMPL joint's bone runs to."""
LEGS, FEET, TOES = (1, 2, 4, 5), (7, 8), (10, 11)
ARMS = (13, 14, 16, 17, 18, 19, 20, 21)
CHEST, COLLARS, SHOULDERS = 9, (13, 14), (16, 17)
HEAD = 15
SPINE = (3, 6, 9)
LEG_JOINTS, ARM_JOINTS = ((1, 4, 7), (2, 5, 8)), ((16, 18, 20), (17, 19, 21))
"""Beginning, middle and end of the two bones of the left and the right limb."""
_BENT = 0.15
"""Sine of a knee's or an elbow's bend from which on the plane of the bend is known."""
_SLOPES = np.radians((-10, 45))
"""By how much the bone to the toes points down on feet that are flat; a rest pose with others is on its toes."""
_FOOT = 0.24
"""Lengths of the shin: a shorter bone runs down to the ground below the ankle and not to the toes."""
_DOUBTFUL = 0.005
"""The weight of a frame that says little, beside 1: it counts where no frame says more."""


def frame(first: Array, second: Array) -> Array:
    """(..., 4) the frame whose first axis is ``first`` and whose second lies nearest to ``second``."""
    x = unit(first)
    y = unit(beside(second, x))
    return rot.from_axes([x, y, np.cross(x, y)])


def beside(vectors: Array, along: Array) -> Array:
    """The part of vectors (..., 3) that is square to directions (..., 3) of length 1."""
    return vectors - (vectors * along).sum(-1, keepdims=True) * along


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

    A collar bone is short, and skeletons have its ends in different places: what counts is how far it is from rest.
    """
    person = SMPL22.rest_positions()
    upright = frame(np.eye(3)[1], np.eye(3)[0])
    bones = frame(person[list(SHOULDERS)] - person[list(COLLARS)], np.eye(3)[2])
    return rot.multiply(chest[..., None, :], rot.multiply(rot.inverse(upright), bones))


# Measured from a motion ----------------------------------------------------------------------------------------------


def measure_frames(places: Array, world: Array, drivers: Sequence[int | None], otherwise: Array) -> Array:
    """(22, 4) joint_from_anatomy, the mean over a motion.

    places: (frames, 22, 3) metres, y up; world: (frames, joints, 4) the joints' orientations; drivers: per SMPL joint
    the joint that turns it; otherwise: (22, 4) the frames of SMPL joints that nothing turns.
    """
    frames, weights = frames_of_places(places)
    axes = otherwise.copy()
    for j, driver in enumerate(drivers):
        if driver is not None:
            axes[j] = mean_rotation(rot.multiply(rot.inverse(world[:, driver]), frames[:, j]), weights[:, j])
    return axes


def frames_of_places(places: Array) -> tuple[Array, Array]:
    """World frames (frames, 22, 4) of the 22 joints (frames, 22, 3) and how much each says (frames, 22), above 0 to 1.

    A straight knee or elbow says nothing about the twist of its limb: its weight is the sine of the bend. Of the
    pelvis, the spine and the head those frames count in which the trunk goes on where the thighs end, as in standing.
    """
    hips, shoulders, along = hips_line(places), shoulder_line(places), trunk(places)
    ahead = np.cross(shoulders, along)
    result = np.empty((*places.shape[:2], 4))
    weights = np.ones(places.shape[:2])
    for j, child in enumerate(CHILD):
        bone = places[:, child] - places[:, j] if child is not None else along
        result[:, j] = frame(np.where(_length(bone) > 1e-6, bone, along), ahead if j in ARMS else shoulders)
    for j, share in ((0, 0.0), (3, 1 / 3), (6, 2 / 3), (9, 1.0), (HEAD, 1.0)):
        result[:, j] = trunk_frame((1 - share) * unit(hips) + share * unit(shoulders), along)
    weights[:, [0, *SPINE, 12, HEAD]] = _standing(places, along)[:, None]
    result[:, COLLARS] = collar_frames(result[:, CHEST])
    weights[:, COLLARS] = arms_hang(places)
    for upper, lower, end in LEG_JOINTS:
        a = unit(places[:, lower] - places[:, upper])
        b = unit(places[:, end] - places[:, lower])
        bend = _bend(a, b)
        hinge = np.where(bend[:, None] > _DOUBTFUL, np.cross(a, b), hips)
        result[:, upper], result[:, lower] = frame(a, hinge), frame(b, hinge)
        weights[:, [upper, lower]] = bend[:, None]
    for upper, lower, end in ARM_JOINTS:
        a, b = unit(places[:, lower] - places[:, upper]), unit(places[:, end] - places[:, lower])
        bend = _bend(a, b)
        known = bend[:, None] > _DOUBTFUL
        result[:, upper] = frame(a, np.where(known, b, ahead))
        result[:, lower] = frame(b, np.where(known, -a, ahead))
        result[:, end] = result[:, lower]
        weights[:, [upper, lower, end]] = bend[:, None]
    for foot, toe in zip(FEET, TOES):
        flat = _flat(places, foot)
        result[:, foot] = result[:, toe] = np.where(flat[:, None], _level_sole(places, foot), _sole(places, foot))
        weights[:, [foot, toe]] = np.where(flat, 1.0, _DOUBTFUL)[:, None]
    return result, weights


def measure_sole(places: Array, world: Array, driver: int | None, *, rest: Array, foot: int) -> Array | None:
    """(4,) joint_from_anatomy of a foot that stands flat in a motion and not in the rest pose.

    places: (frames, 22, 3) metres, y up; world: (frames, joints, 4) the joints' orientations; driver: the joint that
    turns the foot; rest: (22, 3) metres, a rest pose that is upright along y; foot: SMPL's number of the ankle. None
    where the rest pose has flat feet, or where the foot never stands and its bone is too short to run to toes.
    """
    if driver is None or stands_on_flat_feet(rest, foot):
        return None
    flat = _flat(places, foot)
    length = np.linalg.norm(rest[foot + 3] - rest[foot])
    if flat.sum() >= 3:
        world_soles = _level_sole(places, foot)
    elif length > _FOOT * np.linalg.norm(rest[foot] - rest[foot - 3]):
        flat, world_soles = np.ones(len(places), dtype=bool), _sole(places, foot)
    else:
        return None
    soles = rot.multiply(rot.inverse(world[flat, driver]), world_soles[flat])
    return mean_rotation(soles, np.ones(len(soles)))


def stands_on_flat_feet(rest: Array, foot: int) -> bool:
    """Whether a foot's bone slopes in a rest pose (22, 3) that is upright along y as it does on a flat foot."""
    slope = float(np.arcsin(-unit(rest[foot + 3] - rest[foot])[1]))
    return bool(_SLOPES[0] < slope < _SLOPES[1])


def _flat(places: Array, foot: int) -> NDArray[np.bool_]:
    """(frames,) bool: ankle and toe are as low as they get, below an upright shin and a body that is up."""
    shin = places[:, foot - 3] - places[:, foot]
    bone = places[:, foot + 3] - places[:, foot]
    low = [places[:, j, 1] < np.percentile(places[:, j, 1], 20) + 0.01 for j in (foot, foot + 3)]
    upright = (unit(shin)[:, 1] > 0.8) & (unit(bone)[:, 1] > -0.9)
    up = places[:, 0, 1] - places[:, foot, 1] > 1.2 * _length(shin)[:, 0]
    return low[0] & low[1] & upright & up


def _level_sole(places: Array, foot: int) -> Array:
    """(frames, 4) the frame of a sole that is level and points where the toes are."""
    heading = (places[:, foot + 3] - places[:, foot]) * np.array([1.0, 0.0, 1.0])
    return frame(heading, np.cross([0.0, 1.0, 0.0], heading))


def _sole(places: Array, foot: int) -> Array:
    """(frames, 4) the frame of a sole against which the bone to the toes slopes as on the uniform person."""
    shin = places[:, foot] - places[:, foot - 3]
    bone = places[:, foot + 3] - places[:, foot]
    left = np.cross(unit(bone), unit(shin))
    left = np.where(_length(left) > _BENT, left, hips_line(places))
    person = SMPL22.rest_positions()
    fall = np.arcsin(-unit(person[foot + 3] - person[foot])[1])
    return rot.multiply(frame(bone, left), rot.inverse(rot.rotvec_to_quat(np.array([0.0, fall, 0.0]))))


def _length(vectors: Array) -> Array:
    return np.asarray(np.linalg.norm(vectors, axis=-1, keepdims=True))


def _standing(places: Array, along: Array) -> Array:
    """(frames,) near 1 where the trunk goes on where the thighs end and both are upright."""
    thighs = unit(places[:, [1, 2]].mean(axis=1) - places[:, [4, 5]].mean(axis=1))
    straight = (unit(along) * thighs).sum(axis=-1).clip(0, 1) * unit(along)[:, 1].clip(0, 1)
    return np.maximum(straight**8, _DOUBTFUL)


def arms_hang(places: Array) -> Array:
    """(frames, 2) near 1 where an upper arm hangs down along the trunk, so that its shoulder rests."""
    arms, along = unit(places[:, [18, 19]] - places[:, SHOULDERS]), unit(trunk(places))
    down = -(arms * along[:, None]).sum(axis=-1).clip(-1, 0)
    return np.maximum(down**8, _DOUBTFUL)


def _bend(a: Array, b: Array) -> Array:
    """(frames,) the sine between two directions where it is large enough to show their plane."""
    sine = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.where(sine > _BENT, sine, _DOUBTFUL)


def mean_rotation(q: Array, weight: Array) -> Array:
    """(4,) the weighted mean of quaternions (n, 4): the first eigenvector of sum w q q^T (Markley et al. 2007)."""
    return np.linalg.eigh(np.einsum("n,ni,nj->ij", weight, q, q))[1][:, -1]
