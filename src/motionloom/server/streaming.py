"""Server-sent events of a job: its log, from the event that the client saw last, as fast as the client reads."""

import asyncio
import base64
import contextlib
import json
from collections.abc import AsyncIterator
from typing import Any

from motionloom.server.jobs import FINAL, Event, Job

BEAT = 15.0
"""Seconds after which a silent stream says that it is still there."""


async def events(job: Job, after: int) -> AsyncIterator[bytes]:
    """The job's events behind number ``after``, until its end."""
    loop, woken = asyncio.get_running_loop(), asyncio.Event()
    stop = job.listen(lambda: _wake(loop, woken))
    try:
        yield b"retry: 1000\n\n"
        while True:
            woken.clear()
            for event in job.events_after(after):
                if event.kind == "level" and not job.holds(event):
                    continue  # it left the log while a slow client was reading others
                after = event.number
                yield encoded(job, event)
                if event.kind in FINAL:
                    return
            try:
                await asyncio.wait_for(woken.wait(), BEAT)
            except TimeoutError:
                yield b": still there\n\n"
    finally:
        stop()


def encoded(job: Job, event: Event) -> bytes:
    """One event as the stream has it."""
    data: dict[str, Any] = job.public() if event.kind in FINAL else event.data
    if event.poses is not None:
        data = data | {"positions": base64.b64encode(event.poses.tobytes()).decode()}
    return f"id: {event.number}\nevent: {event.kind}\ndata: {json.dumps(data)}\n\n".encode()


def _wake(loop: asyncio.AbstractEventLoop, woken: asyncio.Event) -> None:
    with contextlib.suppress(RuntimeError):  # the server is going down
        loop.call_soon_threadsafe(woken.set)
