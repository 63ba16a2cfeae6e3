"""`predict` and `switch`: what may come after a motion, and the way from one to another."""

from dataclasses import dataclass
from typing import Any

from motionloom.requests.fields import Checked, declare, group
from motionloom.requests.sampling import PredictionSampling
from motionloom.requests.shared import Finish, seconds

DAY = 86_400
"""Seconds."""
NAMES = ("seed", "count", "guidance", "steps", "best_of", "temperature")


@dataclass(frozen=True, kw_only=True)
class _Past(Finish):
    motion: Any = declare("motion", "what is gone on from", needed=True)
    start: float | None = declare("number", "begin at this second of it", low=0, unit="seconds")
    end: float | None = declare("number", "end at this second of it", low=0, unit="seconds")


@dataclass(frozen=True, kw_only=True)
class Held(Checked):
    """A motion that parts of somebody's future are held to."""

    from_time: float = declare("number", "the second of it at which the future begins", 0.0, low=0, unit="seconds")


@dataclass(frozen=True, kw_only=True)
class Predict(_Past):
    """Make motions that may come after a motion."""

    seconds: float = seconds("how far to predict", 2.0, high=DAY)
    person: int = declare("whole", "who goes on, of several people in one motion, counted from 0", 0, low=0, high=7)
    root: bool = declare("flag", "let the person leave the place, which is not as published", True)
    sampling: PredictionSampling = group(PredictionSampling(count=10), *NAMES)


@dataclass(frozen=True, kw_only=True)
class Switch(_Past):
    """Lead from one motion into another."""

    target: Any = declare("motion", "what is led into", needed=True)
    seconds: float = seconds("length of the transition", 1.0, high=30)
    facing: str = declare(
        "word",
        "turn the target to go on as the past faces, or keep its own direction",
        "turned",
        words=("turned", "kept"),
    )
    sampling: PredictionSampling = group(PredictionSampling(count=1), *NAMES)
