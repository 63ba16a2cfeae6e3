"""Requests from what doors get: keys of a JSON object, columns of a row, what was typed."""

from collections.abc import Callable, Container, Mapping
from dataclasses import fields, replace
from types import MappingProxyType
from typing import Any, TypeVar

from motionloom.errors import MotionloomError, listed, meant, quoted
from motionloom.requests.fields import Spec, specs

R = TypeVar("R")


def make(request: type[R], values: Mapping[str, Any]) -> R:
    """A request of its values by name, wherever in its groups they belong."""
    own: dict[str, Any] = {}
    for one in fields(request):  # type: ignore[arg-type]
        if names := one.metadata.get("group"):
            usual: Any = one.default
            own[one.name] = replace(usual, **{name: values[name] for name in names if name in values})
        elif one.name in values:
            own[one.name] = values[one.name]
    return request(**own)


def settled(values: Any, timeline: Any = None, *, but: Container[str] = ()) -> Any:
    """A request's sampling, with the seed and guidance that it says beside it, or else its timeline.

    but: names that the timeline does not say, since the request did.
    """
    own = {name: getattr(values, name, None) for name in ("seed", "guidance")}
    left = {name: getattr(timeline, name, None) for name, value in own.items() if value is None and name not in but}
    said = {name: value for name, value in (own | left).items() if value is not None}
    return replace(values.sampling, **said)


def read(
    request: type[R],
    values: Mapping[str, Any],
    what: str,
    *,
    place: Callable[[str], str] = repr,
    most: Mapping[str, float] = MappingProxyType({}),
) -> R:
    """The request that values from outside say, such as the keys of a JSON object; one that is None is not said.

    what: what the keys belong to, in words. place: a key as the door names it. most: largest numbers that the door
    takes of a field, where that is less. Raises `MotionloomError` for what there is not, and for what cannot be.
    """
    known = narrowed(request, most)
    given = {str(name): value for name, value in values.items() if value is not None}
    if unknown := [name for name in given if name not in known]:
        name = unknown[0]
        raise MotionloomError(f"{what} has no {quoted(name)}{meant(name, known)}; it has {listed(tuple(known))}")
    needed = [name for name, spec in known.items() if spec.needed]
    if missing := [name for name in needed if name not in given]:
        raise MotionloomError(f"{what} has no {place(missing[0])}; it needs {listed(needed)}")
    return make(request, {name: known[name].check(value, place(name)) for name, value in given.items()})


def typed(request: type, values: Mapping[str, str]) -> dict[str, Any]:
    """Values of fields from text, such as what follows a ``?`` of an address."""
    return {name: specs(request)[name].parse(value, repr(name)) for name, value in values.items()}


def narrowed(request: type, most: Mapping[str, float]) -> Mapping[str, Spec]:
    """The fields of a request where a door takes less: ``most`` has largest numbers by name."""
    if not most:
        return specs(request)
    known = dict(specs(request))
    for name in known.keys() & most.keys():
        known[name] = replace(known[name], high=min(known[name].high, most[name]))
    return known
