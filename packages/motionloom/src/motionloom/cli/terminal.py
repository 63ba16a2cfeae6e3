"""What commands print, whatever they quote, cannot steer the terminal that shows it."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO, cast

from motionloom.core.errors import printable


class _Escaped:
    """A stream of text in which all that is no plain letter, blank, tab or end of line is written out."""

    def __init__(self, unescaped: TextIO) -> None:
        self.unescaped = unescaped

    def write(self, text: str) -> int:
        self.unescaped.write(printable(text))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.unescaped, name)


def say(line: str) -> None:
    """Print a line of the program's own on stderr."""
    print(f"motionloom: {line}", file=sys.stderr)


def note(line: str) -> None:
    """Print on stderr what somebody may want to know, though nothing is wrong."""
    print(f"note: {line}", file=sys.stderr)


@contextmanager
def escaping() -> Iterator[None]:
    """Within the block stdout and stderr are escaped: messages, warnings, tables, prompts, names out of files."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (cast(TextIO, _Escaped(stream)) for stream in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def unescaped(stream: TextIO) -> TextIO:
    """The terminal itself, for those who steer it: progress bars."""
    return getattr(stream, "unescaped", stream)
