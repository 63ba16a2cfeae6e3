"""Files of the laboratory: tables as text, and JSON and pages that are written whole or not at all."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from motionloom.core.files.atomic import atomic_path, check_place


def markdown(rows: Sequence[Sequence[str]]) -> str:
    """A table for a report."""
    head, *body = [[cell.replace("|", "/") for cell in row] for row in rows]
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *body])


def plain(rows: Sequence[Sequence[str]]) -> str:
    """The same in columns for a terminal."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )


def check_report(path: Path) -> Path:
    """The path, if a report can be written there, whose folders may be missing: a check before long work."""
    check_place(path, folders=True)
    return path


def write_json(path: Path, value: Any) -> Path:
    """Whole or not at all, the folders made."""
    return write_text(path, json.dumps(value, indent=1) + "\n")


def write_text(path: Path, value: str) -> Path:
    """Whole or not at all, the folders made."""
    with atomic_path(path, folders=True) as temp:
        temp.write_text(value, encoding="utf-8")
    return path
