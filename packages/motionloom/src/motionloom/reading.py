"""Bytes of files from outside: of files and pipes alone, and never more than is allowed. And tables of our own."""

import json
import os
import stat
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

from motionloom.errors import MotionloomError

MAX_BYTES = 2 * 1024**3
"""Files above this size (2 GB) are refused."""
_PIECE = 1 << 20


def read_bytes(path: Path | str, *, max_bytes: int = MAX_BYTES, empty: bool = False) -> bytes:
    """The bytes of a file, or all that comes out of a pipe.

    What a file says of its own size is not believed: no more than ``max_bytes`` are read in any case.

    Raises `MotionloomError` if it is missing, a folder, a device, or larger than ``max_bytes``, and unless ``empty`` if
    it holds nothing but blanks.
    """
    path = Path(path)
    try:
        kind = path.stat().st_mode
        if stat.S_ISDIR(kind):
            raise MotionloomError(f"{path} is a folder; name a file in it")
        if not (stat.S_ISREG(kind) or stat.S_ISFIFO(kind)):
            raise MotionloomError(f"{path} is a device and no file; name a file")
        data = _read(path, max_bytes)
    except (OSError, ValueError) as error:
        if isinstance(error, MotionloomError):
            raise
        raise MotionloomError(f"cannot read {path}: {getattr(error, 'strerror', None) or error}") from None
    if not empty and not data.strip():
        raise MotionloomError(f"{path} is empty")
    return data


def _read(path: Path, max_bytes: int) -> bytes:
    with path.open("rb") as stream:
        size = os.fstat(stream.fileno()).st_size
        if size > max_bytes:
            raise MotionloomError(f"{path} has {_sized(size)}; files above {_sized(max_bytes)} are not read")
        data = stream.read(size + 1)  # all of it, where the size is true
        if len(data) == size:
            return data
        whole = bytearray(data)
        while piece := stream.read(_PIECE):
            whole += piece
            if len(whole) > max_bytes:
                raise MotionloomError(f"{path} gives more than {_sized(max_bytes)}, which is not read")
    return bytes(whole)


def _sized(size: int) -> str:
    if size < 1e5:
        return f"{size:,} bytes"
    return f"{size / 1e9:.1f} GB" if size >= 1e8 else f"{size / 1e6:.1f} MB"


def read_json(path: Path | str, what: str) -> Any:
    """The JSON of a small file; raises `MotionloomError` where it cannot be read as ``what``, such as ``a map``."""
    try:
        return json.loads(read_bytes(path, max_bytes=1_000_000).decode("utf-8"))
    except (ValueError, RecursionError) as error:
        if isinstance(error, MotionloomError):
            raise
        raise MotionloomError(f"{path} cannot be read as {what} in JSON: {error}") from None


def read_table(package: str, file: str) -> Any:
    """The content of a .toml or .json file that ships in a package, such as ``motionloom.cli``."""
    text = (resources.files(package) / file).read_text(encoding="utf-8")
    return json.loads(text) if file.endswith(".json") else tomllib.loads(text)
