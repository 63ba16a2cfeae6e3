"""What a mask file may hold (docs/predict.md): seconds and frames count from the end of the past."""

from collections.abc import Mapping

from motionloom.requests.fields import Spec

LONGEST = 86_400
"""Seconds."""
MAX_FRAME = 100_000_000

MASK: Mapping[str, Spec] = {"hold": Spec("part", "what is held; entries add up", many=1000, needed=True)}
PART: Mapping[str, Spec] = {
    "joints": Spec(
        "joint", "joints of the 22, groups of them, or root: the way through the world", many=100, needed=True
    ),
    "from": Spec("number", "without it the end of the past", low=0, high=LONGEST, unit="seconds"),
    "to": Spec("number", "without it the end of the prediction", low=0, high=LONGEST, unit="seconds"),
    "frames": Spec(
        "whole",
        "stretches of frames of the past's rate, each from its first one to before its second one",
        low=0,
        high=MAX_FRAME,
        size=2,
        many=100_000,
    ),
}
"""A part has frames, or from and to."""
