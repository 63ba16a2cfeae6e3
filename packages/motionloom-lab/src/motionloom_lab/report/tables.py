"""What every suite's table has: its columns (``lab/suites/columns.toml``) and the notes under it (``notes.toml``)."""

from collections.abc import Mapping
from functools import cache
from typing import Any

from motionloom.reading import read_table
from motionloom_lab.report.report import Column


@cache
def _rows(file: str) -> dict[str, Any]:
    return read_table("motionloom_lab.suites", file)


def columns(table: str) -> tuple[Column, ...]:
    """The columns of a table, in order."""
    return tuple(
        Column(name, title, better, meaning, digits, bool(share))
        for name, (title, better, digits, meaning, *share) in _rows("columns.toml")[table].items()
    )


def notes(table: str, numbers: Mapping[str, Any] | None = None) -> tuple[str, ...]:
    """The notes under a table, with the numbers that they name put in."""
    return tuple(note.format(**(numbers or {})) for note in _rows("notes.toml")[table])
