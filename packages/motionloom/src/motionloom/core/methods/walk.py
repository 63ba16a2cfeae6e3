"""How noise is taken away: so many moves from the noisiest level to the clean one, with a solver and a guidance."""

from dataclasses import dataclass

import numpy as np

from motionloom.core.defaults import GUIDANCE, LARGEST_GUIDANCE, LARGEST_SEED, SOLVER, SPACING, STEPS
from motionloom.core.diffusion import SOLVERS, SPACINGS, Schedule, Solver, levels
from motionloom.core.errors import MotionloomError


@dataclass(frozen=True)
class Walk:
    """The settings of one walk from noise to data; `MotionloomError` for those that nothing is sampled with.

    The papers take ``steps`` = 1000, ``solver`` "ddpm" and ``spacing`` "index" (every level once).
    """

    steps: int = STEPS
    """Network calls."""
    solver: str = SOLVER
    """A name of `core.diffusion.SOLVERS`."""
    spacing: str = SPACING
    """A name of `core.diffusion.SPACINGS`: how the steps are spread over the levels."""
    guidance: float = GUIDANCE
    """s of classifier-free guidance, u + s (c - u); 1: the text alone, 0: no text."""

    def __post_init__(self) -> None:
        if self.solver not in SOLVERS or self.spacing not in SPACINGS:
            raise MotionloomError(
                f"there is no solver {self.solver!r} with spacing {self.spacing!r}; solvers are {', '.join(SOLVERS)}, "
                f"spacings {', '.join(SPACINGS)}"
            )
        if not np.isfinite(self.guidance) or abs(self.guidance) > LARGEST_GUIDANCE:
            raise MotionloomError(f"a guidance of {self.guidance:g} makes no motion; usual values are 1 to 7")

    def levels(self, schedule: Schedule) -> list[int]:
        """The falling noise levels, from the schedule's last to 0; `MotionloomError` for more steps than it has."""
        if self.steps not in range(1, schedule.steps + 1):
            raise MotionloomError(f"{self.steps} steps cannot be taken; these weights take 1 to {schedule.steps}")
        return levels(schedule, self.steps, spacing=self.spacing)  # type: ignore[arg-type]

    @property
    def solve(self) -> Solver:
        """The solver of this name."""
        return SOLVERS[self.solver]


def check_prompts(prompts: "list[str] | tuple[str, ...]", seeds: "list[int] | tuple[int, ...]") -> None:
    """Raise `MotionloomError` where prompts and seeds are not one of each a motion, or a seed is out of range."""
    if len(prompts) != len(seeds) or not prompts:
        raise MotionloomError(f"{len(prompts)} prompts and {len(seeds)} seeds do not fit; give one of each per motion")
    if not all(0 <= seed < LARGEST_SEED for seed in seeds):
        raise MotionloomError(f"a seed is a whole number from 0 to {LARGEST_SEED - 1}; got {min(seeds)}")
