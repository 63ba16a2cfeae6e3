"""Real people in numbers: how the checks judge real clips, and how real clips score in realism.

`reference.json` beside this file holds the numbers for the mocap pack the project was built with (no motion, no text),
so that tables can show them where no recordings are at hand. `motionloom evaluate reference` writes it anew.
"""

from collections.abc import Iterable, Sequence
from typing import Any

from motionloom.core.features.layout import FPS
from motionloom.core.reading import read_table
from motionloom_lab.metrics.actions import Measures, measure
from motionloom_lab.metrics.obedience import CHECKS, Check
from motionloom_lab.metrics.realism import average
from motionloom_lab.suites.items import RealClip
from motionloom_train.data.progress import Say, silent


def known() -> dict[str, Any]:
    """The shipped numbers."""
    return read_table("motionloom_lab.suites", "reference.json")


def reference(clips: Iterable[RealClip], progress: Say = silent) -> dict[str, Any]:
    """All numbers for a set of real clips, as plain data."""
    every = list(clips)
    progress(f"{len(every)} real clips")
    rows = [(clip, measure(clip.positions, FPS)) for clip in every if clip.captions]
    sources = sorted({clip.source for clip in every})
    return {
        "clips": len(every),
        "held_out_clips": sum(clip.held_out for clip in every),
        "checks": {check.name: judged(check, rows) for check in CHECKS},
        "confusion": confusion(rows),
        "realism": {
            "held_out": _rounded([c for c in every if c.held_out]),
            **{source: _rounded([c for c in every if c.source == source]) for source in sources},
        },
    }


def _rounded(clips: Sequence[RealClip]) -> dict[str, float]:
    return {name: round(value, 4) for name, value in average([c.positions for c in clips], FPS).items()}


def judged(check: Check, rows: Sequence[tuple[RealClip, Measures]]) -> dict[str, str]:
    """Passes of a check as ``passed/tried`` among examples of the action (held-out, all) and clips of other actions."""
    roles = [(check.role(clip.captions), clip.held_out, check.obeyed(numbers)) for clip, numbers in rows]
    groups = {
        "held_out": [ok for role, held_out, ok in roles if role == "example" and held_out],
        "all": [ok for role, _, ok in roles if role == "example"],
        "related": [ok for role, _, ok in roles if role == "related"],
        "others": [ok for role, _, ok in roles if role == "other"],
    }
    return {name: f"{sum(oks)}/{len(oks)}" for name, oks in groups.items()}


def confusion(rows: Sequence[tuple[RealClip, Measures]]) -> dict[str, dict[str, float]]:
    """For the real examples of each action (outer) the share that pass each check (inner); no examples, no entry."""
    table: dict[str, dict[str, float]] = {}
    for action in CHECKS:
        examples = [numbers for clip, numbers in rows if action.role(clip.captions) == "example"]
        if examples:
            table[action.name] = {c.name: round(sum(map(c.obeyed, examples)) / len(examples), 3) for c in CHECKS}
    return table


def rates(data: dict[str, Any]) -> list[list[str]]:
    """Table of the passes, the heading first."""
    rows = [["check", "real held-out", "real all", "related", "other actions", "wrong"]]
    for name, counts in data["checks"].items():
        passed, tried = map(int, counts["others"].split("/"))
        wrong = f"{100 * passed / max(1, tried):.1f} %"
        rows.append([name, counts["held_out"], counts["all"], counts["related"], counts["others"], wrong])
    return rows


def confusion_table(data: dict[str, Any]) -> list[list[str]]:
    """Table of per cent, an action a row and a check a column, columns by the number of their check."""
    numbers = {check.name: str(k) for k, check in enumerate(CHECKS, start=1)}
    rows = [["real clips of", *numbers.values()]]
    for action, shares in data["confusion"].items():
        cells = [f"{100 * shares[c.name]:.0f}" if shares[c.name] else "." for c in CHECKS]
        rows.append([f"{numbers[action]} {action}", *cells])
    return rows
