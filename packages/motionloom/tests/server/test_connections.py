"""Connections that say nothing or take nothing: they are closed, and nobody who asks waits for them."""

import socket
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from time import sleep
from types import SimpleNamespace

import pytest

pytest.importorskip("starlette", reason="needs the extra 'studio'")
pytest.importorskip("uvicorn", reason="needs the extra 'studio'")

from motionloom.server.connections import Connection, H11Protocol
from motionloom.server.limits import Limits
from tests.server.serving import PATIENCE, Server, running

UNFINISHED = b"GET /health HTTP/1.1\r\nHost: 127.0.0.1\r\nX-a: "
TOKEN = "a-token-for-tests"


@contextmanager
def opened(server: Server, count: int, request: bytes) -> Iterator[list[socket.socket]]:
    """So many connections, of which each has said so much."""
    with ExitStack() as stack:
        sockets = []
        for _ in range(count):
            one = stack.enter_context(socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE))
            one.sendall(request)
            sockets.append(one)
        yield sockets


def answered(server: Server, request: bytes) -> bytes:
    """The status that a request gets; a moment passes first."""
    sleep(0.1)
    with opened(server, 1, request) as (one,):
        return one.recv(12)[9:]


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with a token and few places: 16 requests at once, of which 8 are left for who holds the token."""
    limits = {"connections": 16, "reserve": 8, "header_seconds": 2.0, "stuck_seconds": 2.0, "streams": 6}
    with running(tmp_path_factory.mktemp("project"), "--token", TOKEN, **limits) as instance:
        yield instance


def test_six_hundred_unfinished_requests_turn_nobody_away(server: Server) -> None:
    with opened(server, 600, UNFINISHED):
        assert server.json("GET", "/health")[0] == 200
        assert server.json("GET", "/capabilities")[0] == 200


@pytest.mark.parametrize("message", [b"", UNFINISHED, b"GET /health HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\nGET"])
def test_whoever_does_not_finish_a_request_is_closed(small: Server, message: bytes) -> None:
    with opened(small, 3, message) as connections:
        for one in connections:
            while one.recv(1 << 16):
                pass  # until the end, which comes though nothing more is said


def test_an_answer_that_nobody_takes_ends(small: Server) -> None:
    """Streams of a job that fill every buffer on their way; afterwards there is room for as many again."""
    header = {"Authorization": f"Bearer {TOKEN}"}
    fields = {"task": "generate", "prompt": "a person walks", "seconds": 30.0, "count": 8, "steps": 200}
    job = small.json("POST", "/jobs", fields, headers=header)[1]["id"]
    request = f"GET /jobs/{job}/events?token={TOKEN} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode()
    with opened(small, 6, request) as connections:
        for one in connections:
            assert one.recv(12) == b"HTTP/1.1 200"
        status, answer = small.json("GET", f"/jobs/{job}/events?token={TOKEN}")
        assert (status, "6 event streams are open" in answer["error"]) == (503, True)
        assert any(answered(small, request) == b"200" for _ in range(600)), "their places are free again"
    small.json("DELETE", f"/jobs/{job}", headers=header)


def test_a_burst_of_three_hundred_streams_gets_as_many_as_the_limit(server: Server) -> None:
    job = server.submit(task="generate", prompt="a person walks", seconds=10.0, count=8, steps=200)
    request = f"GET /jobs/{job}/events HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode()
    with opened(server, 300, request) as connections:
        answers = Counter(one.recv(12)[9:] for one in connections)
        status, answer = server.json("DELETE", f"/jobs/{job}")
    assert answers == {b"200": 128, b"503": 172}
    assert (status, answer["state"]) == (200, "cancelled")


def test_who_holds_the_token_is_answered_while_others_take_every_place_they_can(small: Server) -> None:
    """Files of the page need no token: strangers who ask for them and take nothing fill their own places only."""
    large = max(small_page(), key=lambda path: path.stat().st_size)
    if large.stat().st_size < 1 << 19:
        pytest.skip("the page is not built (make page)")
    request = f"GET /assets/{large.name} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode()
    with opened(small, 40, request):
        assert small.json("GET", "/capabilities", headers={"Authorization": f"Bearer {TOKEN}"})[0] == 200


def test_who_comes_when_all_others_are_being_answered_makes_no_room_for_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    closed: list[object] = []
    monkeypatch.setattr(H11Protocol, "connection_made", lambda self, transport: None)
    monkeypatch.setattr(Connection, "close", lambda self: closed.append(self))
    waiting: dict[object, None] = {}

    def comes() -> object:
        one = Connection.__new__(Connection)
        parts = {"_limits": Limits(connections=1), "_waiting": waiting, "_patience": None, "connections": {1, 2}}
        vars(one).update(parts, loop=SimpleNamespace(call_later=lambda *_: None))
        one.connection_made(None)
        return one

    first = comes()
    assert (closed, list(waiting)) == ([], [first])
    comes()
    assert closed == [first], "who waited before makes room"


def small_page() -> list[Path]:
    from motionloom.server.page import FOLDER

    return [path for path in FOLDER.glob("assets/*") if path.is_file()] or [Path(__file__)]
