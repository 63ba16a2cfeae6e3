"""Server-sent events of a job: its log, from the event that the client saw last, as fast as the client reads."""

import asyncio
import contextlib
from collections.abc import AsyncIterator

from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from motionloom.server.jobs import FINAL, Job
from motionloom.server.refusal import Refusal

BEAT = 15.0
"""Seconds after which a silent stream says that it is still there."""


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
    loop, woken = asyncio.get_running_loop(), asyncio.Event()
    stop = job.listen(lambda: _wake(loop, woken))
    try:
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
    finally:
        stop()


def _wake(loop: asyncio.AbstractEventLoop, woken: asyncio.Event) -> None:
    with contextlib.suppress(RuntimeError):  # the server is going down
        loop.call_soon_threadsafe(woken.set)
