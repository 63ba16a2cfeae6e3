"""What a timeline file may hold: segments that follow each other, and what is said of all of them."""

from dataclasses import dataclass
from typing import Any

from motionloom.requests.fields import Checked, declare, like
from motionloom.requests.sampling import Sampling
from motionloom.requests.shared import LONGEST, prompt

SECONDS = 5.0
"""Of a segment where nothing is said."""


@dataclass(frozen=True, kw_only=True)
class SegmentKeys(Checked):
    """The keys of one segment."""

    text: str = prompt(needed=True)
    seconds: float = declare("number", "length of each segment", SECONDS, low=0.2, high=LONGEST, unit="seconds")
    guidance: float | None = like(Sampling, "guidance", default=None)
    transition: float | None = declare(
        "number",
        "seconds that two neighbours share; without it 1, or what fits",
        low=0.05,
        high=LONGEST / 2,
        unit="seconds",
    )
    goal: Any = declare("goal", "goals of this segment, seen from where the person is when it begins")
    goals: Any = declare("goal", "several of them", many=1000)
    adapters: Any = declare(
        "adapters", "what 'motionloom teach' made, for this segment alone: FILE, which is FILE:1, or FILE:FACTOR"
    )


@dataclass(frozen=True, kw_only=True)
class TimelineKeys(Checked):
    """The keys of a timeline file."""

    segments: Any = declare("segments", "what the person does, one after the other", needed=True)
    seed: int | None = like(Sampling, "seed", "the same seed makes the same motion", default=None)
    guidance: float | None = like(Sampling, "guidance", default=None)
    transition: float | None = like(SegmentKeys, "transition")
    start: Any = declare("motion file", "a motion that is gone on from")
    path: Any = declare("goal", "goals of the whole, in the world")
