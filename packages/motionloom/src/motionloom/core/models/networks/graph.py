"""What an ONNX graph out of a weight file holds, looked at before anything runs it.

A graph comes with weights that anybody may have made. It may only use the operators that networks here are written
with; it holds no weights, no other files, no code, no graphs inside of graphs. This reads the protocol buffers
themselves, so that nothing but these bytes is needed: field numbers are those of onnx.proto3.
"""

import math
import struct
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

LOCATION = "weights"
"""Where a graph has its initialisers: with the weights, in the same file."""
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
"""Ends of slices that run to the end."""

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
    model = _parts(memoryview(data), "a model with the part {}, which none here has", (1, 2, 3, 4, 5, 6, 7, 8, 14))
    for opset in model[8]:
        _check_domain(_parts(_part(opset))[1], "operators of {!r}, which are not ONNX's own")
    if len(model[7]) != 1:
        raise ValueError("no ONNX graph")
    graph = _parts(_part(model[7][0]), "a graph with the part {}, which none here has", (1, 2, 5, 10, 11, 12, 13))
    initialisers = [_initialiser(_part(tensor)) for tensor in graph[5]]
    constants = sum(_check_node(_part(node)) for node in graph[1]) + sum(inside for _, _, inside in initialisers)
    if len(graph[1]) > MAX_NODES or constants > MAX_CONSTANTS:
        raise ValueError("a graph too large")
    inputs, outputs = (tuple(_name(_part(value)) for value in graph[number]) for number in (11, 12))
    return Outline(inputs, outputs, {name: shape for name, shape, _ in initialisers if shape is not None})


def _parts(message: memoryview, problem: str = "", known: Collection[int] = ()) -> dict[int, list[Field]]:
    """The values of a message by the numbers of their fields; a ``problem`` for those that are not ``known``."""
    values: dict[int, list[Field]] = defaultdict(list)
    for number, value in fields(message):
        if problem and number not in known:
            raise ValueError(problem.format(number))
        values[number].append(value)
    return values


def _check_domain(names: Sequence[Field], problem: str) -> None:
    for name in names:
        if bytes(_part(name)) not in (b"", b"ai.onnx"):
            raise ValueError(problem.format(_text(name)))


def _check_node(node: memoryview) -> int:
    """Bytes of the constants in a node."""
    parts, inside = _parts(node), 0
    for operator in parts[4]:
        if _text(operator) not in OPERATORS:
            raise ValueError(f"the operator {_text(operator)!r}, which no network here has")
    _check_domain(parts[7], "an operator of {!r}, which is not ONNX's own")
    for attribute in parts[5]:
        problem = "an attribute of the kind {}, which no network here has"
        for tensor in _parts(_part(attribute), problem, (1, 2, 3, 4, 5, 7, 8, 13, 20))[5]:
            _, shape, size = _initialiser(_part(tensor))
            inside += size
            if shape is not None:
                raise ValueError("a constant that lies elsewhere")
    return inside


def _initialiser(tensor: memoryview) -> tuple[str, tuple[int, ...] | None, int]:
    """Name, shape where the numbers are to be had from the weight file, and bytes of what is inside."""
    known = (1, 2, 4, 5, 7, 8, 9, 12, 13, 14)
    parts = _parts(tensor, "a tensor with the part {}, which none here has", known)
    name, raw = ["", *map(_text, parts[8])][-1], bytes([memoryview(b""), *map(_part, parts[9])][-1])
    kind, elsewhere = ([0, *map(_whole, parts[number])][-1] for number in (2, 14))
    shape = [size for value in parts[1] for size in _numbers(value)]
    if any(not 0 <= size <= 1 << 24 for size in shape) or math.prod(shape) > 1 << 28:
        raise ValueError(f"a tensor {name!r} of the shape {shape}")
    if elsewhere or parts[13]:
        places = [dict(fields(_part(value))) for value in parts[13]]
        nothing = memoryview(b"")
        locations = [(_text(place.get(1, nothing)), _text(place.get(2, nothing))) for place in places]
        if locations != [("location", LOCATION)] or kind != _FLOAT or raw:
            raise ValueError(f"a tensor {name!r} that lies in another file")
        return name, tuple(shape), 0
    if kind in (_INT32, _INT64):
        _check_whole([number for value in parts[5] + parts[7] for number in _numbers(value)] + _unpacked(raw, kind))
    return name, None, len(tensor)


def _check_whole(numbers: list[int]) -> None:
    sizes = [max(abs(number), 1) for number in numbers if number not in _ENDS]
    if sizes and (max(sizes) > MAX_NUMBER or (len(sizes) <= 8 and math.prod(sizes) > MAX_NUMBER**2 // 64)):
        raise ValueError(f"a shape of {max(sizes)}, larger than anything here")


def _unpacked(raw: bytes, kind: int) -> list[int]:
    size, code = (4, "i") if kind == _INT32 else (8, "q")
    count = len(raw) // size
    return list(struct.unpack(f"<{count}{code}", raw[: count * size]))


def _name(info: memoryview) -> str:
    return next((_text(value) for number, value in fields(info) if number == 1), "")


def _text(value: Field) -> str:
    return bytes(_part(value)).decode("utf-8", "replace")[:100]


def _part(value: Field) -> memoryview:
    if isinstance(value, int):
        raise ValueError("a number where there should be a part")
    return value


def _whole(value: Field) -> int:
    if not isinstance(value, int):
        raise ValueError("a part where there should be a number")
    return value


def _numbers(value: Field) -> list[int]:
    """Of a repeated number, packed or not."""
    if isinstance(value, int):
        return [_signed(value)]
    numbers, place = [], 0
    while place < len(value):
        number, place = _varint(value, place)
        numbers.append(_signed(number))
    return numbers


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
