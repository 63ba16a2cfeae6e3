"""Jobs: what was asked, how far it is, what came of it, and the log that event streams are read from.

A `Job` is written by the worker's thread and read by the server's; what changes lies behind its lock. Nobody waits for
readers: a stream that is slow finds fewer levels in the log, never a longer one.
"""

import secrets
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from motionloom.server.asking import Request

FINAL = ("done", "failed", "cancelled")


@dataclass(frozen=True, eq=False)
class Event:
    """One entry of a job's log."""

    number: int
    """Rises within a job; the ``id`` of server-sent events."""
    kind: str
    """``progress``, ``level``, or one of `FINAL`."""
    data: dict[str, Any]
    poses: np.ndarray | None = None
    """Of a level: (people, frames, 22, 3) float32 metres."""


@dataclass(eq=False)
class Job:
    """One job of one client."""

    request: Request
    client: str
    most_bytes: int
    """Of poses in the log."""
    id: str = field(default_factory=lambda: secrets.token_hex(8))
    state: str = "queued"
    done: int = 0
    of: int = 0
    error: str | None = None
    results: list[dict[str, Any]] = field(default_factory=list)
    log_bytes: int = 0
    _number: int = 0
    _progress: Event | None = None
    _final: Event | None = None
    _levels: deque[Event] = field(default_factory=deque)
    _listeners: set[Callable[[], None]] = field(default_factory=set)
    _lock: threading.RLock = field(default_factory=threading.RLock)

    @property
    def finished(self) -> bool:
        """Whether nothing more will come of it."""
        return self.state in FINAL

    def public(self) -> dict[str, Any]:
        """The job as clients see it."""
        with self._lock:
            share = 1.0 if self.state == "done" else self.done / self.of if self.of else 0.0
            return {
                "id": self.id, "task": self.request.task, "state": self.state, "progress": round(min(share, 1.0), 4),
                "error": self.error, "results": list(self.results),
            }  # fmt: skip

    # -- what the worker reports

    def started(self) -> bool:
        """Take the job up; False if it was cancelled before."""
        with self._lock:
            if self.finished:
                return False
            self.state = "running"
            return True

    def progress(self, done: int, of: int) -> None:
        """So many network calls of so many are made."""
        with self._lock:
            self.done, self.of = done, of
            self._progress = self._event("progress", {"done": done, "of": of})
        self._tell()

    def level(self, level: int, of: int, row: int, poses: np.ndarray, begin: float = 0.0) -> None:
        """What the network predicts for a motion: poses (people, frames, 22, 3) from its second ``begin`` on."""
        people, frames = poses.shape[:2]
        about = {"level": level, "of": of, "row": row, "people": people, "frames": frames, "begin": round(begin, 4)}
        with self._lock:
            self._levels.append(self._event("level", about, poses.astype("<f4")))
            self.log_bytes += people * frames * 22 * 12
            while self.log_bytes > self.most_bytes and self._levels:
                self._drop()
        self._tell()

    def add_result(self, result: dict[str, Any]) -> None:
        """One motion more is finished and kept."""
        with self._lock:
            if not self.finished:
                self.results.append(result)

    def end(self, state: str, error: str | None = None) -> bool:
        """The last thing that happens to a job; False if it had ended before."""
        with self._lock:
            if self.finished:
                return False
            self.state, self.error = state, error
            self._final = self._event(state, {})
        self._tell()
        return True

    # -- what streams read

    def events_after(self, number: int) -> list[Event]:
        """What is in the log behind an event's number: levels, the latest progress, the end."""
        with self._lock:
            kept = [*self._levels, *(event for event in (self._progress, self._final) if event is not None)]
            return sorted((event for event in kept if event.number > number), key=lambda event: event.number)

    def holds(self, event: Event) -> bool:
        """Whether a level is still in the log."""
        with self._lock:
            return bool(self._levels) and self._levels[0].number <= event.number

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call ``listener``, in any thread, whenever something happens; gives what ends that."""
        with self._lock:
            self._listeners.add(listener)
        return lambda: self._listeners.discard(listener)

    def wait(self) -> None:
        """Block until the job has ended."""
        ended = threading.Event()
        stop = self.listen(ended.set)
        while not self.finished:
            ended.wait()
            ended.clear()
        stop()

    def forget_levels(self) -> None:
        """Drop the poses of the log."""
        with self._lock:
            self._levels.clear()
            self.log_bytes = 0

    def _drop(self) -> None:
        event = self._levels.popleft()
        self.log_bytes -= event.poses.nbytes if event.poses is not None else 0

    def _event(self, kind: str, data: dict[str, Any], poses: np.ndarray | None = None) -> Event:
        self._number += 1
        return Event(self._number, kind, data, poses)

    def _tell(self) -> None:
        with self._lock:
            listeners = tuple(self._listeners)
        for listener in listeners:
            listener()
