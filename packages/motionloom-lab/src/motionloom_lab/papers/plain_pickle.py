"""Pickles of plain values and numpy arrays, read by Python's own unpickler with everything that acts taken out.

Of the unpickler's operations those are left that push a value, remember it, or fill a list or a table (`OPERATIONS`).
``find_class`` knows the few names that numpy's own pickles hold, and answers with methods of this class, which make
arrays from bytes whose length they check. Any other name and any other operation ends the reading. Python 2's pickles
(protocols 0 to 2) are read with latin-1 strings, as ``pickle.load(file, encoding="latin1")`` would.

The usual files of Human3.6M and HumanEva-I are .npz files that keep one such pickle: see `read_tables`.
"""

import io
import math
import pickle
import pickletools
import re
import struct
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.files import text
from motionloom.core.reading import read_bytes
from motionloom.io.npz import opened, read_header

MAX_OPERATIONS = 1 << 18
"""Operations of one file. Each costs microseconds; a list of 50,000 words takes 100,000."""
MAX_ITEMS = 1 << 21
"""Items a file may unfold to when shared containers are counted each time."""
MAX_DEPTH = 64
"""Containers within containers."""
BROKEN = (
    pickle.UnpicklingError,
    struct.error,
    EOFError,
    ValueError,
    IndexError,
    KeyError,
    TypeError,
    AttributeError,
    OverflowError,
    MemoryError,
    RecursionError,
)
"""What a damaged pickle raises in `PlainUnpickler.value`."""
NAMES: Mapping[tuple[str, str], str] = {
    ("numpy", "ndarray"): "ndarray",
    ("numpy", "dtype"): "dtype",
    ("_codecs", "encode"): "encode",
    ("__builtin__", "bytes"): "bytes",
    ("builtins", "bytes"): "bytes",
    ("numpy.core.multiarray", "_reconstruct"): "reconstruct",
    ("numpy._core.multiarray", "_reconstruct"): "reconstruct",
    ("numpy.core.multiarray", "scalar"): "scalar",
    ("numpy._core.multiarray", "scalar"): "scalar",
    ("numpy.core.numeric", "_frombuffer"): "frombuffer",
    ("numpy._core.numeric", "_frombuffer"): "frombuffer",
}
"""The names that plain pickles may have; each is a method ``make_...`` of the unpickler."""
OPERATIONS = frozenset(
    {
        *("PROTO", "FRAME", "STOP", "MARK", "NONE", "NEWTRUE", "NEWFALSE"),
        *("INT", "BININT", "BININT1", "BININT2", "LONG", "LONG1", "LONG4", "FLOAT", "BINFLOAT"),
        *("STRING", "BINSTRING", "SHORT_BINSTRING", "UNICODE"),
        *("BINUNICODE", "SHORT_BINUNICODE", "BINUNICODE8"),
        *("BINBYTES", "SHORT_BINBYTES", "BINBYTES8", "BYTEARRAY8"),
        *("EMPTY_TUPLE", "TUPLE", "TUPLE1", "TUPLE2", "TUPLE3"),
        *("EMPTY_LIST", "LIST", "APPEND", "APPENDS"),
        *("EMPTY_DICT", "DICT", "SETITEM", "SETITEMS"),
        *("PUT", "BINPUT", "LONG_BINPUT", "MEMOIZE", "GET", "BINGET", "LONG_BINGET"),
        *("GLOBAL", "STACK_GLOBAL", "REDUCE", "BUILD"),
    }
)
"""What is left of the unpickler; names and calls are methods of `PlainUnpickler` alone."""
_SPARE = 16 << 20
"""Bytes that arrays and decoded texts may hold beyond twice the pickle's own: a few that are shared."""
_DTYPE = re.compile(r"[|<>=]?(b1|[iu][1248]|f[248]|c8|c16|[SU][1-9][0-9]{0,4}|O8?)")
_OPERATION_NAMES = {ord(operation.code): operation.name for operation in pickletools.opcodes}


def read_plain_file(path: Path | str, *, limit: int) -> object:
    """`read_plain` on a file of at most `limit` bytes."""
    path = Path(path)
    return read_plain(read_bytes(path, max_bytes=limit, empty=True), limit=limit, name=str(path))


def read_plain(data: bytes, *, limit: int, name: str = "the pickle") -> object:
    """The value of a pickle of plain values and numpy arrays, and nothing else.

    Args:
        data: The whole pickle, protocols 0 to 5 without out-of-band buffers.
        limit: Most bytes of the pickle, of all its arrays together, and of texts in it that are decoded to bytes. Of
            the latter two it is 16 MiB and twice the pickle, if that is less.
        name: What errors call it.

    Returns:
        Dictionaries (keys: strings, bytes, numbers or None), lists, tuples, strings, bytes, whole numbers of at most 64
        bits, floats, booleans, None, numpy arrays (of numbers, strings, or of such values again: dtype object) and
        numpy scalars. Numbers may be NaN: the caller knows whether that is wrong.

    Raises:
        MotionloomError: Anything else in it (a class, a call, a persistent id, a value that holds itself), or it is
            damaged, too large or nested deeper than `MAX_DEPTH`.
    """
    try:
        if len(data) > limit:
            raise ValueError(f"it holds {len(data)} bytes, more than {limit}")
        stream = io.BytesIO(data)
        value = PlainUnpickler(stream, min(limit, _SPARE + 2 * len(data))).value()
        if stream.read(1):
            raise ValueError("it does not hold exactly one value")
        return value
    except BROKEN as error:
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise MotionloomError(f"{name} is not a pickle of plain values and is not opened ({reason})") from None


class _Dispatch(dict[int, Callable[..., None]]):
    """The unpickler's table of operations: counts them, and names the one that is not allowed."""

    def __init__(self, allowed: Mapping[int, Callable[..., None]]) -> None:
        super().__init__(allowed)
        self.left = MAX_OPERATIONS

    def __getitem__(self, code: int) -> Callable[..., None]:
        self.left -= 1
        if self.left < 0:
            raise ValueError(f"it has more than {MAX_OPERATIONS} operations")
        if code not in self:
            raise ValueError(f"it asks for {_OPERATION_NAMES.get(code, f'the unknown operation {code}')}")
        return super().__getitem__(code)


@dataclass(eq=False)
class _Dtype:
    """A numpy type as its pickle builds it: first the letters, then the byte order."""

    letters: str
    order: str | None = None

    def numpy(self) -> np.dtype:
        dtype = np.dtype(self.letters)
        return dtype if self.order in (None, "|") else dtype.newbyteorder(cast(Any, self.order))


class PlainUnpickler(pickle._Unpickler):
    """Reads one pickle of plain values; `lab.papers.torch_file` teaches it the few names of torch's files."""

    names: Mapping[tuple[str, str], str] = NAMES
    operations: frozenset[str] = OPERATIONS
    leaves: tuple[type, ...] = (str, bytes, bytearray, float, bool, type(None), np.generic)
    """Values without parts that a result may hold, beside whole numbers."""
    stack: list[Any]
    metastack: list[list[Any]]
    append: Callable[[Any], None]
    read: Callable[[int], bytes]
    pop_mark: Callable[[], list[Any]]

    def __init__(self, stream: io.BytesIO, limit: int) -> None:
        super().__init__(stream, encoding="latin1")
        self.limit = limit
        self.bytes_made: Counter[str] = Counter()
        self.unbuilt: dict[int, np.ndarray] = {}
        own = {"BUILD": "load_build", "SETITEM": "load_setitem", "SETITEMS": "load_setitems", "DICT": "load_dict"}
        table = {}
        known = pickle._Unpickler.dispatch
        for code, function in known.items():
            name = _OPERATION_NAMES[code]
            if name in self.operations:
                table[code] = getattr(type(self), own[name]) if name in own else function
        table[ord(pickle.BYTEARRAY8)] = type(self).load_bytearray8
        self.dispatch = _Dispatch(table)  # type: ignore[misc]

    def value(self) -> Any:
        """The value of the pickle; the stream is left behind it. Raises one of `BROKEN` for whatever is wrong."""
        result = self.load()
        if self.stack or self.metastack:
            raise ValueError("it does not hold exactly one value")
        if self.unbuilt:
            raise ValueError("its array is incomplete")
        _Unfolded(self.leaves).count(result)
        return result

    # Names, and their values.

    def find_class(self, module: str, name: str) -> Any:
        """The method that replaces a name; nothing named in the file is ever looked up."""
        if (module, name) not in self.names:
            raise ValueError(f"it names {module[:40]}.{name[:40]}")
        return getattr(self, f"make_{self.names[module, name]}")

    def persistent_load(self, pid: Any) -> Any:
        """Plain pickles name nothing outside."""
        raise ValueError("it names something outside")

    def make_ndarray(self, *arguments: Any) -> Any:
        """The class of arrays, which is only named."""
        raise ValueError("its ndarray cannot be read")

    def make_dtype(self, letters: Any, *more: Any) -> _Dtype:
        """A numpy type of numbers, text or objects."""
        if not isinstance(letters, str) or not _DTYPE.fullmatch(letters):
            raise ValueError("its dtype cannot be read")
        return _Dtype(letters)

    def make_reconstruct(self, kind: Any, *more: Any) -> np.ndarray:
        """An array that is filled later, since others may refer to it before."""
        if kind != self.make_ndarray:
            raise ValueError("its array is of no known kind")
        array = np.zeros(0)
        self.unbuilt[id(array)] = array
        return array

    def make_frombuffer(self, data: Any, dtype: Any, shape: Any, order: Any) -> np.ndarray:
        """An array of protocol 5."""
        array = self.make_reconstruct(self.make_ndarray)
        self.build(array, (1, shape, dtype, order == "F", data))
        return array

    def make_scalar(self, dtype: Any, data: Any) -> Any:
        """One number of a numpy type."""
        kind, data = self._numbers(data, dtype, ())
        return np.frombuffer(data, kind)[0]

    def make_encode(self, text: Any, encoding: Any) -> bytes:
        """Bytes, as protocol 2 writes them."""
        if encoding not in ("latin1", "latin-1"):
            raise ValueError("its encode cannot be read")
        self._count("texts", len(text))
        return _as_bytes(text)

    def make_bytes(self) -> bytes:
        """No bytes at all, as protocol 2 writes them."""
        return b""

    # Operations that fill something.

    def load_build(self) -> None:
        """BUILD: fills an unfinished array or dtype, and nothing else."""
        state = self.stack.pop()
        self.build(self.stack[-1], state)

    def load_setitem(self) -> None:
        """SETITEM: one entry of a table."""
        pair = [self.stack.pop(), self.stack.pop()][::-1]
        _fill_table(self.stack[-1], pair)

    def load_setitems(self) -> None:
        """SETITEMS: entries of a table."""
        items = self.pop_mark()
        _fill_table(self.stack[-1], items)

    def load_dict(self) -> None:
        """DICT: a table with its entries."""
        items = self.pop_mark()
        table: dict[Any, Any] = {}
        _fill_table(table, items)
        self.append(table)

    def load_bytearray8(self) -> None:
        """BYTEARRAY8, without room for bytes that are not there."""
        size = int.from_bytes(self.read(8), "little")
        data = self.read(min(size, self.limit + 1))
        if len(data) != size:
            raise ValueError("it is damaged or cut short")
        self.append(bytearray(data))

    def build(self, target: Any, state: Any) -> None:
        """Fill an unfinished array or dtype with its state in the file."""
        if not isinstance(state, tuple) or len(state) < 5:
            raise ValueError("its array is incomplete")
        if isinstance(target, _Dtype):
            if target.order is not None or state[1] not in ("<", ">", "|", "="):
                raise ValueError("its dtype cannot be read")
            if any(part is not None for part in state[2:5]):
                raise ValueError("its array has fields")
            target.order = state[1]
            return
        _, shape, dtype, columns, data = state[:5]
        if self.unbuilt.pop(id(target), None) is None:
            raise ValueError("it builds something that is no array")
        if not isinstance(shape, tuple) or len(shape) > 16 or not all(type(n) is int and n >= 0 for n in shape):
            raise ValueError("its array has no shape")
        if isinstance(data, list):
            kind = self._objects(data, dtype, shape, by_columns=bool(columns))
        else:
            kind, data = self._numbers(data, dtype, shape)
        target.__setstate__((1, shape, kind, bool(columns), data))

    def _objects(self, data: list[Any], dtype: Any, shape: tuple[int, ...], *, by_columns: bool) -> np.dtype:
        if not isinstance(dtype, _Dtype) or not dtype.numpy().hasobject or (by_columns and len(shape) > 1):
            raise ValueError("its array holds objects")
        self._count("arrays", 8 * len(data))
        if math.prod(shape) != len(data):
            raise ValueError(f"its array of shape {shape} has {len(data)} values")
        return np.dtype(object)

    def _numbers(self, data: Any, dtype: Any, shape: tuple[int, ...]) -> tuple[np.dtype, bytes]:
        """Type and bytes of an array, as many as its shape has."""
        kind = dtype.numpy() if isinstance(dtype, _Dtype) else np.dtype(object)
        if kind.hasobject or not isinstance(data, bytes | bytearray | str):
            raise ValueError("its array does not hold numbers")
        if len(data) != math.prod(shape) * kind.itemsize:
            raise ValueError(f"its array of shape {shape} has {len(data)} bytes")
        self._count("arrays", len(data))
        data = _as_bytes(data)
        if kind.kind == "b":
            data = (np.frombuffer(data, np.uint8) != 0).tobytes()
        if kind.kind == "U" and data:
            characters = np.frombuffer(data, np.dtype(np.uint32).newbyteorder(kind.byteorder))
            if (characters > 0x10FFFF).any():
                raise ValueError("its array holds numbers that are no characters")
        return kind, data

    def _count(self, what: str, size: int) -> None:
        # A short file can name the same long string again and again.
        self.bytes_made[what] += size
        if self.bytes_made[what] > self.limit:
            raise ValueError(f"its {what} hold more than {self.limit} bytes")


class _Unfolded:
    """Counts the items of a value, shared ones each time; cycles, depth and what is no plain value are refused."""

    def __init__(self, leaves: tuple[type, ...]) -> None:
        self.leaves = leaves
        self.sizes: dict[int, int] = {}
        self.open: set[int] = set()

    def count(self, value: Any, depth: int = 0) -> int:
        """How many items the value unfolds to; raises ValueError above `MAX_ITEMS`."""
        if isinstance(value, self.leaves) or (isinstance(value, np.ndarray) and not value.dtype.hasobject):
            return 1
        if type(value) is int:
            if not -(1 << 63) <= value < 1 << 64:
                raise ValueError("it holds a number of more than 64 bits")
            return 1
        if id(value) in self.sizes:
            return self.sizes[id(value)]
        if id(value) in self.open or depth > MAX_DEPTH:
            raise ValueError(f"it holds itself or is nested deeper than {MAX_DEPTH}")
        self.open.add(id(value))
        size = 1
        for item in self._items(value):
            size += self.count(item, depth + 1)
            if size > MAX_ITEMS:
                raise ValueError(f"it unfolds to more than {MAX_ITEMS} items")
        self.open.discard(id(value))
        self.sizes[id(value)] = size
        return size

    def _items(self, value: Any) -> Iterable[Any]:
        if isinstance(value, dict):
            return value.values()
        if isinstance(value, np.ndarray):
            return value.ravel()
        if isinstance(value, list | tuple):
            return value
        raise ValueError("it holds a name and no value")


def _as_bytes(data: Any) -> bytes:
    if not isinstance(data, str | bytes | bytearray):
        raise ValueError("its bytes are none")
    return data.encode("latin-1") if isinstance(data, str) else bytes(data)


def _fill_table(table: Any, items: list[Any]) -> None:
    # Keys are looked at before they are hashed: a deep tuple would end the process.
    if not isinstance(table, dict) or len(items) % 2:
        raise ValueError("it fills something that is no table")
    if not all(isinstance(key, str | bytes | int | float | None) for key in items[::2]):
        raise ValueError("a key of its table is no plain value")
    table.update(zip(items[::2], items[1::2], strict=True))


MAX_ARRAYS = 20_000
Tables = dict[str, dict[str, np.ndarray]]


def read_tables(path: Path | str, name: str) -> Tables:
    """The dictionary of dictionaries of number arrays that an .npz file keeps under ``name``.

    Raises MotionloomError, naming the file, for a file that is missing, damaged, too large or holds anything else.
    """
    with opened(path) as (archive, members, most):
        if name not in members:
            listed = ", ".join(text.shown(n) for n in list(members)[:8]) or "nothing"
            raise MotionloomError(f"{path} is not read (it has no {name}, but {listed}); fetch it again")
        with archive.open(members[name]) as stream:
            shape, _, dtype = read_header(cast(BinaryIO, stream))
            if dtype.kind != "O" or shape != ():
                raise MotionloomError(
                    f"{path} is not read ({name} is an array of {dtype} of the shape {shape} and no dictionary); "
                    "fetch it again"
                )
            if members[name].file_size > 8 * most:
                raise MotionloomError(f"{path} is not read (it unfolds far beyond its size); fetch it again")
            data = stream.read(members[name].file_size)
    value = read_plain(data, limit=text.MAX_BYTES, name=str(path))
    try:
        return _tables(value)
    except ValueError as error:
        raise MotionloomError(f"{path} is not read ({error}); fetch it again") from None


def _tables(value: object) -> Tables:
    """What the pickle held, if it is a dictionary, by names, of dictionaries of arrays of numbers."""
    if isinstance(value, np.ndarray) and value.dtype == object and value.shape == ():
        value = value.item()
    if not isinstance(value, dict) or not all(isinstance(inner, dict) for inner in value.values()):
        raise ValueError("it holds no dictionary of dictionaries")
    if not all(isinstance(key, str) for table in (value, *value.values()) for key in table):
        raise ValueError("its dictionaries have keys that are not text")
    arrays = [array for inner in value.values() for array in inner.values()]
    if not all(isinstance(array, np.ndarray) and array.dtype.kind in "fiu" for array in arrays):
        raise ValueError("its dictionaries hold something else than arrays of numbers")
    if len(arrays) > MAX_ARRAYS or sum(array.nbytes for array in arrays) > text.MAX_BYTES:
        raise ValueError(f"it holds more than {MAX_ARRAYS} arrays or 2 GB of numbers")
    return value
