"""Options of a command from the fields of its request: names, kinds and sentences are written there."""

import argparse
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from motionloom.requests.export import RATE
from motionloom.requests.fields import Spec, specs


def option(name: str, spec: Spec) -> str:
    """How a field is typed, such as ``--best-of``; one that is true by default is ``--no-foot-lock``."""
    return f"--{'no-' if spec.kind == 'flag' and spec.default else ''}{name.replace('_', '-')}"


class _Store(argparse.Action):
    """Keeps what was typed as the field holds it; a mistake names the option."""

    def __init__(self, option_strings: Sequence[str], dest: str, spec: Spec, **more: Any) -> None:
        super().__init__(option_strings, dest, **more)
        self.spec = spec

    def __call__(self, parser: Any, namespace: Any, values: Any, option_string: str | None = None) -> None:
        spec, place = self.spec, self.option_strings[0]
        typed = values if isinstance(values, list) else [values]
        parsed = [spec.parse(one, place) for one in typed]
        value = tuple(parsed) if spec.size else parsed[0]
        setattr(namespace, self.dest, (*getattr(namespace, self.dest), value) if spec.many else value)


def add_options(
    parser: argparse.ArgumentParser,
    request: type,
    *names: str,
    changes: Mapping[str, Mapping[str, Any]] = MappingProxyType({}),
) -> None:
    """An option for each of these fields of a request; without names, for all whose values can be typed.

    Those that are there already are not added again. changes: of single fields another ``help``, and ``aliases``.
    """
    for name, spec in specs(request).items():
        typed = spec.kind in ("number", "whole", "flag", "word", "text") and not spec.needed
        if not (name in names if names else typed) or option(name, spec) in parser._option_string_actions:
            continue
        change = changes.get(name, {})
        sentence = change.get("help", spec.help)
        if spec.kind == "flag":
            sentence = f"do not {sentence}" if spec.default else sentence
            kind = "store_false" if spec.default else "store_true"
            parser.add_argument(option(name, spec), dest=name, action=kind, help=sentence)
            continue
        about = [f"{spec.low:g} to {spec.high:g}"] if spec.high <= 1000 and spec.kind in ("whole", "number") else []
        if spec.default is not None and not spec.many:
            about.append(f"default {spec.default:g}" if isinstance(spec.default, float) else f"default {spec.default}")
        about += ["repeatable"] if spec.many else []
        parser.add_argument(
            option(name, spec),
            *change.get("aliases", ()),
            action=_Store,
            spec=spec,
            default=spec.default,
            nargs=spec.size or None,
            metavar=_metavar(spec),
            help=f"{sentence} ({', '.join(about)})" if about else sentence,
        )


class PrintSchema(argparse.Action):
    """``--schema``: print the JSON Schema of a kind of file, and end."""

    def __init__(self, option_strings: Sequence[str], dest: str, kind: str) -> None:
        super().__init__(option_strings, dest, nargs=0, help=f"print the JSON Schema of {kind} files and end")
        self.kind = kind

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from motionloom.goals.schemas import SCHEMAS

        print(SCHEMAS[self.kind](), end="")
        parser.exit()


def _metavar(spec: Spec) -> str | tuple[str, ...]:
    if spec.words:
        return f"{{{','.join(spec.words)}}}"
    number = {"seconds": "S", RATE: "N"}.get(spec.unit, "X")
    one = {"whole": "N", "number": number}.get(spec.kind, "WORD")
    return {0: one, 2: ("FROM", "TO")}.get(spec.size, tuple("XYZ"))


_UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "in": 0.0254, "ft": 0.3048}


def as_unit(text: str) -> float:
    """Metres per unit of length, from a number or the unit's name."""
    try:
        value = _UNITS.get(text.lower()) or float(text)
    except ValueError:
        value = 0.0
    if not 1e-6 <= value <= 1e6:
        units = ", ".join(_UNITS)
        raise argparse.ArgumentTypeError(f"a unit is {units} or a number of metres above 0; got {text!r}")
    return value
