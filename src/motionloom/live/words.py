"""The words for what somebody does who is steered without words: plain ones, which every prior knows."""

import math
import re

from motionloom.goals.goal import turn_between

STANDS = "a person stands still"
_FORWARD = (
    (0.15, STANDS),
    (1.9, "a person walks forward"),
    (2.4, "a person jogs slowly"),
    (math.inf, "a person runs forward"),
)
_BACKWARDS, _SIDEWAYS = "a person walks backwards", "a person walks sideways"


_STANDING = re.compile(r"\b(stands?|standing|stops?|halts?)\b", re.IGNORECASE)


def is_standing(words: str) -> bool:
    """Whether words ask for somebody who stays where he is."""
    return bool(_STANDING.search(words))


def for_pace(speed: float, direction: float | None, facing: float | None) -> str:
    """speed: metres per second; direction, facing: radians in the world, None where they are one."""
    words = next(words for most, words in _FORWARD if speed < most)
    if words == STANDS or direction is None or facing is None:
        return words
    off = abs(float(turn_between(direction, facing)))
    if off > math.radians(130):
        return _BACKWARDS
    return _SIDEWAYS if off > math.radians(50) else words
