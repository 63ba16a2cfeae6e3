"""A sampled stretch in a user's own motion: their skeleton, their frame rate, no jump at the borders.

What lies outside of the stretch is never touched. Inside, the sampled motion is moved by what it lacks at the borders,
in place and in velocity; that fades over a few frames ("inertialization", Bollo, GDC 2018, with a cubic).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.blending import smoothstep
from motionloom.core.body.feet import clean_feet
from motionloom.core.body.ik import motion_from_positions
from motionloom.core.errors import MotionloomError
from motionloom.core.features.humanml import positions_at, resample_positions
from motionloom.core.features.layout import FPS
from motionloom.core.features.placed import PlacedMotion
from motionloom.core.ground import GroundPose
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Skeleton
from motionloom.edits.boundary import match_boundary, match_rotations
from motionloom.retarget import joints22, to_smpl22
from motionloom.retarget.anatomy import read_body
from motionloom.retarget.onto import match_root, onto, place_of, with_place

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

EASE = 0.3
"""Seconds over which a difference of pose at a border fades."""


@dataclass(frozen=True, eq=False)
class KeptParts:
    """Parts of a skeleton that stay inside of a stretch."""

    joints: Flags
    """(joints,) whose rotations stay."""
    place: Flags
    """(3,) which coordinates of the root stay."""


def kept_parts(skeleton: Skeleton, joints: frozenset[int] = frozenset(), place: Flags | None = None) -> KeptParts:
    """The skeleton's own joints for some of the 22; joints that correspond to none of them (fingers) always stay.

    place: (3,) which coordinates of the root stay; None: none.
    """
    drivers = read_body(skeleton).drivers
    first = {driver: j for j, driver in reversed(list(enumerate(drivers))) if driver is not None}
    inner = set(first)
    for k in range(len(skeleton) - 1, 0, -1):
        if k in inner:
            inner.add(skeleton.parents[k])
    flags = np.ones(len(skeleton), dtype=bool)
    for k in sorted(inner):
        above = flags[skeleton.parents[k]] if k else 0 in joints
        flags[k] = first[k] in joints if k in first else above
    return KeptParts(flags, (np.zeros(3, dtype=bool) if place is None else place) | (0 in joints))


def person_at_20(motion: Motion) -> Array:
    """(frames + 1, 22, 3) metres: the uniform person at 20 fps for at least as long as the motion, and a frame more.

    What lies behind the motion's end goes straight on.
    """
    places = to_smpl22(motion).positions()
    frames = int(np.ceil((len(motion) - 1) / motion.fps * FPS - 1e-6)) + 1
    more = int(np.ceil(frames / FPS * motion.fps)) + 1 - len(motion)
    step = places[-1] - places[-2]
    ahead = places[-1] + step * np.arange(1, max(more, 0) + 1)[:, None, None]
    return resample_positions(np.concatenate([places, ahead]), motion.fps)[: frames + 1]


def person_at(motion: Motion, at: np.ndarray) -> Array:
    """(len(at), 22, 3) metres: the uniform person at fractional frames of a motion of two frames or more."""
    return positions_at(to_smpl22(motion).positions(), at)


def apply_sample(sample: PlacedMotion, old: Motion, *, foot_lock: bool) -> Motion:
    """What was sampled, on the old motion's skeleton, at its rate and length, over its floor; feet cleaned."""
    places = resample_positions(sample.positions, FPS, target=old.fps)[: len(old)]
    nearest = np.minimum((np.arange(len(old)) * FPS / old.fps).round().astype(int), len(sample.contacts) - 1)
    return apply_positions(places, old, contacts=sample.contacts[nearest], foot_lock=foot_lock)


def apply_positions(
    places: Array, old: Motion, *, foot_lock: bool, contacts: Array | None = None, known: int | None = None
) -> Motion:
    """Places (frames of ``old``, 22, 3) metres of the uniform person that the old motion is, on its skeleton, over its
    floor; feet cleaned, by contacts (frames, 4) or by what the feet do. ``known``: as of `onto`."""
    person = motion_from_positions(places, old.fps)
    return onto(clean_feet(person, contacts=contacts) if foot_lock else person, old, known=known)


def splice(old: Motion, new: Motion, first: int, *, last: int | None = None, keep: KeptParts | None = None) -> Motion:
    """``old`` with the frames ``first`` to before ``last`` (the end) of ``new`` in it.

    Args:
        old, new: of one skeleton, frame rate and length, and both with or both without moving bones.
        first, last: frames outside are the old ones bit for bit.
        keep: parts that are the old ones inside too; None: only joints that correspond to none of the 22.
    """
    last, keep = len(old) if last is None else last, keep or kept_parts(old.skeleton)
    ease = min(max(2, round(min(EASE * old.fps, (last - first) / 2))), last - first)
    turns = new.rotations
    for border, step in ((first - 1, 1), (last, -1)):
        if 0 <= border < len(old):
            turns = match_rotations(turns, old.rotations, border, step, ease)
    inside, before = slice(first, last), max(first - 1, 0)
    turns = np.where(keep.joints[:, None], old.rotations, turns)
    rotations, place = old.rotations.copy(), place_of(old).copy()
    rotations[inside] = rot.unroll(np.concatenate([old.rotations[before : before + 1], turns[inside]]))[1:]
    way = _eased_places(place, place_of(new), first, last, ease)
    place[inside] = np.where(keep.place, place, way)[inside]
    return with_place(replace(old, rotations=rotations), place)


def continue_motion(tail: Motion, places: Array, *, foot_lock: bool, contacts: Array | None = None) -> Motion:
    """What comes behind a motion, on its skeleton and over its floor, without a jump.

    Args:
        tail: its last frames, 2 or more.
        places: (frames, 22, 3) metres of the uniform person that it is; the first ``len(tail)`` are the tail's own.
        foot_lock: keep planted feet still.
        contacts: (frames, 4) as in the features; None: by what the feet do.

    Returns:
        The frames behind the tail.
    """
    old = concatenate(tail, *[tail.frames(len(tail) - 1, len(tail))] * (len(places) - len(tail)))
    solved = apply_positions(places, old, contacts=contacts, foot_lock=foot_lock, known=len(tail))
    return splice(old, solved, len(tail)).frames(len(tail), len(old))


def overlay(motion: Motion, source: Motion, joints: Array, place: Array) -> Motion:
    """``motion`` with parts of another one of the same skeleton, rate and length: exactly its own where a weight is 1.

    ``joints`` (frames, joints) weigh the local rotations, ``place`` (frames,) what carries the way through the world.
    """
    turns = rot.slerp(motion.rotations, source.rotations, joints)
    turns = np.where(joints[..., None] >= 1, source.rotations, np.where(joints[..., None] > 0, turns, motion.rotations))
    share = place[:, None]
    way = np.where(share >= 1, place_of(source), (1 - share) * place_of(motion) + share * place_of(source))
    return with_place(replace(motion, rotations=turns), way)


def move_rigidly(motion: Motion, turn: Array, about: Array, to: Array) -> Motion:
    """The motion turned by a quaternion (4,) about a point and moved so that the point comes to another (3,)."""
    rotations = motion.rotations.copy()
    rotations[:, 0] = rot.multiply(turn, rotations[:, 0])
    return replace(motion, root=rot.rotate(turn, motion.root - about) + to, rotations=rotations)


def move_on_floor(motion: Motion, here: GroundPose, there: GroundPose) -> Motion:
    """The motion moved along the floor so that one ground pose becomes another, the path carried by the same joint as
    before (`match_root`)."""
    turn = rot.rotvec_to_quat(np.array([0.0, there.facing - here.facing, 0.0]))
    about, to = np.array([here.x, 0.0, here.z]), np.array([there.x, 0.0, there.z])
    return match_root(motion, move_rigidly(motion, turn, about, to))


def ground_pose_at(motion: Motion, frame: int) -> GroundPose:
    """The ground pose of the hips in a frame."""
    places = joints22(motion.frames(frame, frame + 1))[0]
    across = places[1] - places[2]
    return GroundPose.of((places[1] + places[2]) / 2, float(np.arctan2(-across[2], across[0])))


def concatenate(*parts: Motion) -> Motion:
    """One motion after the other; all on the first one's skeleton and at its rate."""
    moved = None if parts[0].translations is None else [p.translations for p in parts if p.translations is not None]
    return replace(
        parts[0],
        root=np.concatenate([p.root for p in parts]),
        rotations=np.concatenate([p.rotations for p in parts]),
        translations=None if moved is None else np.concatenate(moved),
    )


def _eased_places(old: Array, new: Array, first: int, last: int, ease: int) -> Array:
    """``new`` (frames, 3) with what it lacks at the borders; what they lack differently spreads over the stretch."""
    lack, frames = old - new, len(old)
    before, behind = first > 0, last < frames
    level = np.array([1.0, 0.0, 1.0])  # with one border only, the other end is at the height that was sampled
    left = lack[first - 1] if before else level * lack[last] if behind else np.zeros(3)
    right = lack[last] if behind else level * left
    u = ((np.arange(frames) - first + 1) / (last - first + 1))[:, None]
    result = new + left + smoothstep(u) * (right - left)
    for border, step, there in ((first - 1, 1, before), (last, -1, behind)):
        if there and 0 <= border - step < frames:
            slope = lack[border] - lack[border - step]
            result[border + step * np.arange(1, ease + 1)] += match_boundary(np.zeros(3), slope, ease)
    return result


def check_like(past: Motion, other: Motion, what: str) -> None:
    """Raise MotionloomError unless both are of one skeleton and rate, and both with or without moving bones."""
    if other.skeleton != past.skeleton:
        raise MotionloomError(
            f"the {what} has another skeleton ({len(other.skeleton)} joints, the past {len(past.skeleton)}); "
            "retarget it to the past's first"
        )
    if (other.translations is None) != (past.translations is None):
        raise MotionloomError(
            f"the {what} and the past must both have bones of constant length, or both have moving ones"
        )
    if abs(other.fps - past.fps) > 1e-3 * past.fps:
        raise MotionloomError(f"the {what} has {other.fps:g} fps and the past {past.fps:g}; resample it first")
