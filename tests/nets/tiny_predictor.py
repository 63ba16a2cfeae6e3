"""Predictors small enough for tests: random weights none of which is zero, few joints, short windows."""

import numpy as np
import torch

from motionloom.diffusion import Dct, cosine
from motionloom.features.positions import Layout
from motionloom.nets.predictor import TransLinear
from motionloom.runtime.predictor import PredictorConfig
from motionloom.train.modules import predictor_session
from motionloom.weights.predictor import Predictor, condition_shape
from motionloom.weights.prior import Card

BODY = Layout(("root", "left", "right", "head"), (-1, 0, 0, 0), (0, 2, 1, 3), ((1, 2),))
"""Told with the root's way, and turned to the facing."""
BARE = Layout(BODY.names, BODY.parents, BODY.pairs, root=False, z_up=True)
"""As published: no way, +Z up."""


def predictor(
    variant: str = "masked", *, levels: int = 1000, frames: int = 20, kept: int = 8, seed: int = 0
) -> Predictor:
    """A predictor of ``frames`` frames, 5 of them observed, at 20 fps."""
    told = variant == "masked"
    layout = BODY if told else BARE
    shape = condition_shape(layout, kept) if told else None
    config = PredictorConfig(
        channels=layout.channels, kept=kept, layers=2, width=16, heads=2, condition=shape, beside=told
    )
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        net = TransLinear(config)
        with torch.no_grad():
            for value in net.parameters():
                value.add_(0.2 * torch.randn_like(value))
    rng, shape = np.random.default_rng(seed), (kept, layout.channels)
    mean, std = 0.1 * rng.standard_normal(shape, np.float32), rng.random(shape, np.float32) + np.float32(0.5)
    pose = np.stack([mean[0], std[0]])
    if not told:
        mean, std, pose = np.zeros_like(mean), np.ones_like(std), np.stack([0 * mean[0], 0 * std[0] + 1])
    card = Card("tiny", "do what you like", "random numbers", {"steps": 3})
    return Predictor(
        predictor_session(net.eval().requires_grad_(False)),
        cosine(levels),
        layout,
        Dct(frames, kept),
        5,
        20.0,
        "masked" if told else "published",
        mean,
        std,
        pose,
        card,
    )
