"""Where somebody is to go in the frames of the next window: steering and paths as a few places of the pelvis.

Places are asked every `EVERY` frames only, so that between them the body sways as it is drawn. Nobody changes pace or
way within a frame: what is asked leads over from how the person moves.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.goals.goal import Goal, Placement, turn_between
from motionloom.goals.paths import WALKING, even, lengths_along
from motionloom.live.commands import Path, Steer

Array = NDArray[np.float64]

EVERY = 8
"""Frames between two places that are asked."""
PICK_UP, TURN = 12.0, 20.0
"""Frames in which a pace is taken up, and in which half a turn is made."""
ARRIVED = 0.3
"""Metres from the end of a path at which it is over."""
BRAKING = 1.0
"""Metres per second squared with which somebody slows down towards the end of a path."""


@dataclass(frozen=True)
class Course:
    """Where somebody is and how he moves in the first frame that can be changed."""

    place: Placement
    velocity: tuple[float, float]
    """Metres a frame, x and z in the world."""


def steered(course: Course, steer: Steer, frames: int, fps: float) -> Goal:
    """Places and facings for so many frames, in the world, at the asked speed; facings alone where none is asked."""
    goal = Goal.nothing(frames)
    at = np.arange(EVERY, frames, EVERY)
    if steer.speed is not None:
        ahead = course.place.facing if steer.facing is None else steer.facing
        direction = ahead if steer.direction is None else steer.direction
        way = _walked(course, direction, steer.speed / fps, frames)
        _ask(goal, at, way)
    if steer.facing is not None:
        turn = float(turn_between(steer.facing, course.place.facing))
        goal.facing[:] = course.place.facing + turn * _eased(np.arange(frames), _turning(turn))
        goal.facing_asked[at] = True
    return goal


def _ask(goal: Goal, at: NDArray[np.int_], way: Array) -> None:
    """Ask for the pelvis in some frames of a way (frames, 2)."""
    goal.positions[at, 0, ::2] = way[at]
    goal.asked[at, 0, ::2] = True


def _walked(course: Course, direction: float, step: float, frames: int) -> Array:
    """(frames, 2) places of somebody who comes to go ``step`` metres a frame to ``direction``."""
    x, z = course.velocity
    pace = math.hypot(x, z)
    start = math.atan2(x, z) if pace > 0.01 else course.place.facing
    turn = float(turn_between(direction, start))
    count = np.arange(frames)
    angle = start + turn * _eased(count, _turning(turn))
    size = pace + (step - pace) * _eased(count, PICK_UP)
    steps = np.stack([size * np.sin(angle), size * np.cos(angle)], axis=-1)
    return np.array([course.place.x, course.place.z]) + np.concatenate([np.zeros((1, 2)), steps[:-1].cumsum(0)])


def _turning(turn: float) -> float:
    return 8.0 + (TURN - 8.0) * min(abs(turn) / math.pi, 1.0)


def _eased(count: NDArray[np.int_], over: float) -> Array:
    u = (count / over).clip(0, 1)
    return u * u * (3 - 2 * u)


class Trail:
    """A path that is being walked."""

    def __init__(self, path: Path, course: Course) -> None:
        points = np.array([(course.place.x, course.place.z), *path.points])
        chord = lengths_along(points)
        count = max(2, min(20_000, int(chord[-1] / 0.05) + 1))
        self._points = even(points, np.linspace(0, 1, count)) if chord[-1] > 0 else points
        self._along = lengths_along(self._points)
        self.speed = WALKING if path.speed is None else path.speed
        self._gone = 0.0

    def left(self, course: Course) -> float:
        """Metres to the end from where somebody is; remembers how far he has come."""
        near = np.flatnonzero(np.abs(self._along - self._gone) < 2.0)
        here = np.array([course.place.x, course.place.z])
        nearest = near[np.linalg.norm(self._points[near] - here, axis=-1).argmin()]
        self._gone = max(self._gone, float(self._along[nearest]))
        rest = float(self._along[-1]) - self._gone
        return max(rest, float(np.linalg.norm(self._points[-1] - here))) if rest < ARRIVED else rest

    def goal(self, course: Course, frames: int, fps: float) -> tuple[Goal, int]:
        """Places for so many frames, in the world, and the frame that is near the end (``frames``: none is)."""
        left, pace, gone = self.left(course), math.hypot(*course.velocity), 0.0
        places = np.empty(frames)
        for k in range(frames):
            places[k] = gone
            wanted = pace + (self.speed / fps - pace) * float(_eased(np.array([k]), PICK_UP)[0])
            gone += min(wanted, math.sqrt(2 * BRAKING * max(left - gone, 0.0)) / fps, left - gone)
        over = int((left - places > ARRIVED).sum())
        way = np.stack([np.interp(self._gone + places, self._along, column) for column in self._points.T], axis=-1)
        here = np.array([course.place.x, course.place.z])
        way += (here - way[0]) * (1 - _eased(np.arange(frames), fps))[:, None]
        goal, at = Goal.nothing(frames), np.arange(EVERY, frames, EVERY)
        _ask(goal, at, way)
        return goal, over
