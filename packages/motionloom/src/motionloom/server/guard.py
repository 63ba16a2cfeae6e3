"""Which requests are answered: by their Host and Origin, and the token. ASGI middleware in front of everything.

A page of another site can make a browser send requests to 127.0.0.1, and with a name that it lets point there (DNS
rebinding) even read the answers. So a server on the loopback answers to names of the loopback only, and no request that
another site's page sends is answered by any server.
"""

import hmac
import ipaddress
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import parse_qs, urlsplit

from motionloom.server.limits import Limits

LOOPBACK = ("localhost", "127.0.0.1", "::1")
OPEN = ("/health",)
"""Paths that need no token, beside those of the page's own files."""


@dataclass(frozen=True)
class Door:
    """What a request must have."""

    loopback: bool
    """The server is bound to the loopback."""
    token: str | None = None
    hosts: tuple[str, ...] = ()
    """Further names that the server has."""
    origins: tuple[str, ...] = ()
    """Further origins whose pages are answered, such as a development server's ``http://localhost:5173``."""
    page: frozenset[str] = frozenset()
    """Paths of the page's files, which anybody may read."""

    def problem(self, scope: dict[str, Any]) -> tuple[int, str] | None:
        """Status and sentence for a request that is not let in."""
        headers = _headers(scope)
        host = headers.get("host", "")
        if not self._known(host):
            return 403, (
                f"this server is not known as {host[:80]!r}; ask it as 127.0.0.1 or localhost, or start it with "
                "--allow-host NAME"
            )
        origin = headers.get("origin")
        if origin is not None and origin not in self.origins and urlsplit(origin).netloc.lower() != host.lower():
            return 403, f"pages of {origin[:80]!r} may not ask this server; start it with --allow-origin to let them"
        if origin is None and headers.get("sec-fetch-site") == "cross-site" and scope["path"] not in ("/", "/docs"):
            return 403, "a page of another site asked for this, and is not answered"
        if not self._open(scope) and not self.holds_token(scope):
            return 401, "this server wants its token: 'Authorization: Bearer TOKEN', or ?token=TOKEN"
        return None

    def _known(self, host: str) -> bool:
        try:
            name = (urlsplit(f"//{host}").hostname or "").lower()
        except ValueError:
            return False
        if name in (*LOOPBACK, *self.hosts):
            return True
        return not self.loopback and _is_address(name)

    def _open(self, scope: dict[str, Any]) -> bool:
        path, method = scope["path"], scope.get("method", "")
        return method in ("GET", "HEAD") and (path in OPEN or path in self.page)

    def holds_token(self, scope: dict[str, Any]) -> bool:
        """Whether a request comes with the token; where there is none, everybody has it."""
        if self.token is None:
            return True
        token = _headers(scope).get("authorization", "").removeprefix("Bearer ").strip()
        if not token:
            token = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token", [""])[0]
        return hmac.compare_digest(token.encode(), self.token.encode())


def _headers(scope: dict[str, Any]) -> dict[str, str]:
    return {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}


class Guard:
    """Answers for the application where `Door` finds a problem, and where too much is being answered already."""

    def __init__(self, app: Any, door: Door, limits: Limits) -> None:
        self.app, self.door, self.limits = app, door, limits
        self._answering = {True: 0, False: 0}
        """Requests that are being answered, of who holds the token and of who does not."""

    async def __call__(self, scope: dict[str, Any], receive: Any, send: Any) -> None:
        if scope["type"] not in ("http", "websocket"):
            return await self.app(scope, receive, send)
        holds = self.door.holds_token(scope)
        problem = self.door.problem(scope) or self._full(holds)
        if problem is None:
            self._answering[holds] += 1
            try:
                return await self.app(scope, receive, send)
            finally:
                self._answering[holds] -= 1
        if scope["type"] == "websocket":
            await receive()
            return await send({"type": "websocket.close", "code": 1008, "reason": problem[1][:120]})
        body = json.dumps({"error": _in_envelope(scope["path"], *problem)}).encode()
        headers = [(b"content-type", b"application/json"), (b"connection", b"close")]
        if problem[0] == 503:
            headers.append((b"retry-after", b"2"))
        await send({"type": "http.response.start", "status": problem[0], "headers": headers})
        await send({"type": "http.response.body", "body": body})

    def _full(self, holds: bool) -> tuple[int, str] | None:
        most = self.limits.connections
        if sum(self._answering.values()) < most and (holds or self._answering[False] < most - self.limits.reserve):
            return None
        return 503, "this server answers as many requests as it can already; try again in a moment"


def _in_envelope(path: str, status: int, sentence: str) -> Any:
    """The sentence, or MMCP's envelope of it where the request is one of MMCP."""
    if path != "/generate" and not path.startswith("/mmcp"):
        return sentence
    code = {401: "unauthorized", 503: "resource_exhausted"}.get(status, "forbidden")
    return {"code": code, "message": sentence, "details": {}}


def is_loopback(host: str) -> bool:
    """Whether an address to bind to is reached from this machine only."""
    return host == "localhost" or (_is_address(host) and ipaddress.ip_address(host).is_loopback)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def door(host: str, token: str | None, *, hosts: Sequence[str], origins: Sequence[str], page: Iterable[str]) -> Door:
    """The door of a server that is bound to ``host``."""
    named = () if _is_address(host) else (host.lower(),)
    known = (*named, *(name.lower() for name in hosts))
    return Door(is_loopback(host), token, known, tuple(origins), frozenset(page))
