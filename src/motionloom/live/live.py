"""`Live`: one pose after the other, without end, and what is asked in between changes what comes.

There is one plan: the frames that were drawn and not yet shown. When something is asked, or when the plan runs short,
a window is drawn from the next frame on (`window`), knowing the last half second; its body follows from the poses that
were shown (`body`). Everything is counted in frames, no clock is looked at: the same seed and the same commands at the
same frames make the same motion. `clock` runs one of these against the time.
"""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray

from motionloom.edits.heading import heading_for
from motionloom.edits.steering import Correction, toward
from motionloom.errors import MotionloomError
from motionloom.features import humanml
from motionloom.features.layout import FPS, LAYOUT, WIDTH
from motionloom.goals.goal import Goal, Placement, body_facing, overlaid
from motionloom.goals.paths import WALKING
from motionloom.live.body import body
from motionloom.live.commands import Command, Path, Pose, Reach, Say, Steer
from motionloom.live.course import ARRIVED, Course, Trail, steered
from motionloom.live.settings import Settings
from motionloom.live.window import Drawer, Noise
from motionloom.live.words import STANDS, for_pace
from motionloom.motion import Motion
from motionloom.skeleton import SMPL22
from motionloom.tasks.long import Past
from motionloom.tasks.text import LARGEST_SEED
from motionloom.weights.prior import Prior

Array = NDArray[np.float64]

STAY = 4
"""Frames that a joint is asked to stay where it was asked to be."""
LOGGED = 100_000
"""Commands that are remembered with their frames."""
MOST_ASKED = 64
"""Things to reach and poses that wait at once; of more the oldest are dropped."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One pose that was shown."""

    number: int
    """0, 1, 2, ... at the rate of the `Live`."""
    time: float
    """Seconds from frame 0."""
    root: Array
    """(3,) metres in the world."""
    rotations: Array
    """(22, 4) each joint's orientation in its parent's frame; joint 0 in the world."""
    words: str
    """What is being done."""

    def positions(self) -> Array:
        """(22, 3) metres in the world."""
        return motion_of([self], 1.0).positions()[0]


def motion_of(frames: Sequence[Frame], fps: float) -> Motion:
    """Frames that follow each other as a motion of the 22-joint person."""
    root, turns = np.stack([frame.root for frame in frames]), np.stack([frame.rotations for frame in frames])
    return Motion(SMPL22, fps, root, turns)


@dataclass(frozen=True, eq=False)
class _Plan:
    """Frames from ``first`` on: some of the past, which were shown, and what was drawn."""

    first: int
    features: Array
    """(frames, 263), not standardised."""
    places: list[Placement]
    """Where the person is in each frame, one more than there are frames."""
    motion: Motion
    drawn: int
    """The frame that this plan was drawn from."""
    words: str

    @property
    def stop(self) -> int:
        return self.first + len(self.features)


@dataclass(frozen=True, eq=False)
class _Due:
    """Something to be in one frame, in the world."""

    frame: int
    goal: Goal
    """Of one frame."""


class Live:
    """Somebody who moves without end and does what is asked.

    live = Live(Prior.load(), seed=1)
    live.say("a person walks forward")
    for frame in live:
        ...

    Not for several threads at once; `clock.Player` plays one against the time.
    """

    def __init__(
        self,
        prior: Prior,
        *,
        seed: int = 0,
        fps: float = FPS,
        start: Motion | None = None,
        settings: Settings | None = None,
    ) -> None:
        """prior: weights that make HumanML3D's 263 numbers. fps: rate of the frames that are shown, 1 to 240; motion is
        drawn at 20 per second and interpolated. start: a motion of anybody that this goes on from, in its place;
        without one the person begins at the origin facing +Z, standing. Raises `MotionloomError` for what cannot be.
        """
        if len(prior.mean) != WIDTH or prior.fps != FPS:
            raise MotionloomError(
                f"these weights make {len(prior.mean)} numbers a frame; live motion needs {WIDTH} at {FPS:g} fps"
            )
        if not 0 <= seed < LARGEST_SEED:
            raise MotionloomError(f"a seed is a whole number from 0 to below 2**62; got {seed}")
        if not (np.isfinite(fps) and 1 <= fps <= 240):
            raise MotionloomError(f"live motion of {fps:g} frames per second cannot be shown; give 1 to 240")
        self.settings, self.fps = settings or Settings(), float(fps)
        self._draw = Drawer(prior, self.settings)
        self._noise = Noise(seed, self.settings.steps, len(prior.mean))
        self._frame = 0  # the next one to be shown, at the rate of what is shown
        self._words, self._steer, self._trail = "", Steer(), None
        self._asked: deque[Command] = deque()
        self._due: deque[_Due] = deque(maxlen=MOST_ASKED)
        self._known, self._shown = self._begin(start)
        self._next, self._plan, self._again = 0, None, 0  # the next frame at 20 per second; when to draw anew
        self._two: list[tuple[Array, Array, str]] = []  # the last two frames at 20 per second
        self._rest, self._open = self.settings.rest, True  # frames between windows; whether commands may be taken up
        self._taken: deque[tuple[int, Command]] = deque(maxlen=LOGGED)

    # What is asked

    def ask(self, command: Command) -> None:
        """Ask for something from the next frame on."""
        if isinstance(command, Reach | Pose) or not self._asked or type(self._asked[-1]) is not type(command):
            self._asked.append(command)
        else:
            self._asked[-1] = command  # of several of one kind for one frame the last one counts
        while len(self._asked) > MOST_ASKED:
            self._asked.popleft()

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
            there = Placement(float(seen[0, 0, 0]), float(seen[0, 0, 2]), body_facing(seen[0]))
            places = there.from_world(seen)[0]
        self.ask(Pose(tuple(map(tuple, np.asarray(places, dtype=np.float64).tolist())), within))

    # What is shown

    @property
    def number(self) -> int:
        """Of the frame that comes next."""
        return self._frame

    @property
    def calls(self) -> int:
        """Guided calls of the network so far."""
        return self._draw.calls

    @property
    def taken(self) -> list[tuple[int, Command]]:
        """What was asked, with the frames that it first changed: asked before these frames of a `Live` of the same seed
        and start, it makes the same motion again."""
        return list(self._taken)

    def stretch(self, seconds: float) -> int:
        """Draw windows at least so many seconds apart, for machines that are slow; gives the frames back (at 20 per
        second), which are not below those of the settings."""
        self._rest = min(max(int(np.ceil(seconds * FPS)), self.settings.rest), self.settings.used)
        return self._rest

    def __iter__(self) -> Iterator[Frame]:
        return self

    def __next__(self) -> Frame:
        self._open = True
        at = self._frame / self.fps * FPS
        low = int(at + 1e-9)
        part = at - low if at - low > 1e-9 else 0.0
        while self._next < low + (2 if part else 1):
            self._two = [*self._two, self._shown_next()][-2:]
        root, turns, words = self._two[0 if part else -1]
        if part:
            after = self._two[-1]
            both = Motion(SMPL22, FPS, np.stack([root, after[0]]), np.stack([turns, after[1]]))
            between = both.at(np.array([part]), FPS)
            root, turns = between.root[0], between.rotations[0]
        frame = Frame(self._frame, self._frame / self.fps, root, turns, words)
        self._frame += 1
        return frame

    def take(self, count: int) -> Motion:
        """The next ``count`` frames as a motion."""
        return motion_of([next(self) for _ in range(count)], self.fps)

    def _shown_next(self) -> tuple[Array, Array, str]:
        """The next frame at 20 per second."""
        plan = self._plan
        asked = self._open and len(self._asked) > 0
        self._open = False
        if plan is None or self._next >= self._again or (asked and self._next >= plan.drawn + self._rest):
            plan = self._plan = self._planned(asked or plan is None)
        k = self._next - plan.first
        self._next += 1
        return plan.motion.root[k], plan.motion.rotations[k], plan.words

    # Planning

    def _begin(self, start: Motion | None) -> tuple[tuple[Array, Placement], Motion | None]:
        """Features of the past and where the first of them is, and the body that was shown."""
        if start is None:
            return (np.zeros((0, WIDTH)), Placement()), None
        past = Past.of(start)
        known = past.known.double().numpy()
        begin = _back(known, past.end)
        motion = body(*_decoded(known, begin)[:2], FPS, None)
        count = self.settings.known
        places = _decoded(known, begin)[2]
        return (known[-count:], places[-count - 1]), motion.frames(len(motion) - count, len(motion))

    def _past(self) -> tuple[Array, Placement, Motion | None]:
        """Features of the last frames, where the first of them is, and the body that was shown in them."""
        plan, count = self._plan, self.settings.known
        if plan is None:
            return *self._known, self._shown
        end = self._next - plan.first
        begin = max(0, end - count)
        return plan.features[begin:end], plan.places[begin], plan.motion.frames(begin, end)

    def _planned(self, asked: bool) -> _Plan:
        """A plan from the next frame on, with what was asked if that may be taken up."""
        known, begin, shown = self._past()
        course = _course(known, begin)
        while asked and self._asked:
            command = self._asked.popleft()
            self._taken.append((self._frame, command))
            self._take_up(command, course)
        frames, count = self.settings.ahead, len(known)
        goal, words, again = self._wanted(course, frames)
        edits: list[Correction] = []
        turns: list[Correction] = []
        if not goal.empty:
            edits.append(toward(goal.seen_from(course.place), self._draw.prior, first=count))
        if self._trail is None and self._steer.speed is None and self._steer.direction is not None:
            way = self._steer.direction - course.place.facing
            turns.append(heading_for(way, self._draw.prior, first=count))
        first = self._next - count
        draw = self._noise.draw(first, count + frames, self._draw.prior.mean.device)
        features = self._draw(words, torch.from_numpy(known).float(), frames, draw, edits=edits, turns=turns)
        positions, contacts, places = _decoded(features, begin)
        made = body(positions, contacts, FPS, shown)
        motion = made if shown is None else _one(shown, made)
        self._again = self._next + again
        return _Plan(first, features, places, motion, self._next, words)

    def _take_up(self, command: Command, course: Course) -> None:
        if isinstance(command, Say):
            self._words = command.text
        elif isinstance(command, Steer):
            self._steer, self._trail = command, None
        elif isinstance(command, Path):
            self._steer, self._trail = Steer(), Trail(command, course)
        else:
            frame = self._next + max(4, round(command.within * FPS))
            self._due.append(_Due(frame, self._goal_of(command, frame, course)))

    def _goal_of(self, command: Reach | Pose, frame: int, course: Course) -> Goal:
        goal = Goal.nothing(1)
        if isinstance(command, Reach):
            joint = SMPL22.index(command.joint)
            goal.positions[0, joint] = command.position
            goal.asked[0, joint] = True
            return goal
        plan = self._plan
        there = course.place if plan is None else plan.places[min(frame - plan.first, len(plan.places) - 1)]
        places = np.array(command.places)
        goal.positions[0] = there.to_world(places - places[:1] * [1, 0, 1])
        goal.asked[0] = True
        return goal

    def _wanted(self, course: Course, frames: int) -> tuple[Goal, str, int]:
        """What is asked of the next frames, in the world; the words; and after how many frames to draw again."""
        again, words, steer = self.settings.used, self._words, self._steer
        if self._trail is not None and self._trail.left(course) <= ARRIVED:
            self._trail = None
        if self._trail is not None:
            goal, over = self._trail.goal(course, frames, FPS)
            again = max(self.settings.rest, min(again, over))
            words = words or for_pace(self._trail.speed, None, None)
        else:
            goal = steered(course, steer, frames, FPS)
            pace = (0.0 if steer.direction is None else WALKING) if steer.speed is None else steer.speed
            words = words or for_pace(pace, steer.direction, steer.facing)
        while self._due and self._due[0].frame + STAY <= self._next:
            self._due.popleft()
        for due in self._due:
            here = np.arange(max(due.frame - self._next, 0), min(due.frame + STAY - self._next, frames))
            for k in here:
                goal = overlaid(due.goal.padded(int(k), frames - int(k) - 1), goal)
        return goal, words or STANDS, again


def _one(shown: Motion, made: Motion) -> Motion:
    turns = np.concatenate([shown.rotations, made.rotations])
    return replace(made, root=np.concatenate([shown.root, made.root]), rotations=turns)


def _decoded(features: Array, begin: Placement) -> tuple[Array, Array, list[Placement]]:
    """Places (frames, 22, 3) in the world, contacts (frames, 4), and where the person is, one frame more."""
    longer = np.concatenate([features, features[-1:]])
    positions = begin.to_world(humanml.decode_positions(longer))
    facing = begin.facing - 2 * np.concatenate([[0.0], np.cumsum(features[:, 0])])
    places = [Placement(float(p[0, 0]), float(p[0, 2]), float(f)) for p, f in zip(positions, facing, strict=True)]
    return positions[:-1], features[:, LAYOUT["contacts"]], places


def _back(features: Array, end: Placement) -> Placement:
    """Where the person was in the first of some frames behind which he is at ``end``."""
    last = _decoded(features, Placement())[2][-1]
    turn = end.facing - last.facing
    x, _, z = Placement(facing=turn).to_world(np.array([last.x, 0.0, last.z]))
    return Placement(end.x - float(x), end.z - float(z), turn)


def _course(known: Array, begin: Placement) -> Course:
    if not len(known):
        return Course(begin, (0.0, 0.0))
    places = _decoded(known, begin)[2]
    back = places[max(0, len(places) - 5)]
    count = min(4, len(places) - 1)
    return Course(places[-1], ((places[-1].x - back.x) / count, (places[-1].z - back.z) / count))
