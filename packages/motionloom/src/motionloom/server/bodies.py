"""Bodies of requests and files that are answered, piece by piece.

Of a request never more is read than is allowed, and never for longer; a file of one answer is gone from the folder
before the first byte is sent.
"""

import asyncio
import os
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager, suppress
from pathlib import Path, PurePosixPath, PureWindowsPath

from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response, StreamingResponse

from motionloom.core.files.text import shown
from motionloom.core.reading import check_text
from motionloom.server.limits import Limits
from motionloom.server.project import Project
from motionloom.server.refusal import Refusal

CLOSE = {"Connection": "close"}
"""The rest of a body that is refused is not read: the connection ends."""


async def body_of(request: Request, most: int) -> bytes:
    """The whole body; raises `Refusal` for one that is too large, too slow or not whole."""
    data = bytearray()
    async for piece in _pieces(request, most, Limits.body_seconds):
        data += piece
    return bytes(data)


def session_of(request: Request) -> str:
    """The session that a page names in X-Client; empty where there is none."""
    return check_text(request.headers.get("x-client", "")[:64], "X-Client")


@asynccontextmanager
async def file_of(
    request: Request, project: Project, suffixes: Sequence[str], limits: Limits
) -> AsyncIterator[tuple[Path, str]]:
    """The body as a file in the project's temporary folder, and the name it was sent with (``?name=``).

    Of the name only the ending, one of ``suffixes``, says where the file is. It is gone behind the block unless it was
    moved away.
    """
    client_path = check_text(request.query_params.get("name", ""), "the file's name")
    name = PurePosixPath(PureWindowsPath(client_path).name).name[:200]
    suffix = PurePosixPath(name).suffix.lower()
    if suffix not in suffixes:
        raise Refusal(
            400,
            f"say the file's name with ?name=, ending in {', '.join(suffixes)}; got {shown(client_path)}",
            headers=CLOSE,
        )
    part = project.part(suffix)
    try:
        with part.open("wb") as file:
            async for piece in _pieces(request, limits.upload_bytes, limits.body_seconds):
                file.write(piece)
        yield part, name
    finally:
        part.unlink(missing_ok=True)


async def _pieces(request: Request, most: int, seconds: float) -> AsyncIterator[bytes]:
    length = request.headers.get("content-length", "0")
    if length.isdecimal() and len(length) < 20 and int(length) > most:
        raise _too_large(int(length), most)
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


PIECE = 1 << 18
"""Bytes that are read at once."""


def file_once(part: Path, *, media_type: str, name: str) -> Response:
    """The answer that sends ``part`` as a download called ``name``.

    The file loses its name here and is read through the open descriptor, so that nothing is left of it whatever becomes
    of the client.
    """
    file = part.open("rb")
    with suppress(PermissionError):  # Windows keeps the name of an open file; it goes behind the last byte
        part.unlink()

    async def pieces() -> AsyncIterator[bytes]:
        try:
            while piece := await run_in_threadpool(file.read, PIECE):
                yield piece
        finally:
            file.close()
            part.unlink(missing_ok=True)

    size = os.fstat(file.fileno()).st_size
    headers = {"Content-Length": str(size), "Content-Disposition": f'attachment; filename="{name}"'}
    return StreamingResponse(pieces(), media_type=media_type, headers=headers)
