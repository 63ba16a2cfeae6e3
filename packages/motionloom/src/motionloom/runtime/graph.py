"""What an ONNX graph out of a weight file holds, looked at before anything runs it.

A graph comes with weights that anybody may have made. It may only use the operators that networks here are written
with; it holds no weights, no other files, no code, no graphs inside of graphs. This reads the protocol buffers
themselves, so that nothing but these bytes is needed: field numbers are those of onnx.proto3.
"""

import math
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

LOCATION = "weights"
"""What a graph says of where its initialisers lie: with the weights, in the same file."""
MAX_BYTES = 4 << 20
MAX_NODES = 20_000
MAX_CONSTANTS = 1 << 20
"""Bytes of all constants together."""
MAX_NUMBER = 65_536
"""The largest whole number of a constant, and the largest product of them: what is used as a shape."""
OPERATORS = frozenset(
    """
    Add And Cast Clip Concat Constant ConstantOfShape Cos CumSum Div Equal Exp Expand Flatten Gather Gelu Gemm Greater
    Identity LayerNormalization Less MatMul Max Min Mod Mul Neg Not Or Pad Pow Range Reciprocal ReduceMean ReduceSum
    Relu Reshape Shape Sigmoid Sin Slice Softmax Split Sqrt Squeeze Sub Tanh Transpose Unsqueeze Where
    """.split()  # noqa: SIM905
)
_FLOAT, _INT32, _INT64 = 1, 6, 7
_ENDS = (2**63 - 1, 1 - 2**63, -(2**63), 2**31 - 1, -(2**31))
"""How slices say: to the end."""

Field: TypeAlias = "int | memoryview"


@dataclass(frozen=True)
class Outline:
    """The names of a graph."""

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    weights: Mapping[str, tuple[int, ...]]
    """Initialisers that are to be had from the weight file, with their shapes."""


@lru_cache(maxsize=32)  # a graph is looked at when its file is read and when it is run
def outline(data: bytes) -> Outline:
    """Check a graph and give its names; raises ValueError for what is no graph or may not be run."""
    if len(data) > MAX_BYTES:
        raise ValueError(f"a graph of {len(data)} bytes, more than {MAX_BYTES}")
    graphs: list[memoryview] = []
    for number, value in fields(memoryview(data)):
        if number == 7:
            graphs.append(_part(value))
        elif number == 8:
            _check_opset(_part(value))
        elif number not in (1, 2, 3, 4, 5, 6, 14):
            raise ValueError(f"a model with the part {number}, which none here has")
    if len(graphs) != 1:
        raise ValueError("no ONNX graph")
    return _outline(graphs[0])


def _outline(graph: memoryview) -> Outline:
    names: dict[int, list[str]] = {11: [], 12: []}
    weights: dict[str, tuple[int, ...]] = {}
    nodes = constants = 0
    for number, value in fields(graph):
        if number == 1:
            nodes += 1
            constants += _check_node(_part(value))
        elif number == 5:
            name, shape, inside = _initialiser(_part(value))
            constants += inside
            if shape is not None:
                weights[name] = shape
        elif number in names:
            names[number].append(_name(_part(value)))
        elif number not in (2, 10, 13):
            raise ValueError(f"a graph with the part {number}, which none here has")
        if nodes > MAX_NODES or constants > MAX_CONSTANTS:
            raise ValueError("a graph too large")
    return Outline(tuple(names[11]), tuple(names[12]), weights)


def _check_opset(opset: memoryview) -> None:
    for number, value in fields(opset):
        if number == 1 and bytes(_part(value)) not in (b"", b"ai.onnx"):
            raise ValueError(f"operators of {_text(value)!r}, which are not ONNX's own")


def _check_node(node: memoryview) -> int:
    """Bytes of the constants in a node."""
    inside = 0
    for number, value in fields(node):
        if number == 4 and _text(value) not in OPERATORS:
            raise ValueError(f"the operator {_text(value)!r}, which no network here has")
        if number == 7 and bytes(_part(value)) not in (b"", b"ai.onnx"):
            raise ValueError(f"an operator of {_text(value)!r}, which is not ONNX's own")
        if number == 5:
            inside += _check_attribute(_part(value))
    return inside


def _check_attribute(attribute: memoryview) -> int:
    inside = 0
    for number, value in fields(attribute):
        if number == 5:
            _, shape, size = _initialiser(_part(value))
            inside += size
            if shape is not None:
                raise ValueError("a constant that lies elsewhere")
        elif number not in (1, 2, 3, 4, 7, 8, 13, 20):
            raise ValueError(f"an attribute of the kind {number}, which no network here has")
    return inside


def _initialiser(tensor: memoryview) -> tuple[str, tuple[int, ...] | None, int]:
    """Name, shape where the numbers are to be had from the weight file, and bytes of what is inside."""
    shape: list[int] = []
    name, kind, elsewhere, places = "", 0, False, []
    raw = b""
    whole: list[int] = []
    for number, value in fields(tensor):
        if number == 1:
            shape += _numbers(value)
        elif number == 2:
            kind = _whole(value)
        elif number == 8:
            name = _text(value)
        elif number == 9:
            raw = bytes(_part(value))
        elif number in (5, 7):
            whole += _numbers(value)
        elif number == 13:
            places.append(dict(fields(_part(value))))
        elif number == 14:
            elsewhere = _whole(value) != 0
        elif number not in (4, 12):
            raise ValueError(f"a tensor with the part {number}, which none here has")
    if any(not 0 <= size <= 1 << 24 for size in shape) or math.prod(shape) > 1 << 28:
        raise ValueError(f"a tensor {name!r} of the shape {shape}")
    if elsewhere or places:
        said = [(_text(place.get(1, b"")), _text(place.get(2, b""))) for place in places]
        if said != [("location", LOCATION)] or kind != _FLOAT or raw:
            raise ValueError(f"a tensor {name!r} that lies in another file")
        return name, tuple(shape), 0
    if kind in (_INT32, _INT64):
        _check_whole(whole + _unpacked(raw, kind))
    return name, None, len(tensor)


def _check_whole(numbers: list[int]) -> None:
    sizes = [max(abs(number), 1) for number in numbers if number not in _ENDS]
    if sizes and (max(sizes) > MAX_NUMBER or (len(sizes) <= 8 and math.prod(sizes) > MAX_NUMBER**2 // 64)):
        raise ValueError(f"a shape of {max(sizes)}, larger than anything here")


def _unpacked(raw: bytes, kind: int) -> list[int]:
    size, code = (4, "i") if kind == _INT32 else (8, "q")
    count = len(raw) // size
    return list(struct.unpack(f"<{count}{code}", raw[: count * size]))


def _name(value_info: memoryview) -> str:
    return next((_text(value) for number, value in fields(value_info) if number == 1), "")


def _text(value: Field) -> str:
    return bytes(_part(value)).decode("utf-8", "replace")[:100]


def _part(value: "Field | bytes") -> memoryview:
    if isinstance(value, int):
        raise ValueError("a number where there should be a part")
    return memoryview(value)


def _whole(value: Field) -> int:
    if not isinstance(value, int):
        raise ValueError("a part where there should be a number")
    return value


def _numbers(value: Field) -> list[int]:
    """Of a repeated number, packed or not."""
    if isinstance(value, int):
        return [_signed(value)]
    found, place = [], 0
    while place < len(value):
        number, place = _varint(value, place)
        found.append(_signed(number))
    return found


def _signed(number: int) -> int:
    return number - (1 << 64) if number >= 1 << 63 else number


def fields(message: memoryview) -> Iterator[tuple[int, Field]]:
    """Numbers and values of a message's fields; raises ValueError where it is none."""
    place = 0
    while place < len(message):
        tag, place = _varint(message, place)
        number, kind = tag >> 3, tag & 7
        if kind == 0:
            value, place = _varint(message, place)
            yield number, value
            continue
        size = {1: 8, 5: 4}.get(kind, -1)
        if kind == 2:
            size, place = _varint(message, place)
        if size < 0 or place + size > len(message) or not number:
            raise ValueError("no ONNX graph")
        yield number, message[place : place + size]
        place += size


def _varint(message: memoryview, place: int) -> tuple[int, int]:
    number = 0
    for shift in range(0, 70, 7):
        if place >= len(message):
            break
        byte = message[place]
        place += 1
        number |= (byte & 127) << shift
        if byte < 128:
            return number, place
    raise ValueError("no ONNX graph")
