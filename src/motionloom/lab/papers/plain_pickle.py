"""Pickles of plain values and numpy arrays, read without unpickling.

This is no unpickler: nothing named in the file is looked up or called. The bytes are split into operations
(`pickletools` knows their arguments), and the loop below carries out only those that push a value, remember it, or fill
a container. The few names that numpy's own pickles hold stand as words, and `_made` turns them into arrays itself
from bytes whose length it checks. Files that name anything else, or that use an operation which is not in the lists
below, are refused as a whole. Python 2's pickles (protocols 0 to 2) are read with latin-1 strings, as
``pickle.load(file, encoding="latin1")`` would.
"""

import codecs
import io
import math
import pickletools
import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np

from motionloom.errors import MotionloomError
from motionloom.reading import read_bytes

MAX_OPERATIONS = 1 << 18
"""Operations of one file. Each costs microseconds; a list of 50,000 words takes 100,000."""
MAX_ITEMS = 1 << 21
"""Items a file may unfold to when shared containers are counted each time."""
MAX_DEPTH = 64
"""Containers within containers."""

_SPARE = 16 << 20
"""Bytes that arrays and decoded texts may hold beyond twice the pickle's own: a few that are shared."""

_OPERATIONS = {operation.code: operation for operation in pickletools.opcodes}
_PUSHES = {
    "BINUNICODE", "SHORT_BINUNICODE", "BINUNICODE8", "UNICODE", "STRING", "BINSTRING", "SHORT_BINSTRING",
    "BINBYTES", "SHORT_BINBYTES", "BINBYTES8", "BYTEARRAY8", "FLOAT", "BINFLOAT",
    "BININT", "BININT1", "BININT2", "INT", "LONG", "LONG1", "LONG4",
}  # fmt: skip
_CONSTANTS: Mapping[str, object] = {"NONE": None, "NEWTRUE": True, "NEWFALSE": False, "EMPTY_TUPLE": ()}
_EMPTY: Mapping[str, Callable[[], object]] = {"EMPTY_LIST": list, "EMPTY_DICT": dict}
_REMEMBERS = {"BINPUT", "LONG_BINPUT", "PUT", "MEMOIZE"}
_RECALLS = {"BINGET", "LONG_BINGET", "GET"}
_TUPLES = {"TUPLE1": 1, "TUPLE2": 2, "TUPLE3": 3}
_IGNORED = {"PROTO", "FRAME"}

NAMES: Mapping[tuple[str, str], str] = {
    ("numpy", "ndarray"): "ndarray",
    ("numpy", "dtype"): "dtype",
    ("_codecs", "encode"): "encode",
    ("__builtin__", "bytes"): "bytes",
    ("builtins", "bytes"): "bytes",
    **{(f"numpy.{core}.multiarray", "_reconstruct"): "_reconstruct" for core in ("core", "_core")},
    **{(f"numpy.{core}.multiarray", "scalar"): "scalar" for core in ("core", "_core")},
    **{(f"numpy.{core}.numeric", "_frombuffer"): "_frombuffer" for core in ("core", "_core")},
}
"""The words that plain pickles may say."""
_DTYPE = re.compile(r"[|<>=]?(b1|[iu][1248]|f[248]|c8|c16|[SU][1-9][0-9]{0,4}|O8?)")


@dataclass(frozen=True)
class Name:
    """One of the words of numpy's pickles; never the thing it names."""

    word: str


@dataclass(eq=False)
class _Dtype:
    """A numpy type as its pickle builds it: first the letters, then the byte order."""

    letters: str
    order: str | None = None

    def numpy(self) -> np.dtype:
        dtype = np.dtype(self.letters)
        return dtype if self.order in (None, "|") else dtype.newbyteorder(cast(Any, self.order))


@dataclass(eq=False)
class _Array:
    """An array as its pickle builds it: empty first, since others may refer to it before it is filled."""

    shape: tuple[int, ...] = ()
    values: np.ndarray | list[Any] | None = None


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
        numpy scalars. Arrays may be read-only. Numbers may be NaN: the caller knows whether that is wrong.

    Raises:
        MotionloomError: Anything else in it (a class, a call, a persistent id, a value that holds itself), or it is
            damaged, too large or nested deeper than `MAX_DEPTH`.
    """
    try:
        if len(data) > limit:
            raise ValueError(f"it holds {len(data)} bytes, more than {limit}")
        stream = io.BytesIO(data)
        value = Machine(min(limit, _SPARE + 2 * len(data))).run(stream)
        if stream.read(1):
            raise ValueError("it does not hold exactly one value")
        return value
    except BROKEN as error:
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise MotionloomError(f"{name} is not a pickle of plain values and is not opened ({reason})") from None


BROKEN = (ValueError, IndexError, KeyError, TypeError, AttributeError, OverflowError, MemoryError, RecursionError)
"""What a damaged pickle raises in a `Machine`."""


@dataclass
class Machine:
    """Carries out the operations of one pickle; `lab.papers.torch_file` teaches it the few names of torch's files."""

    limit: int
    """Most bytes of all arrays together, and of all texts that are made bytes."""
    names: Mapping[tuple[str, str], str] = field(default_factory=lambda: NAMES)
    """The words that the file may say, by module and name."""
    stack: list[Any] = field(default_factory=list)
    below: list[list[Any]] = field(default_factory=list)  # the stacks under each open mark
    memo: dict[int, Any] = field(default_factory=dict)
    made: Counter[str] = field(default_factory=Counter)  # bytes of arrays, and of texts made bytes

    def run(self, stream: io.BytesIO) -> object:
        """The value of the pickle that begins where the stream is; the stream is left behind it.

        Raises one of `BROKEN` for whatever is wrong with it.
        """
        for _ in range(MAX_OPERATIONS):
            operation = _OPERATIONS.get(stream.read(1).decode("latin-1"))
            if operation is None:
                raise ValueError("it is damaged or cut short")
            if operation.name == "STOP":
                return self._result()
            if operation.name == "STRING":
                value = _quoted(stream.readline())  # pickletools' own reader admits ASCII only
            else:
                value = None if operation.arg is None else operation.arg.reader(stream)
            self._step(operation.name, value)
        raise ValueError(f"it has more than {MAX_OPERATIONS} operations")

    def _result(self) -> object:
        if self.below or len(self.stack) != 1:
            raise ValueError("it does not hold exactly one value")
        return Finished().of(self.stack[0], 0)[0]

    def _step(self, name: str, value: Any) -> None:
        stack = self.stack
        if name in _PUSHES:
            stack.append(_checked(value))
        elif name in _CONSTANTS:
            stack.append(_CONSTANTS[name])
        elif name in _EMPTY:
            stack.append(_EMPTY[name]())
        elif name in _REMEMBERS:
            self.memo[len(self.memo) if name == "MEMOIZE" else value] = stack[-1]
        elif name in _RECALLS:
            stack.append(self.memo[value])
        elif name == "MARK":
            self.below.append(stack)
            self.stack = []
        elif name in ("TUPLE", "LIST", "DICT", "APPENDS", "SETITEMS"):
            self.stack = self.below.pop()
            self._gather(name, stack)
        elif name in ("APPEND", "SETITEM"):
            values = self._take(1 if name == "APPEND" else 2)
            _fill(stack[-1], values)
        elif name in _TUPLES:
            stack.append(tuple(self._take(_TUPLES[name])))
        else:
            self._numpy_step(name, value)

    def _gather(self, name: str, values: list[Any]) -> None:
        if name in ("APPENDS", "SETITEMS"):
            _fill(self.stack[-1], values)
        elif name == "TUPLE":
            self.stack.append(tuple(values))
        else:
            container: Any = [] if name == "LIST" else {}
            _fill(container, values)
            self.stack.append(container)

    def _numpy_step(self, name: str, value: Any) -> None:
        if name == "GLOBAL":
            module, _, word = value.partition(" ")
            self.stack.append(self._named(module, word))
        elif name == "STACK_GLOBAL":
            self.stack.append(self._named(*self._take(2)))
        elif name == "REDUCE":
            called, arguments = self._take(2)
            if not isinstance(called, Name) or not isinstance(arguments, tuple):
                raise ValueError("it calls something")
            self.stack.append(self.made_of(called.word, arguments))
        elif name == "BUILD":
            (state,) = self._take(1)
            self.build(self.stack[-1], state)
        elif name not in _IGNORED:
            raise ValueError(f"it asks for {name}")

    def _take(self, count: int) -> list[Any]:
        if len(self.stack) < count:
            raise ValueError("it is damaged")
        values = self.stack[-count:]
        del self.stack[-count:]
        return values

    def _named(self, module: object, word: object) -> Name:
        if not isinstance(module, str) or not isinstance(word, str):  # whose text might be endless
            raise ValueError("it names something by other than two words")
        if (module, word) not in self.names:
            raise ValueError(f"it names {module[:40]}.{word[:40]}")
        return Name(self.names[module, word])

    def made_of(self, word: str, arguments: tuple[Any, ...]) -> object:
        """What a word of the file makes of its arguments."""
        if word == "dtype" and isinstance(arguments[0], str) and _DTYPE.fullmatch(arguments[0]):
            return _Dtype(arguments[0])
        if word == "_reconstruct" and isinstance(arguments[0], Name) and arguments[0].word == "ndarray":
            return _Array()
        if word == "_frombuffer":
            data, dtype, shape, order = arguments
            array = _Array()
            self.build(array, (1, shape, dtype, order == "F", data))
            return array
        if word == "scalar" and len(arguments) == 2:
            return self._values(arguments[1], arguments[0], ())[()]
        if word == "encode" and len(arguments) == 2 and arguments[1] in ("latin1", "latin-1"):
            data = _bytes(arguments[0])
            self._count("texts", len(data))
            return data
        if word == "bytes" and not arguments:
            return b""
        raise ValueError(f"its {word} cannot be read")

    def build(self, made: object, state: object) -> None:
        """Fill what was made before with what the file says of it."""
        if not isinstance(state, tuple) or len(state) < 5:
            raise ValueError("its array is incomplete")
        if isinstance(made, _Dtype) and made.order is None and state[1] in ("<", ">", "|", "="):
            if any(part is not None for part in state[2:5]):
                raise ValueError("its array has fields")
            made.order = state[1]
            return
        _, shape, dtype, columns, data = state[:5]
        if not isinstance(made, _Array) or made.values is not None:
            raise ValueError("it builds something that is no array")
        if not isinstance(shape, tuple) or len(shape) > 16 or not all(type(n) is int and n >= 0 for n in shape):
            raise ValueError("its array has no shape")
        made.shape = shape
        if isinstance(data, list):
            made.values = self._objects(data, dtype, shape, by_columns=bool(columns))
        else:
            made.values = self._values(data, dtype, shape, "F" if columns else "C")

    def _objects(self, data: list[Any], dtype: object, shape: tuple[int, ...], *, by_columns: bool) -> list[Any]:
        if not isinstance(dtype, _Dtype) or dtype.numpy().hasobject is False or (by_columns and len(shape) > 1):
            raise ValueError("its array holds objects")
        self._count("arrays", 8 * len(data))
        if math.prod(shape) != len(data):
            raise ValueError(f"its array of shape {shape} has {len(data)} values")
        return list(data)

    def _values(self, data: object, dtype: object, shape: tuple[int, ...], order: Any = "C") -> np.ndarray:
        kind = dtype.numpy() if isinstance(dtype, _Dtype) else np.dtype(object)
        if kind.hasobject or not isinstance(data, bytes | bytearray | str):
            raise ValueError("its array does not hold numbers")
        if len(data) != math.prod(shape) * kind.itemsize:
            raise ValueError(f"its array of shape {shape} has {len(data)} bytes")
        self._count("arrays", len(data))
        data = _bytes(data)
        if kind.kind == "b":
            return (np.frombuffer(data, np.uint8) != 0).reshape(shape, order=order)
        if (
            kind.kind == "U"
            and (np.frombuffer(data, np.dtype(np.uint32).newbyteorder(kind.byteorder)) > 0x10FFFF).any()
        ):
            raise ValueError("its array holds numbers that are no characters")
        return np.frombuffer(data, kind).reshape(shape, order=order) if data else np.zeros(shape, kind)

    def _count(self, what: str, size: int) -> None:
        # A short file can name the same long string again and again.
        self.made[what] += size
        if self.made[what] > self.limit:
            raise ValueError(f"its {what} hold more than {self.limit} bytes")


class Finished:
    """The values with their arrays in place; shared values stay shared, and cycles are refused."""

    def __init__(self) -> None:
        self.done: dict[int, tuple[Any, int]] = {}
        self.open: set[int] = set()

    def of(self, value: Any, depth: int) -> tuple[Any, int]:
        """The finished value and how many items it unfolds to."""
        if not isinstance(value, list | dict | tuple | _Array):
            if isinstance(value, Name | _Dtype):
                raise ValueError("it holds a name and no value")
            return value, 1
        if id(value) in self.open or depth > MAX_DEPTH:
            raise ValueError(f"it holds itself or is nested deeper than {MAX_DEPTH}")
        if id(value) not in self.done:
            self.open.add(id(value))
            self.done[id(value)] = self._container(value, depth + 1)
            self.open.discard(id(value))
        finished, size = self.done[id(value)]
        if size > MAX_ITEMS:
            raise ValueError(f"it unfolds to more than {MAX_ITEMS} items")
        return finished, size

    def _container(self, value: Any, depth: int) -> tuple[Any, int]:
        if isinstance(value, _Array):
            if value.values is None:
                raise ValueError("its array is incomplete")
            if isinstance(value.values, np.ndarray):
                return value.values, 1
        items = value.values if isinstance(value, _Array) else value.values() if isinstance(value, dict) else value
        pairs = [self.of(item, depth) for item in cast(Any, items)]
        finished, size = [item for item, _ in pairs], 1 + sum(count for _, count in pairs)
        if isinstance(value, dict):
            return dict(zip(value, finished, strict=True)), size
        if isinstance(value, _Array):
            array = np.empty(len(finished), dtype=object)
            for place, item in enumerate(finished):
                array[place] = item
            return array.reshape(value.shape), size
        return (tuple(finished) if isinstance(value, tuple) else finished), size


def _bytes(data: object) -> bytes:
    if not isinstance(data, str | bytes | bytearray):
        raise ValueError("its bytes are none")
    return data.encode("latin-1") if isinstance(data, str) else bytes(data)


def _quoted(line: bytes) -> str:
    text = line.strip()
    if len(text) < 2 or text[:1] not in (b'"', b"'") or text[-1:] != text[:1] or not line.endswith(b"\n"):
        raise ValueError("it is damaged")
    return cast(bytes, codecs.escape_decode(text[1:-1])[0]).decode("latin-1")


def _checked(value: Any) -> Any:
    if type(value) is int and not -(1 << 63) <= value < 1 << 64:
        raise ValueError("it holds a number of more than 64 bits")
    return value


def _fill(container: Any, values: list[Any]) -> None:
    if isinstance(container, list):
        container.extend(values)
    elif isinstance(container, dict) and len(values) % 2 == 0:
        if not all(isinstance(key, str | bytes | int | float | None) for key in values[::2]):
            raise ValueError("a key of its table is no plain value")
        container.update(zip(values[::2], values[1::2], strict=True))
    else:
        raise ValueError("it fills something that is no list or table")
