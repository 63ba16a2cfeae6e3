"""A live session over a WebSocket: messages in, poses out, for any ASGI server (docs/live.md).

Two coroutines to a connection: one reads the client's messages, no faster than `RATE`, so that a flood waits in the
client's own socket; one sends poses at their times, and stops while the client does not take them. Neither keeps more
than the player's bounded queues do.
"""

import asyncio
import json
import time
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, Protocol

from motionloom.core.errors import MotionloomError, one_line
from motionloom.live import messages
from motionloom.live.clock import Pace, first_of
from motionloom.live.commands import from_json, person_of
from motionloom.live.sessions import Session, Sessions

RATE, BURST = 200.0, 100.0
"""Messages per second that are read of one client, and how many at once after a rest."""
MOST_WRONG = 50
"""Wrong messages, each cancelled by ten right ones, after which a client is sent away."""
FIRST = 10.0
"""Seconds in which a client must say hello."""
STUCK = 30.0
"""Seconds after which a client that takes nothing is gone."""
LOOK = 0.004
"""Seconds between two looks for a frame that is late."""
EVERY = 2.0
"""Seconds between two reports of how the server keeps up."""
GOODBYE, NOT_ALLOWED, TRY_LATER = 1000, 1008, 1013


class Socket(Protocol):
    """What is used of a WebSocket, as Starlette has it."""

    async def accept(self) -> None: ...
    async def receive(self) -> Mapping[str, Any]: ...
    async def send_text(self, data: str) -> None: ...
    async def close(self, code: int = 1000, reason: str | None = None) -> None: ...


class Gone(Exception):
    """The client is not there any more."""


async def live_session(websocket: Socket, sessions: Sessions) -> None:
    """Serve one client until it leaves; a client that comes back within `sessions.WAIT` goes on where it was."""
    await websocket.accept()
    session: Session | None = None
    try:
        async with asyncio.timeout(FIRST):
            first = await _text(websocket)
        hello = messages.hello(messages.read(first))
        session = await asyncio.to_thread(sessions.begin, hello)
        await _send(websocket, messages.welcome(session.begun, session.key, session.number, session.hinges))
        await _both(_listen(websocket, session), _play(websocket, session))
        await asyncio.to_thread(sessions.end, session)
        session = None
        await _close(websocket, GOODBYE)
    except (MotionloomError, TimeoutError) as error:
        sentence = str(error) or "nothing was said in time"
        with suppress(Gone):
            await _send(websocket, {"type": "error", "message": one_line(sentence)[:300], "last": True})
        code = TRY_LATER if "come back later" in sentence else NOT_ALLOWED
        await _close(websocket, code, one_line(sentence)[:100])
    except Gone:
        pass
    finally:
        if session is not None:
            sessions.leave(session)


async def _both(first: Any, second: Any) -> None:
    """Until one of two coroutines ends; the other is ended with it, and an error of either is raised."""
    tasks = [asyncio.ensure_future(first), asyncio.ensure_future(second)]
    try:
        ended, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in ended:
            task.result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _listen(websocket: Socket, session: Session) -> None:
    """Take commands until the client says bye; raises MotionloomError where it sends too much that is wrong."""
    room, wrong, last = BURST, 0.0, time.monotonic()
    while True:
        text = await _text(websocket)
        now = time.monotonic()
        room, last = min(BURST, room + (now - last) * RATE) - 1.0, now
        if room < 0:
            await asyncio.sleep(-room / RATE)
        try:
            if not await _followed(websocket, session, messages.read(text)):
                return
            wrong = max(0.0, wrong - 0.1)
        except MotionloomError as error:
            wrong += 1
            if wrong > MOST_WRONG:
                raise MotionloomError("too much of what was said is wrong") from None
            await _send(websocket, {"type": "error", "message": one_line(str(error))[:300]})


async def _followed(websocket: Socket, session: Session, message: Mapping[str, Any]) -> bool:
    """Follow one message; False where it ends the session."""
    kind = message["type"]
    if kind == "bye":
        return False
    if kind == "ping":
        await _send(websocket, {"type": "pong", "id": str(message.get("id", ""))[:100], "frame": session.number})
    elif kind == "record":
        await _send(websocket, messages.recorded(session.begun, session.player.taken, session.number))
    else:
        session.player.ask(from_json(message), person_of(message))
    return True


async def _play(websocket: Socket, session: Session) -> None:
    player = session.player
    pace, reported = Pace(time.monotonic, lambda: player.health.rate), time.monotonic()
    while True:
        while (poses := session.pending or player.coming(timeout=0.0)) is None:
            if player.ended:
                raise MotionloomError("the live session ended")
            await asyncio.sleep(LOOK)
        await asyncio.sleep(pace.until(first_of(poses)))
        # what was taken is kept until it is sent: the client may go in between
        if session.pending is None:
            session.pending = poses = player.take() or poses
            session.angles = await asyncio.to_thread(session.follow, poses) if session.robots else []
        frame = first_of(poses)
        late = pace.late(frame)
        player.count_frame(late)
        await _send(websocket, messages.frame(poses, late, session.angles))
        session.number, session.pending = frame.number + 1, None
        if time.monotonic() - reported > EVERY:
            reported = time.monotonic()
            await _send(websocket, messages.health(player.health))


async def _text(websocket: Socket) -> str | bytes:
    """The next message, as text or bytes; `Gone` where there is none."""
    try:
        message = await websocket.receive()
    except Exception as error:  # every server has its own for a client that is gone
        raise Gone from error
    if message["type"] != "websocket.receive":
        raise Gone
    text = message.get("text")
    return text if text is not None else message.get("bytes") or b""


async def _send(websocket: Socket, message: Mapping[str, Any]) -> None:
    """Send one message; `Gone` where nobody takes it."""
    text = json.dumps(message, separators=(",", ":"))
    try:
        async with asyncio.timeout(STUCK):
            await websocket.send_text(text)
    except Exception as error:
        raise Gone from error


async def _close(websocket: Socket, code: int, reason: str | None = None) -> None:
    with suppress(Exception):  # it may be closed
        await websocket.close(code, reason)
