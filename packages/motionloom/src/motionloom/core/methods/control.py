"""Fine-tuned control (Shafir et al. 2024, section 3.3, algorithms 1 and 2).

Known numbers M (a trajectory, a wrist) stay free of noise all the way, as in training (algorithm 1): at every level t
they are signal_t * known.

    X_T  = signal_T * known * M + noise_T * z * (1 - M)
    X^_0 = known on M, else G_s(X_t, t, c)                        "original in-painting" of algorithm 2
    X_s  = from X_t and X^_0;  signal_s * known on M              "our addition": no noise on M

As published, but for one thing: nothing of the motion that the known numbers come from is in the start beside them (the
published code starts from all of it, noised). Training by algorithm 1 is `motionloom_train.control`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from motionloom.core.methods.blending import control_by_blending
from motionloom.core.methods.edit import Observed
from motionloom.core.methods.walk import Walk
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.prior import Prior


def control(
    prior: Prior,
    net: PriorSession,
    prompts: Sequence[str],
    observed: Observed,
    *,
    seeds: Sequence[int],
    walk: Walk | None = None,
) -> np.ndarray:
    """Motions in which the observed numbers are exact, from one network that was fine-tuned to see them.

    Args:
        prior: The weights that the network was fine-tuned from: text encoder, schedule and statistics.
        net: A fine-tuned network, or the prior's own with an adapter (`core.models.adapter.adapted`).
        prompts: One per row, "" for none.
        observed: What is known, (rows, frames, features) standardised, and its mask.
        seeds: One per row; a row depends on no other row.
        walk: How noise is taken away.

    Returns:
        (rows, frames, features) standardised.

    Raises:
        MotionloomError: The parts do not fit together.
    """
    free = replace(observed, noise_free=True)
    return control_by_blending(prior, [net], prompts, free, seeds=seeds, walk=walk)
