"""The one exception a user is meant to see, and how what it quotes is shown."""

import json
from collections.abc import Collection, Mapping
from typing import Any


class MotionloomError(ValueError):
    """A mistake in what came from outside: a file, a prompt, an option.

    The message is one sentence (what was wrong, what was there, what to do); the command line prints it
    to stderr and exits with 2. Programming errors stay ordinary exceptions. Whatever names and values it mentions, it
    is shown as one line of at most `LONGEST_MESSAGE` characters.
    """

    def __init__(self, message: str = "", *, where: str = "") -> None:
        super().__init__(message)
        self.where = where
        """Keys from the outside in, such as ``segments[1].goal.joints[0]``, where the mistake is in JSON."""

    def __str__(self) -> str:
        return one_line(super().__str__())


LONGEST_MESSAGE = 800


def one_line(message: str) -> str:
    """A message as a terminal may show it: what would break the line or steer the terminal is written out."""
    if len(message) > LONGEST_MESSAGE:
        half = LONGEST_MESSAGE // 2 - 3
        message = f"{message[:half]} ... {message[-half:]}"
    return _escaped(message)


def printable(text: str) -> str:
    """Text of several lines as a terminal may show it; tabs stay. What is written out is so as in JSON: ``\\u001b``."""
    return "\n".join(_escaped(line, keep="\t") for line in text.split("\n"))


def _escaped(line: str, keep: str = "") -> str:
    if line.isprintable():
        return line
    return "".join(each if each.isprintable() or each in keep else json.dumps(each)[1:-1] for each in line)


def quoted(text: str, limit: int = 40) -> str:
    """Text as it may appear in a message: in quotes, without control characters, not too long."""
    return repr(text if len(text) <= limit else text[: limit - 3] + "...")


def listed(keys: Collection[str]) -> str:
    """'a, b and c'"""
    *first, last = keys
    return f"{', '.join(first)} and {last}" if first else last


ELSEWHERE = {
    "duration": "seconds",
    "length": "seconds",
    "text": "prompt",
    "description": "prompt",
    "cfg_scale": "guidance",
    "guidance_scale": "guidance",
    "num_samples": "count",
}
"""What other programs call fields, and their names here."""


def meant(word: str, known: Collection[str]) -> str:
    """What a message may add about a misspelt or foreign word: the known one that is like it, in brackets, if any."""
    import difflib  # here, since whoever makes no mistake need not wait for it

    same = ELSEWHERE.get(word)
    near = [same] if same in known else difflib.get_close_matches(word[:40], known, n=1)
    return f" (did you mean {near[0]!r}?)" if near else ""


def kind_of(value: Any) -> str:
    """A value for a message: what it is, and itself where that is short."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value) if abs(value) < 10**20 else "a number beyond all bounds"
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, str):
        return quoted(value)
    if isinstance(value, Mapping):
        return "a mapping"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    return f"a {type(value).__name__}"
