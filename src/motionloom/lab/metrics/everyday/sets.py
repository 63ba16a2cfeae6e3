"""The sets of checks by name: ``basic`` (the old twenty), ``everyday`` and ``all``."""

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path

from motionloom.errors import MotionloomError
from motionloom.io.text import read_utf8
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


def in_words(checks: Sequence[Check | Everyday], path: Path) -> tuple[Check | Everyday, ...]:
    """The checks that a .toml file has a sentence for, ``"walk slowly" = "..."``, with that as their prompt.

    Raises `MotionloomError` for a file that is no such table and for names of no check among these.
    """
    try:
        words = tomllib.loads(read_utf8(path, max_bytes=1 << 16))
    except (ValueError, RecursionError) as error:
        raise MotionloomError(f'{path} is no TOML ({error}); give lines such as "walk slowly" = "..."') from None
    by_name = {check.name: check for check in checks}
    wrong = next((n for n, said in words.items() if n not in by_name or not isinstance(said, str) or not said), None)
    if wrong is not None or not words:
        raise MotionloomError(
            f"{path} has no sentence for a check at {wrong or 'any line'!r}; the checks are {', '.join(by_name)}"
        )
    return tuple(replace(by_name[name], prompt=said, paraphrases=()) for name, said in words.items())
