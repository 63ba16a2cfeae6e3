"""Files that are made for one answer: gone from the folder before the first byte is sent."""

import os
from collections.abc import AsyncIterator
from contextlib import suppress
from pathlib import Path

from starlette.concurrency import run_in_threadpool
from starlette.responses import Response, StreamingResponse

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
