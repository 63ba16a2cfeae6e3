"""Carrying a motion from one humanoid to another."""

import numpy as np
from numpy.typing import NDArray

from motionloom.motion import Motion
from motionloom.retarget.joint_map import Override, joint_map

Array = NDArray[np.float64]


def joints22(motion: Motion, override: Override | None = None) -> Array:
    """(frames, 22, 3) metres: where the 22 SMPL joints are on the source's own body, in its own world.

    Raises `MotionloomError` naming the joints that could not be found; see `joint_map`.
    """
    points = joint_map(motion.skeleton, override)
    return np.einsum("sj,fjc->fsc", points.matrix(motion.skeleton), motion.positions())
