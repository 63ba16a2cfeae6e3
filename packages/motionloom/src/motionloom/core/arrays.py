"""Functions on arrays and on tensors: what sampling and training both need is written once.

Nothing here imports torch: whoever has a tensor has imported it.
"""

import sys
from typing import Any, TypeVar

import numpy as np

Numbers = TypeVar("Numbers", bound=Any)
"""A numpy array or a torch tensor; what comes back is of the same kind."""


def namespace(numbers: Any) -> Any:
    """The library with the functions for these numbers: numpy, or torch for tensors."""
    if isinstance(numbers, np.ndarray | np.generic | float):
        return np
    return sys.modules["torch"]


def stack(*numbers: Any) -> Any:
    """Numbers (...) that broadcast, side by side on a new last axis."""
    xp = namespace(numbers[0])
    parts = np.broadcast_arrays(*numbers) if xp is np else xp.broadcast_tensors(*numbers)
    return xp.stack(parts, axis=-1)


def unit(vectors: Numbers) -> Numbers:
    """Vectors (..., n) scaled to length 1; those of no length stay as they are."""
    length = (vectors * vectors).sum(-1, keepdims=True) ** 0.5
    return vectors / length.clip(1e-12)


def cross(a: Numbers, b: Numbers) -> Numbers:
    """Cross products of vectors (..., 3)."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return stack(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)


def true_spans(mask: np.ndarray | np.bool_) -> list[tuple[int, int]]:
    """Half-open ranges (first, end) of consecutive True in flags (frames,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(mask, dtype=int), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
