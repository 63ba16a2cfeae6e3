"""A film of pictures that a client draws."""

import io
import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from PIL import Image, ImageSequence

from motionloom.core.errors import MotionloomError
from motionloom.server import films
from motionloom.server.films import read
from motionloom.viz.film import find_ffmpeg
from tests.server.serving import PATIENCE, Server

client = pytest.importorskip("websockets.sync.client", reason="needs the extra 'studio'")
exceptions = pytest.importorskip("websockets.exceptions")
SMALL = {"format": "gif", "width": 96, "height": 64, "fps": 20, "count": 5}


@contextmanager
def _open(server: Server, **fields: Any) -> Iterator[Any]:
    with client.connect(f"ws://127.0.0.1:{server.port}/film") as socket:
        socket.send(json.dumps(SMALL | fields))
        yield socket


def _hear(socket) -> dict[str, Any]:
    return json.loads(socket.recv(PATIENCE))


def _picture(number: int, size: tuple[int, int] = (96, 64)) -> bytes:
    """A bar that moves, as it is sent."""
    data, picture = io.BytesIO(), Image.new("RGB", size, "navy")
    picture.paste("white", (number * 8, 0, number * 8 + 4, 64))
    picture.save(data, "PNG")
    return len(data.getvalue()).to_bytes(4, "little") + data.getvalue()


def _left(server: Server) -> list[str]:
    return [path.name for path in server.project.rglob("*") if path.suffix in (".gif", ".mp4", ".part")]


def _filmed(server: Server, **fields: Any) -> bytes:
    """The file of five pictures, each in two pieces."""
    with _open(server, **fields) as socket:
        for number in range(5):
            assert _hear(socket) == {"done": number}
            data = _picture(number)
            socket.send(data[:50])
            socket.send(data[50:])
        size, data = _hear(socket)["size"], b""
        while len(data) < size:
            data += socket.recv(PATIENCE)
        with pytest.raises(exceptions.ConnectionClosed):  # behind which nothing is left to do
            socket.recv(PATIENCE)
    return data


def test_pictures_become_a_film(server: Server) -> None:
    film = Image.open(io.BytesIO(_filmed(server)))
    assert [one.info["duration"] for one in ImageSequence.Iterator(film)] == [50] * 5
    assert film.size == (96, 64)
    try:
        find_ffmpeg()
    except MotionloomError:
        pytest.skip("there is no ffmpeg")
    assert _filmed(server, format="mp4")[4:8] == b"ftyp"
    assert not _left(server)


def test_a_client_that_leaves_leaves_nothing(server: Server) -> None:
    for _ in range(4):  # more than are written at the same time: each made room when its client left
        with _open(server) as socket:
            assert _hear(socket) == {"done": 0}
            socket.send(_picture(0))
            assert _hear(socket) == {"done": 1}
    assert _filmed(server)
    assert not _left(server)


def test_what_is_no_picture_of_the_film_is_reported(server: Server) -> None:
    wrong = {
        "12x64 pixels": _picture(0, (12, 64)),
        "no whole JPEG or PNG": (6).to_bytes(4, "little") + b"nobody",
        "at most 16 MB": (1 << 30).to_bytes(4, "little"),
    }
    for sentence, data in wrong.items():
        with _open(server) as socket:
            _hear(socket)
            socket.send(data)
            assert sentence in _hear(socket)["error"]
    assert not _left(server)


def test_a_gif_takes_no_more_than_its_share_of_the_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    class Pictures(list[bytes]):
        film = films.Film("gif", (96, 64), 20, 2)

    sent = Pictures([_picture(0)[4:]] * 2)
    monkeypatch.setattr(films, "MAX_GIF_BYTES", len(sent[0]))
    with pytest.raises(MotionloomError, match="choose a smaller size or MP4"):
        films._on_disk(sent, io.BytesIO())  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"format": "avi"}, "mp4"),
        ({"width": 97}, "even"),
        ({"width": 8192, "height": 8192}, "4096x2304"),
        ({"count": 100_000}, "too long"),
        ({"width": 1280, "height": 720, "count": 1000}, "GIF"),
        ({"fps": 1000}, "fps"),
        ({"more": 1}, "more"),
    ],
)
def test_sizes_are_checked_before_anything_is_written(change: dict[str, Any], sentence: str) -> None:
    with pytest.raises(MotionloomError, match=sentence):
        read(json.dumps(SMALL | change), 600.0)
