"""Where a person is to go in the frames of the next window: steering, paths, and the way to what is to be reached.

Steering and paths are goals for the pelvis in every `EVERY`-th frame only, so that between them the body sways
as it is sampled. Nobody changes pace or way within a frame: a goal begins with how the person moves.

A window has the goals of its own frames. So what is to be reached later waits until it is near in time, and
what is out of anybody's reach until the person is in front of it.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.core.blending import smoothstep
from motionloom.core.features.layout import FPS
from motionloom.core.ground import GroundPose
from motionloom.goals.goal import Goal, turn_between
from motionloom.goals.paths import WALKING, even, lengths_along
from motionloom.live.commands import Path, Pose, Reach, Steer

Array = NDArray[np.float64]

EVERY = 8
"""Frames between two goals for the pelvis."""
PICK_UP, TURN = 12.0, 20.0
"""Frames in which a pace is taken up at least, and in which half a turn is made."""
CHANGE = 0.0075
"""Metres a frame by which a pace changes in a frame (3 m/s²): nobody who runs stands half a second later."""
ARRIVED = 0.3
"""Metres from the end of a path at which it is over."""
AHEAD = 0.6
"""Metres further on along a path to which somebody on it heads."""
FASTEST_TURN, GAIN = math.radians(8.0), 0.008
"""Radians by which a way turns in a frame, and metres a frame by which a pace grows in a frame, at most."""
BRAKING = 1.0
"""Metres per second squared with which somebody slows down towards the end of a path."""


@dataclass(frozen=True)
class Course:
    """Where somebody is and how he moves in the first frame that can be changed."""

    place: GroundPose
    velocity: tuple[float, float]
    """Metres a frame, x and z in the world."""


def steered(course: Course, steer: Steer, frames: int, fps: float) -> Goal:
    """Places and facings for so many frames, in the world, at the steered speed; facings alone where there is none."""
    goal = Goal.nothing(frames)
    at = np.arange(EVERY, frames, EVERY)
    if steer.speed is not None:
        ahead = course.place.facing if steer.facing is None else steer.facing
        direction = ahead if steer.direction is None else steer.direction
        way = _walked(course, direction, steer.speed / fps, frames)
        _ask(goal, at, way)
    if steer.facing is not None:
        turn = float(turn_between(steer.facing, course.place.facing))
        goal.facing[:] = course.place.facing + turn * smoothstep(np.arange(frames) / _turning(turn))
        goal.facing_mask[at] = True
    return goal


def braking(course: Course, frames: int) -> Goal:
    """Places for a person who comes to a stand on the way; none once the person stands."""
    goal = Goal.nothing(frames)
    over = math.hypot(*course.velocity) / CHANGE
    at = np.arange(EVERY, frames, EVERY)
    angle = math.atan2(*course.velocity)
    _ask(goal, at[at < over + EVERY], _walked(course, angle, 0.0, frames))
    return goal


def _ask(goal: Goal, at: NDArray[np.int_], way: Array) -> None:
    """Put the pelvis on a way (frames, 2) in some frames."""
    goal.positions[at, 0, ::2] = way[at]
    goal.mask[at, 0, ::2] = True


def _walked(course: Course, direction: float, step: float, frames: int) -> Array:
    """(frames, 2) places of somebody who comes to go ``step`` metres a frame to ``direction``."""
    x, z = course.velocity
    pace = math.hypot(x, z)
    start = math.atan2(x, z) if pace > 0.01 else course.place.facing
    turn = float(turn_between(direction, start))
    count = np.arange(frames)
    angle = start + turn * smoothstep(count / _turning(turn))
    size = pace + (step - pace) * smoothstep(count / max(PICK_UP, abs(step - pace) / CHANGE))
    steps = np.stack([size * np.sin(angle), size * np.cos(angle)], axis=-1)
    return np.array([course.place.x, course.place.z]) + np.concatenate([np.zeros((1, 2)), steps[:-1].cumsum(0)])


def _turning(turn: float) -> float:
    return 8.0 + (TURN - 8.0) * min(abs(turn) / math.pi, 1.0)


class Trail:
    """A path that is being walked."""

    def __init__(self, path: Path, course: Course) -> None:
        points = np.array([(course.place.x, course.place.z), *path.points])
        chord = lengths_along(points)
        count = max(2, min(20_000, int(chord[-1] / 0.05) + 1))
        self._points = even(points, np.linspace(0, 1, count)) if chord[-1] > 0 else points
        self._along = lengths_along(self._points)
        self.speed = WALKING if path.speed is None else path.speed
        self._gone, self._planned_at, self._planned = 0.0, 0, np.zeros(1)  # metres; the last plan's, frame by frame

    def left(self, course: Course, frame: int) -> float:
        """Metres to the end from where somebody is in a frame; remembers how far he has come."""
        passed = min(frame - self._planned_at, len(self._planned) - 1)
        behind = max(self._gone, self._planned[passed] - 0.75)
        self._gone = self._come(np.array([course.place.x, course.place.z]), behind, 1.5)
        return float(self._along[-1]) - self._gone

    def _come(self, here: Array, gone: float, most: float) -> float:
        """Metres along the path of the place nearest to ``here`` that is not behind, nor further on than ``most``."""
        near = np.flatnonzero((self._along >= gone - 1e-9) & (self._along <= gone + most))
        return (
            float(self._along[near[np.linalg.norm(self._points[near] - here, axis=-1).argmin()]]) if len(near) else gone
        )

    def goal(self, course: Course, frames: int, fps: float, *, frame: int = 0) -> tuple[Goal, int]:
        """Places for so many frames, in the world, and the frame that is near the end (``frames``: none is).

        Somebody heads for the place on the path that is `AHEAD` of him, turns no faster than he can, and goes slower
        while he must turn far.
        """
        here, gone = np.array([course.place.x, course.place.z]), self._gone
        x, z = course.velocity
        pace = math.hypot(x, z)
        angle = math.atan2(x, z) if pace > 0.01 else course.place.facing
        way, facing, over = np.empty((frames, 2)), np.empty(frames), frames
        self._planned_at, self._planned = frame, np.empty(frames)
        for k in range(frames):
            way[k], facing[k], self._planned[k] = here, angle, gone
            left = float(self._along[-1]) - gone
            if left <= ARRIVED and over == frames:
                over = k
            aim = [np.interp(gone + AHEAD, self._along, column) for column in self._points.T] - here
            off = float(turn_between(math.atan2(*aim), angle)) if np.linalg.norm(aim) > 0.05 else 0.0
            angle += float(np.clip(off, -FASTEST_TURN, FASTEST_TURN))
            speed = min(self.speed * max(0.3, math.cos(off)), math.sqrt(2 * BRAKING * max(left, 0.0))) / fps
            pace += float(np.clip(speed - pace, -2 * GAIN, GAIN))
            here = here + pace * np.array([math.sin(angle), math.cos(angle)])
            gone = self._come(here, gone, 2 * pace + 0.1)
        goal, at = Goal.nothing(frames), np.arange(EVERY, frames, EVERY)
        _ask(goal, at, way)
        goal.facing[:], goal.facing_mask[at] = facing, True  # a sharp turn has two ways round; this is the one
        return goal, over


NEAR, NEAR_POSE = 50, 20
"""Frames before its time from which on windows have a place to reach, and a pose, which is taken where the person
is by then."""
SOON, OFF = 12, 15
"""Frames in which something is reached by somebody who has come to it, and those in which he gets going."""
HURRY = 2.2
"""Metres per second with which somebody goes to a place at most, where that brings him there in time."""
ARMS = {"wrist": 0.7, "elbow": 0.5, "foot": 0.6, "ankle": 0.6, "knee": 0.4}
"""Metres on the floor between the pelvis and what a joint reaches without a step."""
ELSE = 0.3
"""The same of the other joints."""
BEFORE = 0.25
"""Metres nearer than that somebody goes who goes to a place."""
LUNGE, PACE = 0.3, 1.0
"""Metres, and metres a second, by which a body goes along with what it reaches for: a lean, and a step or two."""


@dataclass(frozen=True, eq=False)
class Target:
    """A place or a pose that waits for its time."""

    command: Reach | Pose
    due: int
    """The frame in which it is to be so."""
    near: bool = False
    """Somebody has gone to it."""

    @property
    def first(self) -> int:
        """The frame from which on windows have it."""
        return self.due - (NEAR if isinstance(self.command, Reach) else NEAR_POSE)


def too_far(command: Reach, place: GroundPose) -> float:
    """Metres that somebody at a place is too far away to reach without a step; 0 where he is near enough."""
    x, _, z = command.position
    return max(0.0, math.hypot(x - place.x, z - place.z) - _arm(command.joint))


def within_reach(command: Reach, place: GroundPose, frames: int) -> bool:
    """Whether somebody who will be at a place so many frames from now reaches it with what a body can do until then."""
    return too_far(command, place) <= LUNGE + PACE * frames / FPS


def same_place(one: GroundPose, other: GroundPose, frames: int) -> bool:
    """Whether somebody gets from one place to another in so many frames by what a body can do at once."""
    return math.hypot(one.x - other.x, one.z - other.z) <= LUNGE + PACE * frames / FPS


def must_go(command: Reach, place: GroundPose, frames: int) -> bool:
    """Whether somebody at a place who is to reach something so many frames from now walks there from now on."""
    return too_far(command, place) / WALKING >= (frames - NEAR) / FPS


def way_to(command: Reach, place: GroundPose, frames: int) -> Path:
    """The way from a place to where a thing is reached from: at a walk, or faster where that is in time."""
    x, _, z = command.position
    away = math.hypot(x - place.x, z - place.z)
    left = max(0.0, 1 - max(0.0, _arm(command.joint) - BEFORE) / max(away, 1e-6))
    needed = away * left / max((frames - SOON - OFF) / FPS, 0.05)
    end = place.x + (x - place.x) * left, place.z + (z - place.z) * left
    return Path((end,), needed if WALKING < needed <= HURRY else WALKING)


def _arm(joint: str) -> float:
    return ARMS.get(joint.rsplit("_", 1)[-1], ELSE)
