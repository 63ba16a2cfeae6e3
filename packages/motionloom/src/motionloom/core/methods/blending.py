"""DiffusionBlending (Shafir et al. 2024, section 3.3, equation 3): several fine-tuned networks control together.

    G_s^{a,b}(X_t, t, c_a, c_b) = G^a(X_t, t, c_a) + s (G^b(X_t, t, c_b) - G^a(X_t, t, c_a))

Here written for any number of networks, each guided by its own words first, as a weighted sum; two networks of weights
1 - s and s are equation 3. The walk is algorithm 2, with the union of what the networks control (`methods.control`).
"""

from collections.abc import Callable, Sequence

import numpy as np

from motionloom.core.diffusion import Denoiser, Weight, blend, guide, row_noise
from motionloom.core.errors import MotionloomError
from motionloom.core.methods.edit import Observed, controlled, known_part
from motionloom.core.methods.walk import Walk
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.networks.prior_condition import Condition
from motionloom.core.models.prior import Prior


def blended(
    nets: Sequence[PriorSession],
    cond: Condition,
    known: np.ndarray,
    mask: np.ndarray,
    *,
    weights: Sequence[Weight],
    guidance: Weight,
) -> Denoiser:
    """The weighted sum of networks, each guided by itself and shown what is known where it can see it.

    Args:
        nets: Networks of one prior.
        cond: What the words of the rows say.
        known: (rows, frames, features) standardised.
        mask: The same shape, bool: what the networks see of it.
        weights: One per network, used as they are: a number, what broadcasts to the motions, or either by level.
        guidance: Of each network, as of `core.diffusion.guide`.

    Returns:
        The denoiser of states (rows, frames, features).
    """
    null = cond.null()
    guided = [
        guide(net, net.show(net.bind(cond), known, mask), net.show(net.bind(null), known, mask), guidance)
        for net in nets
    ]
    return guided[0] if len(nets) == 1 and weights[0] == 1.0 else blend(guided, weights)


def control_by_blending(
    prior: Prior,
    nets: Sequence[PriorSession],
    prompts: Sequence[str],
    observed: Observed,
    *,
    seeds: Sequence[int],
    weights: Sequence[Weight] | None = None,
    edited: Callable[[Denoiser], Denoiser] | None = None,
    walk: Walk | None = None,
) -> np.ndarray:
    """Motions in which the observed numbers are exact, from several networks.

    Args:
        prior: The weights that the networks belong to.
        nets: Networks of this prior: its own, fine-tuned ones, `core.models.adapter.adapted` ones.
        prompts: One per row, "" for none.
        observed: What is known (with several controls their union); what is not may hold anything. Where it is not
            ``noise_free`` this is MDM's inpainting: noise everywhere, and no network is shown what is known.
        seeds: One per row; a row's motion depends on no other row.
        weights: One per network; the mean by default.
        edited: Changes the blended denoiser before the known numbers are written into its estimates.
        walk: How noise is taken away.

    Returns:
        (rows, frames, features) standardised.

    Raises:
        MotionloomError: The parts do not fit together.
    """
    walk, mask = walk or Walk(), observed.mask
    known = known_part(prior, observed)
    if not nets or not len(prompts) == len(seeds) == len(known):
        raise MotionloomError(
            f"{len(nets)} networks, {len(prompts)} prompts and {len(seeds)} seeds do not fit {len(known)} motions; "
            "give at least one network, and a prompt and a seed for each motion"
        )
    weights = [1 / len(nets)] * len(nets) if weights is None else list(weights)
    if len(weights) != len(nets):
        raise MotionloomError(f"there are {len(weights)} weights for {len(nets)} networks; give one for each")
    visible = mask if observed.noise_free else np.zeros_like(mask)
    denoise = blended(nets, prior.condition(list(prompts)), known, visible, weights=weights, guidance=walk.guidance)
    return controlled(
        edited(denoise) if edited else denoise,
        Observed(known, mask, observed.noise_free),
        levels=walk.levels(prior.schedule),
        solver=walk.solve,
        schedule=prior.schedule,
        noise=row_noise(seeds),
    )
