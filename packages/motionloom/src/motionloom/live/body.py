"""Places of joints to a body whose first frames were shown: those stay, the rest follows from them.

The pose and its change that were shown last pass into the new ones as at the borders of an inpainted stretch
(`edits.boundary`), here on a body with constant bones; planted feet stay planted where they were shown.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.edits.boundary import JOIN, match_boundary, match_rotations
from motionloom.features.layout import FEET
from motionloom.kinematics.feet import clean_feet, correction, planted_feet
from motionloom.kinematics.ik import motion_from_positions
from motionloom.motion import Motion
from motionloom.retarget import retarget
from motionloom.retarget.transfer import joints22, move_feet
from motionloom.skeleton import SMPL22, Skeleton

Array = NDArray[np.float64]


def body(positions: Array, contacts: Array, fps: float, shown: Motion | None) -> Motion:
    """The 22-joint person of places (frames, 22, 3) metres, begun with the frames that were shown.

    The first ``len(shown)`` places are those that ``shown`` was made of; contacts: (frames, 4) as in the features.
    """
    sampled = motion_from_positions(positions, fps)
    if shown is None:
        return clean_feet(sampled, contacts=contacts)
    return _begun(shown, clean_feet(_continuing(sampled, shown), contacts=contacts, shown=len(shown)))


def put(motion: Motion, skeleton: Skeleton, shown: Motion | None) -> Motion:
    """A motion of the 22-joint person on another skeleton, begun with the frames that were shown on that.

    A foot is planted there when the 22-joint person's is.
    """
    if skeleton == SMPL22:
        return motion
    retargeted = retarget(motion, skeleton)
    if shown is None:
        return retargeted
    continued, since = _continuing(retargeted, shown), len(shown) - 1
    places, planted = joints22(continued)[since:], planted_feet(motion.positions(), motion.fps)[since:]
    shift = np.zeros((len(motion), 2, 3))
    for i in (0, 1):
        ankle, toe = FEET[2 * i : 2 * i + 2]
        flags = planted[:, 2 * i : 2 * i + 2]
        shift[since:, i] = correction(places[:, ankle], places[:, toe], flags, motion.fps, held=True)
    return _begun(shown, move_feet(continued, shift))


def _begun(shown: Motion, made: Motion) -> Motion:
    """What was made, its first frames bit for bit those that were shown."""
    count = len(shown)
    turns = rot.unroll(np.concatenate([shown.rotations[-1:], made.rotations[count:]]))[1:]
    return replace(
        made,
        root=np.concatenate([shown.root, made.root[count:]]),
        rotations=np.concatenate([shown.rotations, turns]),
    )


def _continuing(sampled: Motion, shown: Motion) -> Motion:
    """The shown frames, and the sampled ones behind them, which take up pose and velocity of what was shown."""
    count, behind = len(shown), len(sampled) - len(shown)
    reach = min(JOIN, behind)
    off = shown.root - sampled.root[:count]
    root = sampled.root.copy()
    root[:count] = shown.root
    root[count : count + reach] += match_boundary(off[-1], off[-1] - off[max(count - 2, 0)], reach)
    turns = match_rotations(sampled.rotations, shown.rotations, count - 1, 1, reach)
    turns[:count] = shown.rotations
    return replace(sampled, root=root, rotations=rot.unroll(rot.normalize(turns)))
