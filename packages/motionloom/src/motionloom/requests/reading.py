"""Requests from the values of an interface: keys of a JSON object, columns of a row, text."""

from collections.abc import Callable, Container, Mapping
from dataclasses import fields, replace
from types import MappingProxyType
from typing import Any, TypeVar

from motionloom.core.errors import MotionloomError, listed, meant, quoted
from motionloom.requests.fields import Spec, specs

R = TypeVar("R")


def build_request(request: type[R], values: Mapping[str, Any]) -> R:
    """A request of its values by name, wherever in its groups they belong."""
    own: dict[str, Any] = {}
    for one in fields(request):  # type: ignore[arg-type]
        if names := one.metadata.get("group"):
            usual: Any = one.default
            own[one.name] = replace(usual, **{name: values[name] for name in names if name in values})
        elif one.name in values:
            own[one.name] = values[one.name]
    return request(**own)


def resolve_sampling(values: Any, timeline: Any = None, *, but: Container[str] = ()) -> Any:
    """A request's sampling, with the seed and guidance of the request or else of its timeline.

    but: names that are not taken from the timeline.
    """
    own = {name: getattr(values, name, None) for name in ("seed", "guidance")}
    defaults = {name: getattr(timeline, name, None) for name, value in own.items() if value is None and name not in but}
    settings = {name: value for name, value in (own | defaults).items() if value is not None}
    return replace(values.sampling, **settings)


def read(
    request: type[R],
    values: Mapping[str, Any],
    what: str,
    *,
    place: Callable[[str], str] = repr,
    most: Mapping[str, float] = MappingProxyType({}),
) -> R:
    """The request of values from outside, such as the keys of a JSON object; None is as no value.

    what: what the keys belong to, in words. place: a key as the interface names it. most: largest numbers that the
    interface takes of a field, where that is less. Raises `MotionloomError` for unknown keys and impossible values.
    """
    known = narrow_fields(request, most)
    present = {str(name): value for name, value in values.items() if value is not None}
    if unknown := [name for name in present if name not in known]:
        name = unknown[0]
        raise MotionloomError(f"{what} has no {quoted(name)}{meant(name, known)}; it has {listed(tuple(known))}")
    needed = [name for name, spec in known.items() if spec.needed]
    if missing := [name for name in needed if name not in present]:
        raise MotionloomError(f"{what} has no {place(missing[0])}; it needs {listed(needed)}")
    return build_request(request, {name: known[name].check(value, place(name)) for name, value in present.items()})


def parse_fields(request: type, values: Mapping[str, str]) -> dict[str, Any]:
    """Values of fields from text, such as what follows a ``?`` of an address."""
    return {name: specs(request)[name].parse(value, repr(name)) for name, value in values.items()}


def narrow_fields(request: type, most: Mapping[str, float]) -> Mapping[str, Spec]:
    """The fields of a request where an interface takes less: ``most`` has largest numbers by name."""
    if not most:
        return specs(request)
    known = dict(specs(request))
    for name in known.keys() & most.keys():
        known[name] = replace(known[name], high=min(known[name].high, most[name]))
    return known
