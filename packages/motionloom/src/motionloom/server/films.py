"""Films of pictures that a page draws: one picture after the other over a WebSocket, encoded as they come.

The connection is the film: a client that leaves, is too slow or sends what is no picture ends the encoder, and nothing
is left of its file. A picture is taken when the encoder wants it, so neither side keeps more than a few. Those
of a GIF are in a file until the last one has come, because its palette is of all of it.
"""

import asyncio
import io
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, TYPE_CHECKING, Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from motionloom.core.errors import MotionloomError, one_line
from motionloom.core.files.text import parse_json
from motionloom.goals.fields import Field
from motionloom.server.bodies import PIECE
from motionloom.server.refusal import full_disk

if TYPE_CHECKING:
    from PIL import Image

    from motionloom.server.app import Studio

MAX_PICTURE = 16 << 20
"""Bytes of one picture."""
MAX_FPS = 60.0
MAX_GIF_PIXELS = 250_000_000
"""Of all pictures of a GIF together, which is in memory until it is written."""
MAX_GIF_BYTES = 1 << 30
"""Of its pictures as they are sent, which are on the disk until it is written."""
MOST = 2
"""Films that are written at the same time."""
GOODBYE, REFUSED = 1000, 1008
_ROOM = asyncio.Semaphore(MOST)


@dataclass(frozen=True)
class Film:
    """What a client sends first."""

    format: str
    size: tuple[int, int]
    fps: float
    count: int

    def decoded(self, data: bytes) -> "Image.Image":
        """A picture as it was sent; raises `MotionloomError` for what is no picture of this film."""
        from PIL import Image

        try:
            picture = Image.open(io.BytesIO(data), formats=("JPEG", "PNG"))
            if picture.size != self.size:
                width, height = self.size
                raise MotionloomError(
                    f"a picture has {picture.width}x{picture.height} pixels; the film {width}x{height}"
                )
            return picture.convert("RGB")
        except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
            why = one_line(str(error))[:80]
            raise MotionloomError(f"a picture of the film is no whole JPEG or PNG ({why})") from None


class _Gone(Exception):
    """The client is not there any more."""


async def film(websocket: WebSocket) -> None:
    """Write one film: first what it is, as JSON, then its pictures; back comes a count for each, and the file."""
    studio: Studio = websocket.app.state.studio
    await websocket.accept()
    with suppress(_Gone, WebSocketDisconnect, RuntimeError):  # RuntimeError: something is sent to who has left
        try:
            async with asyncio.timeout(studio.limits.body_seconds):
                message = await _received(websocket)
            description = read(message.get("text") or "", studio.limits.total_seconds)
            part = studio.project.part(f".{description.format}")
            try:
                if _ROOM.locked():
                    raise MotionloomError(f"{MOST} films are being written already; wait until one of them is done")
                async with _ROOM:
                    await asyncio.to_thread(_write, _Pictures(websocket, description, studio.limits.body_seconds), part)
                await _send(websocket, part)
            finally:
                part.unlink(missing_ok=True)
            await websocket.close(GOODBYE)
        except (MotionloomError, TimeoutError, OSError) as error:
            await websocket.send_text(json.dumps({"error": _sentence(studio, error)}))
            await websocket.close(REFUSED)


def read(text: str, seconds: float) -> Film:
    """The film that a client sends, of at most ``seconds``; raises `MotionloomError` for what is no film."""
    from motionloom.viz.film import MAX_GIF_FRAMES, film_size

    keys = ("format", "width", "height", "fps", "count")
    parts = Field(parse_json(text, "the film"), "the film").mapping(keys, keys)
    kind = parts["format"].word(("mp4", "gif"))
    width, height, count = (_whole(parts[name]) for name in ("width", "height", "count"))
    fps = parts["fps"].number(1.0, MAX_FPS)
    if film_size((width, height)) != (width, height):
        raise MotionloomError(f"a film has even numbers of pixels; got {width}x{height}")
    if count > seconds * fps + 1:
        raise MotionloomError(f"a film of {count / fps:.0f} s is too long; at most {seconds:g} s are written")
    if kind == "gif" and (count > MAX_GIF_FRAMES or count * width * height > MAX_GIF_PIXELS):
        raise MotionloomError(
            f"a GIF of {count} pictures of {width}x{height} is too large; choose a smaller size or MP4"
        )
    return Film(kind, (width, height), fps, count)


def _whole(field: Field) -> int:
    value = field.number(1, 1_000_000)
    if value != int(value):
        field.wrong("a whole number")
    return int(value)


class _Pictures:
    """The pictures of a client, as the thread of the encoder takes them."""

    def __init__(self, websocket: WebSocket, film: Film, seconds: float) -> None:
        self.film = film
        self._websocket, self._seconds = websocket, seconds
        self._loop = asyncio.get_running_loop()
        self._rest = bytearray()

    def __iter__(self) -> Iterator[bytes]:
        for number in range(self.film.count):
            coming = asyncio.run_coroutine_threadsafe(self._next(number), self._loop)
            yield coming.result(2 * self._seconds)

    async def _next(self, number: int) -> bytes:
        """The next picture; what was taken before is counted to the client."""
        await self._websocket.send_text(json.dumps({"done": number}))
        async with asyncio.timeout(self._seconds):
            size = int.from_bytes(await self._bytes(4), "little")
            if not 0 < size <= MAX_PICTURE:
                raise MotionloomError(f"a picture of {size} bytes is not read; at most {MAX_PICTURE >> 20} MB are")
            return await self._bytes(size)

    async def _bytes(self, count: int) -> bytes:
        while len(self._rest) < count:
            self._rest += (await _received(self._websocket)).get("bytes") or b""
        data = bytes(self._rest[:count])
        del self._rest[:count]
        return data


def _write(pictures: _Pictures, part: Path) -> None:
    from motionloom.viz.film import write_film

    film = pictures.film
    with TemporaryFile(dir=part.parent) as file:
        frames = _on_disk(pictures, file) if film.format == "gif" else lambda _: map(film.decoded, pictures)
        write_film(frames, part, film.size, rate=film.fps, count=film.count)


def _on_disk(pictures: _Pictures, file: IO[bytes]) -> "Callable[[Sequence[int]], Iterator[Image.Image]]":
    """Pictures that can be read again: a GIF's palette is of pictures from all over it."""
    ends = [0]
    for data in pictures:
        pictures.film.decoded(data)
        if ends[-1] + len(data) > MAX_GIF_BYTES:
            raise MotionloomError(
                f"the pictures of a GIF are over {MAX_GIF_BYTES >> 20} MB; choose a smaller size or MP4"
            )
        ends.append(ends[-1] + file.write(data))

    def pictures_at(numbers: Sequence[int]) -> "Iterator[Image.Image]":
        for number in numbers:
            file.seek(ends[number])
            yield pictures.film.decoded(file.read(ends[number + 1] - ends[number]))

    return pictures_at


async def _send(websocket: WebSocket, part: Path) -> None:
    """The finished file: its size, and its bytes in pieces."""
    with part.open("rb") as file:
        await websocket.send_text(json.dumps({"size": part.stat().st_size}))
        while piece := await asyncio.to_thread(file.read, PIECE):
            await websocket.send_bytes(piece)


async def _received(websocket: WebSocket) -> Mapping[str, Any]:
    message = await websocket.receive()
    if message["type"] != "websocket.receive":
        raise _Gone
    return message


def _sentence(studio: "Studio", error: Exception) -> str:
    if (full := full_disk(error)) is not None:
        return full.sentence
    return studio.project.without_paths(str(error)) or "no picture came in time, and the film was left"
