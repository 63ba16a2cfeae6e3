"""What others published, for orientation only: other data, other evaluators, other machines.

The numbers stand in `published.json`, block by block with what they were measured on; no comparison ever reads them.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any

from motionloom.reading import read_table
from motionloom_lab.report.report import Row, Value


@cache
def blocks() -> list[dict[str, Any]]:
    """Each with its ``suites``, ``measured_on``, ``source``, ``columns`` and ``rows``: a name and numbers or nulls."""
    return read_table("motionloom_lab.report", "published.json")


def published(suite: str, columns: Sequence[str]) -> tuple[Row, ...]:
    """The rows for a suite, with those numbers that it has columns for; rows without any are left out."""
    return tuple(row for block in blocks() if suite in block["suites"] for row in _rows(block, columns))


def _rows(block: dict[str, Any], columns: Sequence[str]) -> list[Row]:
    found = []
    for name, *numbers in block["rows"]:
        values = {
            column: Value(float(number))
            for column, number in zip(block["columns"], numbers, strict=True)
            if number is not None and column in columns
        }
        if values:
            found.append(Row(name, values, f"{block['measured_on']} ({block['source']})"))
    return found
