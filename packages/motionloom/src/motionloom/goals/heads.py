"""What a head does, in words: "nods twice", "shakes the head", "looks up and to the left", "looks around".

Plain text work by a table. The features that weights learn hold no turn of the head, so nothing is sampled:
`motionloom.kinematics.gaze` turns the head by what is read.
"""

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.core.blending import smoothstep
from motionloom.core.errors import MotionloomError
from motionloom.goals.numerals import in_digits
from motionloom.goals.verbs import asserted

Array = NDArray[np.float64]
EASE = 0.4
"""Seconds in which a head turns to the side, and back."""
STROKE = {"nods": 0.7, "shakes": 0.8, "looks around": 3.0}
"""Seconds of one nod, of once to and fro, and of once to both sides."""
QUICKEST = 0.3
"""Seconds: no head nods or is shaken more quickly."""
_TO = (
    (r"\bleft", (55, 0)),
    (r"\bright", (-55, 0)),
    (r"\bup|\bsky\b|\bceiling\b", (0, 30)),
    (r"\bdown|\bfloor\b|\bground\b|\bfeet\b", (0, -35)),
)
"""Words, and the degrees to the left and up that they say."""
_OFTEN = {"once": 1, "twice": 2, "thrice": 3}
_LOOK = r"\blook(?:s|ed|ing)?"
_SAID = re.compile(
    r"\bnod(?:s|ded|ding)?\b(?! off)"
    r"|\bsh(?:akes?|ook|aking) (?:his|her|their|its|your|my|the) heads?\b"
    rf"|{_LOOK} (?:\w+ly )?(?:all )?(?:around|left and right|left|right|up|down|both ways|from side to side)\b"
    r"(?! (?:for|the|an?|to see)\b)"
    rf"|{_LOOK} (?:over |to |at )+(?:the |his |her |their |both )?(?:left|right|sides|sky|ceiling|floor|ground|feet)\b"
    r"|\bturn(?:s|ed|ing)? (?:his|her|their|its|your|the) head (?:to the |over the )?(?:left|right)\b",
    re.IGNORECASE,
)
"""What a sentence says of a head and no measure."""
_ONLY = re.compile(r"nod|shak|shook|look|turn", re.IGNORECASE)
KNOWN = "nods, shakes, looks left, right, up or down, and looks around"


@dataclass(frozen=True)
class HeadMove:
    """A move of the head from where it is."""

    kind: str
    """A key of `STROKE`, or ``looks``."""
    left: float
    """Degrees to the left, or to both sides."""
    up: float
    """Degrees up."""
    times: int = 0
    """How often; 0: as often as there is time for."""
    pace: float = 1.0
    """Seconds for each usual one."""

    def at(self, time: Array, seconds: float) -> tuple[Array, Array]:
        """Radians to the left and up (frames,) at times (frames,) from the beginning of so many seconds."""
        ease = min(EASE * self.pace, seconds / 2)
        share = smoothstep(np.minimum(time, seconds - time) / ease)
        if self.kind in STROKE:
            stroke = STROKE[self.kind] * self.pace
            strokes = min(self.times, max(1, int(seconds / QUICKEST))) or max(1, round(seconds / stroke))
            length = min(seconds, strokes * stroke) if self.times else seconds
            phase = 2 * np.pi * strokes * np.clip(time / length, 0, 1)
            if self.kind == "nods":
                share = (1 - np.cos(phase)) / 2
            else:
                share = np.sin(phase) * smoothstep(np.minimum(time, length - time) / min(ease, length / 4))
        return math.radians(self.left) * share, math.radians(self.up) * share


def read_head(text: str) -> HeadMove:
    """What words say of a head; raises `MotionloomError` for those that say nothing of it."""
    words = in_digits(text)
    often = re.search(r"\b(once|twice|thrice|(\d+) (?:times|nods|shakes))\b", words)
    times = (int(often[2]) if often[2] else _OFTEN[often[1]]) if often else 0
    pace = 1.5 if re.search(r"\bslow", words) else 0.7 if re.search(r"\b(?:quick|fast|rapid)", words) else 1.0
    much = 0.5 if re.search(r"\b(?:slightly|a little|a bit)\b", words) else 1.0
    if re.search(r"\bnod", words):
        return HeadMove("nods", 0.0, -20.0 * much, times, pace)
    if re.search(r"\bsh(?:ak|ook)", words):
        return HeadMove("shakes", 25.0 * much, 0.0, times, pace)
    if re.search(r"\baround|\bboth (?:ways|sides)|\bside to side|\bleft and right|\bleft then right", words):
        return HeadMove("looks around", 55.0 * much, 0.0, times, pace)
    turns = [degrees for pattern, degrees in _TO if re.search(pattern, words)]
    if not turns:
        raise MotionloomError(f"a head {KNOWN}; {text.strip()[:60]!r} says none of these")
    left, up = np.sum(turns, axis=0).tolist()
    return HeadMove("looks", left * much, up * much, 0, pace)


def head_said(text: str) -> HeadMove | None:
    """What a sentence about somebody says of the head: "a man walks and looks around"; None for nothing.

    How often and how quickly counts for a nod and a shake; of a look only the words of it do.
    """
    text = asserted(text)
    said = _SAID.search(text)
    if said is None:
        return None
    return read_head(text if re.match(r"nod|sh", said[0], re.IGNORECASE) else said[0])


def is_of_head(text: str, verb: str = "") -> bool:
    """Whether a sentence says what a head does with its first verb (`motionloom.goals.remarks.verb_words`)."""
    return head_said(text) is not None and _ONLY.match(verb) is not None
