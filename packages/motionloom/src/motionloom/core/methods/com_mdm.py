"""Two people through a communication block, ComMDM (Shafir et al. 2024, section 3.2, figure 4).

Two rows of one frozen prior, one a person. Behind its layer n a small transformer reads the activations of both and
corrects each, and it learns D, where each of them stands and faces in the first frame:

    O~_t^{i,(n)} = O_t^{i,(n)} + dO_t^{i,(n)}
    dO_t^{i,(n)}, D^_0^i = ComMDM(O_t^{i,(n)}, O_t^{3-i,(n)}, D_t^i, t)

`core.models.networks.pair.PairSession` is the two networks with the block between them; a state has D in a slot before
its frames. Training it with L_simple is `motionloom_train.pair`.
"""

from collections.abc import Sequence

import numpy as np

from motionloom.core.defaults import LARGEST_SEED
from motionloom.core.diffusion import NoiseSource, guide, inpaint, observe, row_noise, row_seed, run
from motionloom.core.errors import MotionloomError
from motionloom.core.features.pair import PairMotion
from motionloom.core.methods.walk import Walk
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior

SLOTS = 1
"""Tokens before the frames: D."""


def com_mdm(
    prior: Prior,
    block: PairBlock,
    prompts: Sequence[tuple[str, str]],
    frames: int,
    *,
    seeds: Sequence[tuple[int, int]],
    prefix: PairMotion | None = None,
    walk: Walk | None = None,
) -> PairMotion:
    """Pairs of people from words, from a beginning (prefix completion), or from both.

    Args:
        prior: The weights of one person.
        block: The communication block that was trained with it.
        prompts: What each of the two does, one pair of texts per pair of people; an empty text is no condition.
        frames: The length, at the prior's frame rate.
        seeds: One for each person of each pair.
        prefix: The frames that the pairs begin with: features (pairs, 2, some frames, 263) and poses (pairs, 2, 4).
        walk: How noise is taken away.

    Returns:
        Features (pairs, 2, frames, 263), not standardised, and ground poses (pairs, 2, 4) at frame 0. The first person
        of each stands at the origin facing +Z, or, with a code of the kind "world", where the block puts them.

    Raises:
        MotionloomError: The block belongs to another prior, or texts, seeds and prefix do not fit together.
    """
    walk, net = walk or Walk(), block.net(prior)
    texts, rows = [text for pair in prompts for text in pair], [seed for pair in seeds for seed in pair]
    given = 0 if prefix is None else prefix.features.shape[2]
    if not prompts or len(prompts) != len(seeds) or not all(0 <= seed < LARGEST_SEED for seed in rows):
        raise MotionloomError(f"{len(prompts)} pairs of texts and {len(seeds)} of seeds do not fit; give one of each")
    if prefix is not None and (len(prefix.features) != len(prompts) or given >= frames):
        raise MotionloomError(
            f"a prefix of {len(prefix.features)} pairs and {given} frames does not begin {len(prompts)} pairs of "
            f"{frames} frames; give one prefix per pair that is shorter than the motion"
        )
    cond, noise = prior.condition(texts), pair_noise(rows)
    denoise = guide(net, net.bind(cond), net.bind(cond.null()), walk.guidance)
    state = noise(np.empty((len(texts), SLOTS + frames, len(prior.mean)), np.float32))
    levels, hold = walk.levels(prior.schedule), None
    if prefix is not None:
        known, mask = net.states(prefix, frames), np.zeros(state.shape, np.bool_)
        mask[:, : SLOTS + given] = True
        hold = observe(known, mask, prior.schedule, np.zeros_like)
        denoise, state = inpaint(denoise, known, mask), hold(state, levels[0])
    clean = run(
        denoise,
        state,
        levels=levels,
        solver=walk.solve,
        schedule=prior.schedule,
        noise=noise,
        constrain=hold,
    )
    return net.pairs(clean)


def pair_noise(seeds: Sequence[int]) -> NoiseSource:
    """Noise of rows' own seeds; a motion gets the noise that it has alone, the slot before it another."""
    places, motion = row_noise([row_seed(seed, 0, 1) for seed in seeds]), row_noise(seeds)
    return lambda like: np.concatenate([places(like[:, :SLOTS]), motion(like[:, SLOTS:])], axis=1)
