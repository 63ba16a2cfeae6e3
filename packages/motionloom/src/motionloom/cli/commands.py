"""Which commands there are: those of this package, and how those of others are found."""

import argparse
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import NamedTuple, NoReturn

from motionloom.core.reading import read_table

Commands = argparse._SubParsersAction
Add = Callable[[Commands], None]

_TABLE = read_table("motionloom.cli", "commands.toml")
FAMILIES: dict[str, dict[str, str]] = _TABLE["families"]
"""Modules beside this one, each with a table of the commands that belong together: their lines in `--help`."""
GROUP = "motionloom.commands"
"""Entry points by which an installed package adds a command: its name, and the function that registers it."""


class Other(NamedTuple):
    """A command that another package of ours brings."""

    about: str
    """Its line in `--help`, which is printed without looking for the package."""
    module: str
    """The module that registers it."""
    page: str
    """Its page in the folder of documents."""


OTHERS = {name: Other(row["help"], row["module"], row["page"]) for name, row in _TABLE["commands"].items()}
BROUGHT_BY: dict[str, str] = _TABLE["packages"]
"""What this package does without, and what installs each."""


def add_commands(commands: Commands, command: str | None) -> None:
    """Register no more than is needed to know ``command``; where nothing here knows it, all names there are.

    None: all options of all, with those of other packages where these are installed. A ``command`` of a package that is
    not has its help, and raises ModuleNotFoundError when its words are read.
    """
    if command is not None and command in OTHERS:
        try:
            _registered(command)(commands)
        except ModuleNotFoundError as error:
            _add_absent(commands, command, error)
        return
    known = any(command in helps for helps in FAMILIES.values())
    for family, helps in FAMILIES.items():
        if command is None or command in helps:
            from motionloom.cli.tables import add_family

            add_family(commands, f"motionloom.cli.{family}", helps)
        elif not known:
            for name, line in helps.items():
                commands.add_parser(name, help=line, add_help=False)
    if known:
        return
    for name, other in OTHERS.items():
        if command is None and find_spec(other.module.partition(".")[0]):
            _registered(name)(commands)
        else:
            commands.add_parser(name, help=other.about, add_help=False)
    if command is not None and command not in commands.choices and not command.startswith("-"):
        for add in _installed(command):
            add(commands)


def _add_absent(commands: Commands, name: str, error: ModuleNotFoundError) -> None:
    """Register a command whose package is not installed: it can say what it is for, and what to install."""
    reason = absence(error)
    if reason is None:
        raise error
    about = f"What it does: {OTHERS[name].about} (docs/{OTHERS[name].page}); {reason}."
    parser = commands.add_parser(name, help=OTHERS[name].about, description=about)

    def refuse(args: Sequence[str] = (), namespace: object = None) -> NoReturn:
        if {"-h", "--help", "--help-all"} & set(args):
            parser.print_help()
            parser.exit()
        raise error

    parser.parse_known_args = refuse  # type: ignore[method-assign, assignment]


def _registered(name: str) -> Add:
    return next(_installed(name), None) or import_module(OTHERS[name].module).add


def _installed(name: str) -> Iterator[Add]:
    """What registers a command, by the entry points of installed packages."""
    from importlib.metadata import entry_points

    for entry in entry_points(group=GROUP, name=name):
        yield entry.load()


def absence(error: ModuleNotFoundError) -> str | None:
    """What to install for a module that a command needs; None for one that should have been there."""
    for name, package in BROUGHT_BY.items():
        if f"{error.name}.".startswith(f"{name}."):
            return (
                f"this command needs {name}, which is not installed; pip install '{package}', or 'make dev' in a "
                "clone, brings it"
            )
    return None
