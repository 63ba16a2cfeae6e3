"""A `Live` against the time: a thread that samples ahead, a bounded buffer, and frames that are handed out on time.

Only frames that were handed out are fixed. After a command, what is in the buffer is computed anew from the first
frame on that a window can be ready for, so a command waits about as long as a window takes, however long the
buffer is; a window that is being sampled because the buffer runs short is given up for it. Where a new window comes too
late, because frames that it was to replace were shown meanwhile, those stay, and it is sampled once more from later on.
On a slow machine windows follow each other less often, and where one takes longer than its frames last, all is shown
more slowly, evenly; `Health` says so. When frames are late all the same the clock waits: what is shown never jumps.
"""

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from math import ceil
from statistics import median_low
from typing import Generic

from motionloom.core.features.layout import FPS
from motionloom.live.commands import Command, FrameCommand
from motionloom.live.live import LOGGED, Frame, Frames, Mark, Stage
from motionloom.tasks.watching import watching

SHORTEST, LONGEST = 0.5, 2.0
"""Seconds of frames that wait in the buffer, at least and at most."""
WINDOWS = 3.0
"""As many of the longest windows' times the buffer holds: one that is given up, one for a command, and again."""
USUAL, SPARE = 0.8, 1.05
"""A window is expected to take so many times what this share of the last ones took at most."""
WAITING = 64
"""Commands that wait for the planner; of more the oldest are dropped."""
SLOW = 0.6
"""Seconds that a command waits from which on the machine counts as too slow."""
LATE = 0.02
"""Seconds after its time from which on a frame counts as late."""
SLOWER, SLOWEST = 1.15, 0.2
"""A window is shown for so many times as long as one takes, where that is longer than its frames last; and the rate
below which nothing is shown evenly."""
REMEMBERED = 20
"""Windows whose sampling times are looked at."""
LATELY = 3
"""Of them the last, half of which decide that the machine has become slow."""


@dataclass(frozen=True)
class Health:
    """How a player keeps up."""

    shown: int
    """Frames handed out."""
    late: int
    """Of them more than `LATE` after their time."""
    worst: float
    """Seconds of the worst of these delays."""
    ahead: float
    """Seconds from now behind which frames can still be changed: what a command waits for, up to a frame."""
    dropped: int
    """Commands that were thrown away because too many came."""
    times: float
    """Frames are computed so many times faster than they are shown; 0 before the first."""
    rate: float = 1.0
    """How fast frames are shown: 1 as a person moves, less where the machine computes them more slowly than that."""
    problem: str = ""
    """In words, where the machine is too slow."""


def first_of(frames: Frame | tuple[Frame, Frame]) -> Frame:
    """The frame of the only person, or of the first of two: both have one number and one time."""
    return frames if isinstance(frames, Frame) else frames[0]


class Pace:
    """When frames are due: the first at once, each other one so long after the one before as they are apart, at the
    rate at which they are shown; a late one delays all behind it."""

    def __init__(self, now: Callable[[], float], rate: Callable[[], float] = lambda: 1.0) -> None:
        """rate: gives how fast motion is shown, 1 as it moves (`Health.rate`)."""
        self._now, self._rate = now, rate
        self._last: tuple[float, float] | None = None
        """Time of the frame that was shown last, and when it was."""

    def until(self, frame: Frame) -> float:
        """Seconds until a frame is due, 0 where it is late."""
        return max(0.0, self._due(frame) - self._now())

    def late(self, frame: Frame) -> float:
        """Seconds that a frame comes after its time; called once, when it is shown."""
        due = self._due(frame)
        late = max(0.0, self._now() - due)
        self._last = frame.time, due + (late if late > LATE else 0.0)  # the clock waits: what follows is not rushed
        return late

    def _due(self, frame: Frame) -> float:
        if self._last is None:
            return self._now()
        time, moment = self._last
        return moment + (frame.time - time) / self._rate()


@dataclass(frozen=True, eq=False)
class _Ready(Generic[Frames]):
    """A frame in the buffer."""

    mark: Mark
    """Before it was computed."""
    frames: Frames
    commands: list[FrameCommand]


class _GivenUp(Exception):
    """A window that is not needed any more."""


class Player(Generic[Frames]):
    """Plays one `Live` or `LivePair` against the time. Commands come from any thread; frames are taken by one."""

    def __init__(self, live: Stage[Frames], *, now: Callable[[], float] = time.monotonic) -> None:
        self._live, self._now = live, now
        self._inbox: deque[tuple[Command, int]] = deque()
        self._buffer: deque[_Ready[Frames]] = deque()
        self._next, self._due = live.number, now()  # the frame that is taken next, and when, as far as one knows
        self._log: deque[FrameCommand] = deque(maxlen=LOGGED)
        self._changed = threading.Condition()
        self._stopped, self._error = False, None
        self._soonest = 0  # frame at 20 per second from which on a command is followed
        self._calm = False  # whether a window is being sampled without a command
        self._lead, self._length = 0.25, SHORTEST  # seconds that a window is expected to take; seconds of the buffer
        self._rest = live.settings.rest
        self._took: deque[float] = deque(maxlen=REMEMBERED)
        self._busy = 0.0
        self._health = Health(0, 0, 0.0, self._lead, 0, 0.0)
        self._thread = threading.Thread(target=self._plan, name="motionloom-live", daemon=True)

    def start(self) -> "Player[Frames]":
        """Begin to sample ahead, in a thread of its own."""
        self._thread.start()
        return self

    def __enter__(self) -> "Player[Frames]":
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        """End the planner; finished frames can still be taken."""
        with self._changed:
            self._stopped = True
            self._changed.notify_all()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join()

    @property
    def ended(self) -> bool:
        """Whether no more frames are computed."""
        return self._stopped

    def ask(self, command: Command, person: int | None = None) -> None:
        """Send a command that takes effect as soon as possible, as of `Stage.ask`."""
        parts = self._live.addressed(command, person)
        with self._changed:
            self._inbox.extend(parts)
            while len(self._inbox) > WAITING:
                self._inbox.popleft()
                self._health = replace(self._health, dropped=self._health.dropped + 1)
            self._changed.notify_all()

    @property
    def health(self) -> Health:
        """How it keeps up."""
        with self._changed:
            return self._health

    @property
    def taken(self) -> list[FrameCommand]:
        """The commands that the frames taken so far show, each with the first of these frames (`Stage.taken`)."""
        with self._changed:
            return list(self._log)

    def frames(self) -> Iterator[Frames]:
        """Frames, each at its time; without end, or until `stop`."""
        pace = Pace(self._now, lambda: self._health.rate)
        while (coming := self.coming()) is not None:
            time.sleep(pace.until(first_of(coming)))
            frames = self.take()
            assert frames is not None
            self.count_frame(pace.late(first_of(frames)))
            yield frames

    def coming(self, timeout: float | None = None) -> Frames | None:
        """The next frame as it is planned now, as soon as it is there; until it is taken it may be computed anew. None
        after ``timeout`` seconds or at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._buffer or self._stopped or self._error, timeout)
            if not self._buffer and self._error is not None:
                raise self._error
            return self._buffer[0].frames if self._buffer else None

    def take(self, timeout: float | None = None) -> Frames | None:
        """The next frame as soon as it is there, whatever the time, which is fixed from now on; None after ``timeout``
        seconds or at the end. Who shows frames at their times takes each when it is due, so that commands do not wait.
        """
        with self._changed:
            if self.coming(timeout) is None:
                return None
            ready = self._buffer.popleft()
            self._next, self._due = self._next + 1, self._now() + 1 / (self._live.fps * self._health.rate)
            self._log += ready.commands
            self._changed.notify_all()
            return ready.frames

    def count_frame(self, late: float) -> None:
        """Count a frame that was shown, so many seconds after its time."""
        with self._changed:
            old = self._health
            self._health = replace(old, shown=old.shown + 1, late=old.late + (late > LATE), worst=max(old.worst, late))

    # The planner, in a thread of its own

    def _plan(self) -> None:
        try:
            with watching(self._look):
                while self._step():
                    pass
        except _GivenUp:
            pass
        except Exception as error:
            with self._changed:
                self._error, self._stopped = error, True
                self._changed.notify_all()

    def _step(self) -> bool:
        """Do what is to be done next, and wait for it; False at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._stopped or self._task() is not None)
            task = self._task()
        if self._stopped or task is None:
            return False
        task()
        return True

    def _task(self) -> Callable[[], None] | None:
        """What there is to do, the most urgent first."""
        room = len(self._buffer) < max(2, round(self._length * self._live.fps))
        if room and self._live.planned:
            return self._extend
        if self._inbox:
            mark = self._place() or self._live.mark()
            if self._takes(mark):
                return partial(self._follow, mark)
        return self._extend if room else None

    def _place(self) -> Mark | None:
        """The first frame of the buffer from which on a command can be followed: a window is ready before it is
        due, and the command before is not too near."""
        wait = self._lead - max(0.0, self._due - self._now())
        first = max(0, ceil(wait * self._live.fps * self._health.rate - 1e-6))
        marks = (ready.mark for ready in islice(self._buffer, first, None))
        return next((mark for mark in marks if self._takes(mark)), None)

    def _takes(self, mark: Mark) -> bool:
        return mark.next >= self._soonest and self._live.takes(mark)

    def _look(self, _: object) -> None:
        """Between two network calls: give the window up where something else is to be done."""
        with self._changed:
            if self._stopped or (self._calm and self._inbox and self._place() is not None):
                raise _GivenUp

    def _extend(self) -> None:
        """One frame more for the buffer."""
        begun, mark, window = self._now(), self._live.mark(), self._live.window
        self._calm = True
        try:
            ready = self._next_ready()
        except _GivenUp:
            self._live.back(mark)
            ready = None
        self._calm = False
        took = self._now() - begun
        with self._changed:
            self._busy += took
            if ready is not None:
                self._buffer.append(ready)
            if self._live.window != window:
                self._fit(took)
            self._changed.notify_all()

    def _next_ready(self) -> _Ready[Frames]:
        mark, frames = self._live.mark(), next(self._live)
        return _Ready(mark, frames, self._live.fresh)

    def _follow(self, mark: Mark) -> None:
        """Take up the commands from a frame of the buffer on, or behind its last one."""
        begun, live, ready = self._now(), self._live, []
        with self._changed:
            commands = list(self._inbox)
            self._inbox.clear()
        undo = live.back(mark)
        for command, person in commands:
            live.ask(command, person)
        while live.window == mark.window:
            ready.append(self._next_ready())
        took = self._now() - begun
        with self._changed:
            self._busy += took
            if self._next > mark.frame:  # it was shown meanwhile
                live.forth(undo)
                self._inbox.extendleft(reversed(commands))
                self._fit(took, least=took)
            else:
                while self._buffer and self._buffer[-1].mark.frame >= mark.frame:
                    self._buffer.pop()
                self._buffer.extend(ready)
                self._soonest = live.window + self._rest
                self._fit(took)
            self._changed.notify_all()

    def _fit(self, took: float, least: float = 0.0) -> None:
        """How far ahead frames are kept, and how often windows are sampled, for how long these take; the next one is
        expected to take ``least`` at least."""
        self._took.append(took)
        longest, usual = max(self._took), sorted(self._took)[int(USUAL * (len(self._took) - 1))]
        self._lead = SPARE * max(usual, least)
        self._length = min(max(WINDOWS * longest, SHORTEST), LONGEST)
        self._rest = self._live.stretch(1.25 * longest)
        times = self._live.number / self._live.fps / max(self._busy, 1e-9)
        lately = median_low([*self._took][-LATELY:])
        lasts = self._live.settings.used / FPS
        rate = max(SLOWEST, min(1.0, lasts / (SLOWER * max(usual, lately))))
        self._health = replace(
            self._health, ahead=self._lead, times=times, rate=rate, problem=self._problem(longest, rate)
        )

    def _problem(self, longest: float, rate: float) -> str:
        if self._lead <= SLOW:
            return ""
        sentence = (
            f"this machine takes {longest:.2f} s for a window of motion: what is asked is followed every "
            f"{self._rest / (FPS * rate):.2f} s and {self._lead:.2f} s late"
        )
        return sentence if rate == 1 else f"{sentence}, and all is shown at {rate:.2f} of its speed"
