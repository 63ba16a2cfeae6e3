"""The command line: turns words into calls, nothing else. Heavy libraries are imported by the commands, not here."""

import argparse
import importlib
import os
import sys
import warnings
from collections.abc import Sequence
from typing import Any

from motionloom.cli.newcomers import suggestion, with_command, with_options
from motionloom.errors import MotionloomError

FAMILIES = (
    "generate",
    "compose",
    "control",
    "edit",
    "predict",
    "duet",
    "files",
    "data",
    "teach",
    "train",
    "evaluate",
    "bench",
    "weights",
    "completion",
)


class _Parser(argparse.ArgumentParser):
    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **({"allow_abbrev": False} | more))  # --out must never mean --out-unit

    def error(self, message: str) -> None:  # type: ignore[override]
        """One sentence and exit code 2, without the page of usage."""
        self.exit(2, f"{self.prog}: {message}; see {self.prog} --help\n")

    def parse_known_args(self, args=None, namespace=None):  # type: ignore[override]
        """What a command does not know is its own mistake, not the whole program's: its --help is the one to read."""
        found, unknown = super().parse_known_args(None if args is None else with_options(self, args), namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}{suggestion(self, unknown)}")
        return found, unknown


def parser() -> argparse.ArgumentParser:
    """The whole command line as one parser."""
    top = _Parser(
        prog="motionloom", description="Human motion from words: generate, export, look at, train and measure it."
    )
    top.add_argument("--version", action="store_true", help="print the version and end")
    commands = top.add_subparsers(title="commands", metavar="COMMAND", parser_class=_Parser)
    for family in FAMILIES:
        importlib.import_module(f"motionloom.cli.{family}").add(commands)
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; 0 done, 2 a mistake in what was asked or given, 130 interrupted."""
    try:  # from here on: a Ctrl-C while the commands are still being imported is one too
        return _run(argv)
    except MotionloomError as error:
        print(f"motionloom: {error}", file=sys.stderr)
    except BrokenPipeError:  # the reader, such as `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        print(f"motionloom: {error.strerror or error}: {error.filename or ''}".rstrip(": "), file=sys.stderr)
    except KeyboardInterrupt:
        print("motionloom: interrupted", file=sys.stderr)
        return 130
    return 2


def _run(argv: Sequence[str] | None) -> int:
    top = parser()
    commands = next(a.choices for a in top._actions if isinstance(a, argparse._SubParsersAction))
    arguments = top.parse_args(with_command(sys.argv[1:] if argv is None else argv, commands))
    if arguments.version:
        from importlib.metadata import version

        print(f"motionloom {version('motionloom')}")
        return 0
    if not hasattr(arguments, "run"):
        top.print_help(sys.stderr)
        return 2
    with warnings.catch_warnings():
        warnings.showwarning = _warn
        return arguments.run(arguments) or 0


def _warn(message: Warning | str, *_: object) -> None:
    """A warning as one sentence, without the place in the source that Python would add."""
    print(f"motionloom: {' '.join(str(message).split())}", file=sys.stderr)
