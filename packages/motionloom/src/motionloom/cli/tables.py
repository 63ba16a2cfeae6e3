"""Commands as tables list them: ``duet.toml`` beside ``duet.py`` has the help, the options and the function of `duet`.

A command has ``help`` (those of this package are in `commands.toml`), ``description``, ``run`` (a function of the
module), and ``options``; or ``commands`` below it. ``defaults`` are further values, ``unset`` names options that are
None unless they are typed, and ``like`` another command that it is the same as otherwise. Each of its ``options`` is
one of these:

* ``react-to``, the name of a row, in the command's table ``own`` or in ``shared.toml``;
* ``@reading``, a group of ``shared.toml``;
* ``tasks.Duet seconds loop``, fields of a request; all whose values can be typed where none is named.

Keys of an ``own`` row replace those of the shared row, and of the row in ``own`` of the command above. For a field, an
``own`` row may have another ``help``, and ``aliases``.
"""

import argparse
from argparse import Namespace
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

from motionloom.cli.newcomers import option_names, take_text_anywhere
from motionloom.cli.options import PrintSchema, add_options, as_unit
from motionloom.core.reading import read_table
from motionloom.formats import readable, writable

Table = dict[str, Any]
READERS: dict[str, Callable[[str], Any]] = {"text": str, "int": int, "float": float, "path": Path, "unit": as_unit}
"""What reads the word of an option, by its kind."""


@dataclass(frozen=True)
class Option:
    """One option, or one word without a name."""

    name: str
    """As it is typed, without the dashes."""
    help: str | None = None
    """A sentence, in which ``{readable}`` and the like stand for suffixes of files, and ``{usual}`` for that."""
    usual: str = ""
    kind: str = "text"
    """One of `READERS`; ``flag``; or ``schema``, which prints the JSON Schema that ``const`` names."""
    choices: tuple[Any, ...] = ()
    many: str | int = ""
    """``append`` where it may be repeated, else how many words it takes, as argparse has it."""
    default: Any = None
    const: str | None = None
    """The value without a word."""
    metavar: str | tuple[str, ...] | None = None
    dest: str = ""
    """What the value is called."""
    aliases: tuple[str, ...] = ()
    required: bool = False
    positional: bool = False

    @staticmethod
    def of(name: str, row: Table) -> "Option":
        """A row of a table."""
        tuples = {key: tuple(value) for key, value in row.items() if isinstance(value, list) and key != "default"}
        return Option(**{"name": name, "dest": name.replace("-", "_"), **row, **tuples})


def add_family(commands: Any, module: str, helps: Mapping[str, str] = MappingProxyType({})) -> None:
    """Register the commands of the table beside a module, which is imported when one of them runs.

    helps: the lines in `--help` of commands whose rows have none.
    """
    package, _, name = module.rpartition(".")
    rows = {name: {"help": helps.get(name)} | row for name, row in read_table(package, f"{name}.toml").items()}
    _add_commands(commands, rows, module, {})


def _add_commands(commands: Any, rows: Table, module: str, above: Table) -> None:
    for name, row in rows.items():
        row = rows.get(row.get("like"), {}) | row
        own = above | {key: above.get(key, {}) | value for key, value in row.get("own", {}).items()}
        about = _filled(row["description"]) if "description" in row else None
        parser = commands.add_parser(name, help=row["help"], description=about)
        if "commands" in row:
            below = parser.add_subparsers(metavar=row.get("metavar", "COMMAND"), required=True)
            _add_commands(below, row["commands"], module, own)
            continue
        add_entries(parser, row["options"], own)
        run = partial(_run, module, row["run"])
        parser.set_defaults(run=run, **row.get("defaults", {}), **dict.fromkeys(row.get("unset", ())))
        if row.get("text_anywhere"):
            take_text_anywhere(parser)


def _run(module: str, function: str, arguments: Namespace) -> int | None:
    return getattr(import_module(module), function)(arguments)


def add_entries(parser: argparse.ArgumentParser, entries: Sequence[str], own: Table) -> None:
    """The options that entries of a table name; what is there already is not added again."""
    shared = _shared()
    for entry in entries:
        request, *names = entry.split()
        if entry.startswith("@"):
            add_entries(parser, shared["groups"][entry[1:]], own)
        elif "." in request:
            module, _, name = request.partition(".")
            add_options(parser, getattr(import_module(f"motionloom.requests.{module}"), name), *names, changes=own)
        else:
            add_option(parser, Option.of(entry, shared["options"].get(entry, {}) | own.get(entry, {})))


@cache
def _shared() -> Table:
    return read_table("motionloom.cli", "shared.toml")


def add_option(
    parser: argparse.ArgumentParser, option: Option, readers: Mapping[str, Callable[[str], Any]] = READERS
) -> None:
    """One option, unless it is there; ``readers``: what reads a word, by the option's kind."""
    name = option.name if option.positional else f"--{option.name}"
    if name in option_names(parser):
        return
    how: dict[str, Any] = {} if option.positional else {"dest": option.dest, "required": option.required}
    how["help"] = None if option.help is None else _filled(option.help, option.usual)
    if option.kind == "flag":
        how["action"] = "store_true"
    elif option.kind == "schema":
        how = {"action": PrintSchema, "kind": option.const}
    else:
        how |= {"type": readers[option.kind], "choices": option.choices or None, "metavar": option.metavar}
        how |= {"action": "append"} if option.many == "append" else {"nargs": option.many or None}
        how |= {key: getattr(option, key) for key in ("default", "const") if getattr(option, key) is not None}
    parser.add_argument(name, *option.aliases, **how)


def _filled(text: str, usual: str = "") -> str:
    """A sentence with what its braces stand for."""
    suffixes = {"readable": ", ".join(readable()), "writable": ", ".join(writable()), "suffixes": " ".join(writable())}
    return text.format(usual=usual, **suffixes).replace("%", "%%")
