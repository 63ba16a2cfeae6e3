"""`--help`: a screen of options in groups, and `--help-all`, which lists the rest.

`help.toml` has the groups, and which options need a package that may not be installed.
"""

import argparse
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from typing import Any

from motionloom.core.reading import read_table

SCREEN = 24
"""Options above which they are printed in groups."""
Section = tuple[str | None, str | None, Sequence[argparse.Action]]
"""Title, description and options."""


class HelpAll(argparse.Action):
    """``--help-all``: print every option, and end."""

    def __init__(self, option_strings: Sequence[str], dest: str, **more: Any) -> None:
        super().__init__(option_strings, dest, nargs=0, default=argparse.SUPPRESS, **more)

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        print(help_of(parser, whole=True), end="")
        parser.exit()


def help_of(parser: argparse.ArgumentParser, *, whole: bool = False) -> str:
    """The help of a command, without the options of packages that are not installed.

    whole: with the expert options of a command that has more than `SCREEN`.
    """
    table = read_table("motionloom.cli", "help.toml")
    absent = {name for module, names in table["needs"].items() if find_spec(module) is None for name in names}
    shown = [one for one in parser._actions if one.help != argparse.SUPPRESS and one.dest not in absent]
    formatter = parser._get_formatter()
    if len(shown) <= SCREEN:
        formatter.add_usage(parser.usage, shown, parser._mutually_exclusive_groups)
        sections: Iterator[Section] = _as_declared(parser, shown)
        end = parser.epilog
    else:
        needed = [one for one in shown if one.required or not one.option_strings]
        formatter.add_usage(None, [*needed, argparse.Action(["[OPTION ...]"], "", 0, required=True)], ())
        sections = _grouped(parser, shown, table["groups"], whole)
        end = parser.epilog if whole else f"{parser.prog} --help-all lists the expert options too."
    formatter.add_text(parser.description)
    for title, description, actions in sections:
        formatter.start_section(title)
        formatter.add_text(description)
        formatter.add_arguments(actions)
        formatter.end_section()
    formatter.add_text(end)
    return formatter.format_help()


def _as_declared(parser: argparse.ArgumentParser, shown: Sequence[argparse.Action]) -> Iterator[Section]:
    for group in parser._action_groups:
        yield group.title, group.description, [one for one in group._group_actions if one in shown]


def _grouped(
    parser: argparse.ArgumentParser, shown: Sequence[argparse.Action], groups: dict[str, list[str]], whole: bool
) -> Iterator[Section]:
    known = {name for names in groups.values() for name in names}
    rest = [one for one in shown if one.dest not in known and one.dest != "help"]
    yield parser.prog.rpartition(" ")[2], None, rest
    for title, names in groups.items():
        if whole or title != "expert":
            own = [one for one in shown if one.dest in names]
            yield title, None, sorted(own, key=lambda one: names.index(one.dest))
