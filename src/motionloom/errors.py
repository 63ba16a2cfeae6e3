"""The one exception a user is meant to see, and how what it quotes is shown."""

import json


class MotionloomError(ValueError):
    """A mistake in what came from outside: a file, a prompt, an option.

    The message is one sentence (what was wrong, what was there, what to do); the command line prints it
    to stderr and exits with 2. Programming errors stay ordinary exceptions. Whatever names and values it mentions, it
    is shown as one line of at most `LONGEST_MESSAGE` characters.
    """

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
