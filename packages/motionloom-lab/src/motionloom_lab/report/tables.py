"""What every suite's table has: its columns and notes (``lab/suites/columns.toml`` and ``notes.toml``), and what others
published (``published.json``): for orientation only, of other data, other evaluators, other machines.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from motionloom.core.reading import read_table
from motionloom_lab.report.report import Column, Row, Value

_read = cache(read_table)


def columns(table: str) -> tuple[Column, ...]:
    """The columns of a table, in order."""
    return tuple(
        Column(name, title, better, meaning, digits, bool(share))
        for name, (title, better, digits, meaning, *share) in _read("motionloom_lab.suites", "columns.toml")[
            table
        ].items()
    )


def notes(table: str, numbers: Mapping[str, Any] | None = None) -> tuple[str, ...]:
    """The notes under a table, with the numbers that they name inserted."""
    return tuple(note.format(**(numbers or {})) for note in _read("motionloom_lab.suites", "notes.toml")[table])


def published(suite: str, columns: Sequence[str]) -> tuple[Row, ...]:
    """The rows for a suite, with those numbers that it has columns for; rows without any are left out.

    A block has ``suites``, ``measured_on``, ``source``, ``columns`` and ``rows``: a name and numbers or nulls.
    """
    rows = []
    for block in _read("motionloom_lab.report", "published.json"):
        for name, *numbers in block["rows"] if suite in block["suites"] else ():
            pairs = zip(block["columns"], numbers, strict=True)
            values = {column: Value(float(n)) for column, n in pairs if n is not None and column in columns}
            if values:
                rows.append(Row(name, values, f"{block['measured_on']} ({block['source']})"))
    return tuple(rows)
