"""The sets of checks by name: ``basic`` (the old twenty), ``everyday`` and ``all``."""

import tomllib
from dataclasses import replace
from importlib import resources

from motionloom.errors import MotionloomError
from motionloom.lab.metrics.everyday import arms, exercise, gaits, postures, rows, turns
from motionloom.lab.metrics.everyday.check import Everyday
from motionloom.lab.metrics.obedience import CHECKS as BASIC
from motionloom.lab.metrics.obedience import Check

THEMES: dict[str, tuple[Everyday, ...]] = {
    "gaits, starts and stops": gaits.CHECKS,
    "turns, jumps, balance and dance": turns.CHECKS,
    "postures, ground, stairs": postures.CHECKS,
    "arms, hands and gestures": arms.CHECKS,
    "exercise and fighting": exercise.CHECKS,
    "two in a row": rows.CHECKS,
}
"""The everyday checks by theme."""

_REWORDED: dict[str, str] = tomllib.loads(
    (resources.files("motionloom.lab.suites") / "everyday_reworded.toml").read_text(encoding="utf-8")
)

EVERYDAY: tuple[Everyday, ...] = tuple(
    replace(check, paraphrases=(_REWORDED[check.name],)) for theme in THEMES.values() for check in theme
)
"""All everyday checks, in the order of their themes, each with one other wording."""

SETS: dict[str, tuple[Check | Everyday, ...]] = {"basic": BASIC, "everyday": EVERYDAY, "all": (*BASIC, *EVERYDAY)}
"""Checks by the name of their set."""


def chosen(name: str, only: list[str] | None = None) -> tuple[Check | Everyday, ...]:
    """The checks of a set; ``only`` keeps those with these names. Raises `MotionloomError` for a name that is none."""
    if name not in SETS:
        raise MotionloomError(f"no set of checks called {name!r}; the sets are {', '.join(SETS)}")
    checks = SETS[name]
    if not only:
        return checks
    by_name = {check.name: check for check in SETS["all"]}
    wrong = next((n for n in only if n not in by_name), None)
    if wrong is not None:
        raise MotionloomError(
            f"no check called {wrong!r}; the checks of {name} are {', '.join(c.name for c in checks)}"
        )
    return tuple(by_name[n] for n in only)
