"""Places of joints to a body whose first frames were shown: those stay, the rest follows from them.

The pose and its change that were shown last pass into the new ones as at the borders of an inpainted stretch
(`edits.boundary`), here on a body with constant bones; planted feet stay planted where they were shown.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.body.feet import clean_feet, correction, planted_feet
from motionloom.core.body.ik import motion_from_positions
from motionloom.core.features.layout import FEET
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.edits.boundary import JOIN, match_boundary, match_rotations
from motionloom.retarget import retarget
from motionloom.retarget.transfer import joints22, move_feet

Array = NDArray[np.float64]


def body(positions: Array, contacts: Array, fps: float, past: Motion | None) -> Motion:
    """The 22-joint person of places (frames, 22, 3) metres, begun with the frames that were shown.

    past: these frames, computed from the first ``len(past)`` places; contacts: (frames, 4) as in the features.
    """
    sampled = motion_from_positions(positions, fps)
    if past is None:
        return clean_feet(sampled, contacts=contacts)
    return _begun(past, clean_feet(_continuing(sampled, past), contacts=contacts, shown=len(past)))


def transfer(motion: Motion, skeleton: Skeleton, past: Motion | None) -> Motion:
    """A motion of the 22-joint person on another skeleton, begun with the frames that were shown on that.

    A foot is planted there when the 22-joint person's is.
    """
    if skeleton == SMPL22:
        return motion
    retargeted = retarget(motion, skeleton)
    if past is None:
        return retargeted
    continued, since = _continuing(retargeted, past), len(past) - 1
    places, planted = joints22(continued)[since:], planted_feet(motion.positions(), motion.fps)[since:]
    shift = np.zeros((len(motion), 2, 3))
    for i in (0, 1):
        ankle, toe = FEET[2 * i : 2 * i + 2]
        flags = planted[:, 2 * i : 2 * i + 2]
        shift[since:, i] = correction(places[:, ankle], places[:, toe], flags, motion.fps, held=True)
    return _begun(past, move_feet(continued, shift))


def _begun(past: Motion, motion: Motion) -> Motion:
    """The motion, its first frames bit for bit those that were shown."""
    count = len(past)
    turns = rot.unroll(np.concatenate([past.rotations[-1:], motion.rotations[count:]]))[1:]
    return replace(
        motion,
        root=np.concatenate([past.root, motion.root[count:]]),
        rotations=np.concatenate([past.rotations, turns]),
    )


def _continuing(sampled: Motion, past: Motion) -> Motion:
    """The shown frames, and the sampled ones behind them, which take up pose and velocity of what was shown."""
    count, behind = len(past), len(sampled) - len(past)
    reach = min(JOIN, behind)
    off = past.root - sampled.root[:count]
    root = sampled.root.copy()
    root[:count] = past.root
    root[count : count + reach] += match_boundary(off[-1], off[-1] - off[max(count - 2, 0)], reach)
    turns = match_rotations(sampled.rotations, past.rotations, count - 1, 1, reach)
    turns[:count] = past.rotations
    return replace(sampled, root=root, rotations=rot.unroll(rot.normalize(turns)))
