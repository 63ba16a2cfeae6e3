"""A motion of the uniform person back on somebody's own skeleton: moved there as in their own motion, where that is.

Their file may hold the root still and move the hips, their feet may have another height, their hands another rest;
what comes back is compared with their own motion, retargeted to the uniform person and back.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Skeleton
from motionloom.retarget.anatomy import read_body
from motionloom.retarget.axes import FEET, TOES, mean_rotation
from motionloom.retarget.transfer import joints22, retarget, to_smpl22

Array = NDArray[np.float64]

LEAVES = (10, 11, 15, 20, 21)
"""Toes, head and hands: their directions do not follow from the places of the 22 joints."""


def onto(person: Motion, old: Motion, *, known: int | None = None) -> Motion:
    """The uniform person's motion on the skeleton of ``old``, at its place and over its floor.

    Args:
        person: of the 22-joint skeleton, as many frames as ``old``, at its rate.
        old: the motion that it takes the place of; upright along +Y.
        known: how many of the first frames are the old motion's own, if what follows them is not: they show where it
            is and how its head, hands and toes are held. None: all frames do, and they are held as the person does.

    Raises:
        MotionloomError: where the old motion does not stand upright along +Y.
    """
    motion = match_root(old, retarget(person, old.skeleton))
    back = motion.frames(0, known) if known else match_root(old, retarget(to_smpl22(old), old.skeleton))
    original, carrier = old.frames(0, len(back)), _carrier(old.skeleton)
    apart = rot.multiply(original.world_rotations()[:, carrier], rot.inverse(back.world_rotations()[:, carrier]))
    if np.median(np.abs(apart[:, 0])) < np.cos(np.radians(30)):
        raise MotionloomError("the clip does not stand upright along +Y; say which axis of its file is up (--up z)")
    apart = (place_of(original) - place_of(back)).mean(axis=0)
    if known:
        lowest, own = (joints22(part)[:, [*FEET, *TOES], 1].min(axis=1) for part in (back, original))
        apart[1] = (own - lowest).mean()  # legs of another build stand as high, their hips need not
        motion = _held_alike(motion, old, known)
    return with_place(motion, place_of(motion) + apart)


def _held_alike(motion: Motion, old: Motion, known: int) -> Motion:
    """``motion`` with hands, head and toes held as they usually are in the first ``known`` frames of ``old``.

    Places do not say how; without it they would turn to how the uniform person holds them, in a blink.
    """
    drivers, rotations = read_body(motion.skeleton).drivers, motion.rotations.copy()
    now = motion.frames(0, known).world_rotations()
    was = old.frames(0, known).world_rotations()
    for joint in (drivers[leaf] for leaf in LEAVES):
        if joint is not None and drivers.count(joint) == 1:
            apart = mean_rotation(rot.multiply(rot.inverse(now[:, joint]), was[:, joint]), np.ones(known))
            rotations[:, joint] = rot.multiply(rotations[:, joint], apart)
    return replace(motion, rotations=rotations)


def match_root(old: Motion, motion: Motion) -> Motion:
    """The same poses as the old motion's files hold them, of as many frames: which joint carries the path.

    Files may hold the root still and move the hips in it; then the bones' changing lengths stay the old ones.
    """
    if old.translations is None:
        return motion
    carrier = _carrier(old.skeleton)
    if carrier == 0:
        return replace(motion, translations=old.translations)
    parent = old.skeleton.parents[carrier]
    above, place = old.world_rotations()[:, parent], old.positions()[:, parent]
    rotations, translations = motion.rotations.copy(), old.translations.copy()
    chain = old.skeleton.ancestors(parent)
    rotations[:, chain] = old.rotations[:, chain]
    undo = rot.inverse(above)
    rotations[:, carrier] = rot.multiply(undo, motion.world_rotations()[:, carrier])
    translations[:, carrier] = rot.rotate(undo, motion.positions()[:, carrier] - place)
    return Motion(old.skeleton, old.fps, old.root, rotations, translations)


def _carrier(skeleton: Skeleton) -> int:
    """The joint that turns the pelvis."""
    return read_body(skeleton).drivers[0] or 0


def place_of(motion: Motion) -> Array:
    """(frames, 3) what carries the way through the world."""
    carrier = 0 if motion.translations is None else _carrier(motion.skeleton)
    if carrier == 0 or motion.translations is None:
        return motion.root
    return motion.translations[:, carrier]


def with_place(motion: Motion, place: Array) -> Motion:
    """The motion with that, (frames, 3) metres, in its stead."""
    carrier = 0 if motion.translations is None else _carrier(motion.skeleton)
    if carrier == 0 or motion.translations is None:
        return replace(motion, root=place)
    translations = motion.translations.copy()
    translations[:, carrier] = place
    return replace(motion, translations=translations)
