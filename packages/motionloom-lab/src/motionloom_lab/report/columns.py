"""The columns of every suite's table, as ``lab/suites/columns.toml`` lists them."""

import tomllib
from functools import cache
from importlib import resources
from typing import Any

from motionloom_lab.report.report import Column


@cache
def _tables() -> dict[str, dict[str, list[Any]]]:
    return tomllib.loads((resources.files("motionloom_lab.suites") / "columns.toml").read_text(encoding="utf-8"))


def columns(table: str) -> tuple[Column, ...]:
    """The columns of a table, in order."""
    return tuple(
        Column(name, title, better, meaning, digits, bool(share))
        for name, (title, better, digits, meaning, *share) in _tables()[table].items()
    )
