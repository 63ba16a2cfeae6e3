"""Which way is up in a recording that does not say so: by gravity, by where feet stand, and by the rest pose."""

import numpy as np

from motionloom import rotations as rot
from motionloom.motion import Motion
from motionloom.retarget.anatomy import read_body
from motionloom.retarget.axes import FEET, HEAD, TOES, unit
from motionloom.retarget.joint_map import Override

TALL = 0.8
"""Cosine between a person and the axis along which they are upright."""
OFTEN = 0.7
"""Share of the frames in which they must be."""
_ENOUGH = 20_000
"""Frames, from all over the recording, that are looked at."""


def up_axis(motion: Motion, override: Override | None = None) -> str:
    """``"y"`` or ``"z"``, the axis that is up; ``"y?"`` or ``"z?"`` where somebody may as well lie on the floor.

    People are mostly upright, stand on feet that stay at one height, and lie near the ground. Raises
    `MotionloomError` if the skeleton is no humanoid.
    """
    body, motion = read_body(motion.skeleton, override), motion.thinned(_ENOUGH)
    places = body.places(motion.positions(), motion.world_rotations())
    tall = unit(places[:, HEAD] - places[:, FEET].mean(axis=1))
    along = (np.abs(tall) > TALL).mean(axis=0)
    if along[2] < OFTEN or tall[:, 2].mean() < 0:
        return "y" if along[1] >= OFTEN or along[1] > along[2] else "y?"
    if float(body.up[2]) > 0.9:
        return "z"
    heights = places[:, :, 1]
    if heights.min() > -0.15 * body.leg and heights.max() < 0.7 * body.leg:
        return "y?"  # it lies on the floor y = 0
    feet = places[:, TOES, 2].min(axis=1)
    return "z" if np.ptp(np.percentile(feet, [10, 90])) < 0.15 * body.leg else "z?"


def stood_up(motion: Motion) -> Motion:
    """From Z up to Y up: a quarter turn of everything about X."""
    return motion.turned(rot.rotvec_to_quat(np.array([-np.pi / 2, 0.0, 0.0])))
