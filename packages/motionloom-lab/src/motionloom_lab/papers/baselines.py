"""The cheap ways to make one long motion of several, for comparison: what a better way has to beat."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.blending import shares
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion, heading

BLANK = 8
"""Frames between two segments that nobody generated (TEACH's own number)."""


def slerp_joined(motions: Sequence[Motion], *, blank: int = BLANK) -> Motion:
    """Motions one after the other, ``blank`` frames between each two filled by interpolation of the joint rotations.

    Each later motion is turned about the vertical and moved on the ground to where the one before it ended, its height
    kept; the blank frames take the interior points of ``blank`` + 2 equally spaced ones in [0, 1]: spherical
    interpolation of every joint's rotation, linear of the root. All must be of one skeleton (22 joints) and frame rate.
    The transition rule of Athanasiou et al., "TEACH: Temporal Action Compositions for 3D Humans", 3DV 2022. (Its
    headings come from the root's rotation; here from hips and shoulders.)
    """
    if not motions or blank < 0:
        raise MotionloomError(f"there is nothing to join: {len(motions)} motions, {blank} frames between them")
    joined = motions[0]
    for motion in motions[1:]:
        if motion.fps != joined.fps or motion.skeleton.names != joined.skeleton.names:
            raise MotionloomError("only motions of one skeleton and one frame rate can be joined; retarget or resample")
        following = _place(motion, joined)
        amount = shares(blank)
        last, first = joined.rotations[-1], following.rotations[0]
        shape = (blank, *last.shape[:-1])
        between = rot.slerp(
            np.broadcast_to(last, (*shape, 4)),
            np.broadcast_to(first, (*shape, 4)),
            np.broadcast_to(amount[:, None], shape),
        )
        way = joined.root[-1] * (1 - amount[:, None]) + following.root[0] * amount[:, None]
        joined = replace(
            joined,
            root=np.concatenate([joined.root, way, following.root]),
            rotations=rot.unroll(np.concatenate([joined.rotations, between, following.rotations])),
        )
    return joined


def _place(motion: Motion, before: Motion) -> Motion:
    """Turned and moved so that its first frame is where the last one of ``before`` is, facing the same way."""
    end, start = before.frames(len(before) - 1, len(before)), motion.frames(0, 1)
    angle = float(heading(end.positions())[0] - heading(start.positions())[0])
    turn = np.array([np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0])
    root = rot.rotate(np.broadcast_to(turn, (len(motion), 4)), motion.root - motion.root[0] * [1, 0, 1])
    rotations = np.array(motion.rotations)
    rotations[:, 0] = rot.multiply(np.broadcast_to(turn, (len(motion), 4)), rotations[:, 0])
    return replace(motion, root=root + before.root[-1] * [1, 0, 1], rotations=rotations)
