"""`Segment`: one prompted stretch of a long motion."""

from dataclasses import dataclass

from motionloom.core.errors import MotionloomError, kind_of
from motionloom.goals.adapters import Applied
from motionloom.goals.goal import FPS, Goal
from motionloom.requests.sampling import LARGEST_GUIDANCE
from motionloom.requests.shared import LONGEST

TRANSITION = 1.0
"""Seconds that neighbours share by default: the paper's handshake."""


@dataclass(frozen=True)
class Segment:
    """One prompted stretch of a long motion."""

    text: str
    seconds: float
    guidance: float | None = None
    """Strength of the text; None: that of the whole."""
    transition: float = TRANSITION
    """Seconds shared with the next segment, half before and half after the seam."""
    goal: Goal | None = None
    """Targets for the frames of this segment, seen from the person's ground pose when it begins (origin, facing +Z)."""
    adapters: tuple[Applied, ...] = ()
    """Adapters trained on clips, or their files, each with a factor, for this segment alone."""

    def __post_init__(self) -> None:
        subject = f"the segment {self.text[:40]!r}"
        limits = (
            ("seconds", self.seconds, LONGEST),
            ("transition", self.transition, LONGEST),
            ("guidance", self.guidance, LARGEST_GUIDANCE),
        )
        for name, value, most in limits:
            if value is not None and not abs(value) <= most:
                raise MotionloomError(f"{subject} has {name} {kind_of(value)}; give a number, at most {most:g}")
        frames = round(self.seconds * FPS)
        if self.goal is not None and len(self.goal) != frames:
            raise MotionloomError(
                f"{subject} has {frames} frames and its goal {len(self.goal)}; make them equally long"
            )
