"""A live session through the server's own door."""

import json

import pytest

from tests.server.serving import Server

SKIP = "needs the extra 'studio': pip install 'motionloom[studio]'"
client = pytest.importorskip("websockets.sync.client", reason=SKIP)


def _address(server: Server) -> str:
    return f"ws://127.0.0.1:{server.port}/live"


def test_a_live_session_plays_frames_in_order_and_obeys(server: Server) -> None:
    with client.connect(_address(server)) as socket:
        socket.send(json.dumps({"type": "hello", "seed": 1}))
        assert json.loads(socket.recv(60))["type"] == "welcome"
        socket.send(json.dumps({"type": "say", "text": "a person walks"}))
        frames = [m["frame"] for m in (json.loads(socket.recv(60)) for _ in range(30)) if m["type"] == "frame"]
    assert frames == list(range(frames[0], frames[0] + len(frames)))
    assert len(frames) >= 25


def test_pages_of_other_sites_steer_nobody_here(server: Server) -> None:
    from websockets.exceptions import InvalidHandshake

    with pytest.raises(InvalidHandshake), client.connect(_address(server), origin="https://elsewhere.example"):
        pass
