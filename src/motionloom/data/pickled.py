"""Arrays in dictionaries out of .npz files that keep them as pickled objects, without unpickling anything.

The usual files of Human3.6M and HumanEva-I hold one object: a dictionary of dictionaries of arrays. A pickle is a
program, so it is not run: `pickletools` splits it into operations, and the loop below knows those that write down
strings, numbers, containers and arrays. What it meets as a "call" is compared with those that NumPy's arrays are
written with and never made.
"""

import io
import math
import pickletools
import re
import struct
import tokenize
import warnings
import zipfile
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.errors import MotionloomError
from motionloom.io import text

MAX_OPERATIONS = 1_000_000
"""Operations of one pickle; the files of the benchmarks have some ten thousand."""
MAX_ARRAYS = 20_000
Tables = dict[str, dict[str, np.ndarray]]
_BROKEN = (
    zipfile.BadZipFile, zlib.error, struct.error, tokenize.TokenError, SyntaxError, ValueError, TypeError, LookupError,
    OSError, EOFError, NotImplementedError, RuntimeError, OverflowError, MemoryError, AttributeError,
)  # fmt: skip


def read_tables(path: Path | str, name: str) -> Tables:
    """The dictionary of dictionaries of number arrays that an .npz file keeps under ``name``.

    Raises MotionloomError, naming the file, for a file that is missing, damaged, too large or holds anything else.
    """
    try:
        with warnings.catch_warnings(), zipfile.ZipFile(io.BytesIO(_zip_bytes(path))) as archive:
            warnings.simplefilter("ignore")
            members = archive.infolist()
            if len(members) > 1000 or sum(m.file_size for m in members) > text.MAX_BYTES:
                raise ValueError("it unpacks to more than 1000 arrays or 2 GB")
            found = {m.filename.removesuffix(".npy"): m for m in members}
            if name not in found:
                listed = ", ".join(text.shown(n) for n in list(found)[:8]) or "nothing"
                raise ValueError(f"it has no {name}, but {listed}")
            with archive.open(found[name]) as stream:
                file = io.BytesIO(stream.read(found[name].file_size))
        version = np.lib.format.read_magic(file)
        readers = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
        shape, _, dtype = readers[version](file)
        if dtype.kind != "O" or shape != ():
            raise ValueError(f"{name} is an array of {dtype} of the shape {shape} and no dictionary")
        return _tables(read_object(file.read()))
    except MotionloomError:
        raise
    except _BROKEN as error:
        reason = " ".join(str(error).split())[:160]
        raise MotionloomError(f"{path} is not read ({reason or type(error).__name__}); fetch it again") from None


def _zip_bytes(path: Path | str) -> bytes:
    data = text.read_bytes(path)
    if not data.startswith(b"PK"):
        raise ValueError("it is not an NPZ archive")
    return data


def _tables(value: object) -> Tables:
    """What `read_object` found, if it is a dictionary of dictionaries of arrays of numbers."""
    if isinstance(value, _Made) and isinstance(value.value, list) and value.shape == () and len(value.value) == 1:
        value = value.value[0]
    if not isinstance(value, dict) or not all(isinstance(inner, dict) for inner in value.values()):
        raise ValueError("it holds no dictionary of dictionaries")
    arrays = [array for inner in value.values() for array in inner.values()]
    if not all(isinstance(array, _Made) and isinstance(array.value, np.ndarray) for array in arrays):
        raise ValueError("its dictionaries hold something else than arrays of numbers")
    if len(arrays) > MAX_ARRAYS or sum(array.value.nbytes for array in arrays) > text.MAX_BYTES:
        raise ValueError(f"it holds more than {MAX_ARRAYS} arrays or 2 GB of numbers")
    return {outer: {key: made.value for key, made in inner.items()} for outer, inner in value.items()}


@dataclass(frozen=True)
class _Name:
    """Something that a pickle asks for; only compared, never looked up."""

    name: str


@dataclass(eq=False)
class _Made:
    """An array (``value`` an array, or a list for one of objects) or a type of numbers that a pickle writes down."""

    kind: str
    value: Any = None
    shape: tuple[int, ...] = ()


_NAMES = {
    "numpy.core.multiarray._reconstruct": "array",
    "numpy._core.multiarray._reconstruct": "array",
    "numpy.dtype": "dtype",
    "numpy.ndarray": "ndarray",
    "_codecs.encode": "bytes",
    "__builtin__.bytes": "empty",
}
_PUSHES = {
    "BINUNICODE", "SHORT_BINUNICODE", "BINUNICODE8", "UNICODE", "SHORT_BINSTRING", "BINSTRING", "SHORT_BINBYTES",
    "BINBYTES", "BINBYTES8", "BININT", "BININT1", "BININT2", "INT", "LONG", "LONG1", "LONG4",
}  # fmt: skip
_CONSTANTS = {"NONE": None, "NEWTRUE": True, "NEWFALSE": False, "EMPTY_TUPLE": ()}
_TUPLES = {"TUPLE1": 1, "TUPLE2": 2, "TUPLE3": 3}


@dataclass
class _Stack:
    """The values that a pickle has written down so far."""

    items: list[Any] = field(default_factory=list)
    below: list[list[Any]] = field(default_factory=list)
    memo: dict[int, Any] = field(default_factory=dict)
    encoded: int = 0

    def pop(self, count: int) -> list[Any]:
        """The topmost values, lowest first."""
        if len(self.items) < count:
            raise ValueError("its pickle ends in the middle")
        taken = self.items[-count:]
        del self.items[-count:]
        return taken

    def to_mark(self) -> list[Any]:
        """The values since the last mark."""
        taken, self.items = self.items, self.below.pop()
        return taken


def read_object(data: bytes) -> object:
    """The object that a pickle (protocol 2 to 4) of strings, numbers, containers and arrays writes down.

    Raises ValueError, IndexError, KeyError or TypeError for any other pickle.
    """
    stack = _Stack()
    for count, (operation, value, _) in enumerate(pickletools.genops(io.BytesIO(data))):
        if count > MAX_OPERATIONS:
            raise ValueError(f"its pickle has more than {MAX_OPERATIONS} operations")
        _step(stack, operation.name, value)
    if stack.below or len(stack.items) != 1:
        raise ValueError("its pickle does not hold one object")
    return stack.items[0]


def _step(stack: _Stack, name: str, value: Any) -> None:
    if name in _PUSHES:
        stack.items.append(value)
    elif name in _CONSTANTS:
        stack.items.append(_CONSTANTS[name])
    elif name in ("EMPTY_LIST", "EMPTY_DICT"):
        stack.items.append([] if name == "EMPTY_LIST" else {})
    elif name in _TUPLES or name == "TUPLE":
        values = stack.pop(_TUPLES[name]) if name in _TUPLES else stack.to_mark()  # before `items`, which this replaces
        stack.items.append(tuple(values))
    elif name in ("MEMOIZE", "BINPUT", "LONG_BINPUT", "PUT"):
        stack.memo[len(stack.memo) if name == "MEMOIZE" else value] = stack.items[-1]
    elif name in ("BINGET", "LONG_BINGET", "GET"):
        stack.items.append(stack.memo[value])
    elif name == "MARK":
        stack.below.append(stack.items)
        stack.items = []
    elif name in ("APPENDS", "SETITEMS", "APPEND", "SETITEM"):
        values = stack.to_mark() if name.endswith("S") else stack.pop(1 if name == "APPEND" else 2)
        _fill(stack.items[-1], values)
    elif name in ("GLOBAL", "STACK_GLOBAL"):
        parts = value.split(" ", 1) if name == "GLOBAL" else stack.pop(2)
        stack.items.append(_known(parts))
    elif name == "REDUCE":
        stack.items.append(_made(*stack.pop(2)))
    elif name == "BUILD":
        made, state = stack.items[-2], stack.pop(1)[0]
        _build(stack, made, state)
    elif name not in ("PROTO", "FRAME", "STOP"):
        raise ValueError(f"its pickle has the operation {name}, which no array needs")


def _fill(container: Any, values: list[Any]) -> None:
    if isinstance(container, list):
        container.extend(values)
    elif isinstance(container, dict) and len(values) % 2 == 0 and all(isinstance(k, str) for k in values[::2]):
        container.update(zip(values[::2], values[1::2], strict=True))
    else:
        raise ValueError("its pickle has a dictionary whose keys are not text")


def _known(parts: list[Any]) -> _Name:
    name = ".".join(part if isinstance(part, str) else "?" for part in parts)
    if name not in _NAMES:
        raise ValueError(f"its pickle asks for {text.shown(name[:60])} and may do anything if run, so it is not")
    return _Name(_NAMES[name])


def _made(function: Any, arguments: Any) -> Any:
    """What a call would give, written down without making it."""
    if not isinstance(function, _Name) or not isinstance(arguments, tuple):
        raise ValueError("its pickle calls something else than NumPy's arrays do")
    if function.name == "array":
        return _Made("array")
    if function.name == "bytes" and len(arguments) == 2 and all(isinstance(a, str) for a in arguments):
        return arguments[0]  # latin-1, see `_bytes`
    if function.name == "empty" and not arguments:
        return ""
    if function.name == "dtype" and arguments and isinstance(arguments[0], str):
        if re.fullmatch(r"O[48]?|[fiu][1248]", arguments[0]):
            return _Made("dtype", np.dtype(arguments[0].rstrip("48") if arguments[0][0] == "O" else arguments[0]))
        raise ValueError(f"its pickle has numbers of the kind {text.shown(arguments[0][:20])}")
    raise ValueError("its pickle calls something else than NumPy's arrays do")


def _build(stack: _Stack, made: Any, state: Any) -> None:
    """Fill a made array or type in with its state, as NumPy's ``__setstate__`` does; each only once."""
    if not isinstance(made, _Made) or not isinstance(state, tuple) or len(state) < 5:
        raise ValueError("its pickle fills in something that is no array")
    if made.kind == "dtype":
        if state[1] not in ("<", ">", "=", "|"):
            raise ValueError("its pickle has numbers of an unknown byte order")
        made.value = made.value.newbyteorder(state[1])
        return
    _, shape, dtype, fortran, data = state[:5]
    sizes = isinstance(shape, tuple) and len(shape) <= 8 and all(type(n) is int and n >= 0 for n in shape)
    if made.value is not None or not sizes or not isinstance(dtype, _Made) or not isinstance(dtype.value, np.dtype):
        raise ValueError("its pickle has an array without a shape and a type")
    made.shape = shape
    if isinstance(data, list):
        if dtype.value.kind != "O" or len(data) != math.prod(shape):
            raise ValueError(f"its pickle has an array that says {shape} but holds {len(data)} objects")
        made.value = data
        return
    held = _bytes(stack, data)
    if dtype.value.kind == "O" or math.prod(shape) * dtype.value.itemsize != len(held):
        raise ValueError(f"its pickle has an array that says {shape} but holds {len(held)} bytes")
    flat = np.frombuffer(held, dtype=dtype.value) if held else np.empty(0, dtype.value)
    made.value = flat.reshape(shape[::-1]).T if fortran is True else flat.reshape(shape)


def _bytes(stack: _Stack, data: Any) -> bytes:
    """An array's bytes; protocol 2 writes them as text. Copies are counted: the same text may come a thousand times."""
    if isinstance(data, bytes):
        return data
    if not isinstance(data, str):
        raise ValueError("its pickle has an array without numbers")
    stack.encoded += len(data)
    if stack.encoded > text.MAX_BYTES:
        raise ValueError("its pickle holds more than 2 GB of numbers")
    return data.encode("latin-1")
