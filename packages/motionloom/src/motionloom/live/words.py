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


_GOING = r"""walk\w*|runs?|running|jog\w*|sprint\w*|stroll\w*|march\w*|step\w*|skip\w*|hop\w*|jump\w*|crawl\w*|sneak\w*|
    creep\w*|limp\w*|stagger\w*|wander\w*|danc\w*|goes|go|going|moves?|moving|rush\w*|hurr\w+|climb\w*|strid\w+"""
_STAYING = r"""stands?|standing|stays?|staying|waits?|waiting|sits?|sitting|seated|lies?|lying|lays|laying|kneel\w*|
    squat\w*|crouch\w*|sleep\w*|rests?|resting|falls?|falling|collaps\w+|freez\w+|(?:stops?|halts?)(?:\s+\w+ing)?"""
_EITHER = re.compile(rf"\b(?:(?P<staying>{_STAYING})|{_GOING})\b", re.IGNORECASE | re.VERBOSE)


def stays(words: str) -> bool:
    """Whether words end with somebody who stays where he is: stands, sits or lies. The last of several verbs counts."""
    found = list(_EITHER.finditer(words))
    return bool(found) and found[-1]["staying"] is not None


def for_pace(speed: float, direction: float | None, facing: float | None) -> str:
    """speed: metres per second; direction, facing: radians in the world, None where they are one."""
    words = next(words for most, words in _FORWARD if speed < most)
    if words == STANDS or direction is None or facing is None:
        return words
    off = abs(float(turn_between(direction, facing)))
    if off > math.radians(130):
        return _BACKWARDS
    return _SIDEWAYS if off > math.radians(50) else words
