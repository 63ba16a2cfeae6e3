"""What is measured of every motion of a batch, and conditions on it, such as ``skate < 0.2 and obeys``."""

import ast
import importlib
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.reading import read_table
from motionloom.kinematics import physics

Values = Mapping[str, float | bool | None]
Judge = Callable[[str, np.ndarray, float], bool | None]
"""(prompt, positions (frames, 22, 3) metres, fps) to whether the motion does what the words say; None: unknown."""

_TABLE = read_table("motionloom.bulk", "measures.toml")
MEANING: dict[str, str] = _TABLE["motion"]
"""What each measure is."""
ROBOT: dict[str, str] = _TABLE["robot"]
"""Of rows with a robot, as `motionloom.robots.figures` has them."""
SHARED = ("apart", "nearest")
"""Measures of two people together."""
SECOND = "second_"
"""What the measures of the second of two people are called beside those of the first."""


def measure(motion: Motion, prompt: str, judge: Judge | None = None) -> dict[str, float | bool | None]:
    """Measures of a motion of the 22-joint person, rounded; None where a measure has no meaning for it."""
    positions, fps = motion.positions(), motion.fps
    skate, jerk = physics.foot_skate(positions, fps), physics.jerk(positions, fps)
    travel = physics.travel(positions, fps)
    numbers = {
        "seconds": motion.seconds,
        "skate": skate.ratio,
        "skate_speed": skate.contact_speed,
        "penetration": physics.penetration(positions),
        "floating": physics.float_height(positions),
        "jerk": jerk.mean,
        "peak_jerk": jerk.peak,
        "travel": travel,
        "speed": travel / motion.seconds,
        "turn": float(np.degrees(physics.turn(positions))),
    }
    values: dict[str, float | bool | None] = {name: round(float(value), 4) for name, value in numbers.items()}
    unknown = dict.fromkeys(("error", "worst", "keeps", *SHARED))
    return {**values, **unknown, "obeys": judge(prompt, positions, fps) if judge else None}


def measure_two(people: Sequence[Motion], prompts: Sequence[str], judge: Judge | None = None) -> list[dict[str, Any]]:
    """Measures of each of two people in one world, as of `measure`, and with them those of both together."""
    first, second = (person.positions() for person in people)
    hips = np.linalg.norm(first[:, 0] - second[:, 0], axis=-1)
    nearest = min(float(np.linalg.norm(a[:, None] - b[None], axis=-1).min()) for a, b in zip(first, second))
    together = {"apart": round(float(hips.mean()), 4), "nearest": round(nearest, 4)}
    return [{**measure(person, prompt, judge), **together} for person, prompt in zip(people, prompts, strict=True)]


def in_one(people: Sequence[Values]) -> dict[str, float | bool | None]:
    """The measures of everybody in a motion as one mapping: the first person's by their names, the second's as well."""
    second = {f"{SECOND}{name}": value for name, value in people[1].items() if name not in SHARED} if people[1:] else {}
    return {**people[0], **second}


def find_judge(name: str) -> Judge:
    """The function ``module:name``; raises `MotionloomError` where there is none."""
    module, _, function = name.partition(":")
    try:
        return getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError, ValueError) as error:
        raise MotionloomError(f"no judge {name!r} ({error}); name one as module:function") from None


class Filter:
    """A condition on measures: comparisons, ``and``, ``or``, ``not``, ``+ - * /``, numbers and names of `MEANING`
    and `ROBOT`.

    A comparison with a measure that has no meaning for a motion is unknown, and unknown holds: ``obeys`` lets
    motions pass whose prompt no check knows.
    """

    def __init__(self, text: str) -> None:
        """Raises `MotionloomError` for whatever else the text contains; nothing of it is ever executed."""
        self.text = text
        if len(text) > 1000:
            raise MotionloomError(f"the filter has {len(text):,} characters; say it in at most 1,000")
        try:
            tree = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError, MemoryError, RecursionError):
            raise MotionloomError(
                f"the filter {text!r} is no condition; write one such as: skate < 0.2 and obeys"
            ) from None
        self._value = _compiled(tree, text)
        self.names = frozenset(node.id for node in ast.walk(tree) if isinstance(node, ast.Name))

    def holds(self, values: Values) -> bool:
        """Whether the measures meet the condition; what is unknown does."""
        value = self._value(values)
        return True if value is None else bool(value)


_COMPARE: dict[type, Callable[[Any, Any], bool]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
_COUNT: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: lambda a, b: None if b == 0 else a / b,
}


def _compiled(node: ast.expr, text: str, depth: int = 0) -> Callable[[Values], Any]:
    """What computes the value of an expression, None where it is unknown (as in Kleene's logic of three values).

    Raises `MotionloomError` for every other expression.
    """
    if depth > 50:
        raise MotionloomError("the filter is nested too deeply; say it more plainly")

    def inside(*parts: ast.expr) -> list[Callable[[Values], Any]]:
        return [_compiled(part, text, depth + 1) for part in parts]

    match node:
        case ast.BoolOp(op=op, values=parts):
            functions = inside(*parts)
            return lambda values: _all_or_any(isinstance(op, ast.Or), [part(values) for part in functions])
        case ast.UnaryOp(op=ast.Not() | ast.USub() as op, operand=part):
            return _of_known(operator.not_ if isinstance(op, ast.Not) else operator.neg, inside(part))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _COUNT:
            return _of_known(_COUNT[type(op)], inside(left, right))
        case ast.Compare(left=left, ops=ops, comparators=others) if all(type(op) in _COMPARE for op in ops):
            functions = inside(left, *others)
            return lambda values: _compared(ops, [part(values) for part in functions])
        case ast.Constant(value=bool() | int() | float() as value):
            return lambda values: value
        case ast.Name(id=name):
            if name not in MEANING and name not in ROBOT:
                known = ", ".join((*MEANING, *ROBOT))
                raise MotionloomError(f"the filter {text!r} asks for {name!r}; the measures are {known}")
            return lambda values: values.get(name)
    excerpt = (ast.get_source_segment(text.strip(), node) or "")[:40]
    raise MotionloomError(
        f"the filter {text!r} holds {excerpt!r}; it may hold comparisons of measures and numbers, and, or, not"
    )


def _of_known(function: Callable[..., Any], parts: Sequence[Callable[[Values], Any]]) -> Callable[[Values], Any]:
    """A function of parts, unknown where one of them is."""

    def value(values: Values) -> Any:
        numbers = [part(values) for part in parts]
        return None if None in numbers else function(*numbers)

    return value


def _all_or_any(decisive: bool, values: Sequence[Any]) -> bool | None:
    """``or`` of values if ``decisive`` is True, else ``and``; None where unknown ones decide."""
    if any(one is not None and bool(one) == decisive for one in values):
        return decisive
    return None if None in values else not decisive


def _compared(ops: Sequence[ast.cmpop], values: Sequence[Any]) -> bool | None:
    """A chain of comparisons; None where it holds for what is known and something is unknown."""
    pairs = list(zip(values, ops, values[1:], strict=False))
    known = [_COMPARE[type(op)](a, b) for a, op, b in pairs if a is not None and b is not None]
    return False if not all(known) else None if len(known) < len(pairs) else True
