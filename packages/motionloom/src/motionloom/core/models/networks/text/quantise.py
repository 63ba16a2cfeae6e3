"""Eight-bit storage of weight matrices: one symmetric scale per output row."""

import numpy as np
from numpy.typing import NDArray

LEVELS = 127


def quantise(matrix: NDArray[np.floating]) -> tuple[NDArray[np.int8], NDArray[np.float16]]:
    """(rows, columns) float -> int8 values of the same shape and float16 scales (rows,), matrix ~ values * scale.

    The error of an entry is at most half a scale, and half a scale is 1/254 of the row's largest entry.
    """
    whole = matrix.astype(np.float32)
    scale = (np.abs(whole).max(1) / np.float32(LEVELS)).astype(np.float16)
    scale = np.maximum(scale, np.finfo(np.float16).tiny)  # a row of zeros, or one too small for float16
    values = np.clip(np.round(whole / scale.astype(np.float32)[:, None]), -LEVELS, LEVELS).astype(np.int8)
    return values, scale


def dequantise(values: NDArray[np.int8], scale: NDArray[np.float16]) -> NDArray[np.float32]:
    """The float32 matrix behind `quantise`'s answer."""
    matrix = values.astype(np.float32)
    matrix *= scale.astype(np.float32)[:, None]  # a second matrix would double the time
    return matrix
