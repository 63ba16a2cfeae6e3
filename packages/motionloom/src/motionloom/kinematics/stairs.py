"""What is under the feet of somebody who is above the floor: steps of one height, or nothing.

Conventions of :mod:`motionloom.kinematics.physics`; the floor is y = 0.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from motionloom.core.arrays import true_spans
from motionloom.kinematics.gestures import leg_length
from motionloom.kinematics.physics import ANKLES, TOES, Array, smooth, velocity

UP = 0.12
"""Metres of the lowest joint over the floor from which on somebody is above it."""
HIGH = 0.1
"""Metres of the lowest joint over the floor from which on somebody is in the air, if it is for a second."""
FLIGHT = 0.8
"""Seconds: nobody who jumps is in the air longer."""
CLIMB = 0.3
"""Metres between the lowest and the highest foothold of stairs."""
AT_ONCE = 0.4
"""Metres from one foothold to the next that nobody goes down in one step."""
RISES = np.arange(0.15, 0.205, 0.005)
"""Metres that steps may be high."""
_ONE_LEVEL, _ON_THE_FLOOR = 0.1, 0.4
"""Metres between footholds of one level; leg lengths of the pelvis over the floor of who sits or lies on it."""
_SLOW = 0.6
"""Metres per second of a foot that bears."""


@dataclass(frozen=True)
class Foothold:
    """Where a foot bears the body for a while."""

    side: int
    """0 left, 1 right."""
    first: int
    end: int
    """Half-open range of frames."""
    height: float
    """Metres of the toe over the floor."""


@dataclass(frozen=True)
class Stairs:
    """Steps of one height, and which of them each foothold is on: the next one, or the same."""

    rise: float
    """Metres of each step."""
    holds: tuple[Foothold, ...]
    levels: tuple[int, ...]
    """Of each foothold, 0 the floor."""

    @property
    def steps(self) -> int:
        """How many of them somebody treads on."""
        return len({level for level in self.levels if level > 0})


def stairs(positions: np.ndarray, fps: float) -> Stairs | None:
    """The stairs that somebody goes up or down; None on the floor, and where the feet bear nowhere for `FLIGHT`.

    positions: (frames, 22, 3) metres. The rise of the steps is the one of `RISES` that the footholds are nearest to.
    """
    p = np.asarray(positions, dtype=np.float64)
    holds = footholds(p, fps)
    if not _lasting(_lowest(p) > UP, fps) or hovering(p, fps) or not holds:
        return None
    heights = np.array([hold.height for hold in holds])
    if np.ptp(heights) < CLIMB:
        return None
    off = [float(np.abs(heights - rise * np.round(heights / rise)).mean()) for rise in RISES]
    rise = round(float(RISES[int(np.argmin(off))]), 3)
    levels = np.maximum(np.round(heights / rise).astype(int), 0).tolist()
    if (top := _turning_point(heights)) is not None:
        way_up, way_down = _one_by_one(levels[: top + 1]), _one_by_one(levels[top:][::-1])[::-1]
        levels = [min(level, way_up[-1], way_down[0]) for level in way_up + way_down[1:]]
    elif heights[-1] >= heights[0]:
        levels = _one_by_one(levels)
    else:
        levels = _one_by_one(levels[::-1])[::-1]
    return Stairs(rise, tuple(holds), tuple(levels))


def _turning_point(heights: Array) -> int | None:
    """The highest foothold of somebody who goes up and, step by step, down again; None of others.

    Who falls to the floor from there at once was not sampled going down: another action follows.
    """
    top = len(heights) - 1 - int(np.argmax(heights[::-1]))
    falls = -np.diff(heights[top:])
    there_and_back = heights[top] - max(heights[0], heights[-1]) >= CLIMB
    return top if there_and_back and falls.max() < AT_ONCE else None


def _one_by_one(levels: list[int]) -> list[int]:
    """Levels that rise by one at the most, and never fall: nobody takes four steps at once."""
    result = [0]
    for before, level in pairwise(np.maximum.accumulate(levels).tolist()):
        result.append(result[-1] + min(level - before, 1))
    return result


def footholds(positions: np.ndarray, fps: float) -> list[Foothold]:
    """Where a foot is slow and nothing but the other foot is 5 cm lower, in the order of time."""
    p = np.asarray(positions, dtype=np.float64)
    others = np.delete(p, [*ANKLES, *TOES], axis=1)[..., 1].min(axis=1)
    holds = []
    for side, (toe, ankle) in enumerate(zip(TOES, ANKLES, strict=True)):
        slow = np.linalg.norm(smooth(velocity(p[:, ankle], fps), 3), axis=-1) < _SLOW
        height = np.minimum(p[:, toe, 1], p[:, ankle, 1])
        for first, end in true_spans(slow & (height < others + 0.05)):
            if end - first >= 0.15 * fps:
                holds.append(Foothold(side, first, end, float(np.median(p[first:end, toe, 1]))))
    return sorted(holds, key=lambda hold: hold.first + hold.end)


def hovering(positions: np.ndarray, fps: float) -> list[tuple[int, int]]:
    """Half-open ranges of frames, `FLIGHT` or longer, in which somebody is above the floor and nothing bears them.

    A foot or another lowest joint that is slow bears: on a step, a seat, a bed.
    """
    p = np.asarray(positions, dtype=np.float64)
    low = p[..., 1].argmin(axis=1)
    speed = np.linalg.norm(smooth(velocity(p, fps), 3), axis=-1)
    borne = speed[np.arange(len(p)), low] < _SLOW
    for hold in footholds(p, fps):
        borne[hold.first : hold.end] = True
    return _lasting((_lowest(p) > UP) & ~borne, fps)


def in_the_air(positions: np.ndarray, fps: float) -> list[tuple[int, int]]:
    """Half-open ranges of frames, a second or longer, in which the lowest joint is over `HIGH` and nothing is under it.

    positions: (frames, 22, 3) metres, the floor y = 0. Two steps of one height or more are something (`stairs`); a
    seat or a bed is not: whoever wants one has to put it there.
    """
    p = np.asarray(positions, dtype=np.float64)
    spans = [(first, end) for first, end in true_spans(_lowest(p) > HIGH) if end - first >= fps]
    flight = stairs(p, fps) if spans else None
    return spans if flight is None or flight.steps < 2 else []


def falls_from_above(positions: np.ndarray, fps: float) -> bool:
    """Whether somebody stands above the floor at first, on one level, and comes to sit or lie on the floor.

    positions: (frames, 22, 3) metres. Recorded people fell onto mats, whose height was taken for the floor's.
    """
    p = np.asarray(positions, dtype=np.float64)
    begins = float(np.median(_lowest(p)[: max(1, round(fps / 2))]))
    down = p[:, 0, 1] < _ON_THE_FLOOR * leg_length(p)
    if begins <= UP or not down.any():
        return False
    before = [hold for hold in footholds(p[: int(down.argmax())], fps) if hold.end - hold.first > fps / 4]
    return bool(before) and all(abs(hold.height - begins) < _ONE_LEVEL for hold in before)


def _lasting(flags: np.ndarray, fps: float) -> list[tuple[int, int]]:
    return [(first, end) for first, end in true_spans(flags) if end - first > FLIGHT * fps]


def _lowest(p: Array) -> Array:
    return p[..., 1].min(axis=1)
