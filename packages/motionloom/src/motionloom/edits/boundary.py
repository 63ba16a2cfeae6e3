"""Known frames beside frames that are sampled: what is sampled leaves them, comes to them and arrives without a jump.

`match_boundary` is how, for whatever is sampled: features within the loop, joint places, a root's path, rotations.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.blending import cubic_decay
from motionloom.core.features import humanml
from motionloom.core.features.layout import LAYOUT

Array = NDArray[np.float64]

JOIN = 10
"""Frames over which what the network samples goes over from the known frames' course to its own."""


@dataclass(frozen=True, eq=False)
class InpaintWindow:
    """Some frames of a motion in the world; those from ``first`` to before ``last`` are sampled anew."""

    positions: Array
    """(frames + 1, 22, 3) metres at 20 fps, floor at y = 0; the last frame only shows how the one before it moves."""
    first: int
    last: int
    keep: NDArray[np.bool_]
    """(263,) numbers that stay inside of the stretch too."""
    strength: float = 1.0
    """Share of the noise levels the old frames are taken to; 1 samples from noise alone."""
    facing: bool = True
    """Whether the sampled person must face at frame ``last`` as the known one does there."""
    place: bool = True
    """Whether it must also be at the same place."""
    begin: float = 0.0
    """Seconds of the clip at which the window begins; of meaning for who is `watching` alone."""

    def __len__(self) -> int:
        return len(self.positions) - 1


def match_boundary(
    lack: np.ndarray, slope: np.ndarray, frames: int, *, first: int = 1, decay: Callable[[Any], Any] = cubic_decay
) -> np.ndarray:
    """What to add to the frames beside a boundary, so that neither value nor velocity jumps there.

    Args:
        lack: (...) what the sampled motion lacks to the known one at the boundary.
        slope: (...) by how much that grows per frame on the way to the boundary.
        frames: over how many frames both die down to nothing.
        first: 1: the boundary is the last known frame; 0: it is the first sampled frame, which lacks so much.
        decay: `blending.cubic_decay` or `blending.quintic_decay`.

    Returns:
        (frames, ...) for the frames one after the other, away from the boundary.
    """
    over = frames + first
    u = np.arange(first, over, dtype=lack.dtype).reshape(frames, *[1] * lack.ndim) / max(over, 1)
    value, change = decay(u)
    return value * lack + change * over * slope


def match_rotations(turns: Array, known: Array, border: int, step: int, frames: int) -> Array:
    """Rotations with the frames beside a boundary turned, so that neither direction nor angular velocity jumps.

    Args:
        turns: (frames, joints, 4) unit quaternions, which stay but for the frames beside the boundary.
        known: the same, or more or fewer frames; read at ``border`` and one frame further from what is sampled.
        border: the last known frame.
        step: 1: what is sampled follows it; -1: it comes before.
        frames: over how many frames the difference dies down.
    """
    beside = [at for at in (border - step, border) if 0 <= at < len(known)]
    lack = rot.quat_to_rotvec(rot.multiply(known[beside], rot.inverse(turns[beside])))
    slope = lack[1] - lack[0] if len(lack) == 2 else np.zeros_like(lack[0])
    at, result = border + step * np.arange(1, frames + 1), turns.copy()
    result[at] = rot.multiply(rot.rotvec_to_quat(match_boundary(lack[-1], slope, frames)), turns[at])
    return result


def arrival(known: np.ndarray, mask: np.ndarray, window: InpaintWindow) -> Callable[[np.ndarray], np.ndarray]:
    """A function that bends the root's free velocities so that facing and place at frame ``last`` are the known ones.

    On features (rows, frames, 263), not standardised. What is missing is spread over the stretch as sin², so that
    velocities at its borders stay; full turns are nobody's fault and stay too.
    """
    first, last = window.first, window.last
    tied = (window.facing or window.place) and first > 0 and last < known.shape[1]
    if not tied or mask[:, first:last, :3].any():
        return lambda features: features
    share = np.sin(np.pi * (np.arange(last - first) + 0.5) / (last - first)) ** 2
    share = (share / share.sum()).astype(known.dtype)
    goal = humanml.recover_root(known)[1][:, last]

    def arrive(features: np.ndarray) -> np.ndarray:
        bent = features.copy()
        if window.facing:
            lacking = (known - features)[:, first:last, 0].sum(1)
            lacking = lacking - np.pi * (lacking / np.pi).round()
            bent[:, first:last, 0] += share * lacking[:, None]
        if window.place:
            turn, root = humanml.recover_root(bent)
            lacking = goal - root[:, last]
            # velocities are given in the heading of the frame behind them
            w, y = turn[:, first + 1 : last + 1, 0], turn[:, first + 1 : last + 1, 2]
            c, s = 1 - 2 * y * y, 2 * w * y
            x, z = lacking[:, None, 0], lacking[:, None, 2]
            bent[:, first:last, 1] += share * (c * x + s * z)
            bent[:, first:last, 2] += share * (c * z - s * x)
        return bent

    return arrive


def joining(known: np.ndarray, mask: np.ndarray, first: int, last: int) -> Callable[[np.ndarray], np.ndarray]:
    """A function that bends the free numbers so that they leave the known ones, and come to them, without a jump.

    On features (rows, frames, 263), not standardised; ``mask`` is True at known ones, the stretch is ``first`` to
    before ``last``. At each border its first frame continues the two known frames beside it, in value and
    in change; the difference fades over `JOIN` frames as a cubic.
    """
    frames = known.shape[1]
    reach = min(JOIN, (last - first) // 2)
    free = ~mask
    free[..., LAYOUT["contacts"]] = False
    borders = [(first - 1, 1)] * (first >= 2) + [(last, -1)] * (last <= frames - 2)

    def join(features: np.ndarray) -> np.ndarray:
        bent = features.copy()
        for border, step in borders if reach >= 2 else ():
            pace = known[:, border] - known[:, border - step]
            start = border + step
            lack = known[:, border] + pace - features[:, start]
            slope = pace - (features[:, start + step] - features[:, start])
            at = start + step * np.arange(reach)
            bent[:, at] += match_boundary(lack, slope, reach, first=0).swapaxes(0, 1)
        return np.where(free, bent, features)

    return join
