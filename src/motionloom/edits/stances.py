"""Stances: stretches of frames in which a foot stands, and what it takes that it does."""

import numpy as np
from numpy.typing import NDArray

from motionloom.blending import smoothstep
from motionloom.kinematics.gestures import true_spans

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

    standing: (frames,) flags. Between stances it goes with the body and what leads from one to the other.
    """
    stances = true_spans(standing)
    extra = [shift[start:stop].mean(0) - shift[start:stop] for start, stop in stances]
    return shift + _between(len(shift), stances, extra, BEYOND)


def stilled(ankle: Array, toe: Array, planted: Flags, *, known: int = 0) -> Array:
    """(frames, 3) metres, horizontal, to add to a foot so that what is planted of it stands in one place.

    ankle, toe: (frames, 3) metres in the world; planted: (frames, 2) flags for the two. A stance keeps its mean place;
    one that begins in the first ``known`` frames keeps the place that it has in the last of them.
    """
    steps = np.zeros((len(ankle) - 1, 3))
    for place, flags in ((ankle, planted[:, 0]), (toe, planted[:, 1])):
        both = flags[1:] & flags[:-1]
        steps[both] = -np.diff(place, axis=0)[both]  # toes last: the foot turns about them while all of it stands
    steps[:, 1] = 0
    stances, paths = true_spans(planted[:, 0] | planted[:, 1]), []
    for start, stop in stances:
        path = np.concatenate([np.zeros((1, 3)), np.cumsum(steps[start : stop - 1], axis=0)])
        path -= path[known - 1 - start] if start < known < stop else path.mean(0)
        paths.append(path * min(1.0, FAR / max(float(np.linalg.norm(path, axis=-1).max()), 1e-9)))
    return _between(len(ankle), stances, paths, EASE)


def _between(frames: int, stances: list[tuple[int, int]], values: list[Array], ease: int) -> Array:
    """(frames, 3): the values (frames of the stance, 3) in each stance, what leads from one to the next between them.

    Further than ``ease`` from all stances it is 0.
    """
    result = np.zeros((frames, 3))
    ends = [(-ease, -ease), *stances, (frames + ease, frames + ease)]
    known = [np.zeros((1, 3)), *values, np.zeros((1, 3))]
    for i in range(len(stances) + 1):
        left, right = ends[i][1] - 1, ends[i + 1][0]
        at = np.arange(max(left + 1, 0), min(right, frames))
        if right - left <= 2 * ease:
            fading, coming = 1 - smoothstep((at - left) / (right - left)), smoothstep((at - left) / (right - left))
        else:
            fading, coming = 1 - smoothstep((at - left) / ease), 1 - smoothstep((right - at) / ease)
        result[at] = fading[:, None] * known[i][-1] + coming[:, None] * known[i + 1][0]
    for (start, stop), path in zip(stances, values, strict=True):
        result[start:stop] = path
    return result
