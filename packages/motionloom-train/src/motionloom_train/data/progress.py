"""How progress is reported."""

from collections.abc import Callable

Say = Callable[[str], None]
"""Called with a line of progress now and then."""


def silent(line: str) -> None:
    """Report nothing."""
