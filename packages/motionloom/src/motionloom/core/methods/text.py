"""Text to motion (Tevet et al. 2023, *Human Motion Diffusion Model*; Shafir et al. 2024, section 3).

The network answers the clean motion, X^_0 = G(X_t, t, c). With the words at strength s (Ho & Salimans 2022, eq. 6)

    G_s(X_t, t, c) = G(X_t, t, none) + s (G(X_t, t, c) - G(X_t, t, none))

and from t = T to 0 the estimate is taken back to a cleaner level: q(X_s | X_t, X^_0) of the noising process, equation 1
of Shafir et al. 2024.
"""

from collections.abc import Sequence

import numpy as np

from motionloom.core.body.feet import clean_feet
from motionloom.core.body.ik import motion_from_positions
from motionloom.core.diffusion import Denoiser, Weight, guide, row_noise, run
from motionloom.core.features import humanml
from motionloom.core.features.layout import LAYOUT
from motionloom.core.methods.walk import Walk, check_prompts
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion


def guided(
    prior: Prior,
    prompts: Sequence[str],
    scale: Weight,
    *,
    lengths: Sequence[int] | None = None,
    flags: np.ndarray | None = None,
) -> Denoiser:
    """G_s of these prompts, one per row; an empty one is no condition.

    Args:
        prior: The weights.
        prompts: One per row of the states.
        scale: s, a number, one per row, or either by level.
        lengths: Frames of each row that attention may look at; None: all of them.
        flags: (rows, frames) 1 in transitions, for networks with a transition embedding.

    Returns:
        The denoiser of states (rows, frames, features).
    """
    cond = prior.condition(list(prompts), list(lengths) if lengths else None)
    if prior.net.config.flags and flags is not None:
        cond = cond._replace(flags=flags)
    return guide(prior.net, prior.net.bind(cond), prior.net.bind(cond.null()), scale)


def text_to_motion(
    prior: Prior, prompts: Sequence[str], frames: int, *, seeds: Sequence[int], walk: Walk | None = None
) -> np.ndarray:
    """Motions of these words.

    Args:
        prior: The weights.
        prompts: One per motion.
        frames: The length of all of them, at the prior's frame rate.
        seeds: One per motion, 0 or more and below `LARGEST_SEED`; a motion depends on its own prompt and seed alone.
        walk: How noise is taken away.

    Returns:
        (motions, frames, features), not standardised: what the prior was trained on, 263 numbers by default.

    Raises:
        MotionloomError: A prompt or seed is missing, or the walk does not fit the weights.
    """
    walk = walk or Walk()
    check_prompts(list(prompts), list(seeds))
    noise = row_noise(seeds)
    state = run(
        guided(prior, prompts, walk.guidance),
        noise(np.empty((len(prompts), frames, len(prior.mean)), np.float32)),
        levels=walk.levels(prior.schedule),
        solver=walk.solve,
        schedule=prior.schedule,
        noise=noise,
    )
    return prior.to_features(state)


def to_motion(features: np.ndarray, fps: float, *, foot_lock: bool = True) -> Motion:
    """A person with constant bones.

    Args:
        features: (frames, 263) HumanML3D numbers, not standardised.
        fps: Frames per second.
        foot_lock: Whether planted feet hold still.

    Returns:
        The motion of the 22-joint person, metres, +Y up, who starts at the origin facing +Z.
    """
    motion = motion_from_positions(humanml.decode_positions(features), fps)
    return clean_feet(motion, contacts=features[:, LAYOUT["contacts"]]) if foot_lock else motion
