"""Known frames beside a stretch that is drawn: guesses leave them, come to them and arrive without a jump."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from motionloom.features import humanml
from motionloom.features.layout import LAYOUT

Array = NDArray[np.float64]

JOIN = 10
"""Frames over which what the network draws is led from the known frames' course to its own."""


@dataclass(frozen=True, eq=False)
class InpaintWindow:
    """Some frames of a motion in the world; those from ``first`` to before ``last`` are sampled anew."""

    positions: Array
    """(frames + 1, 22, 3) metres at 20 fps, floor at y = 0; the last frame only tells how the one before it moves."""
    first: int
    last: int
    keep: NDArray[np.bool_]
    """(263,) numbers that stay inside of the stretch too."""
    strength: float = 1.0
    """Share of the noise levels the old frames are taken to; 1 draws from noise alone."""
    facing: bool = True
    """Whether the drawn person must face at frame ``last`` as the known one does there."""
    place: bool = True
    """Whether it must also stand there."""

    def __len__(self) -> int:
        return len(self.positions) - 1


def arrival(known: Tensor, mask: Tensor, window: InpaintWindow) -> Callable[[Tensor], Tensor]:
    """A function that bends the root's free velocities so that facing and place at frame ``last`` are the known ones.

    On features (rows, frames, 263), not standardised. What is missing is spread over the stretch as sin², so that
    velocities at its borders stay; full turns are nobody's fault and stay too.
    """
    first, last = window.first, window.last
    tied = (window.facing or window.place) and first > 0 and last < known.shape[1]
    if not tied or bool(mask[:, first:last, :3].any()):
        return lambda features: features
    share = torch.sin(torch.pi * (torch.arange(last - first, device=known.device) + 0.5) / (last - first)) ** 2
    share = share / share.sum()
    goal = humanml.recover_root(known)[1][:, last]

    def arrive(features: Tensor) -> Tensor:
        bent = features.clone()
        if window.facing:
            lacking = (known - features)[:, first:last, 0].sum(1)
            lacking = lacking - torch.pi * (lacking / torch.pi).round()
            bent[:, first:last, 0] += share * lacking[:, None]
        if window.place:
            turn, root = humanml.recover_root(bent)
            lacking = goal - root[:, last]
            # velocities are told in the heading of the frame they lead to
            w, y = turn[:, first + 1 : last + 1, 0], turn[:, first + 1 : last + 1, 2]
            c, s = 1 - 2 * y * y, 2 * w * y
            x, z = lacking[:, None, 0], lacking[:, None, 2]
            bent[:, first:last, 1] += share * (c * x + s * z)
            bent[:, first:last, 2] += share * (c * z - s * x)
        return bent

    return arrive


def joining(known: Tensor, mask: Tensor, first: int, last: int) -> Callable[[Tensor], Tensor]:
    """A function that bends the free numbers so that they leave the known ones, and come to them, without a jump.

    On features (rows, frames, 263), not standardised; ``mask`` is True at known ones, the stretch is ``first`` to
    before ``last``. At each border its first frame becomes what the two known frames beside it lead to, in value and
    in change; the difference fades over `JOIN` frames as a cubic.
    """
    frames = known.shape[1]
    reach = min(JOIN, (last - first) // 2)
    u = torch.arange(reach, device=known.device, dtype=known.dtype)[:, None] / max(reach, 1)
    value, change = (1 - u) ** 2 * (1 + 2 * u), (1 - u) ** 2 * u * reach
    free = ~mask
    free[..., LAYOUT["contacts"]] = False
    borders = [(first - 1, 1)] * (first >= 2) + [(last, -1)] * (last <= frames - 2)

    def join(features: Tensor) -> Tensor:
        bent = features.clone()
        for border, step in borders if reach >= 2 else ():
            pace = known[:, border] - known[:, border - step]
            start = border + step
            lack = known[:, border] + pace - features[:, start]
            slope = pace - (features[:, start + step] - features[:, start])
            at = start + step * torch.arange(reach, device=known.device)
            bent[:, at] += value * lack[:, None] + change * slope[:, None]
        return torch.where(free, bent, features)

    return join
