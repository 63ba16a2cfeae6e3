"""How a live motion is sampled: lengths in frames of the prior (20 per second), steps and solver."""

from dataclasses import dataclass

from motionloom.core.errors import MotionloomError
from motionloom.requests.fields import Checked, declare, like
from motionloom.requests.live import Live
from motionloom.requests.sampling import Sampling


@dataclass(frozen=True)
class Settings(Checked):
    """What a `Live` is sampled with; the defaults are those that docs/live.md measures."""

    steps: int = like(Live, "steps", default=7)
    guidance: float = like(Sampling, "guidance")
    guided: float = declare("number", "the noise of a level down to which there is guidance", 0.95, low=0, high=1)
    """Below it guidance hardly changes the estimate, and a call takes one row instead of two (after Kynkäänniemi et al.
    2024)."""
    solver: str = like(Sampling, "solver")
    spacing: str = like(Sampling, "spacing")
    known: int = declare("whole", "frames of the past that a window begins with", 10, low=4, high=40)
    ahead: int = declare("whole", "frames that a window samples", 60, low=11, high=180)
    used: int = declare("whole", "frames of a window that are shown when nothing is asked", 40, low=1, high=170)
    rest: int = declare("whole", "frames between two windows that take up what is asked", 4, low=1, high=170)
    """Commands that come more often are merged."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.rest <= self.used <= self.ahead - 10:
            raise MotionloomError(
                f"windows of {self.ahead} sampled frames, {self.used} of them used, do not fit; give 10 more than are "
                "used"
            )
