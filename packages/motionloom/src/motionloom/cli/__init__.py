"""The command line: turns words into calls, nothing else. Heavy libraries are imported by the commands, not here."""

import argparse
import gc
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Any

from motionloom.cli.commands import absence, add_commands
from motionloom.cli.help import HelpAll, help_of
from motionloom.cli.newcomers import COMMANDS, suggestion, with_command, with_options
from motionloom.cli.terminal import escaping, say
from motionloom.core.errors import MotionloomError, one_line
from motionloom.core.interruption import interruptible, was_interrupted


class _Parser(argparse.ArgumentParser):
    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **({"allow_abbrev": False} | more))  # --out must never mean --out-unit
        self.add_argument("--help-all", action=HelpAll, help=argparse.SUPPRESS)

    def format_help(self) -> str:
        """The options in groups, where there are many."""
        return help_of(self)

    def error(self, message: str) -> None:  # type: ignore[override]
        """One sentence and exit code 2, without the page of usage."""
        self.exit(2, f"{one_line(f'{self.prog}: {message}')}; see {self.prog} --help\n")

    def parse_known_args(self, args=None, namespace=None):  # type: ignore[override]
        """What a command does not know is its own mistake, not the whole program's: its --help is the one to read."""
        arguments, unknown = super().parse_known_args(None if args is None else with_options(self, args), namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}{suggestion(self, unknown)}")
        return arguments, unknown


def parser(command: str | None = None) -> argparse.ArgumentParser:
    """The command line as one parser: the whole, or no more than is needed to know ``command``."""
    top = _Parser(
        prog="motionloom", description="Human motion from words: generate, export, look at, train and measure it."
    )
    top.add_argument("--version", action="store_true", help="print the version and end")
    commands = top.add_subparsers(title="commands", metavar="COMMAND", parser_class=_Parser)
    add_commands(commands, command)
    return top


def commands_of(top: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """The parsers of the commands, by name."""
    return next(dict(a.choices) for a in top._actions if isinstance(a, argparse._SubParsersAction))


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; 0 done, 2 a mistake in the line or a file, 130 interrupted (also by SIGTERM, SIGHUP)."""
    try:  # from here on: a Ctrl-C while the commands are still being imported is one too
        with interruptible(), escaping():
            return _run_and_report(argv)
    except KeyboardInterrupt:  # while the end was being reported
        return 130


def _run_and_report(argv: Sequence[str] | None) -> int:
    """Run one command, and report in one line why it ended if it did not end well."""
    code = 2
    try:
        return _run(argv)
    except MotionloomError as error:
        problem = str(error)
    except ModuleNotFoundError as error:
        problem = absence(error)
        if problem is None:
            raise
    except BrokenPipeError:  # the reader, such as `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        problem = one_line(f"{error.strerror or error}: {error.filename or ''}".rstrip(": "))
    except KeyboardInterrupt:
        problem, code = "interrupted", 130
    except Exception:  # a library that was interrupted may end in an error of its own
        if not was_interrupted():
            raise
        problem, code = "interrupted", 130
    say(problem)
    return code


def _run(argv: Sequence[str] | None) -> int:
    # small products: numpy's own threads would wait on the cores that the networks compute on
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    words = list(sys.argv[1:] if argv is None else argv)
    top = parser(COMMANDS.get(words[0], words[0]) if words else "")
    arguments = top.parse_args(with_command(words, commands_of(top)))
    if arguments.version:
        from importlib.metadata import version

        print(f"motionloom {version('motionloom')}")
        return 0
    if not hasattr(arguments, "run"):
        top.print_help(sys.stderr)
        return 2
    with warnings.catch_warnings(), _seldom_collected(), _blender(getattr(arguments, "blender", None)):
        warnings.showwarning = _warn
        return arguments.run(arguments) or 0


def _blender(chosen: Path | None) -> AbstractContextManager[None]:
    """The Blender that the line names, for FBX files."""
    if chosen is None:
        return nullcontext()
    from motionloom.io.blender import using

    return using(chosen)


@contextmanager
def _seldom_collected() -> Iterator[None]:
    """Look for garbage in cycles less often: imports make many objects, and all of them are needed."""
    before = gc.get_threshold()
    gc.set_threshold(100_000, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)


def _warn(message: Warning | str, *_: object) -> None:
    """A warning as one sentence, without the place in the source that Python would add."""
    say(" ".join(str(message).split()))
