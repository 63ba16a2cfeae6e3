"""Fields of requests: each says its kind, unit, bounds, default and one sentence, and nobody else does.

A request is a frozen dataclass of fields that `declare` and `group` make. It checks itself (`Checked`); doors read the
`Spec` of each field: the command line for its options, the server for its reader and its schemas. A mistake is one
sentence that begins with the place, as each door names places: ``--best-of``, ``'best_of'``, ``best_of``.
"""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import cache
from numbers import Real
from typing import Any, NoReturn, TypedDict, Unpack

from motionloom.core.errors import MotionloomError, kind_of, meant
from motionloom.core.reading import check_text

_PARSERS: Mapping[str, Callable[[str], Any]] = {
    "whole": int,
    "number": float,
    "flag": {"true": True, "false": False}.__getitem__,
}
UNBOUND = 1e6


@dataclass(frozen=True, slots=True)
class Spec:
    """What one field may hold."""

    kind: str
    """number, whole, flag, word or text; or what doors read in their own way, such as motion, timeline or goals."""
    help: str
    """One sentence, without its full stop."""
    default: Any = None
    needed: bool = False
    low: float = -UNBOUND
    high: float = UNBOUND
    """The largest number, or of a text the most characters."""
    above: bool = False
    """``low`` itself is too little."""
    unit: str = ""
    words: tuple[str, ...] = ()
    hint: str = ""
    """What is usual, or what to do, for messages."""
    many: int = 0
    """As many values at most, in a list; 0: one value."""
    size: int = 0
    """Numbers of one value; 0: a single one."""
    pair: bool = False
    """Two people may have one each; in Python alone."""

    @property
    def range(self) -> str:
        """What is allowed, in words."""
        low, high = (f"{bound:,}" if isinstance(bound, int) else f"{bound:,g}" for bound in (self.low, self.high))
        if self.kind == "whole":
            return f"a whole number from {low} to {high}"
        if self.high == UNBOUND:
            return f"{low} or more {self.unit}".rstrip()
        return f"{f'above {low} and at most {high}' if self.above else f'{low} to {high}'} {self.unit}".rstrip()

    def check(self, value: Any, place: str) -> Any:
        """The value as the field holds it; `MotionloomError` that begins with ``place`` for anything else."""
        if self.pair and isinstance(value, tuple):
            return tuple(self._one(one, place) for one in value)
        if not self.many:
            return self._one(value, place)
        if not isinstance(value, list | tuple) or len(value) > self.many:
            _wrong(place, f"must be a list of at most {self.many}", value)
        return tuple(self._one(one, f"{place}[{number}]") for number, one in enumerate(value))

    def parse(self, typed: str, place: str) -> Any:
        """The same of what somebody typed: one value, or one number of several."""
        value: Any = typed
        with suppress(ValueError, KeyError):
            value = _PARSERS.get(self.kind, str)(typed)
        return replace(self, size=0)._one(value, place)

    def _one(self, value: Any, place: str) -> Any:
        if self.size:
            if not isinstance(value, list | tuple) or len(value) != self.size:
                _wrong(place, f"must be a list of {self.size} numbers", value)
            return tuple(replace(self, size=0)._one(one, place) for one in value)
        if self.kind in ("whole", "number"):
            return self._number(value, place)
        if self.kind == "flag" and not isinstance(value, bool):
            _wrong(place, "must be true or false", value)
        if self.kind == "word" and value not in self.words:
            near = meant(value, self.words) if isinstance(value, str) else ""
            raise MotionloomError(f"{place} is {kind_of(value)}{near}; there are {', '.join(self.words)}")
        return self._text(value, place) if self.kind == "text" else value

    def _number(self, value: Any, place: str) -> float:
        if not isinstance(value, Real) or isinstance(value, bool):
            _wrong(place, f"must be a {'whole ' * (self.kind == 'whole')}number", value)
        one: Any = value
        inside = self.low <= one <= self.high and not (self.above and one == self.low)
        if not inside or (self.kind == "whole" and one != int(one)):
            _wrong(place, f"must be {self.range}{self.hint and f', {self.hint}'}", value)
        return int(one) if self.kind == "whole" else float(one)

    def _text(self, value: Any, place: str) -> str:
        if not isinstance(value, str):
            _wrong(place, "must be text", value)
        what = "a prompt" if place.strip("'") == "prompt" else place
        check_text(value, what)
        if self.hint and not value.strip():
            raise MotionloomError(f"{what} is empty; {self.hint}")
        if len(value) > self.high:
            raise MotionloomError(f"{what} has {len(value):,} characters; say it in at most {self.high:,g}")
        return value


def _wrong(place: str, demand: str, value: Any) -> NoReturn:
    raise MotionloomError(f"{place} {demand}; got {kind_of(value)}")


class Bounds(TypedDict, total=False):
    """The rest of a `Spec`, as keywords."""

    needed: bool
    low: float
    high: float
    above: bool
    unit: str
    words: tuple[str, ...]
    hint: str
    many: int
    size: int
    pair: bool


class Changes(Bounds, total=False):
    """What may be another one where a field is taken over."""

    default: Any


def declare(kind: str, help: str, default: Any = None, **more: Unpack[Bounds]) -> Any:
    """A field of a request: the values of its `Spec`."""
    spec = Spec(kind, help, default, **more)
    return field(metadata={"spec": spec}, **({} if spec.needed else {"default": default}))


def like(source: type, name: str, help: str = "", **changes: Unpack[Changes]) -> Any:
    """A field as another request has it, with another sentence or default."""
    spec = specs(source)[name]
    spec = replace(spec, help=help or spec.help, **changes)
    return field(metadata={"spec": spec}, **({} if spec.needed else {"default": spec.default}))


def group(usual: Any, *names: str) -> Any:
    """A field that holds a part of a request, such as its sampling; ``names`` of its fields are the request's own."""
    return field(default=usual, metadata={"group": names})


@cache
def specs(request: type) -> Mapping[str, Spec]:
    """The fields of a request by name, those of its groups among them."""
    result: dict[str, Spec] = {}
    own = request.__annotations__
    for one in sorted(fields(request), key=lambda one: one.name not in own):
        if spec := one.metadata.get("spec"):
            result[one.name] = replace(spec, default=None if one.default is MISSING else one.default)
        elif names := one.metadata.get("group"):
            known = specs(type(one.default))
            result |= {name: replace(known[name], default=getattr(one.default, name)) for name in names}
    return result


@cache
def _own(request: type) -> tuple[tuple[str, Spec, bool], ...]:
    """Name and spec of each field that is no group, and whether it may be None."""
    declared = [(one, one.metadata.get("spec")) for one in fields(request)]
    return tuple((one.name, spec, one.default is None) for one, spec in declared if spec)


class Checked:
    """Checks its own fields when it is made; raises `MotionloomError` that begins with the field's name."""

    def __post_init__(self) -> None:
        for name, spec, empty in _own(type(self)):
            value = getattr(self, name)
            if value is not None or not empty:
                object.__setattr__(self, name, spec.check(value, name))
