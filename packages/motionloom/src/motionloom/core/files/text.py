"""Reading untrusted text files of numbers: size, binary junk, bad numbers, all with the line in the message."""

import json
import math
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError, quoted
from motionloom.core.motion import MAX_POSES
from motionloom.core.reading import MAX_BYTES, check_texts, mended, read_bytes, whole_number

LIMIT = 1e9
"""Numbers beyond this are no lengths or angles of anybody, and are refused with NaN and infinity."""
FREE_POSES = 2_000_000
"""Frames times joints of which a file need not say anything."""
MAX_DEPTH = 64
"""Lists and mappings within each other."""
_CHUNK = 4 * 1024**2


def read_text(path: Path | str, *, max_bytes: int = MAX_BYTES, empty: bool = False) -> bytes:
    """The bytes of a text file with plain line ends (``\\n``) and without a byte-order mark; refuses binary junk."""
    return plain_text(read_bytes(path, max_bytes=max_bytes, empty=empty), path)


def plain_text(data: bytes, what: Path | str) -> bytes:
    """The same of bytes that are there; ``what``: their file's name, or what they are."""
    if b"\0" in data:
        raise MotionloomError(f"{what} is not a text file: it holds binary data")
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return data.removeprefix(b"\xef\xbb\xbf")


def read_utf8(path: Path | str, *, max_bytes: int, empty: bool = False) -> str:
    """The text of a file in UTF-8, line ends and byte-order mark as in `read_text`; ``empty`` ones only if allowed."""
    try:
        return read_text(path, max_bytes=max_bytes, empty=empty).decode("utf-8")
    except UnicodeDecodeError:
        raise MotionloomError(f"{path} is not UTF-8 text; save it as UTF-8") from None


def parse_json(data: bytes | str, what: Path | str) -> Any:
    """What JSON from outside says: finite numbers, each key once, and texts that are texts (`reading.check_text`).

    Raises `MotionloomError` that begins with ``what``.
    """
    value = _json(data, what, unique=True)
    try:
        check_texts(value, "it")
    except MotionloomError as error:
        raise MotionloomError(f"{what}: {error}") from None
    return value


def stored_json(data: bytes, what: Path | str) -> Any:
    """What JSON says that was stored here: of a key that stands there twice the last value counts, and U+FFFD stands
    for what is no text. Raises `MotionloomError` as `parse_json`.
    """
    return mended(_json(data, what, unique=False))


def _json(data: bytes | str, what: Path | str, *, unique: bool) -> Any:
    try:
        return plain_json(data, finite=True, unique=unique)
    except ValueError as error:
        raise MotionloomError(f"{what} is not JSON ({' '.join(str(error).split())[:120]})") from None


def plain_json(data: bytes | str, *, finite: bool = False, unique: bool = False) -> Any:
    """What JSON says, lying in each other at most `MAX_DEPTH` deep.

    finite: without NaN, infinity and 1e999. unique: no key stands twice in an object. Raises ValueError for anything
    else: what is not UTF-8, endless digits, and depths at which whoever copies or shows the values runs out of stack.
    """

    def constant(name: str) -> float:
        if finite:
            raise ValueError(f"{name} is no number")
        return float(name.replace("Infinity", "inf"))

    def number(digits: str) -> float:
        value = float(digits)
        if finite and not math.isfinite(value):
            raise ValueError(f"{digits[:20]} is no number that fits")
        return value

    try:
        value = json.loads(
            data,
            parse_constant=constant,
            parse_float=number,
            parse_int=whole_number,
            object_pairs_hook=_unique if unique else None,
        )
    except RecursionError:
        raise ValueError("its values lie in each other too deep") from None
    layer = [value]
    for _ in range(MAX_DEPTH):
        layer = [inner for outer in layer for inner in _inside(outer)]
        if not layer:
            return value
    raise ValueError("its values lie in each other too deep")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    mapping = dict(pairs)
    if len(mapping) < len(pairs):
        twice = Counter(key for key, _ in pairs).most_common(1)[0][0]
        raise ValueError(f"the key {quoted(twice)} stands in it twice; leave one of them out")
    return mapping


def _inside(value: Any) -> Iterable[Any]:
    if isinstance(value, dict):
        return value.values()
    return value if isinstance(value, list) else ()


def word(raw: bytes) -> str:
    """Bytes as text: UTF-8 where it is, else Windows-1252, which is Latin-1 without its control characters."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")


def shown(raw: bytes | str, limit: int = 40) -> str:
    """A piece of a file as it may appear in a message: quoted, without control characters, not too long."""
    return quoted(word(raw) if isinstance(raw, bytes) else raw, limit)


def unique_names(names: Iterable[str], others: Iterable[str] = ()) -> tuple[str, ...]:
    """The names, of which a second ``hand`` becomes ``hand_2``, as does a first one that is among ``others``."""
    used, counts, unique = set(others), dict[str, int](), []
    for name in names:
        free = name
        while free in used:
            counts[name] = counts.get(name, 1) + 1
            free = f"{name}_{counts[name]}"
        used.add(free)
        unique.append(free)
    return tuple(unique)


def number(raw: bytes | str) -> float | None:
    """A decimal number within `LIMIT`, or None."""
    digits = raw.decode("latin-1") if isinstance(raw, bytes) else raw
    if not digits.isascii() or "_" in digits:
        return None
    try:
        value = float(digits)
    except ValueError:
        return None
    return value if abs(value) <= LIMIT else None


def check_poses(frames: int, joints: int, path: Path | str, *, numbers: int) -> None:
    """Refuse what would not fit into memory: a small file may claim very many of both.

    numbers: how many the file really holds. A pose takes one at least, but for `FREE_POSES` that need none.
    """
    most = min(MAX_POSES, FREE_POSES + 2 * numbers)
    if frames * joints > most:
        raise MotionloomError(
            f"{path} has {frames} frames of {joints} joints, most of which it says nothing about; at most {most:,} "
            "together are read"
        )


def numbers(data: bytes, *, path: Path | str, first_line: int) -> NDArray[np.float64]:
    """All numbers of a block of text in one flat array, in time linear in its length.

    ``first_line`` is the line of the file on which the block begins, for messages.
    """
    parts = list(number_blocks(data, 0, path=path, first_line=first_line))
    return np.concatenate(parts) if parts else np.empty(0)


def number_blocks(data: bytes, start: int, *, path: Path | str, first_line: int) -> Iterator[NDArray[np.float64]]:
    """The numbers of the text from ``start`` on, flat and some at a time, so that they need not all be held at once."""
    line = first_line
    while start < len(data):
        stop = len(data) if len(data) - start <= _CHUNK else data.rfind(b"\n", start, start + _CHUNK) + 1
        stop = stop if stop > start else len(data)
        chunk = data[start:stop]
        values = _parse(chunk)
        if values is None:
            _complain(chunk, path, line)
        else:
            yield values
        start, line = stop, line + chunk.count(b"\n")


def _parse(chunk: bytes) -> NDArray[np.float64] | None:
    if not chunk.strip():
        return np.empty(0)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            values = np.fromstring(chunk.decode("ascii"), dtype=np.float64, sep=" ")
    except (ValueError, DeprecationWarning, UnicodeDecodeError):
        return None
    return values if (np.abs(values) <= LIMIT).all() else None


def _complain(chunk: bytes, path: Path | str, line: int) -> None:
    for text in chunk.split(b"\n"):
        for raw in text.split():
            if number(raw) is None:
                raise MotionloomError(f"{path}, line {line}: {shown(raw)} is not a finite number below 1e9")
        line += 1
    raise MotionloomError(f"{path}: the block of numbers that ends at line {line} cannot be read")
