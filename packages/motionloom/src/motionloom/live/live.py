"""`Live`: one pose after the other, without end, and commands in between change what comes.

There is one plan: the frames that were sampled and not yet shown. After a command, or when the plan runs short,
a window is sampled from the next frame on (`window`), knowing the last half second; its body follows from the poses
that were shown (`body`). Everything is counted in frames, no clock is looked at: the same seed and the same commands at
the same frames give the same motion. What was sampled and not shown can be computed anew from any frame (`Mark`).
`clock` runs one of these against the time; `pair` has two people.
"""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS, WIDTH
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.live.commands import Command, FrameCommand
from motionloom.live.person import Controls, Person, Request, State
from motionloom.live.settings import Settings
from motionloom.live.window import Noise, Sampler
from motionloom.requests.fields import specs
from motionloom.requests.sampling import Sampling

Array = NDArray[np.float64]

LOGGED = 100_000
"""Commands that are remembered with their frames."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One pose that was shown."""

    number: int
    """0, 1, 2, ... at the rate of the `Live`."""
    time: float
    """Seconds from frame 0."""
    root: Array
    """(3,) metres in the world: joint 0."""
    rotations: Array
    """(joints, 4) each joint's orientation in its parent's frame; joint 0 in the world."""
    words: str
    """What is being done."""
    skeleton: Skeleton = field(default_factory=lambda: SMPL22)

    def positions(self) -> Array:
        """(joints, 3) metres in the world."""
        return motion_of([self], 1.0).positions()[0]


def motion_of(frames: Sequence[Frame], fps: float) -> Motion:
    """Frames that follow each other as a motion."""
    root, turns = np.stack([frame.root for frame in frames]), np.stack([frame.rotations for frame in frames])
    return Motion(frames[0].skeleton, fps, root, turns)


Frames = TypeVar("Frames", Frame, tuple[Frame, Frame])
"""What is shown at once: the frame of one person, or of both."""


@dataclass(frozen=True, eq=False)
class Mark:
    """A `Stage` before one of its frames: all it takes to make that frame and what follows, again or otherwise."""

    frame: int
    """Number of the frame, at the rate that is shown."""
    next: int
    """The next frame at 20 per second."""
    again: int
    """When a window is sampled without a command."""
    window: int
    """Where the last window began."""
    followed: int
    """Where the last one began that took up a command."""
    two: list[list[tuple[Array, Array, str]]]
    """The last two frames at 20 per second, of everybody."""
    people: tuple[State, ...]


@dataclass(frozen=True, eq=False)
class Undo:
    """What takes a `Stage` to where it was before it went back."""

    at: Mark
    """Where it went back to."""
    was: Mark
    log: list[FrameCommand]
    """What had been taken up between the two."""


class Stage(ABC, Generic[Frames]):
    """One person or two who move without end: frames are counted, windows are sampled when they must be.

    Who is `tasks.watching.watching` may end a window between two network calls; `back` then goes to before its frame.
    """

    def __init__(self, people: Sequence[Person], settings: Settings, fps: float) -> None:
        if not (np.isfinite(fps) and 1 <= fps <= 240):
            raise MotionloomError(f"live motion of {fps:g} frames per second cannot be shown; give 1 to 240")
        self.people, self.settings, self.fps = tuple(people), settings, float(fps)
        self._frame = 0  # the next one to be shown, at the rate of what is shown
        self._next = self._again = 0  # the next frame at 20 per second, and when to sample anew
        self._window = self._followed = -settings.used  # where the last window began, and the last with a command
        self._rest, self._open = settings.rest, True  # frames between windows; whether commands may be taken up
        self._two: list[list[tuple[Array, Array, str]]] = []  # the last two frames at 20 per second, of everybody
        self._log: deque[FrameCommand] = deque(maxlen=LOGGED)
        self.fresh: list[FrameCommand] = []
        """The commands that first changed the last frame."""

    @property
    def number(self) -> int:
        """Of the frame that comes next."""
        return self._frame

    @property
    @abstractmethod
    def calls(self) -> int:
        """Guided calls of the network so far."""

    @abstractmethod
    def __next__(self) -> Frames: ...

    def __iter__(self) -> Iterator[Frames]:
        return self

    def ask(self, command: Command, person: int | None = None) -> None:
        """Send a command from the next frame on: to 0 or 1 of two people, or to everybody (None)."""
        for part, whom in self.addressed(command, person):
            self.people[whom].ask(part)

    def addressed(self, command: Command, person: int | None = None) -> list[tuple[Command, int]]:
        """The commands for each person in one that is for one of them or for everybody; changes nothing.

        Raises `MotionloomError` where there is no such person, or nobody of that size does it.
        """
        if person is not None and not 0 <= person < len(self.people):
            count = "one person" if len(self.people) == 1 else f"{len(self.people)} people"
            raise MotionloomError(f"there is no person {person + 1} in this session; it has {count}")
        parts = [(command, whom) for whom in range(len(self.people)) if person in (None, whom)]
        for part, whom in parts:
            self.people[whom].own(part)
        return parts

    @property
    def taken(self) -> list[FrameCommand]:
        """The commands, with the frames that they first changed: sent before these frames to one of the same seed and
        start, they give the same motion again."""
        return list(self._log)

    def stretch(self, seconds: float) -> int:
        """Take up commands at least so many seconds apart, for machines that are slow; returns the frames (at
        20 per second), which are not below those of the settings."""
        self._rest = min(max(int(np.ceil(seconds * FPS)), self.settings.rest), self.settings.used)
        return self._rest

    # Going back

    def mark(self) -> Mark:
        """The present, to go back to."""
        states = tuple(person.state() for person in self.people)
        return Mark(self._frame, self._next, self._again, self._window, self._followed, self._two, states)

    def back(self, mark: Mark) -> Undo:
        """Go back to a mark: the next frame is that of the mark, and the commands since are sent to it."""
        undo = Undo(mark, self.mark(), [])
        while self._log and self._log[-1].frame >= mark.frame:
            undo.log.insert(0, self._log.pop())
        self._restore(mark)
        for i, (person, state) in enumerate(zip(self.people, mark.people, strict=True)):
            person.restore(replace(state, commands=deque()))  # what waited then was taken up since, or waits still
            for command in (*(one.command for one in undo.log if one.person == i), *undo.was.people[i].commands):
                person.ask(command)
        return undo

    def forth(self, undo: Undo) -> None:
        """Be where `back` was called, as if it had not been."""
        while self._log and self._log[-1].frame >= undo.at.frame:
            self._log.pop()
        self._log.extend(undo.log)
        self._restore(undo.was)

    def _restore(self, mark: Mark) -> None:
        self._frame, self._next, self._again, self._window = mark.frame, mark.next, mark.again, mark.window
        self._followed, self._two = mark.followed, mark.two
        for person, state in zip(self.people, mark.people, strict=True):
            person.restore(state)

    @property
    def window(self) -> int:
        """Where the last window began, in frames at 20 per second."""
        return self._window

    def takes(self, mark: Mark) -> bool:
        """Whether a command at a mark is taken up there; it waits where another was taken up just before."""
        return mark.next >= mark.followed + self._rest

    @property
    def planned(self) -> bool:
        """Whether the next frame is there already: nothing is sampled for it, unless a command comes."""
        return self._needed()[0] < self._again

    @abstractmethod
    def _windows(self, requests: Sequence[Request]) -> None:
        """Sample a window for everybody, from frame ``_next`` on."""

    def frames(self) -> tuple[Frame, ...]:
        """The next frame of everybody."""
        self._open, self.fresh = True, []
        last, part = self._needed()
        while self._next <= last:
            self._two = [*self._two, self._advanced()][-2:]
        frames = tuple(self._between(person, i, part) for i, person in enumerate(self.people))
        self._frame += 1
        return frames

    def _needed(self) -> tuple[int, float]:
        """The last frame at 20 per second that the next one needs, and how far it is behind the one before that; 0
        where it is that frame itself."""
        at = self._frame / self.fps * FPS
        low = int(at + 1e-9)
        return (low + 1, at - low) if at - low > 1e-9 else (low, 0.0)

    def _between(self, person: Person, i: int, part: float) -> Frame:
        root, turns, words = self._two[0 if part else -1][i]
        if part:
            after = self._two[-1][i]
            both = Motion(person.skeleton, FPS, np.stack([root, after[0]]), np.stack([turns, after[1]]))
            between = both.at(np.array([part]), FPS)
            root, turns = between.root[0], between.rotations[0]
        return Frame(self._frame, self._frame / self.fps, root, turns, words, person.skeleton)

    def _advanced(self) -> list[tuple[Array, Array, str]]:
        """The next frame at 20 per second."""
        take = self._open and any(person.waiting for person in self.people)
        self._open = False
        take = take and self._next >= self._followed + self._rest
        if take or self._next >= self._again:
            requests = [person.request(self._next, take=take) for person in self.people]
            self.fresh += [
                FrameCommand(self._frame, command, i) for i, one in enumerate(requests) for command in one.commands
            ]
            self._log += self.fresh
            self._windows(requests)
            self._window, self._again = self._next, self._next + min(request.again for request in requests)
            self._followed = self._next if take else self._followed
        poses = [person.pose_at(self._next) for person in self.people]
        self._next += 1
        return poses


class Live(Stage[Frame], Controls):
    """A person who moves without end and follows commands.

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
        skeleton: Skeleton | None = None,
        metre: float = 1.0,
        settings: Settings | None = None,
    ) -> None:
        """prior: weights that make HumanML3D's 263 numbers. fps: rate of the frames that are shown, 1 to 240; motion is
        sampled at 20 per second and interpolated. start: a motion of anybody that this goes on from, in its place;
        without one the person begins at the origin facing +Z. skeleton: a humanoid that frames are shown on (None: the
        22-joint person). metre: metres of the commands (places, speeds) that one of the 22-joint person's becomes,
        such as a robot's `metre`. Raises `MotionloomError` for what cannot be.
        """
        check(prior, seed)
        chosen = settings or Settings()
        super().__init__([Person(prior, chosen, start=start, skeleton=skeleton, metre=metre)], chosen, fps)
        self._sampler = Sampler(prior, chosen)
        self._noise = Noise(seed, chosen.steps, len(prior.mean))

    @property
    def calls(self) -> int:
        """Guided calls of the network so far."""
        return self._sampler.calls

    def __next__(self) -> Frame:
        return self.frames()[0]

    def take(self, count: int) -> Motion:
        """The next ``count`` frames as a motion."""
        return motion_of([next(self) for _ in range(count)], self.fps)

    def _windows(self, requests: Sequence[Request]) -> None:
        (request,), (person,) = requests, self.people
        count, frames = len(request.known), self.settings.ahead
        noise = self._noise.of(self._next - count, count + frames)
        known = request.known.features.astype(np.float32)
        features = self._sampler(request.words, known, frames, noise, edits=request.edits, turns=request.turns)
        person.accept(request, features, self._next)


def check(prior: Prior, seed: int) -> None:
    """`MotionloomError` for weights and seeds that no live motion is sampled with."""
    if len(prior.mean) != WIDTH or prior.fps != FPS:
        raise MotionloomError(
            f"these weights make {len(prior.mean)} numbers a frame; live motion needs {WIDTH} at {FPS:g} fps"
        )
    specs(Sampling)["seed"].check(seed, "seed")
