"""Jobs: the request, how far it is, what came of it, and the log that event streams are read from.

A `Job` is written by the worker's thread and read by the server's; what changes lies behind its lock. An event is
written out once, by the thread in which it happens, and every stream sends the same bytes. Nobody waits for readers: a
stream that is slow finds fewer levels in the log, never a longer one, and holds one event at a time.
"""

import asyncio
import base64
import json
import secrets
import threading
from bisect import bisect_right
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from motionloom.goals.remarks import Remark
from motionloom.server.job_request import JobRequest
from motionloom.server.refusal import Refusal

FINAL = ("done", "failed", "cancelled")


@dataclass(frozen=True, eq=False)
class Event:
    """One entry of a job's log."""

    number: int
    """Rises within a job; the ``id`` of server-sent events."""
    kind: str
    """``progress``, ``level``, or one of `FINAL`."""
    text: bytes
    """As it is sent."""


@dataclass(eq=False)
class Job:
    """One job of one client."""

    request: JobRequest
    client: str
    most_bytes: int
    """Of levels in the log."""
    id: str = field(default_factory=lambda: secrets.token_hex(8))
    state: str = "queued"
    calls: int = 0
    of: int = 0
    status: int | None = None
    """The HTTP status that an error of a request has for the same reason, such as 507 for a full disk."""
    error: str | None = None
    remarks: list[Remark] = field(default_factory=list)
    """Remarks on its words."""
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
            share = 1.0 if self.state == "done" else self.calls / max(self.of, 1)
            return {
                "id": self.id,
                "task": self.request.task,
                "state": self.state,
                "progress": round(min(share, 1.0), 4),
                "status": self.status,
                "error": self.error,
                "remarks": [one.line for one in self.remarks],
                "notes": [asdict(one) for one in self.remarks],
                "results": list(self.results),
            }

    # -- what the worker reports

    def started(self) -> bool:
        """Take the job up; False if it was cancelled before."""
        with self._lock:
            if self.finished:
                return False
            self.state = "running"
            return True

    def progress(self, calls: int, of: int) -> None:
        """So many network calls of so many are finished."""
        with self._lock:
            self.calls, self.of = calls, of
            self._progress = self._event("progress", json.dumps({"done": calls, "of": of}))
        self._tell()

    def level(self, level: int, of: int, row: int, poses: np.ndarray, begin: float = 0.0) -> None:
        """What the network predicts for a motion: poses (people, frames, 22, 3) from its second ``begin`` on."""
        people, frames = poses.shape[:2]
        about = {"level": level, "of": of, "row": row, "people": people, "frames": frames, "begin": round(begin, 4)}
        about["positions"] = base64.b64encode(poses.astype("<f4").tobytes()).decode()
        data = json.dumps(about)  # before the lock: streams wait for that
        with self._lock:
            event = self._event("level", data)
            self._levels.append(event)
            self.log_bytes += len(event.text)
            while self.log_bytes > self.most_bytes and self._levels:
                self.log_bytes -= len(self._levels.popleft().text)
        self._tell()

    def add_result(self, result: dict[str, Any]) -> None:
        """One motion more is finished and kept."""
        with self._lock:
            if not self.finished:
                self.results.append(result)

    def end(self, state: str, error: str | None = None, status: int | None = None) -> bool:
        """The last thing that happens to a job; False if it had ended before."""
        with self._lock:
            if self.finished:
                return False
            self.state, self.error, self.status = state, error, status
            self._final = self._event(state, json.dumps(self.public()))
        self._tell()
        return True

    # -- what streams read

    def event_after(self, number: int) -> Event | None:
        """The first event in the log behind an event's number: a level, the latest progress, or the end."""
        with self._lock:
            at = bisect_right(self._levels, number, key=lambda event: event.number)
            level = self._levels[at] if at < len(self._levels) else None
            candidates = (event for event in (level, self._progress, self._final) if event and event.number > number)
            return min(candidates, key=lambda event: event.number, default=None)

    @contextmanager
    def listening(self, listener: Callable[[], None]) -> Iterator[None]:
        """Within the block ``listener`` is called, in any thread, whenever something happens."""
        with self._lock:
            self._listeners.add(listener)
        try:
            yield
        finally:
            self._listeners.discard(listener)

    @contextmanager
    def news(self) -> Iterator[asyncio.Event]:
        """An event of the running loop that is set whenever something happens in the block."""
        loop, woken = asyncio.get_running_loop(), asyncio.Event()

        def wake() -> None:
            with suppress(RuntimeError):  # the server is going down
                loop.call_soon_threadsafe(woken.set)

        with self.listening(wake):
            yield woken

    def wait(self) -> None:
        """Block until the job has ended."""
        news = threading.Event()
        with self.listening(news.set):
            while not self.finished:
                news.wait()
                news.clear()

    async def ended(self) -> None:
        """The same for the running loop."""
        with self.news() as news:
            while not self.finished:
                await news.wait()
                news.clear()

    def forget_levels(self) -> None:
        """Drop the levels of the log."""
        with self._lock:
            self._levels.clear()
            self.log_bytes = 0

    def _event(self, kind: str, data: str) -> Event:
        self._number += 1
        text = f"id: {self._number}\nevent: {kind}\ndata: {data}\n\n"
        return Event(self._number, kind, text.encode())

    def _tell(self) -> None:
        with self._lock:
            listeners = tuple(self._listeners)
        for listener in listeners:
            listener()


BEAT = 15.0
"""Seconds after which a silent stream sends a sign of life."""


class Streams:
    """How many event streams are open, and how many may be."""

    def __init__(self, most: int) -> None:
        self.most, self.open = most, 0


class EventStream(StreamingResponse):
    """The answer that streams a job's events behind number ``after``; `Refusal` where too many are open."""

    def __init__(self, job: Job, after: int, streams: Streams) -> None:
        headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
        super().__init__(events(job, after), media_type="text/event-stream", headers=headers)
        self._streams = streams

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if self._streams.open >= self._streams.most:
            raise Refusal(503, f"{self._streams.most} event streams are open already; close some")
        self._streams.open += 1  # before anything is waited for, so that no burst passes the limit
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._streams.open -= 1


async def events(job: Job, after: int) -> AsyncIterator[bytes]:
    """The job's events behind number ``after``, until its end."""
    with job.news() as woken:
        yield b"retry: 1000\n\n"
        while True:
            woken.clear()
            while (event := job.event_after(after)) is not None:
                after = event.number
                yield event.text
                if event.kind in FINAL:
                    return
                await asyncio.sleep(0)  # a client that takes all it gets leaves others their turn
            try:
                await asyncio.wait_for(woken.wait(), BEAT)
            except TimeoutError:
                yield b": still there\n\n"
