"""Made-up numbers for tests."""

from collections.abc import Sequence

import numpy as np


def normal(shape: int | Sequence[int], seed: int = 0) -> np.ndarray:
    """Standard normal float32."""
    return np.random.default_rng(seed).standard_normal(shape, np.float32)
