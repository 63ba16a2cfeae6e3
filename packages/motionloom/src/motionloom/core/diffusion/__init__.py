"""Diffusion on plain arrays: schedules, solvers, one sampling loop, and the two kinds of edits.

Nothing here knows about motion. Read `schedule`, `solvers`, `sampling`, then `denoisers` and `constraints`.
"""

from .bases import Basis, Dct, Frames
from .constraints import Constraint, chain, handshake, observe
from .denoisers import Denoiser, Weight, blend, from_noise, guide, inpaint, join_rows, lerp, mix, rising
from .sampling import Snapshot, masked_noise, restart, row_noise, row_seed, run, sample
from .schedule import (
    SCHEDULES,
    SPACINGS,
    NoiseSource,
    Schedule,
    State,
    cosine,
    from_betas,
    generator,
    levels,
    linear,
    sigmoid,
    sqrt,
)
from .solvers import DDPM, SOLVERS, Ddim, DpmSolver2M, Solver, Step
from .staggered import Link, RowsDenoiser, staggered

__all__ = [
    "DDPM",
    "SCHEDULES",
    "SOLVERS",
    "SPACINGS",
    "Basis",
    "Constraint",
    "Dct",
    "Ddim",
    "Denoiser",
    "DpmSolver2M",
    "Frames",
    "Link",
    "NoiseSource",
    "RowsDenoiser",
    "Schedule",
    "Snapshot",
    "Solver",
    "State",
    "Step",
    "Weight",
    "blend",
    "chain",
    "cosine",
    "from_betas",
    "from_noise",
    "generator",
    "guide",
    "handshake",
    "inpaint",
    "join_rows",
    "lerp",
    "levels",
    "linear",
    "masked_noise",
    "mix",
    "observe",
    "restart",
    "rising",
    "row_noise",
    "row_seed",
    "run",
    "sample",
    "sigmoid",
    "sqrt",
    "staggered",
]
