"""Motion editing by inpainting (Tevet et al. 2023, section 3: in-betweening, parts of the body).

Part of the motion is known. In every move the known numbers take the place of the estimated ones, so the rest is
sampled to go with them:

    X^_0 <- known * M + G_s(X_t, t, c) * (1 - M)

`core.methods.control` adds to it that the known numbers stay free of noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from motionloom.core.diffusion import NoiseSource, Schedule, Solver, chain, inpaint, observe, row_noise, run
from motionloom.core.diffusion.denoisers import Denoiser
from motionloom.core.errors import MotionloomError
from motionloom.core.methods.text import guided
from motionloom.core.methods.walk import Walk, check_prompts
from motionloom.core.models.prior import Prior


@dataclass(frozen=True, eq=False)
class Observed:
    """Known part of the states (inpainting)."""

    values: np.ndarray
    """(rows, tokens, features), standardised; read where the mask is True."""
    mask: np.ndarray
    """The same shape, bool."""
    noise_free: bool = False
    """The network sees the known part without noise (Shafir et al. 2024, section 3.3), else at the noise of its level
    (RePaint, Lugmayr et al. 2022)."""
    strength: float = 1.0
    """Share of the noise levels that the values are taken to, and sampled back from (SDEdit, Meng et al. 2022)."""

    def of(self, rows: Sequence[int]) -> "Observed":
        """Those of some rows."""
        return replace(self, values=self.values[rows], mask=self.mask[rows])


def edit(
    prior: Prior, prompts: Sequence[str], observed: Observed, *, seeds: Sequence[int], walk: Walk | None = None
) -> np.ndarray:
    """Motions that keep what is observed and do what the words say in the rest.

    Args:
        prior: The weights.
        prompts: One per row, "" for none.
        observed: What is kept: frames (in-betweening) or numbers of joints (`core.features.layout.mask`) in all frames.
        seeds: One per row.
        walk: How noise is taken away.

    Returns:
        (rows, frames, features) standardised; equal to ``observed.values`` under its mask.

    Raises:
        MotionloomError: The parts do not fit together, or a known number is not finite.
    """
    walk = walk or Walk()
    check_prompts(list(prompts), list(seeds))
    return controlled(
        guided(prior, prompts, walk.guidance),
        Observed(known_part(prior, observed), observed.mask),
        levels=walk.levels(prior.schedule),
        solver=walk.solve,
        schedule=prior.schedule,
        noise=row_noise(seeds),
    )


def controlled(
    denoise: Denoiser,
    observed: Observed,
    *,
    levels: Sequence[int],
    solver: Solver,
    schedule: Schedule,
    noise: NoiseSource,
    start: np.ndarray | None = None,
) -> np.ndarray:
    """The walk with known numbers on any denoiser: inpainting, or algorithm 2 of Shafir et al. 2024 (``noise_free``).

    Args:
        denoise: The denoiser of the rows.
        observed: What is known.
        levels: The falling noise levels.
        solver: What moves from level to level.
        schedule: Signal and noise of each level.
        noise: For the start and for every move.
        start: (rows, frames, features) the clean motion that the free numbers are noised from: zeros by default; the
            published code starts from the motion that the known numbers were taken from.

    Returns:
        (rows, frames, features) standardised.
    """
    known, mask = observed.values, observed.mask
    start = np.zeros_like(known) if start is None else start
    x = schedule.noised(start, levels[0], noise(known))
    hold = observe(known, mask, schedule, np.zeros_like) if observed.noise_free else chain()
    return run(
        inpaint(denoise, known, mask),
        hold(x, levels[0]),
        levels=levels,
        solver=solver,
        schedule=schedule,
        noise=noise,
        constrain=hold,
    )


def known_part(prior: Prior, observed: Observed) -> np.ndarray:
    """The values where they are known, zeros elsewhere, float32; `MotionloomError` for shapes that do not fit."""
    known, mask = observed.values, observed.mask
    if mask.dtype != np.bool_ or known.ndim != 3 or mask.shape != known.shape or known.shape[2] != len(prior.mean):
        raise MotionloomError(
            f"given numbers of shape {tuple(known.shape)} under a {mask.dtype} mask of shape {tuple(mask.shape)} are "
            f"of no use; both must be (motions, frames, {len(prior.mean)}), the mask of booleans"
        )
    known = np.where(mask, known, 0.0).astype(np.float32)
    if not np.isfinite(known).all():
        raise MotionloomError("a given number is not finite (NaN or infinity); correct it or take it out of the mask")
    return known
