"""One person of a live motion: what is asked of him, the frames sampled for him, and the body that was shown."""

import math
import re
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.edits.heading import heading_for
from motionloom.edits.steering import Correction, toward
from motionloom.features.layout import FPS
from motionloom.features.placed import PlacedMotion
from motionloom.goals.goal import Goal, overlaid, turn_between
from motionloom.goals.paths import WALKING
from motionloom.ground import GroundPose
from motionloom.live.body import body, put
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
from motionloom.motion import Motion, ground_pose
from motionloom.skeleton import SMPL22, Skeleton
from motionloom.tasks.long import last_frames
from motionloom.weights.prior import Prior

Array = NDArray[np.float64]

STAY = 4
"""Frames that a joint is asked to stay where it was asked to be."""
GOES = 0.15
"""Metres per second from which on somebody who is steered goes somewhere."""
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

    known: PlacedMotion
    """The last frames."""
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
    placed: PlacedMotion
    motion: Motion
    """The same as a body."""
    shown: Motion
    """The same on the skeleton that is shown."""
    words: str


@dataclass(frozen=True, eq=False)
class _Due:
    """Something that windows are asked for: how somebody is in one frame."""

    frame: int
    command: Reach | Pose
    there: GroundPose
    """Where the person was thought to be then."""


@dataclass(frozen=True, eq=False)
class State:
    """A person before some frame: all that changes while he moves, by the names that it has in him."""

    plan: _Plan | None
    words: str
    steer: Steer
    trail: Trail | None
    targets: deque[Target]
    goes_to: Target | None
    stands: int
    due: deque[_Due]
    asked: deque[Command]


class Person(Asked):
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
        """metre: of what is asked that one of the person's becomes; otherwise as `live.Live`."""
        self._metre = metre
        self._prior, self._settings, self.skeleton = prior, settings, skeleton or SMPL22
        self._words, self._steer = "", Steer()
        self._trail: Trail | None = None
        self._targets: deque[Target] = deque(maxlen=MOST_ASKED)  # what is to be reached, and is not asked of windows
        self._goes_to: Target | None = None  # that which the trail leads to
        self._stands = 0  # the frame until which somebody who has come to a place stands there
        self._asked: deque[Command] = deque()
        self._due: deque[_Due] = deque(maxlen=MOST_ASKED)
        self._plan: _Plan | None = None if start is None else self._begun(start)

    def ask(self, command: Command) -> None:
        """Ask for something from the next frame on; of several steerings or sentences for one frame the last counts."""
        self.own(command)
        last = self._asked[-1] if self._asked else None
        if isinstance(command, Reach | Pose) or type(last) is not type(command):
            self._asked.append(command)
        else:
            self._asked[-1] = command
        while len(self._asked) > MOST_ASKED:
            self._asked.popleft()

    def own(self, command: Command) -> Command:
        """A command in the metres of the 22-joint person; `MotionloomError` where that is out of anybody's reach."""
        return scaled(command, 1 / self._metre)

    @property
    def waiting(self) -> bool:
        """Whether something was asked that no window knows of."""
        return bool(self._asked)

    def state(self) -> State:
        """What `restore` brings back."""
        return State(*(copy(getattr(self, f"_{one.name}")) for one in fields(State)))

    def restore(self, state: State) -> None:
        """Be as in a state; what was asked since is forgotten."""
        for one in fields(State):
            setattr(self, f"_{one.name}", copy(getattr(state, one.name)))

    def pose_at(self, frame: int) -> tuple[Array, Array, str]:
        """Root (3,), rotations (joints, 4) and words of a frame of the plan."""
        assert self._plan is not None
        k = frame - self._plan.first
        return self._plan.shown.root[k], self._plan.shown.rotations[k], self._plan.words

    # Planning

    def _begun(self, start: Motion) -> _Plan:
        """A plan that is over: the end of a motion of anybody, behind which frame 0 is."""
        placed = last_frames(start)
        motion = body(placed.positions, placed.contacts, FPS, None)
        return _Plan(-len(placed), placed, motion, put(motion, self.skeleton, None), STANDS)

    def request(self, frame: int, *, take: bool) -> Request:
        """What the window from ``frame`` on must be; with ``take`` what was asked is taken up."""
        known = PlacedMotion.nothing()
        if (plan := self._plan) is not None:
            end = frame - plan.first
            known = plan.placed.crop(max(0, end - self._settings.known), end)
        course = _course(known)
        taken: list[Command] = []
        while take and self._asked:
            taken.append(self._asked.popleft())
            self._take_up(self.own(taken[-1]), frame, course)
        goal, words, again = self._wanted(frame, course)
        edits: list[Correction] = []
        turns: list[Correction] = []
        if not goal.empty:
            edits.append(toward(goal.relative_to(course.place), self._prior, first=len(known), known=True))
        if self._trail is None and self._steer.speed is None and self._steer.direction is not None:
            turns.append(heading_for(self._steer.direction - course.place.facing, self._prior, first=len(known)))
        return Request(known, words, edits, turns, again, taken)

    def accept(self, request: Request, features: Array, frame: int, begin: GroundPose | None = None) -> None:
        """Take a window (known and sampled frames, 263) for the plan; ``begin`` where nothing was known."""
        count = len(request.known)
        placed = PlacedMotion(features, begin or request.known.begin)
        old = self._plan
        if old is None:
            motion = body(placed.positions, placed.contacts, FPS, None)
            shown = put(motion, self.skeleton, None)
        else:
            part = slice(frame - old.first - count, frame - old.first)
            motion = body(placed.positions, placed.contacts, FPS, old.motion.frames(part.start, part.stop))
            shown = put(motion, self.skeleton, old.shown.frames(part.start, part.stop))
        self._plan = _Plan(frame - count, placed, motion, shown, request.words)

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
        self._steer, self._trail, self._goes_to, self._stands = steer, trail, goes_to, 0
        self._targets = deque((one for one in self._targets if not one.near), maxlen=MOST_ASKED)

    @property
    def _steered(self) -> bool:
        """Whether somebody is steered somewhere."""
        return self._steer.direction is not None if self._steer.speed is None else self._steer.speed > GOES

    def _goal_of(self, command: Reach | Pose, there: GroundPose) -> Goal:
        """Of one frame, for somebody who is there then."""
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
        """Ask windows for what is near, walk to what is not; gives the frames after which to look again."""
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
            elif not far or self._goes_to is not None or self._stands > frame:
                self._targets.append(target)
            else:
                assert isinstance(command, Reach)
                self._go(Steer(), Trail(way_to(command, course.place, left), course), target)
        return again

    def _still_due(self, frame: int, course: Course) -> Iterator[_Due]:
        """What is asked of the next window: a pose comes along with somebody, and what he has left behind is walked to,
        unless he is steered elsewhere."""
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
        """End a trail that is over; who has gone to something stands there until he has reached it."""
        if self._trail is None or self._trail.left(course, frame) > ARRIVED:
            return
        target, self._trail, self._goes_to = self._goes_to, None, None
        if target is not None:
            due = max(target.due, frame + SOON)
            self._targets.appendleft(Target(target.command, due, near=True))
            self._stands = due + STAY

    def _wanted(self, frame: int, course: Course) -> tuple[Goal, str, int]:
        """What is asked of the next frames, in the world; the words; and after how many frames to sample again."""
        frames = self._settings.ahead
        self._arrive(frame, course)
        again = self._look_at_targets(frame, course)
        if self._stands > frame:
            again = min(again, self._stands - frame)
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
        return goal, self._said(frame), max(self._settings.rest, again)

    def _said(self, frame: int) -> str:
        """The words for what is done from a frame on; those that go nowhere are not for somebody who goes."""
        if self._stands > frame:
            return STANDS
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


STANDS = "a person stands still"
_FORWARD = (
    (0.15, STANDS),
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
    """Whether words end with somebody who stays where he is: stands, sits or lies. The last of several verbs counts."""
    found = list(_EITHER.finditer(words))
    return bool(found) and found[-1]["staying"] is not None


def for_pace(speed: float, direction: float | None, facing: float | None) -> str:
    """speed: metres per second; direction, facing: radians in the world, None where they are one."""
    words = next(words for most, words in _FORWARD if speed < most)
    if words == STANDS or direction is None or facing is None:
        return words
    off = abs(float(turn_between(direction, facing)))
    if off > math.radians(130):
        return _BACKWARDS
    return _SIDEWAYS if off > math.radians(50) else words
