"""How a live motion is sampled: lengths in frames of the prior (20 per second), steps and solver."""

from dataclasses import dataclass

from motionloom.diffusion import SOLVERS, SPACINGS
from motionloom.errors import MotionloomError


@dataclass(frozen=True)
class Settings:
    """What a `Live` is sampled with; the defaults are those that docs/live.md measures."""

    steps: int = 7
    """Guided network calls for one window."""
    guidance: float = 2.5
    """Strength of the words; 0 ignores them."""
    guided: float = 0.95
    """The noise of a level (0 to 1) down to which there is guidance. Below it guidance hardly changes the estimate, and
    a call takes one row instead of two (after Kynkäänniemi et al. 2024)."""
    solver: str = "ddpm"
    """One of `diffusion.SOLVERS`."""
    spacing: str = "early"
    """How the noise levels of the steps are spread (`diffusion.SPACINGS`)."""
    known: int = 10
    """Frames of the past that a window begins with."""
    ahead: int = 60
    """Frames that a window samples."""
    used: int = 40
    """Frames of a window that are shown before the next one is sampled, when nothing is asked."""
    rest: int = 4
    """Frames at least between two windows that take up what is asked: what is asked more often is put together."""

    def __post_init__(self) -> None:
        if self.solver not in SOLVERS or self.spacing not in SPACINGS:
            raise MotionloomError(
                f"no solver {self.solver!r} with spacing {self.spacing!r}; there are {', '.join(SOLVERS)} and "
                f"{', '.join(SPACINGS)}"
            )
        if not 1 <= self.steps <= 200 or not abs(self.guidance) <= 100:
            raise MotionloomError(
                f"{self.steps} steps with a guidance of {self.guidance:g} cannot be sampled; give 1 to 200 steps, "
                "usual guidance is 1 to 7"
            )
        if not (4 <= self.known <= 40 and 1 <= self.rest <= self.used <= self.ahead - 10 and self.ahead <= 180):
            raise MotionloomError(
                f"windows of {self.known} known and {self.ahead} sampled frames, {self.used} of them used, do not fit; "
                "give 4 to 40 known frames and at most 180 sampled ones, 10 more than are used"
            )
