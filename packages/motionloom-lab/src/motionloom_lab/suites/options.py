"""The commands of `motionloom evaluate` and their options, as ``options.toml`` lists them; quick to import."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from motionloom.cli.tables import Option
from motionloom.core.reading import read_table

NOT_TYPED = {"weights", "data", "out", "json", "device", "threads", "force", "quick", "keep", "rows-without-published"}
"""Options that a command to measure the same again has in another place, or that change no number."""


@dataclass(frozen=True)
class Command:
    """One command of `motionloom evaluate`."""

    name: str
    help: str
    run: str
    """The function of `lab.suites.commands` that is called with the options that were given."""
    options: tuple[Option, ...]


@cache
def commands() -> dict[str, Command]:
    """All commands by name."""
    table = read_table("motionloom_lab.suites", "options.toml")
    shared = table.pop("shared")
    result = {}
    for name, row in table.items():
        rows = shared | row.get("own", {})
        options = tuple(Option.of(option, rows[option]) for option in row["options"])
        result[name] = Command(name, row["help"], row.get("run", "measured"), options)
    return result


def typed(command: Command, args: Mapping[str, Any]) -> str:
    """What to type to measure the same again; where data lie differs between machines, so they are called SET."""
    by_name = {option.name: option for option in command.options}
    line = ["motionloom", "evaluate", command.name]
    line += [str(args[option.dest]) for option in command.options if option.positional]
    line += ["--weights", _word(args.get("weights", by_name["weights"].default))]
    line += ["--data", by_name["data"].metavar or "SET"] if args.get("data") else []
    for option in command.options:
        line += ["--out", option.metavar or "FOLDER"] if option.name == "out" and option.required else []
        value = args.get(option.dest)
        if option.name in NOT_TYPED or option.positional or value in (None, False, [], option.default):
            continue
        line += _words(option, value)
    return shlex.join([*line, *(["--quick"] if args.get("quick") else [])])


def _words(option: Option, value: Any) -> list[str]:
    """An option and its value as they are typed."""
    name = f"--{option.name}"
    if option.kind == "flag":
        return [name]
    if option.many == "append":
        return [word for one in value for word in (name, _word(one))]
    if option.many:
        return [name, *map(_word, value)]
    if isinstance(value, tuple):
        return [name, ("x" if option.kind == "times" else ",").join(map(str, value))]
    return [name, _word(value)]


def _word(value: Any) -> str:
    """A value; of a place no more than its name."""
    return Path(value).name if "/" in str(value) else str(value)
