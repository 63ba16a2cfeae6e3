"""A `Live` against the time: a thread that samples ahead, a bounded buffer, and frames that are handed out on time.

The buffer is as long as the longest window took lately, and half as much again, so that a command waits no
longer than it must; on a machine that is too slow it grows, windows follow each other less often, and `Health` says so.
When frames are late all the same the clock waits: what is shown never jumps.
"""

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Generic

from motionloom.live.commands import Command, Taken
from motionloom.live.live import Frame, Shown, Stage

SHORTEST, LONGEST = 0.1, 2.0
"""Seconds of frames that wait in the buffer, at least and at most."""
WAITING = 64
"""Commands that wait for the planner; of more the oldest are dropped."""
SLOW = 0.6
"""Seconds that a command waits from which on the machine is said to be too slow."""
LATE = 0.02
"""Seconds after its time from which on a frame counts as late."""
REMEMBERED = 20
"""Windows whose drawing times are looked at."""


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
    """Seconds of frames that the buffer holds when it is full: what a command waits for."""
    dropped: int
    """Commands that were thrown away because too many came."""
    times: float
    """Frames are made so many times faster than they are shown; 0 before the first."""
    problem: str = ""
    """In words, where the machine is too slow."""


def first_of(shown: Frame | tuple[Frame, Frame]) -> Frame:
    """The frame of the only person, or of the first of two: both have one number and one time."""
    return shown if isinstance(shown, Frame) else shown[0]


class Pace:
    """When frames are due: the first at once, the others at their times from there; a late one delays all behind it."""

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._begun: float | None = None

    def until(self, frame: Frame) -> float:
        """Seconds until a frame is due, 0 where it is late."""
        if self._begun is None:
            self._begun = self._now() - frame.time
        return max(0.0, self._begun + frame.time - self._now())

    def late(self, frame: Frame) -> float:
        """Seconds that a frame comes after its time; asked once, when it is shown."""
        assert self._begun is not None
        late = max(0.0, self._now() - self._begun - frame.time)
        if late > LATE:
            self._begun += late  # the clock waits, so that what follows is not rushed
        return late


class Player(Generic[Shown]):
    """Plays one `Live` or `LivePair` against the time. Commands come from any thread; frames are taken by one."""

    def __init__(self, live: Stage[Shown], *, now: Callable[[], float] = time.monotonic) -> None:
        self._live, self._now = live, now
        self._inbox: deque[tuple[Command, int]] = deque()
        self._buffer: deque[Shown] = deque()
        self._changed = threading.Condition()
        self._stopped, self._error = False, None
        self._ahead = 0.25
        self._took: deque[float] = deque(maxlen=REMEMBERED)
        self._busy = 0.0
        self._made = 0
        self._health = Health(0, 0, 0.0, self._ahead, 0, 0.0)
        self._thread = threading.Thread(target=self._plan, name="motionloom-live", daemon=True)

    def start(self) -> "Player[Shown]":
        """Begin to sample ahead, in a thread of its own."""
        self._thread.start()
        return self

    def __enter__(self) -> "Player[Shown]":
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        """End the planner; frames that were made can still be taken."""
        with self._changed:
            self._stopped = True
            self._changed.notify_all()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join()

    @property
    def ended(self) -> bool:
        """Whether no more frames are made."""
        return self._stopped

    def ask(self, command: Command, person: int | None = None) -> None:
        """Ask for something as soon as possible, as of `Stage.ask`."""
        parts = self._live.addressed(command, person)
        with self._changed:
            for part in parts:
                if len(self._inbox) >= WAITING:
                    self._inbox.popleft()
                    self._health = replace(self._health, dropped=self._health.dropped + 1)
                self._inbox.append(part)

    @property
    def health(self) -> Health:
        """How it keeps up."""
        with self._changed:
            return self._health

    @property
    def taken(self) -> list[Taken]:
        """What was asked, with the frames that it first changed (`Stage.taken`)."""
        return self._live.taken

    def frames(self) -> Iterator[Shown]:
        """Frames, each at its time; without end, or until `stop`."""
        pace = Pace(self._now)
        while (found := self.take()) is not None:
            frame = first_of(found)
            time.sleep(pace.until(frame))
            self.shown(pace.late(frame))
            yield found

    def take(self, timeout: float | None = None) -> Shown | None:
        """The next frame as soon as it is there, whatever the time; None after ``timeout`` seconds or at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._buffer or self._stopped or self._error, timeout)
            if not self._buffer:
                if self._error is not None:
                    raise self._error
                return None
            frame = self._buffer.popleft()
            self._changed.notify_all()
            return frame

    def shown(self, late: float) -> None:
        """Count a frame that was shown, so many seconds after its time."""
        with self._changed:
            old = self._health
            self._health = replace(old, shown=old.shown + 1, late=old.late + (late > LATE), worst=max(old.worst, late))

    def _plan(self) -> None:
        try:
            while self._make():
                pass
        except Exception as error:
            with self._changed:
                self._error, self._stopped = error, True
                self._changed.notify_all()

    def _make(self) -> bool:
        with self._changed:
            self._changed.wait_for(lambda: self._stopped or len(self._buffer) < self._room())
            if self._stopped:
                return False
            while self._inbox:
                self._live.ask(*self._inbox.popleft())
        begun, calls = self._now(), self._live.calls
        frame = next(self._live)
        took = self._now() - begun
        with self._changed:
            self._buffer.append(frame)
            self._made += 1
            self._busy += took
            if self._live.calls > calls:
                self._fit(took)
            self._changed.notify_all()
        return True

    def _room(self) -> int:
        return max(2, round(self._ahead * self._live.fps))

    def _fit(self, took: float) -> None:
        """The buffer for how long windows take, and how often they are sampled."""
        self._took.append(took)
        longest = max(self._took)
        self._ahead = min(max(1.5 * longest, SHORTEST), LONGEST)
        rest = self._live.stretch(1.25 * longest)
        times = self._made / self._live.fps / max(self._busy, 1e-9)
        problem = ""
        if self._ahead > SLOW:
            problem = (
                f"this machine takes {longest:.2f} s for a window of motion: what is asked is followed every "
                f"{rest / 20:.2f} s and {self._ahead:.2f} s late"
            )
        self._health = replace(self._health, ahead=self._ahead, times=times, problem=problem)
