"""One person of a live motion: what is asked of him, the frames sampled for him, and the body that was shown."""

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.edits.heading import heading_for
from motionloom.edits.steering import Correction, toward
from motionloom.features import humanml
from motionloom.features.layout import FPS, LAYOUT, WIDTH
from motionloom.goals.goal import Goal, overlaid
from motionloom.goals.paths import WALKING
from motionloom.ground import GroundPose
from motionloom.live.body import body, put
from motionloom.live.commands import Command, Path, Pose, Reach, Say, Steer
from motionloom.live.course import ARRIVED, Course, Trail, braking, steered
from motionloom.live.settings import Settings
from motionloom.live.words import STANDS, for_pace, is_standing
from motionloom.motion import Motion, ground_pose
from motionloom.skeleton import SMPL22, Skeleton
from motionloom.tasks.long import Past
from motionloom.weights.prior import Prior

Array = NDArray[np.float64]

STAY = 4
"""Frames that a joint is asked to stay where it was asked to be."""
RUNS = 1.6
"""Metres per second from which on somebody who is to stand still first slows down: words alone stop a runner in half a
second."""
MOST_ASKED = 64
"""Commands, and things to reach, that wait at once; of more the oldest are dropped."""


class Asked(ABC):
    """What can be asked, as methods."""

    @abstractmethod
    def ask(self, command: Command) -> None:
        """Ask for something from the next frame on."""

    def say(self, text: str) -> None:
        """Do this from now on, such as "a person walks"; empty words leave it to the steering what is done."""
        self.ask(Say(text))

    def steer(self, direction: float | None = None, speed: float | None = None, facing: float | None = None) -> None:
        """Go to a direction (radians in the world; None: ahead), at a speed (metres per second; None: the words' own),
        facing another one (radians; None: as the words do). Without any of them steering ends, and so does a path.
        """
        self.ask(Steer(direction, speed, facing))

    def path(self, points: Sequence[Sequence[float]], speed: float | None = None) -> None:
        """Go through points x, z (metres in the world) at a speed (None: a walk), and stop at the last one."""
        self.ask(Path(tuple(tuple(point) for point in points), speed))  # type: ignore[arg-type]

    def reach(self, joint: str, position: Sequence[float], *, within: float = 0.6) -> None:
        """Bring a joint to a place (3,) in the world within so many seconds."""
        self.ask(Reach(joint, tuple(position), within))  # type: ignore[arg-type]

    def pose(self, places: np.ndarray | Motion, *, within: float = 0.6) -> None:
        """Take a pose within so many seconds: places (22, 3) of a person at the origin who faces +Z, or the first frame
        of a motion of the 22-joint person.
        """
        if isinstance(places, Motion):
            seen = places.frames(0, 1).positions()
            places = ground_pose(seen[0]).from_world(seen)[0]
        self.ask(Pose(tuple(map(tuple, np.asarray(places, dtype=np.float64).tolist())), within))


@dataclass(frozen=True, eq=False)
class Request:
    """What the next window of one person must be."""

    known: Array
    """(frames, 263) features of the last frames, not standardised."""
    begin: GroundPose
    """Where the person is in the first of them."""
    words: str
    edits: list[Correction]
    turns: list[Correction]
    """As of `window.Sampler`."""
    again: int
    """Frames after which to sample again."""
    taken: list[Command]
    """What was asked that this window is the first to know of."""


@dataclass(frozen=True, eq=False)
class _Plan:
    """Frames from ``first`` on: some of the past, which were shown, and what was sampled."""

    first: int
    features: Array
    """(frames, 263), not standardised."""
    places: list[GroundPose]
    """Where the person is in each frame, one more than there are frames."""
    motion: Motion
    shown: Motion
    """The same on the skeleton that is shown."""
    words: str


@dataclass(frozen=True, eq=False)
class _Due:
    """Something to be in one frame, in the world."""

    frame: int
    goal: Goal
    """Of one frame."""


@dataclass(frozen=True, eq=False)
class State:
    """A person before some frame: all that changes while he moves."""

    plan: _Plan | None
    words: str
    steer: Steer
    trail: Trail | None
    due: tuple[_Due, ...]
    asked: tuple[Command, ...]


class Person(Asked):
    """One of those who move. Frames are counted at 20 per second."""

    def __init__(self, prior: Prior, settings: Settings, *, start: Motion | None, skeleton: Skeleton | None) -> None:
        self._prior, self._settings, self.skeleton = prior, settings, skeleton or SMPL22
        self._words, self._steer = "", Steer()
        self._trail: Trail | None = None
        self._asked: deque[Command] = deque()
        self._due: deque[_Due] = deque(maxlen=MOST_ASKED)
        self._plan: _Plan | None = None if start is None else self._begun(start)

    def ask(self, command: Command) -> None:
        """Ask for something from the next frame on; of several steerings or sentences for one frame the last counts."""
        last = self._asked[-1] if self._asked else None
        if isinstance(command, Reach | Pose) or type(last) is not type(command):
            self._asked.append(command)
        else:
            self._asked[-1] = command
        while len(self._asked) > MOST_ASKED:
            self._asked.popleft()

    @property
    def waiting(self) -> bool:
        """Whether something was asked that no window knows of."""
        return bool(self._asked)

    def state(self) -> State:
        """What `restore` brings back."""
        return State(self._plan, self._words, self._steer, copy(self._trail), tuple(self._due), tuple(self._asked))

    def restore(self, state: State) -> None:
        """Be as in a state; what was asked since is forgotten."""
        self._plan, self._words, self._steer, self._trail = state.plan, state.words, state.steer, copy(state.trail)
        self._due = deque(state.due, maxlen=MOST_ASKED)
        self._asked = deque(state.asked)

    def pose_at(self, frame: int) -> tuple[Array, Array, str]:
        """Root (3,), rotations (joints, 4) and words of a frame of the plan."""
        assert self._plan is not None
        k = frame - self._plan.first
        return self._plan.shown.root[k], self._plan.shown.rotations[k], self._plan.words

    # Planning

    def _begun(self, start: Motion) -> _Plan:
        """A plan that is over: the end of a motion of anybody, behind which frame 0 is."""
        past = Past.of(start)
        known = past.known.double().numpy()
        positions, contacts, places = decoded(known, _back(known, past.end))
        motion = body(positions, contacts, FPS, None)
        return _Plan(-len(known), known, places, motion, put(motion, self.skeleton, None), STANDS)

    def request(self, frame: int, *, take: bool) -> Request:
        """What the window from ``frame`` on must be; with ``take`` what was asked is taken up."""
        known, begin = np.zeros((0, WIDTH)), GroundPose()
        if (plan := self._plan) is not None:
            end = frame - plan.first
            known = plan.features[max(0, end - self._settings.known) : end]
            begin = plan.places[end - len(known)]
        course = _course(known, begin)
        taken: list[Command] = []
        while take and self._asked:
            taken.append(self._asked.popleft())
            self._take_up(taken[-1], frame, course)
        goal, words, again = self._wanted(frame, course)
        edits: list[Correction] = []
        turns: list[Correction] = []
        if not goal.empty:
            edits.append(toward(goal.seen_from(course.place), self._prior, first=len(known), known=True))
        if self._trail is None and self._steer.speed is None and self._steer.direction is not None:
            turns.append(heading_for(self._steer.direction - course.place.facing, self._prior, first=len(known)))
        return Request(known, begin, words, edits, turns, again, taken)

    def accept(self, request: Request, features: Array, frame: int, begin: GroundPose | None = None) -> None:
        """Take a window (known and sampled frames, 263) for the plan; ``begin`` where nothing was known."""
        count = len(request.known)
        positions, contacts, places = decoded(features, begin or request.begin)
        old = self._plan
        if old is None:
            motion = body(positions, contacts, FPS, None)
            shown = put(motion, self.skeleton, None)
        else:
            part = slice(frame - old.first - count, frame - old.first)
            motion = body(positions, contacts, FPS, old.motion.frames(part.start, part.stop))
            shown = put(motion, self.skeleton, old.shown.frames(part.start, part.stop))
        self._plan = _Plan(frame - count, features, places, motion, shown, request.words)

    def _take_up(self, command: Command, frame: int, course: Course) -> None:
        if isinstance(command, Say):
            self._words = command.text
        elif isinstance(command, Steer):
            self._steer, self._trail = command, None
        elif isinstance(command, Path):
            self._steer, self._trail = Steer(), Trail(command, course)
        else:
            due = frame + max(4, round(command.within * FPS))
            self._due.append(_Due(due, self._goal_of(command, due, course)))

    def _goal_of(self, command: Reach | Pose, due: int, course: Course) -> Goal:
        goal = Goal.nothing(1)
        if isinstance(command, Reach):
            joint = SMPL22.index(command.joint)
            goal.positions[0, joint] = command.position
            goal.asked[0, joint] = True
            return goal
        plan = self._plan
        there = course.place if plan is None else plan.places[min(due - plan.first, len(plan.places) - 1)]
        places = np.array(command.places)
        goal.positions[0] = there.to_world(places - places[:1] * [1, 0, 1])
        goal.asked[0] = True
        return goal

    def _wanted(self, frame: int, course: Course) -> tuple[Goal, str, int]:
        """What is asked of the next frames, in the world; the words; and after how many frames to sample again."""
        frames, again = self._settings.ahead, self._settings.used
        words, steer = self._words, self._steer
        if self._trail is not None and self._trail.left(course, frame) <= ARRIVED:
            self._trail = None
        if self._trail is not None:
            goal, over = self._trail.goal(course, frames, FPS, frame=frame)
            again = max(self._settings.rest, min(again, over))
            words = words or for_pace(self._trail.speed, None, None)
        else:
            stops = steer.speed is None and is_standing(words) and FPS * math.hypot(*course.velocity) > RUNS
            goal = braking(course, frames) if stops else steered(course, steer, frames, FPS)
            pace = (0.0 if steer.direction is None else WALKING) if steer.speed is None else steer.speed
            words = words or for_pace(pace, steer.direction, steer.facing)
        while self._due and self._due[0].frame + STAY <= frame:
            self._due.popleft()
        for due in self._due:
            here = np.arange(max(due.frame - frame, 0), min(due.frame + STAY - frame, frames))
            for k in here:
                goal = overlaid(due.goal.padded(int(k), frames - int(k) - 1), goal)
        return goal, words or STANDS, again


def decoded(features: Array, begin: GroundPose) -> tuple[Array, Array, list[GroundPose]]:
    """Places (frames, 22, 3) in the world, contacts (frames, 4), and where the person is, one frame more."""
    longer = np.concatenate([features, features[-1:]])
    positions = begin.to_world(humanml.decode_positions(longer))
    facing = begin.facing - 2 * np.concatenate([[0.0], np.cumsum(features[:, 0])])
    places = [GroundPose(float(p[0, 0]), float(p[0, 2]), float(f)) for p, f in zip(positions, facing, strict=True)]
    return positions[:-1], features[:, LAYOUT["contacts"]], places


def _back(features: Array, end: GroundPose) -> GroundPose:
    """Where the person was in the first of some frames behind which he is at ``end``."""
    last = decoded(features, GroundPose())[2][-1]
    turn = end.facing - last.facing
    x, _, z = GroundPose(facing=turn).to_world(np.array([last.x, 0.0, last.z]))
    return GroundPose(end.x - float(x), end.z - float(z), turn)


def _course(known: Array, begin: GroundPose) -> Course:
    if not len(known):
        return Course(begin, (0.0, 0.0))
    places = decoded(known, begin)[2]
    back = places[max(0, len(places) - 5)]
    count = min(4, len(places) - 1)
    return Course(places[-1], ((places[-1].x - back.x) / count, (places[-1].z - back.z) / count))
