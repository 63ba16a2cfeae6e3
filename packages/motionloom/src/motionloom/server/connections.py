"""Connections that say nothing, or take nothing: how long they are waited for, and who makes room for others.

A connection waits while no request of it is being answered. Waiting costs nothing but a place, and anybody can do it
without a token: so those that have waited longest are closed when places run short, and every one of them after
`Limits.header_seconds`. Whoever asks is never turned away for those who only wait; how many are answered at the same
time is the `Guard`'s.
"""

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

from motionloom.server.limits import Limits
from motionloom.server.policy import HEADERS


class Connection(H11Protocol):
    """One connection, with uvicorn's own protocol behind it."""

    def __init__(self, *arguments: Any, limits: Limits, waiting: "dict[Connection, None]", **named: Any) -> None:
        """waiting: the connections of this server that wait, oldest first; each puts itself in and out."""
        super().__init__(*arguments, **named)
        self._limits, self._waiting = limits, waiting
        self._patience: asyncio.TimerHandle | None = None
        """Until headers must have arrived."""
        self._stuck: asyncio.TimerHandle | None = None
        """Until the client must have taken some of what it was sent."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        if len(self.connections) > self._limits.connections and self._waiting:
            next(iter(self._waiting)).close()
        self._wait()  # not before: where all others are being answered, it would make room for itself

    def connection_lost(self, exc: Exception | None) -> None:
        self._leave()
        self._stop_waiting()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._look()

    def handle_websocket_upgrade(self, event: Any) -> None:
        self._leave()
        super().handle_websocket_upgrade(event)

    def on_response_complete(self) -> None:
        self._wait()
        super().on_response_complete()  # which may take up a request that has come meanwhile
        self._look()
        if self.transport.is_closing():
            self._watch()

    def timeout_keep_alive_handler(self) -> None:
        super().timeout_keep_alive_handler()
        self._watch()

    def pause_writing(self) -> None:
        super().pause_writing()
        self._watch()

    def resume_writing(self) -> None:
        self._stop_waiting()
        super().resume_writing()
        if self.transport.is_closing():
            self._watch()

    def send_400_response(self, msg: str) -> None:
        """As uvicorn's, with the headers of every other answer."""
        lines = [f"{name}: {value}" for name, value in [*HEADERS, ("Content-Type", "text/plain; charset=utf-8")]]
        head = "\r\n".join(["HTTP/1.1 400 Bad Request", *lines, f"Content-Length: {len(msg)}", "Connection: close"])
        self.transport.write(f"{head}\r\n\r\n{msg}".encode("ascii"))
        self.close()

    def close(self) -> None:
        """End the connection, also where the client takes nothing of what is left."""
        self._leave()
        self.transport.close()
        self._watch()

    def _look(self) -> None:
        if self.cycle is not None and not self.cycle.response_complete:
            self._leave()

    def _wait(self) -> None:
        if self not in self._waiting:
            self._waiting[self] = None
            self._patience = self.loop.call_later(self._limits.header_seconds, self.close)

    def _leave(self) -> None:
        self._waiting.pop(self, None)
        if self._patience is not None:
            self._patience.cancel()
            self._patience = None

    def _watch(self) -> None:
        if self._stuck is None:
            self._stuck = self.loop.call_later(self._limits.stuck_seconds, self.transport.abort)

    def _stop_waiting(self) -> None:
        if self._stuck is not None:
            self._stuck.cancel()
            self._stuck = None
