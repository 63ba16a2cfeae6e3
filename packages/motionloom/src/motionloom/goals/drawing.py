"""A line drawn in an SVG file as points: the first path, polyline, polygon, line, circle or ellipse of the drawing.

Path data and basic shapes as in SVG 1.1, chapters 8 and 9, with the ``transform`` of the shape and of all groups around
it (chapter 7). Styles, percentages and units other than the drawing's own are not looked at.
"""

import re
from collections.abc import Iterator
from itertools import islice, pairwise
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.files import text

Array = NDArray[np.float64]

SHAPES = ("path", "polyline", "polygon", "line", "circle", "ellipse")
_NOT_RENDERED = {"defs", "clipPath", "mask", "marker", "pattern", "symbol"}
_MAX_BYTES = 16_000_000
_DEEPEST = 500
MAX_PIECES = 20_000
"""Lines and curves in one path."""
_FINE = 48
"""Straight pieces per curve."""
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_BLANK = re.compile(r"[\s,]*")
_TRANSFORM = re.compile(  # possessive, so that a long run of blanks costs no time
    r"\s*+,?\s*+(matrix|translate|scale|rotate|skewX|skewY)\s*+\(([^()]*+)\)"
)
MAX_TRANSFORMS = 1000
"""Steps of all transforms around a shape."""
_TAKES = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}


def read_drawing(path: Path | str) -> Array:
    """(n, 2) points of the drawing's first shape, in its units, seen from above: left on the page is +x, up is +z.

    Curves become fine straight pieces; the first point of the stroke is (0, 0). Raises `MotionloomError` for a file
    that is missing, larger than 16 MB, not well-formed, that declares a document type (where entities come from), or
    whose first shape cannot be walked: damaged, without length, or of several strokes.
    """
    name, attributes, matrix = _first_shape(text.read_bytes(path, max_bytes=_MAX_BYTES), path)
    try:
        strokes = np.array([(point.real, point.imag) for point in _POINTS[name](attributes)])
    except _BadShape as error:
        raise MotionloomError(f"{path}: the <{name}> cannot be walked: {error}") from None
    points = strokes @ matrix[:, :2].T + matrix[:, 2]
    points = -(points - points[:1]) + 0.0
    if not (np.isfinite(points).all() and np.abs(points).max() <= text.LIMIT and np.abs(points).max() > 0):
        raise MotionloomError(f"{path}: the <{name}> has no length, or is larger than any drawing")
    return points


class _BadShape(Exception):
    """What is wrong with a shape's numbers."""


def _first_shape(data: bytes, path: Path | str) -> tuple[str, dict[str, str], Array]:
    """Its name, its attributes and the 2 x 3 matrix of the transforms around it."""
    parser = expat.ParserCreate()
    around: list[tuple[bool, str]] = []  # of each element that is open: is it hidden, its transform
    shapes: list[tuple[str, dict[str, str], list[str]]] = []

    def doctype(*_: object) -> None:
        raise MotionloomError(f"{path} declares a document type, which is not read; save it as plain SVG")

    def begin(name: str, attributes: dict[str, str]) -> None:
        name = name.rpartition(":")[2]
        if not around and name != "svg":
            raise MotionloomError(f"{path} is not an SVG drawing: its outermost element is {text.shown(name)}")
        if len(around) == _DEEPEST:
            raise MotionloomError(f"{path} has elements more than {_DEEPEST} deep, which are not read")
        hidden = name in _NOT_RENDERED or bool(around and around[-1][0])
        around.append((hidden, attributes.get("transform", "")))
        if name in SHAPES and not hidden and not shapes:
            shapes.append((name, attributes, [source for _, source in around]))

    def end(_: str) -> None:
        around.pop()

    parser.StartDoctypeDeclHandler = doctype
    parser.StartElementHandler = begin
    parser.EndElementHandler = end
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, ValueError, LookupError) as error:
        if isinstance(error, MotionloomError):
            raise
        raise MotionloomError(f"{path} is not well-formed XML: {error}") from None
    if not shapes:
        raise MotionloomError(f"{path} has no line to walk: draw a {', '.join(SHAPES[:-1])} or {SHAPES[-1]}")
    name, attributes, transforms = shapes[0]
    matrix = np.eye(2, 3)
    try:
        steps = list(islice((step for source in transforms for step in _transform(source)), MAX_TRANSFORMS + 1))
        if len(steps) > MAX_TRANSFORMS:
            raise _BadShape(f"more than {MAX_TRANSFORMS} transforms around it")
        for kind, values in steps:
            matrix = _chained(matrix, _one_transform(kind, values))
    except _BadShape as error:
        raise MotionloomError(f"{path}: the <{name}> has {error}") from None
    return name, attributes, matrix


def _chained(outer: Array, inner: Array) -> Array:
    return np.column_stack([outer[:, :2] @ inner[:, :2], outer[:, :2] @ inner[:, 2] + outer[:, 2]])


def _transform(source: str) -> Iterator[tuple[str, list[float]]]:
    """The steps of a ``transform`` attribute: what each does, and its numbers."""
    source, at = source.strip(), 0
    while at < len(source):
        match = _TRANSFORM.match(source, at)
        if match is None:
            raise _BadShape(f"a transform that cannot be read: {text.shown(source[at : at + 100])}")
        yield match[1], _list(match[2], most=6)
        at = match.end()


def _one_transform(kind: str, v: list[float]) -> Array:
    if len(v) not in {"matrix": (6,), "rotate": (1, 3), "translate": (1, 2), "scale": (1, 2)}.get(kind, (1,)):
        raise _BadShape(f"a {kind} of {len(v)} numbers")
    if kind == "matrix":
        return np.array([[v[0], v[2], v[4]], [v[1], v[3], v[5]]])
    if kind == "translate":
        return np.array([[1, 0, v[0]], [0, 1, v[1] if len(v) > 1 else 0.0]])
    if kind == "scale":
        return np.array([[v[0], 0, 0], [0, v[-1], 0]])
    if kind != "rotate":
        slant = np.tan(np.radians(v[0]))
        return np.array([[1, slant, 0], [0, 1, 0]]) if kind == "skewX" else np.array([[1, 0, 0], [slant, 1, 0]])
    c, s = np.cos(np.radians(v[0])), np.sin(np.radians(v[0]))
    x, y = v[1:] or (0.0, 0.0)
    return np.array([[c, -s, x - c * x + s * y], [s, c, y - s * x - c * y]])


def _list(source: str, *, most: int) -> list[float]:
    """Numbers parted by blanks or commas; one more than ``most`` where there are more."""
    values, at = [], _BLANK.match(source).end()  # type: ignore[union-attr]
    while at < len(source) and len(values) <= most:
        value, at = _number(source, at)
        values.append(value)
        at = _BLANK.match(source, at).end()  # type: ignore[union-attr]
    return values


def _number(source: str, at: int) -> tuple[float, int]:
    match = _NUMBER.match(source, at)
    value = None if match is None else text.number(match[0])
    if match is None or value is None:
        raise _BadShape(f"{text.shown(source[at : at + 20])} is where a number below 1e9 is expected")
    return value, match.end()


def _attribute(attributes: dict[str, str], name: str) -> float:
    source = attributes.get(name, "0").strip()
    value, end = _number(source, 0)
    if source[end:] not in ("", "px"):
        raise _BadShape(f"its {name} is {text.shown(source)}; give a number in the drawing's own unit")
    return value


def _polyline(attributes: dict[str, str]) -> list[complex]:
    values = _list(attributes.get("points", ""), most=2 * MAX_PIECES)
    if len(values) > 2 * MAX_PIECES:
        raise _BadShape(f"it has more than {MAX_PIECES} points")
    if len(values) < 4 or len(values) % 2:
        raise _BadShape(f"its points are {len(values)} numbers; 2 to {MAX_PIECES} pairs are read")
    return [complex(x, y) for x, y in zip(values[::2], values[1::2], strict=True)]


def _polygon(attributes: dict[str, str]) -> list[complex]:
    points = _polyline(attributes)
    return [*points, points[0]]


def _line(attributes: dict[str, str]) -> list[complex]:
    x1, y1, x2, y2 = (_attribute(attributes, name) for name in ("x1", "y1", "x2", "y2"))
    return [complex(x1, y1), complex(x2, y2)]


def _ellipse(attributes: dict[str, str]) -> list[complex]:
    """From the rightmost point, clockwise on the page."""
    rx, ry = (_attribute(attributes, name if name in attributes else "r") for name in ("rx", "ry"))
    if rx <= 0 or ry <= 0:
        raise _BadShape("its radius is not positive")
    angle = np.linspace(0, 2 * np.pi, 8 * _FINE + 1)
    centre = complex(_attribute(attributes, "cx"), _attribute(attributes, "cy"))
    return [*(centre + rx * np.cos(angle) + 1j * ry * np.sin(angle))]


def _path(attributes: dict[str, str]) -> list[complex]:
    pen = _Pen()
    for command, values in _commands(attributes.get("d", "")):
        pen.draw(command, values)
    if len(pen.points) < 2:
        raise _BadShape("it draws nothing")
    return pen.points


def _commands(source: str):
    """(letter, numbers) of path data, repeated letters written out."""
    at, letter, count = _BLANK.match(source).end(), "", 0  # type: ignore[union-attr]
    while at < len(source):
        if source[at].upper() in _TAKES:
            letter, at = source[at], at + 1
        elif letter.upper() in ("", "Z"):
            raise _BadShape(f"{text.shown(source[at : at + 20])} is where a command such as M or L is expected")
        elif letter in "Mm":
            letter = "L" if letter == "M" else "l"
        values = []
        for place in range(_TAKES[letter.upper()]):
            at = _BLANK.match(source, at).end()  # type: ignore[union-attr]
            if letter in "Aa" and place in (3, 4):  # a flag is one digit and may touch the next number
                if source[at : at + 1] not in ("0", "1"):
                    raise _BadShape(f"{text.shown(source[at : at + 20])} is where an arc's flag, 0 or 1, is expected")
                value, at = float(source[at]), at + 1
            else:
                value, at = _number(source, at)
            values.append(value)
        at = _BLANK.match(source, at).end()  # type: ignore[union-attr]
        count += 1
        if count > MAX_PIECES:
            raise _BadShape(f"it has more than {MAX_PIECES} pieces")
        yield letter, values


class _Pen:
    """Follows path data; points are complex numbers, x + iy."""

    def __init__(self) -> None:
        self.points: list[complex] = []
        self.at = self.first = 0j
        self.handle: tuple[str, complex] = "", 0j
        """The last command and its last control point, which S and T mirror."""

    def draw(self, letter: str, v: list[float]) -> None:
        """One command with its numbers."""
        kind, base = letter.upper(), self.at if letter.islower() else 0j
        if kind == "M":
            self._move(base + complex(*v))
            return
        if not self.points:
            if not self.handle[0]:
                raise _BadShape("its data do not begin with M")
            self.points.append(self.at)
        if kind == "Z":
            self._to([self.first], "Z")
        elif kind in "HV":
            x, y = (base.real + v[0], self.at.imag) if kind == "H" else (self.at.real, base.imag + v[0])
            self._to([complex(x, y)], kind)
        elif kind == "A":
            self._to(_arc(self.at, v, base + complex(*v[5:])), kind)
        else:
            self._bend(kind, [base + complex(x, y) for x, y in zip(v[::2], v[1::2], strict=True)])

    def _move(self, place: complex) -> None:
        if len(self.points) > 1 and place != self.at:
            raise _BadShape("it lifts the pen; draw it in one stroke")
        self.at = self.first = place
        self.handle = "M", place

    def _bend(self, kind: str, p: list[complex]) -> None:
        """L, C, S, Q or T as Bezier curves."""
        if kind in "ST":
            mirrored = 2 * self.at - self.handle[1] if self.handle[0] in {"S": "CS", "T": "QT"}[kind] else self.at
            p = [mirrored, *p]
        u = np.linspace(0, 1, 2 if kind == "L" else _FINE + 1)[1:]
        curve: list[Any] = [self.at, *p]
        while len(curve) > 1:  # de Casteljau
            curve = [a * (1 - u) + b * u for a, b in pairwise(curve)]
        self._to([*curve[0]], kind, p[-2] if len(p) > 1 else p[-1])

    def _to(self, points: list[complex], kind: str, handle: complex | None = None) -> None:
        self.points.extend(points)
        self.at = points[-1]
        self.handle = kind, self.at if handle is None else handle


def _arc(start: complex, v: list[float], end: complex) -> list[complex]:
    """The elliptic arc of SVG 1.1, appendix F.6.5 and F.6.6."""
    rx, ry, turn = abs(v[0]), abs(v[1]), np.exp(1j * np.radians(v[2]))
    if start == end or rx == 0 or ry == 0:
        return [end]
    half = (start - end) / 2 / turn
    x, y = half.real / rx, half.imag / ry
    grow = max(1.0, np.hypot(x, y))
    rx, ry, x, y = rx * grow, ry * grow, x / grow, y / grow
    square = x * x + y * y
    if square < 1e-18:  # the ellipse is so large that its arc is a straight line
        return [end]
    root = np.sqrt(max(0.0, (1 - square) / square)) * (1 if v[3] != v[4] else -1)
    cx, cy = root * y, -root * x
    begin, stop = np.arctan2(y - cy, x - cx), np.arctan2(-y - cy, -x - cx)
    sweep = (stop - begin) % (2 * np.pi) if v[4] else -((begin - stop) % (2 * np.pi))
    angle = begin + sweep * np.linspace(0, 1, 2 * _FINE + 1)[1:]
    centre = (start + end) / 2
    points = centre + turn * (rx * (cx + np.cos(angle)) + 1j * ry * (cy + np.sin(angle)))
    return [*points[:-1], end]


_POINTS = {
    "path": _path,
    "polyline": _polyline,
    "polygon": _polygon,
    "line": _line,
    "circle": _ellipse,
    "ellipse": _ellipse,
}
