"""PNG plots of a report."""

from pathlib import Path

from motionloom.evaluation.report import Report


def draw(report: Report, folder: Path) -> list[Path]:
    """The pictures written into ``folder``."""
    return []
