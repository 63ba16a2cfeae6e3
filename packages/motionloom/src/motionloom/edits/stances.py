"""Stances: stretches of frames in which a foot stands, and what it takes that it does."""

import numpy as np
from numpy.typing import NDArray

from motionloom.core.blending import smoothstep

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

EASE = 6
"""Frames over which the change of a stance comes and goes where no other stance is near."""
FAR = 0.12
"""Metres that a standing foot is moved at most: one that strays further means to move."""
BEYOND = 30
"""Frames before the first stance and after the last over which a foot comes back to going with the body."""


def carried(shift: Array, standing: Flags) -> Array:
    """(frames, 3) metres that a foot goes when the body goes by ``shift``: through every stance by the mean of it.

    standing: (frames,) flags. Between stances it goes with the body and a curve from one to the other.
    """
    extra = np.zeros_like(shift)
    for start, stop in zip(*_ends(standing), strict=True):
        extra[start:stop] = shift[start:stop].mean(0) - shift[start:stop]
    return shift + _between(extra, standing, BEYOND)


def stilled(ankle: Array, toe: Array, planted: Flags, *, known: int = 0) -> Array:
    """(frames, 3) metres, horizontal, to add to a foot so that what is planted of it stands in one place.

    ankle, toe: (frames, 3) metres in the world; planted: (frames, 2) flags for the two. A stance keeps its mean place;
    one that begins in the first ``known`` frames keeps the place that it has in the last of them.
    """
    steps = np.zeros_like(ankle)
    for place, flags in ((ankle, planted[:, 0]), (toe, planted[:, 1])):
        both = flags[1:] & flags[:-1]
        steps[1:][both] = -np.diff(place, axis=0)[both]  # toes last: the foot turns about them while all of it stands
    steps[:, 1] = 0
    path, standing = np.cumsum(steps, axis=0), planted[:, 0] | planted[:, 1]
    result, (starts, stops) = np.zeros_like(path), _ends(standing)
    if not len(starts):
        return result
    frames = stops - starts
    stance = np.repeat(np.arange(len(starts)), frames)
    place = np.stack([np.bincount(stance, column) for column in path[standing].T], axis=-1) / frames[:, None]
    place[(starts < known) & (known < stops)] = path[known - 1]
    away = path[standing] - place[stance]
    furthest = np.maximum.reduceat(np.linalg.norm(away, axis=-1), np.cumsum(frames) - frames)
    result[standing] = away * np.minimum(1.0, FAR / furthest.clip(1e-9))[stance, None]
    return _between(result, standing, EASE)


def _ends(standing: Flags) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The first frame of each stance, and the first one behind it."""
    change = np.diff(standing.astype(np.int8), prepend=0, append=0)
    return np.flatnonzero(change > 0), np.flatnonzero(change < 0)


def _between(values: Array, standing: Flags, ease: int) -> Array:
    """(frames, 3): the values in each stance, what goes from one stance to the next between them.

    Further than ``ease`` from all stances it is 0.
    """
    starts, stops = _ends(standing)
    at, result, nothing = np.flatnonzero(~standing), values.copy(), np.zeros((1, 3))
    gap = np.searchsorted(starts, at)
    left = np.concatenate([[-ease - 1], stops - 1])[gap]
    right = np.concatenate([starts, [len(values) + ease]])[gap]
    near = right - left <= 2 * ease
    across = smoothstep((at - left) / np.where(near, right - left, ease))
    coming = np.where(near, across, 1 - smoothstep((right - at) / ease))
    last, first = np.concatenate([nothing, values[stops - 1]])[gap], np.concatenate([values[starts], nothing])[gap]
    result[at] = (1 - across)[:, None] * last + coming[:, None] * first
    return result
