"""Futures drawn at random, and the distance of two poses written out."""

import math

import numpy as np
from hypothesis import strategies as st

from motionloom_lab.metrics import prediction as pr

SMALL = pr.Limbs(((0, 1), (1, 2), (1, 3)), ((0, 1), (0, 2)))
SIZES = st.tuples(st.integers(0, 2**31), st.integers(1, 5), st.integers(4, 7), st.integers(4, 6), st.integers(1, 4))


def random_window(seed: int, samples: int, frames: int, joints: int, futures: int) -> tuple[np.ndarray, ...]:
    """Samples, truth, futures (the truth first) and three frames of past."""
    rng = np.random.default_rng(seed)
    y = rng.normal(size=(futures, frames, joints, 3))
    return rng.normal(size=(samples, frames, joints, 3)), y[0], y, rng.normal(size=(3, joints, 3))


def pose_distance(a: np.ndarray, b: np.ndarray) -> float:
    return math.sqrt(sum((x - y) ** 2 for x, y in zip(a.ravel().tolist(), b.ravel().tolist())))
