"""Starting the server: the project folder, the door, the worker and uvicorn around them."""

import asyncio
import secrets
import socket
import sys
import threading
import webbrowser
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import uvicorn
import websockets  # noqa: F401  uvicorn does without, and answers live sessions with 404 then
from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocket

from motionloom.core.errors import MotionloomError
from motionloom.goals.adapters import Applied
from motionloom.server import page
from motionloom.server.app import build
from motionloom.server.connections import Connection
from motionloom.server.guard import door, is_loopback
from motionloom.server.limits import Limits
from motionloom.server.policy import HEADERS
from motionloom.server.project import Project
from motionloom.server.refusal import Refusal
from motionloom.server.worker import Worker

if TYPE_CHECKING:
    from motionloom.core.models.prior import Prior
    from motionloom.live.sessions import Sessions
    from motionloom.robots.body import Robot


@dataclass(frozen=True)
class Options:
    """How a server is started."""

    project: Path
    host: str = "127.0.0.1"
    port: int = 8020
    token: str | None = None
    hosts: Sequence[str] = ()
    origins: Sequence[str] = ()
    weights: str = "default"
    device: str = "cpu"
    adapters: Sequence[Applied] = ()
    """What was taught from clips, merged into the prior."""
    robots: Sequence[Path] = ()
    """Models of robots that live sessions may name, by their files' names."""
    show: bool = False
    """Open the page in a browser."""


def serve(options: Options, *, limits: Limits | None = None) -> None:
    """Serve until a signal ends it; raises `MotionloomError` for an address or folder that cannot be had."""
    token = options.token
    if token is None and not is_loopback(options.host):
        token = secrets.token_urlsafe(24)
    if token is not None and (len(token) < 8 or not token.isascii() or not token.isprintable()):
        raise MotionloomError("a token has at least 8 printable letters or digits; leave --token out to get one made")
    limits = limits or Limits()
    robots = read_robots(options.robots)
    bound = _bound(options.host, options.port)  # before anything is written: who is refused leaves no folder
    project = Project(options.project, limits)
    worker = Worker(project, limits, weights=options.weights, device=options.device, adapters=options.adapters)
    known = door(options.host, token, hosts=options.hosts, origins=options.origins, page=page.files())
    live = _Live(worker, robots)
    app = build(project, worker, known, more=[WebSocketRoute("/live", live.answer)])
    host = f"[{options.host}]" if ":" in options.host else options.host
    address = f"http://{host}:{bound.getsockname()[1]}/" + (f"?token={token}" if token else "")
    print(f"motionloom: {address} (project: {project.folder})", file=sys.stderr, flush=True)
    if options.show and page.files():
        threading.Timer(0.3, webbrowser.open, [address]).start()
    elif options.show:
        print(f"motionloom: {page.MISSING}", file=sys.stderr, flush=True)
    config = uvicorn.Config(
        app,
        http=partial(Connection, limits=limits, waiting={}),  # type: ignore[arg-type]
        headers=HEADERS,
        log_level="warning",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=2,
        ws_max_size=1 << 18,
        ws_max_queue=16,
    )
    try:
        uvicorn.Server(config).run(sockets=[bound])
    finally:
        live.close()


def read_robots(models: Sequence[Path]) -> "dict[str, Robot]":
    """Robots by the names of their files; what a model lacks is reported."""
    if not models:
        return {}
    from motionloom.robots.body import read_robot

    robots = {}
    for path in models:
        if path.stem in robots:
            raise MotionloomError(f"two robots are called {path.stem}; give their files names of their own")
        robots[path.stem] = read_robot(path)
        for note in robots[path.stem].remarks():
            print(f"note: {note}", file=sys.stderr)
    return robots


class _Live:
    """A person who is steered while they move (docs/live.md), behind the same door as everything else.

    Live sessions need the sampler, whose import takes longer than all the rest of a server's start. So they are created
    for the first client; the worker's thread imports it meanwhile, while the page is answered already.
    """

    def __init__(self, worker: Worker, robots: "Mapping[str, Robot]") -> None:
        self._robots = robots
        self._worker, self._sessions, self._lock = worker, None, threading.Lock()

    async def answer(self, websocket: WebSocket) -> None:
        """Serve one client."""
        serve_one, sessions = await asyncio.to_thread(self._open_sessions)
        await serve_one(websocket, sessions)

    def close(self) -> None:
        """End all sessions."""
        with self._lock:
            if self._sessions is not None:
                self._sessions.close()

    def _open_sessions(self) -> "tuple[Callable[[WebSocket, Sessions], Awaitable[None]], Sessions]":
        from motionloom.live.sessions import Sessions
        from motionloom.live.socket import live_session

        with self._lock:
            self._sessions = self._sessions or Sessions(self._prior, robots=self._robots)
            return live_session, self._sessions

    def _prior(self) -> "Prior":
        try:
            return self._worker.prior()
        except Refusal as refusal:
            raise MotionloomError(refusal.sentence) from None


def _bound(host: str, port: int) -> socket.socket:
    try:
        family, kind, protocol, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listener = socket.socket(family, kind, protocol)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(place)
        listener.listen(128)  # later connections wait until the application is up
    except (OSError, OverflowError) as error:
        problem = getattr(error, "strerror", None) or error
        raise MotionloomError(
            f"cannot serve at {host}, port {port}: {problem}; name another --port or --host"
        ) from None
    return listener
