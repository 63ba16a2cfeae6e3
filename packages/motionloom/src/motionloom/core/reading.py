"""Bytes of files from outside, of files and pipes alone and never more than is allowed; what text may hold; our tables.

Text that comes in, by whatever interface, is whole Unicode without control characters: only that can be stored as
UTF-8, sent as JSON and shown. `check_text` refuses anything else; `mended` is for what was stored before.
"""

import json
import os
import re
import stat
import tomllib
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from motionloom.core.errors import MotionloomError

MAX_BYTES = 2 * 1024**3
"""Files above this size (2 GB) are refused."""
_PIECE = 1 << 20
_FOREIGN = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff]")
"""Control characters but tabs and line ends, and halves of surrogate pairs."""
LONGEST_NUMBER = 300
"""Digits of a whole number in JSON, so that each fits into a float."""


def check_text(text: str, what: str) -> str:
    """The text itself; raises `MotionloomError` that begins with ``what`` where it holds what is no text."""
    if text.isprintable() or (wrong := _FOREIGN.search(text)) is None:
        return text
    code = ord(wrong[0])
    if code >= 0xD800:
        raise MotionloomError(f"{what} holds half a character (a lone surrogate, U+{code:04X}); send whole ones")
    raise MotionloomError(f"{what} holds the control character U+{code:04X}, which is no text; leave it out")


def check_texts(value: Any, what: str) -> None:
    """The same of all keys and texts of a JSON value; the sentence names the innermost key."""
    if isinstance(value, str):
        check_text(value, what)
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            check_text(str(key), f"a key of {what}")
            check_texts(inner, repr(key))
    elif isinstance(value, list | tuple):
        for inner in value:
            check_texts(inner, what)


def mended(value: Any) -> Any:
    """A JSON value in whose keys and texts U+FFFD stands for what `check_text` refuses; the value itself if nothing."""
    if isinstance(value, str):
        return value if value.isprintable() else _FOREIGN.sub("\ufffd", value)
    if isinstance(value, dict):
        return {mended(key): mended(inner) for key, inner in value.items()}
    return [mended(inner) for inner in value] if isinstance(value, list) else value


def whole_number(digits: str) -> int:
    """A whole number of JSON; raises ValueError for one of very many digits."""
    if len(digits) > LONGEST_NUMBER:
        raise ValueError(f"{digits[:20]}... has {len(digits):,} digits, which is no number that fits")
    return int(digits)


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
        return json.loads(read_bytes(path, max_bytes=1_000_000).decode("utf-8"), parse_int=whole_number)
    except (ValueError, RecursionError) as error:
        if isinstance(error, MotionloomError):
            raise
        raise MotionloomError(f"{path} cannot be read as {what} in JSON: {error}") from None


def read_table(package: str, file: str) -> Any:
    """The content of a .toml or .json file that ships in a package, such as ``motionloom.cli``."""
    place = import_module(package).__file__  # not by importlib.resources, which imports for as long as `--help` takes
    text = Path(str(place)).with_name(file).read_text(encoding="utf-8")
    return json.loads(text) if file.endswith(".json") else tomllib.loads(text)
