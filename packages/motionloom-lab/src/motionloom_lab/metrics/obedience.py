"""Does the motion do what the words say? Prompts in everyday words, each with a check by physics.

A check is data: a prompt, and limits of named numbers, all of which must hold. The tables are
``lab/suites/basic_checks.toml`` (twenty prompts, over the numbers of `lab.metrics.actions`) and
``lab/suites/everyday_checks.toml`` (by theme, over the functions of `lab.metrics.everyday`). How real clips
of an action pass and wrong ones slip through can be counted again (docs/evaluate.md).
"""

import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import read_utf8
from motionloom.core.reading import read_table
from motionloom.kinematics.physics import Array
from motionloom.kinematics.wholeness import ENOUGH, wholeness
from motionloom_lab.metrics.actions import Measures, measure
from motionloom_lab.metrics.everyday.body import Body

NEVER = r"(?!)"
_INFINITY = float("inf")


@dataclass(frozen=True)
class Bound:
    """A range for one measure."""

    measure: str
    low: float = -_INFINITY
    high: float = _INFINITY
    why: str = ""
    """The reason, in plain words."""

    def holds(self, measures: Measures) -> bool:
        """True where the measure lies in the range, ends included."""
        return self.low <= measures[self.measure] <= self.high

    def text(self) -> str:
        """The range as text, such as ``advance >= 1.2``."""
        if self.low == -_INFINITY:
            return f"{self.measure} <= {self.high:g}"
        lower = f"{self.measure} >= {self.low:g}"
        return lower if self.high == _INFINITY else f"{lower} and <= {self.high:g}"


WHOLE = Bound("whole", low=ENOUGH, why="the body is a person's: pelvis, trunk, head, knees and elbows")
"""Every check of every set asks for this first; somebody who is folded obeys nothing."""
SUNK = Bound("sunk", high=0.08, why="nobody goes through the floor")
AFLOAT = Bound("afloat", high=0.15, why="somebody who does not jump or climb touches the floor")


@dataclass(frozen=True)
class Check:
    """One prompt and what a body must do to obey it."""

    name: str
    prompt: str
    seconds: float
    """Length to generate."""
    paraphrases: tuple[str, ...]
    """The same prompt in other words."""
    limits: tuple[Bound, ...]
    """On numbers of ``measures``, and on those that `Body` has by itself."""
    measures: tuple[Callable[[Body], Measures], ...]
    theme: str = ""
    """Of an everyday check; the basic ones have none."""
    airborne: bool = False
    """True for jumps, stairs and ladders, where the lowest joint may be well above y = 0."""
    words: str = NEVER
    """Pattern of captions of real clips that show the action."""
    unless: str = NEVER
    """Pattern of captions that say too much or too little to count as a pure example."""
    related: str = NEVER
    """Pattern of captions of clips that may rightly pass as well; they count neither for nor against."""

    @property
    def bounds(self) -> tuple[Bound, ...]:
        """The limits, a whole body, and, of everyday checks, one that neither sinks into the floor nor hangs in air."""
        floor = (SUNK, *(() if self.airborne else (AFLOAT,))) if self.theme else ()
        return (*self.limits, WHOLE, *floor)

    def measured(self, positions: Array, fps: float) -> Measures:
        """All numbers that are limited, and more, rounded to four places.

        Args:
            positions: (frames, 22, 3) metres on the uniform person, SMPL order, +Y up, the floor at y = 0.
            fps: frames per second.
        """
        return self.of(Body(positions, fps))

    def of(self, body: Body) -> Measures:
        """As `measured`, of signals that are there already.

        ``sunk``: metres the lowest joint is below the floor for a quarter of the time or more. ``afloat``: metres from
        the floor to the lowest joint, median over time.
        """
        found: Measures = {
            "whole": wholeness(body.p),
            "sunk": -float(np.percentile(body.lowest, 25)),
            "afloat": float(np.median(body.lowest)),
        }
        for function in self.measures:
            found |= function(body)
        found |= {b.measure: getattr(body, b.measure) for b in self.limits if b.measure not in found}
        return {name: round(float(value), 4) for name, value in found.items()}

    def obeyed(self, measures: Measures) -> bool:
        """True where every bound holds."""
        return not self.failed(measures)

    def failed(self, measures: Measures) -> tuple[Bound, ...]:
        """The bounds that do not hold."""
        return tuple(bound for bound in self.bounds if not bound.holds(measures))

    def role(self, captions: Sequence[str]) -> str:
        """What a real clip with these captions is to this check: ``example``, ``related`` or ``other``."""
        texts = [caption.lower() for caption in captions]
        hits = sum(bool(re.search(self.words, text)) for text in texts)
        if 2 * hits >= len(texts) > 0 and not any(re.search(self.unless, text) for text in texts):
            return "example"
        loose = f"{self.words}|{self.related}"
        return "related" if any(re.search(loose, text) for text in texts) else "other"


def _function(place: str, side: str | None) -> Callable[[Body], Measures]:
    """The function ``MODULE.NAME`` of `lab.metrics.everyday`, for a side of the body where one is named."""
    module, name = place.split(".")
    found = getattr(import_module(f"motionloom_lab.metrics.everyday.{module}"), name)
    return found if side is None else partial(found, side=("left", "right").index(side))


def _check(name: str, row: Mapping[str, Any], theme: str = "") -> Check:
    """The check of a row of a table."""
    measures = [_function(place, row.get("side")) for place in row.get("measures", ())]
    return Check(
        name,
        row["prompt"],
        row["seconds"],
        tuple(row["paraphrases"]),
        tuple(Bound(*limit) for limit in row["limits"]),
        tuple(measures) or (lambda body: measure(body.unsmoothed, body.fps),),
        theme,
        **{key: row[key] for key in ("airborne", "words", "unless", "related") if key in row},
    )


_read = partial(read_table, "motionloom_lab.suites")
CHECKS: tuple[Check, ...] = tuple(_check(name, row) for name, row in _read("basic_checks.toml").items())
"""The basic checks."""
THEMES: dict[str, tuple[Check, ...]] = {
    theme: tuple(_check(name, row, theme) for name, row in rows.items())
    for theme, rows in _read("everyday_checks.toml").items()
}
"""The everyday checks by theme."""
EVERYDAY: tuple[Check, ...] = tuple(check for checks in THEMES.values() for check in checks)
SETS: dict[str, tuple[Check, ...]] = {"basic": CHECKS, "everyday": EVERYDAY, "all": (*CHECKS, *EVERYDAY)}
"""Checks by the name of their set."""


def chosen(name: str, only: Sequence[str] | None = None) -> tuple[Check, ...]:
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


def check(name: str) -> Check:
    """The check called ``name``; MotionloomError for none."""
    return chosen("all", [name])[0]


def in_words(checks: Sequence[Check], path: Path) -> tuple[Check, ...]:
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


def check_of(prompt: str) -> Check | None:
    """The one basic check that a prompt belongs to: by its words or a paraphrase, else where it names one action alone.

    None for prompts of other actions, of several, and of actions done in a way that no check looks at.
    """
    said = " ".join(prompt.lower().split()).rstrip(".!")
    for candidate in CHECKS:
        if said in (candidate.prompt, *candidate.paraphrases):
            return candidate
    fitting = [candidate for candidate in CHECKS if candidate.role([said]) == "example"]
    return fitting[0] if len(fitting) == 1 else None


def obeys(prompt: str, positions: Array, fps: float) -> bool | None:
    """Whether a motion does what its prompt says, by the check of `check_of`; None where no check knows the prompt.

    positions: (frames, 22, 3) metres on the uniform person, the floor near y = 0.
    """
    found = check_of(prompt)
    return None if found is None else found.obeyed(found.measured(positions, fps))
