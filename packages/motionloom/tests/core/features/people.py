"""Made-up people in motion: smooth random poses of the uniform person, for tests that need no recorded data."""

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22

_KNEES, _ELBOWS, _STIFF = (4, 5), (18, 19), (10, 11, 15, 20, 21)


def wander(seed: int, *, frames: int = 60, fps: float = 20.0, amplitude: float = 0.5, speed: float = 0.03) -> Motion:
    """A walk-like motion on a curve; hinges only bend the way they do, end joints have no turn of their own."""
    rng = np.random.default_rng(seed)
    t = np.arange(frames)[:, None, None] / fps
    vectors = sum(
        rng.normal(size=(22, 3)) / (k + 1) * np.sin(2 * np.pi * 0.4 * (k + 1) * t + rng.uniform(0, 6.28, (22, 3)))
        for k in range(3)
    )
    vectors = amplitude * 0.6 * np.asarray(vectors)
    bend = 0.9 + 0.7 * np.sin(2 * np.pi * 0.7 * t[:, 0] + rng.uniform(0, 6.28, 4))
    for i, j in enumerate((*_KNEES, *_ELBOWS)):
        axis = [1, 0, 0] if j in _KNEES else [0, -1 if j == 18 else 1, 0]
        vectors[:, j] = bend[:, i, None] * np.array(axis)
    vectors[:, list(_STIFF)] = 0
    yaw = rng.uniform(-3, 3) + np.cumsum(np.full(frames, rng.uniform(-0.04, 0.04)))
    turns = rot.rotvec_to_quat(vectors)
    turns[:, 0] = rot.multiply(rot.rotvec_to_quat(yaw[:, None] * [0, 1, 0]), turns[:, 0])
    root = np.cumsum(speed * np.stack([np.sin(yaw), 0 * yaw, np.cos(yaw)], -1), 0) + np.array([0, 0.9, 0])
    return Motion(SMPL22, fps, root, rot.unroll(turns))
