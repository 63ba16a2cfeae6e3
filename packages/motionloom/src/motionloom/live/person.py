"""One person of a live motion: its commands, the frames sampled for it, and the body that was shown."""

import math
import re
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core.features.layout import FPS
from motionloom.core.features.placed import PlacedMotion
from motionloom.core.ground import GroundPose
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion, ground_pose
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.edits.heading import heading_for
from motionloom.edits.steering import Correction, toward
from motionloom.goals.goal import Goal, overlaid, turn_between
from motionloom.goals.paths import WALKING
from motionloom.live.body import body, transfer
from motionloom.live.commands import Command, Path, Pose, Reach, Say, Steer, scaled
from motionloom.live.course import (
    ARRIVED,
    SOON,
    Course,
    Target,
    Trail,
    braking,
    must_go,
    same_place,
    steered,
    way_to,
    within_reach,
)
from motionloom.live.settings import Settings
from motionloom.tasks.history import last_frames

Array = NDArray[np.float64]

STAY = 4
"""Frames that a joint stays where a command wants it."""
GOES = 0.15
"""Metres per second from which on a steered person goes somewhere."""
RUNS = 1.6
"""Metres per second from which on a person who is to stand still first slows down: words alone stop a runner in half a
second."""
MOST_ASKED = 64
"""Commands, and things to reach, that wait at once; of more the oldest are dropped."""


class Controls(ABC):
    """The commands, as methods."""

    @abstractmethod
    def ask(self, command: Command) -> None:
        """Send a command that takes effect from the next frame on."""

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
            positions = places.frames(0, 1).positions()
            places = ground_pose(positions[0]).from_world(positions)[0]
        self.ask(Pose(tuple(map(tuple, np.asarray(places, dtype=np.float64).tolist())), within))


@dataclass(frozen=True, eq=False)
class Request:
    """What the next window of one person must be."""

    known: PlacedMotion
    """The last frames."""
    words: str
    edits: list[Correction]
    turns: list[Correction]
    """As of `window.Sampler`."""
    again: int
    """Frames after which to sample again."""
    commands: list[Command]
    """The commands that this window is the first to know of."""


@dataclass(frozen=True, eq=False)
class _Plan:
    """Frames from ``first`` on: some of the past, which were shown, and what was sampled."""

    first: int
    placed: PlacedMotion
    motion: Motion
    """The same as a body."""
    clip: Motion
    """The same on the skeleton of the frames."""
    words: str


@dataclass(frozen=True, eq=False)
class _Due:
    """Something that windows must meet: how the person is in one frame."""

    frame: int
    command: Reach | Pose
    there: GroundPose
    """Where the person was thought to be then."""


@dataclass(frozen=True, eq=False)
class State:
    """A person before some frame: all that changes in motion, by the names of the person's attributes."""

    plan: _Plan | None
    words: str
    steer: Steer
    trail: Trail | None
    targets: deque[Target]
    goes_to: Target | None
    until: int
    due: deque[_Due]
    commands: deque[Command]


class Person(Controls):
    """One of those who move. Frames are counted at 20 per second."""

    def __init__(
        self,
        prior: Prior,
        settings: Settings,
        *,
        start: Motion | None,
        skeleton: Skeleton | None,
        metre: float = 1.0,
    ) -> None:
        """metre: that of the commands in the person's metres; otherwise as `live.Live`."""
        self._metre = metre
        self._prior, self._settings, self.skeleton = prior, settings, skeleton or SMPL22
        self._words, self._steer = "", Steer()
        self._trail: Trail | None = None
        self._targets: deque[Target] = deque(
            maxlen=MOST_ASKED
        )  # what is to be reached, and is not a goal of windows yet
        self._goes_to: Target | None = None  # that to which the trail goes
        self._until = 0  # the frame until which a person who has come to a place stands there
        self._commands: deque[Command] = deque()
        self._due: deque[_Due] = deque(maxlen=MOST_ASKED)
        self._plan: _Plan | None = None if start is None else self._begun(start)

    def ask(self, command: Command) -> None:
        """As of `Controls.ask`; of several steerings or sentences for one frame the last counts."""
        self.own(command)
        last = self._commands[-1] if self._commands else None
        if isinstance(command, Reach | Pose) or type(last) is not type(command):
            self._commands.append(command)
        else:
            self._commands[-1] = command
        while len(self._commands) > MOST_ASKED:
            self._commands.popleft()

    def own(self, command: Command) -> Command:
        """A command in the metres of the 22-joint person; `MotionloomError` where that is out of anybody's reach."""
        return scaled(command, 1 / self._metre)

    @property
    def waiting(self) -> bool:
        """Whether there is a command that no window knows of."""
        return bool(self._commands)

    def state(self) -> State:
        """What `restore` brings back."""
        return State(*(copy(getattr(self, f"_{one.name}")) for one in fields(State)))

    def restore(self, state: State) -> None:
        """Be as in a state; later commands are forgotten."""
        for one in fields(State):
            setattr(self, f"_{one.name}", copy(getattr(state, one.name)))

    def pose_at(self, frame: int) -> tuple[Array, Array, str]:
        """Root (3,), rotations (joints, 4) and words of a frame of the plan."""
        assert self._plan is not None
        k = frame - self._plan.first
        return self._plan.clip.root[k], self._plan.clip.rotations[k], self._plan.words

    # Planning

    def _begun(self, start: Motion) -> _Plan:
        """A plan that is over: the end of a motion of anybody, behind which frame 0 is."""
        placed = last_frames(start)
        motion = body(placed.positions, placed.contacts, FPS, None)
        return _Plan(-len(placed), placed, motion, transfer(motion, self.skeleton, None), STILL)

    def request(self, frame: int, *, take: bool) -> Request:
        """What the window from ``frame`` on must be; with ``take`` the commands are taken up."""
        known = PlacedMotion.nothing()
        if (plan := self._plan) is not None:
            end = frame - plan.first
            known = plan.placed.crop(max(0, end - self._settings.known), end)
        course = _course(known)
        commands: list[Command] = []
        while take and self._commands:
            commands.append(self._commands.popleft())
            self._take_up(self.own(commands[-1]), frame, course)
        goal, words, again = self._plan_window(frame, course)
        edits: list[Correction] = []
        turns: list[Correction] = []
        if not goal.empty:
            edits.append(toward(goal.relative_to(course.place), self._prior, first=len(known), known=True))
        if self._trail is None and self._steer.speed is None and self._steer.direction is not None:
            turns.append(heading_for(self._steer.direction - course.place.facing, self._prior, first=len(known)))
        return Request(known, words, edits, turns, again, commands)

    def accept(self, request: Request, features: Array, frame: int, begin: GroundPose | None = None) -> None:
        """Take a window (known and sampled frames, 263) for the plan; ``begin`` where nothing was known."""
        count = len(request.known)
        placed = PlacedMotion(features, begin or request.known.begin)
        pasts: tuple[Motion | None, Motion | None] = (None, None)
        if (old := self._plan) is not None:
            last = frame - old.first
            pasts = old.motion.frames(last - count, last), old.clip.frames(last - count, last)
        motion = body(placed.positions, placed.contacts, FPS, pasts[0])
        clip = transfer(motion, self.skeleton, pasts[1])
        self._plan = _Plan(frame - count, placed, motion, clip, request.words)

    def _take_up(self, command: Command, frame: int, course: Course) -> None:
        if isinstance(command, Say):
            self._words = command.text
            if stays(command.text) and (self._trail is not None or self._steered):
                self._go(Steer(), None)
        elif isinstance(command, Steer):
            self._go(command, None)
        elif isinstance(command, Path):
            self._go(Steer(), Trail(command, course))
        else:
            self._targets.append(Target(command, frame + max(4, round(command.within * FPS))))

    def _go(self, steer: Steer, trail: Trail | None, goes_to: Target | None = None) -> None:
        """Go another way than before; what was gone to is given up."""
        self._steer, self._trail, self._goes_to, self._until = steer, trail, goes_to, 0
        self._targets = deque((one for one in self._targets if not one.near), maxlen=MOST_ASKED)

    @property
    def _steered(self) -> bool:
        """Whether somebody is steered somewhere."""
        return self._steer.direction is not None if self._steer.speed is None else self._steer.speed > GOES

    def _goal_of(self, command: Reach | Pose, there: GroundPose) -> Goal:
        """Of one frame, for a person who is ``there`` then."""
        goal = Goal.nothing(1)
        if isinstance(command, Reach):
            joint = SMPL22.index(command.joint)
            goal.positions[0, joint] = command.position
            goal.mask[0, joint] = True
            return goal
        places = np.array(command.places)
        goal.positions[0] = there.to_world(places - places[:1] * [1, 0, 1])
        goal.mask[0] = True
        return goal

    def _place_in(self, frame: int, course: Course) -> GroundPose:
        """Where somebody will be in a frame if he goes on as he does."""
        if (plan := self._plan) is None:
            return course.place
        last = len(plan.placed)
        beyond, there = max(0, frame - plan.first - last), plan.placed.at(min(frame - plan.first, last))
        back = plan.placed.at(max(0, last - 4))
        x, z = ((there.x - back.x) / 4, (there.z - back.z) / 4) if beyond else (0.0, 0.0)
        return GroundPose(there.x + beyond * x, there.z + beyond * z, there.facing)

    def _look_at_targets(self, frame: int, course: Course) -> int:
        """Leave what is near to windows, walk to what is not; returns the frames after which to look again."""
        again = self._settings.used
        waiting, self._targets = self._targets, deque(maxlen=MOST_ASKED)
        for target in waiting:
            if target.due < frame + 4:  # others were walked to first
                target = replace(target, due=frame + SOON)
            command, left = target.command, target.due - frame
            early = target.first > frame
            if early and not (isinstance(command, Reach) and must_go(command, course.place, left)):
                self._targets.append(target)
                again = min(again, target.first - frame)
                continue
            there = self._place_in(target.due, course)
            far = isinstance(command, Reach) and not target.near and not within_reach(command, there, left)
            if not far and not early:
                self._due.append(_Due(target.due, command, there))
            elif not far or self._goes_to is not None or self._until > frame:
                self._targets.append(target)
            else:
                assert isinstance(command, Reach)
                self._go(Steer(), Trail(way_to(command, course.place, left), course), target)
        return again

    def _still_due(self, frame: int, course: Course) -> Iterator[_Due]:
        """What the next window must meet: a pose comes along with the person, who walks back to what was passed, unless
        steered elsewhere."""
        for due in self._due:
            left, there = due.frame - frame, self._place_in(due.frame, course)
            if left + STAY <= 0:
                continue
            if isinstance(due.command, Pose):
                yield due if same_place(due.there, there, max(left, 0)) else replace(due, there=there)
            elif within_reach(due.command, there, max(left, 0)):
                yield due
            elif self._trail is None and not self._steered:
                self._targets.append(Target(due.command, due.frame))

    def _arrive(self, frame: int, course: Course) -> None:
        """End a trail that is over; whoever has gone to something stands there until it is reached."""
        if self._trail is None or self._trail.left(course, frame) > ARRIVED:
            return
        target, self._trail, self._goes_to = self._goes_to, None, None
        if target is not None:
            due = max(target.due, frame + SOON)
            self._targets.appendleft(Target(target.command, due, near=True))
            self._until = due + STAY

    def _plan_window(self, frame: int, course: Course) -> tuple[Goal, str, int]:
        """The goal of the next frames, in the world; the words; and after how many frames to sample again."""
        frames = self._settings.ahead
        self._arrive(frame, course)
        again = self._look_at_targets(frame, course)
        if self._until > frame:
            again = min(again, self._until - frame)
        if self._trail is not None:
            goal, over = self._trail.goal(course, frames, FPS, frame=frame)
            again = min(again, over)
        else:
            stops = self._steer.speed is None and stays(self._words) and FPS * math.hypot(*course.velocity) > RUNS
            goal = braking(course, frames) if stops else steered(course, self._steer, frames, FPS)
        self._due = deque(self._still_due(frame, course), maxlen=MOST_ASKED)
        for due in self._due:
            one = self._goal_of(due.command, due.there)
            for k in range(max(due.frame - frame, 0), min(due.frame + STAY - frame, frames)):
                goal = overlaid(one.padded(k, frames - k - 1), goal)
        return goal, self._words_at(frame), max(self._settings.rest, again)

    def _words_at(self, frame: int) -> str:
        """The words for what is done from a frame on; those that go nowhere are not for somebody who goes."""
        if self._until > frame:
            return STILL
        steer, words = self._steer, self._words
        if self._trail is not None:
            pace, away = self._trail.speed, self._goes_to is not None
            return for_pace(pace, None, None) if away or stays(words) else words or for_pace(pace, None, None)
        pace = (0.0 if steer.direction is None else WALKING) if steer.speed is None else steer.speed
        if not words or (stays(words) and self._steered):
            return for_pace(pace, steer.direction, steer.facing)
        return words


def _course(known: PlacedMotion) -> Course:
    if not len(known):
        return Course(known.begin, (0.0, 0.0))
    count = min(4, len(known))
    end, back = known.end, known.at(len(known) - count)
    return Course(end, ((end.x - back.x) / count, (end.z - back.z) / count))


STILL = "a person stands still"
_FORWARD = (
    (0.15, STILL),
    (1.9, "a person walks forward"),
    (2.4, "a person jogs slowly"),
    (math.inf, "a person runs forward"),
)
_BACKWARDS, _SIDEWAYS = "a person walks backwards", "a person walks sideways"


_GOING = r"""walk\w*|runs?|running|jog\w*|sprint\w*|stroll\w*|march\w*|step\w*|skip\w*|hop\w*|jump\w*|crawl\w*|sneak\w*|
    creep\w*|limp\w*|stagger\w*|wander\w*|danc\w*|goes|go|going|moves?|moving|rush\w*|hurr\w+|climb\w*|strid\w+"""
_STAYING = r"""stands?|standing|stays?|staying|waits?|waiting|sits?|sitting|seated|lies?|lying|lays|laying|kneel\w*|
    squat\w*|crouch\w*|sleep\w*|rests?|resting|falls?|falling|collaps\w+|freez\w+|(?:stops?|halts?)(?:\s+\w+ing)?"""
_EITHER = re.compile(rf"\b(?:(?P<staying>{_STAYING})|{_GOING})\b", re.IGNORECASE | re.VERBOSE)


def stays(words: str) -> bool:
    """Whether words end with staying in place: standing, sitting or lying. The last of several verbs counts."""
    verbs = list(_EITHER.finditer(words))
    return bool(verbs) and verbs[-1]["staying"] is not None


def for_pace(speed: float, direction: float | None, facing: float | None) -> str:
    """speed: metres per second; direction, facing: radians in the world, None where they are one."""
    words = next(words for most, words in _FORWARD if speed < most)
    if words == STILL or direction is None or facing is None:
        return words
    off = abs(float(turn_between(direction, facing)))
    if off > math.radians(130):
        return _BACKWARDS
    return _SIDEWAYS if off > math.radians(50) else words
