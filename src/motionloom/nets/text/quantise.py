"""Eight-bit storage of weight matrices: one symmetric scale per output row."""

import torch
from torch import Tensor

LEVELS = 127


def quantise(matrix: Tensor) -> tuple[Tensor, Tensor]:
    """(rows, columns) float -> int8 values of the same shape and float16 scales (rows,), matrix ~ values * scale.

    The error of an entry is at most half a scale, and half a scale is 1/254 of the row's largest entry.
    """
    scale = (matrix.float().abs().amax(1) / LEVELS).to(torch.float16)
    scale = scale.clamp(min=torch.finfo(torch.float16).tiny)  # a row of zeros, or one too small for float16
    values = (matrix.float() / scale.float()[:, None]).round().clamp(-LEVELS, LEVELS).to(torch.int8)
    return values, scale


def dequantise(values: Tensor, scale: Tensor) -> Tensor:
    """The float32 matrix behind `quantise`'s answer."""
    return values.to(torch.float32, copy=True).mul_(scale.float()[:, None])  # a second matrix would double the time
