"""`motionloom evaluate`: does it do what the words say, does it look real, and did it get better.

Its commands and their options are those of `lab/suites/options.toml`; this reads them from the line.
"""

import argparse
from collections.abc import Callable
from functools import partial
from typing import Any

from motionloom.cli.tables import READERS as SHARED
from motionloom.cli.tables import add_entries, add_option
from motionloom.cli.writing import check_overwriting


def add(subparsers) -> None:
    """Register the commands of `evaluate`."""
    from motionloom_lab.suites.options import commands

    family = subparsers.add_parser("evaluate", help="measure weights: obedience, realism, text metrics; compare runs")
    group = family.add_subparsers(metavar="COMMAND", required=True)
    for name, command in commands().items():
        parser = group.add_parser(name, help=command.help)
        for option in command.options:
            add_option(parser, option, READERS)
        if name != "compare":
            add_entries(parser, ["force"], {})
        parser.set_defaults(run=partial(_run, name))


def _run(name: str, arguments: argparse.Namespace) -> int | None:
    """The command, after a note about finished pages that it writes over; what a stopped run left has none."""
    from motionloom_lab.suites import commands, options

    out = getattr(arguments, "out", None)
    if out is not None:
        check_overwriting(arguments, [out] if out.is_file() else sorted({*out.glob("*.md"), *out.glob("*/report.md")}))
    values = {key: value for key, value in vars(arguments).items() if value is not None and value is not False}
    return getattr(commands, options.commands()[name].run)({**values, "command": name})


def words(text: str) -> tuple[str, ...]:
    """What is between commas."""
    return tuple(word.strip() for word in text.split(",") if word.strip())


def numbers(text: str) -> tuple[int, ...]:
    """Whole numbers between commas."""
    try:
        return tuple(int(word) for word in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} are not whole numbers with commas, such as 5,20,50") from None


def batch(text: str) -> int | str:
    """A number of motions, or all."""
    try:
        return text if text == "all" else int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of motions and not all") from None


def times(text: str) -> tuple[int, int]:
    """Captions x motions of each."""
    try:
        captions, motions = (int(word) for word in ("0x0" if text == "0" else text).split("x"))
        return captions, motions
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not captions x motions of each, such as 10x10, or 0") from None


READERS: dict[str, Callable[[str], Any]] = SHARED | {
    "words": words,
    "numbers": numbers,
    "batch": batch,
    "times": times,
}
"""What an option's text is read with, by its kind."""
