"""What an everyday check is: a prompt, how long it takes, what is measured, and the limits that hold when it is done.

`Everyday` has the same face as :class:`motionloom.lab.metrics.obedience.Check`, so that one run judges both. Its
numbers come from a function of its own, a few lines beside the prompt, with a docstring that says what they are.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from motionloom.kinematics.wholeness import wholeness
from motionloom.lab.metrics.everyday.body import Body
from motionloom.lab.metrics.obedience import WHOLE, Bound, Measures

SUNK = Bound("sunk", "nobody goes through the floor", high=0.08)
AFLOAT = Bound("afloat", "somebody who does not jump or climb touches the floor", high=0.15)


def at_least(measure: str, low: float, why: str) -> Bound:
    """A lower limit and the reason for it."""
    return Bound(measure, why, low=low)


def at_most(measure: str, high: float, why: str) -> Bound:
    """An upper limit and the reason for it."""
    return Bound(measure, why, high=high)


def between(measure: str, low: float, high: float, why: str) -> Bound:
    """Two limits, ends included, and the reason for them."""
    return Bound(measure, why, low=low, high=high)


@dataclass(frozen=True)
class Everyday:
    """One everyday prompt and what a body must do to obey it."""

    name: str
    prompt: str
    seconds: float
    """Length to generate: what the action takes, with a little time around it."""
    measures: Callable[[Body], Measures]
    """The numbers that are limited, and no others."""
    limits: tuple[Bound, ...]
    grounded: bool = True
    """False for jumps, stairs and ladders, where the lowest joint may be well above y = 0."""
    paraphrases: tuple[str, ...] = field(default=(), kw_only=True)
    """The same wish in other words; `sets` reads them from ``everyday_reworded.toml``."""

    @property
    def bounds(self) -> tuple[Bound, ...]:
        """The limits, and those for every body: it is whole, and neither sinks into the floor nor hangs in the air."""
        return (*self.limits, WHOLE, SUNK, *((AFLOAT,) if self.grounded else ()))

    def measured(self, positions: np.ndarray, fps: float) -> Measures:
        """All numbers that are limited, rounded to four places.

        Args:
            positions: (frames, 22, 3) metres, SMPL order, +Y up, the floor at y = 0.
            fps: frames per second.
        """
        return self.of(Body(positions, fps))

    def of(self, body: Body) -> Measures:
        """As `measured`, of signals that are there already."""
        found = {**self.measures(body), "whole": wholeness(body.p), **about_the_floor(body)}
        return {name: round(float(value), 4) for name, value in found.items()}

    def obeyed(self, measures: Measures) -> bool:
        """True where every limit holds."""
        return all(bound.holds(measures) for bound in self.bounds)

    def failed(self, measures: Measures) -> tuple[Bound, ...]:
        """The limits that do not hold."""
        return tuple(bound for bound in self.bounds if not bound.holds(measures))


def about_the_floor(body: Body) -> Measures:
    """``sunk``: metres the lowest joint is below the floor for a quarter of the time or more. ``afloat``: metres
    from the floor to the lowest joint, median over time."""
    return {
        "sunk": -float(np.percentile(body.lowest, 25)),
        "afloat": float(np.median(body.lowest)),
    }
