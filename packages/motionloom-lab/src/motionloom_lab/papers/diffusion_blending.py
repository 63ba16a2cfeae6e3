"""Published control on features: algorithm 2 of Shafir et al. 2024, DiffusionBlending, and MDM's inpainting.

Given numbers M stay free of noise all the way, as in training (algorithm 1): at every level they are signal * known.

    x_T = signal_T * known * M + noise_T * z * (1 - M)
    denoised = sum of w_i (u_i + s (c_i - u_i))         each network guided by itself, then blended
    denoised = known on M;  x_s from x_t and denoised;  x_s = signal_s * known on M

As published, but for one thing: nothing of the motion that the given numbers come from is in the start beside them (the
published code starts from all of it, noised). MDM's inpainting overwrites the estimate alone and noises everything.
"""

from collections.abc import Sequence
from typing import Unpack

import numpy as np

from motionloom.diffusion import (
    SOLVERS,
    Denoiser,
    NoiseSource,
    Schedule,
    Solver,
    Weight,
    chain,
    inpaint,
    observe,
    row_noise,
    run,
)
from motionloom.edits.steering import Correction, corrected
from motionloom.errors import MotionloomError
from motionloom.requests.sampling import Sampling, Settings
from motionloom.runtime.prior import PriorSession
from motionloom.tasks.control import blended
from motionloom.tasks.sampling import Observed
from motionloom.weights.prior import Prior


def control_features(
    prior: Prior,
    nets: Sequence[PriorSession],
    prompts: Sequence[str],
    observed: Observed,
    *,
    seeds: Sequence[int],
    weights: Sequence[Weight] | None = None,
    corrections: Sequence[Correction | None] | None = None,
    sampling: Sampling | None = None,
    **settings: Unpack[Settings],
) -> np.ndarray:
    """Motions in which the observed numbers are exact; (rows, frames, features) standardised.

    Args:
        nets: networks of this prior: its own, fine-tuned ones, `weights.adapter.adapted` ones; each is guided by
            itself.
        prompts: one per row, "" for none.
        observed: what is given (with several controls their union); what is not may hold anything. Where it is not
            ``noise_free`` this is MDM's inpainting: noise everywhere, and no network is shown what is given.
        seeds: one per row; a row's motion depends on no other row.
        weights: one per network, a number or what broadcasts to the motions, or either by level (`diffusion.blend`);
            the mean by default. They are used as they are.
        corrections: change each row's blended estimate before the given numbers are inserted.
        sampling: or single settings of it as keywords.

    Raises:
        MotionloomError: for what does not fit together.

    (Shafir et al. 2024, algorithm 2 and section 4.3.)
    """
    chosen = Sampling.of(sampling, settings)
    mask = observed.mask
    known = _known_part(prior, observed.values, mask)
    if not nets or not len(prompts) == len(seeds) == len(known):
        raise MotionloomError(
            f"{len(nets)} networks, {len(prompts)} prompts and {len(seeds)} seeds do not fit {len(known)} motions; "
            "give at least one network, and a prompt and a seed for each motion"
        )
    weights = [1 / len(nets)] * len(nets) if weights is None else list(weights)
    if len(weights) != len(nets):
        raise MotionloomError(f"there are {len(weights)} weights for {len(nets)} networks; give one for each")
    visible = mask if observed.noise_free else np.zeros_like(mask)
    denoise = blended(nets, prior.condition(list(prompts)), known, visible, weights=weights, guidance=chosen.guidance)
    if corrections is not None:
        denoise = corrected(denoise, corrections)
    return controlled(
        denoise,
        Observed(known, mask, observed.noise_free),
        levels=chosen.levels(prior.schedule),
        solver=SOLVERS[chosen.solver],
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
    """The walk of algorithm 2 on any denoiser; (rows, frames, features).

    ``start`` is the clean motion that the free numbers are noised from: nothing (zeros) by default; the published code
    starts from the motion that the given numbers were taken from.
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


def _known_part(prior: Prior, known: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """``known`` where it is given, zeros elsewhere."""
    if mask.dtype != np.bool_ or known.ndim != 3 or mask.shape != known.shape or known.shape[2] != len(prior.mean):
        raise MotionloomError(
            f"given numbers of shape {tuple(known.shape)} under a {mask.dtype} mask of shape {tuple(mask.shape)} are "
            f"of no use; both must be (motions, frames, {len(prior.mean)}), the mask of booleans"
        )
    known = np.where(mask, known, 0.0).astype(np.float32)
    if not np.isfinite(known).all():
        raise MotionloomError("a given number is not finite (NaN or infinity); correct it or take it out of the mask")
    return known
