"""Bodies of requests: read piece by piece, never more of them than is allowed, never for longer than is allowed."""

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path, PurePosixPath, PureWindowsPath

from starlette.requests import ClientDisconnect, Request

from motionloom.io.text import shown
from motionloom.server.limits import Limits
from motionloom.server.project import Project
from motionloom.server.refusal import Refusal

CLOSE = {"Connection": "close"}
"""The rest of a body that is refused is not read: the connection ends."""


async def body_of(request: Request, most: int, *, seconds: float = Limits.body_seconds) -> bytes:
    """The whole body; raises `Refusal` for one that is too large, too slow or not whole."""
    data = bytearray()
    async for piece in _pieces(request, most, seconds):
        data += piece
    return bytes(data)


@asynccontextmanager
async def file_of(
    request: Request, project: Project, suffixes: Sequence[str], limits: Limits
) -> AsyncIterator[tuple[Path, str]]:
    """The body as a file in the project's temporary folder, and the name it was sent with (``?name=``).

    Of the name only the ending, one of ``suffixes``, says where the file is. It is gone behind the block unless it was
    moved away.
    """
    said = request.query_params.get("name", "")
    name = PurePosixPath(PureWindowsPath(said).name).name[:200]
    suffix = PurePosixPath(name).suffix.lower()
    if suffix not in suffixes:
        raise Refusal(
            400, f"say the file's name with ?name=, ending in {', '.join(suffixes)}; got {shown(said)}", headers=CLOSE
        )
    part = project.part(suffix)
    try:
        with part.open("wb") as file:
            async for piece in _pieces(request, limits.upload_bytes, limits.body_seconds):
                file.write(piece)
        yield part, name if name.isprintable() else f"file{suffix}"
    finally:
        part.unlink(missing_ok=True)


async def _pieces(request: Request, most: int, seconds: float) -> AsyncIterator[bytes]:
    said = request.headers.get("content-length", "0")
    if said.isdecimal() and len(said) < 20 and int(said) > most:
        raise _too_large(int(said), most)
    count = 0
    stream = request.stream()
    deadline = asyncio.get_running_loop().time() + seconds
    while True:
        try:
            piece = await asyncio.wait_for(anext(stream), max(deadline - asyncio.get_running_loop().time(), 0.001))
        except StopAsyncIteration:
            return
        except TimeoutError:
            raise Refusal(408, f"the body did not arrive within {seconds:g} s; send it again", headers=CLOSE) from None
        except ClientDisconnect:
            raise Refusal(400, "the connection ended before the body did") from None
        count += len(piece)
        if count > most:
            raise _too_large(count, most)
        yield piece


def _too_large(size: int, most: int) -> Refusal:
    return Refusal(
        413, f"a body of {size / 1e6:.1f} MB is not read; at most {most / 1e6:.1f} MB are taken here", headers=CLOSE
    )
