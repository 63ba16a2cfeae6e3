"""Predictors small enough for tests: random weights none of which is zero, few joints, short windows."""

import numpy as np

from motionloom.core.diffusion import Dct, cosine
from motionloom.core.models.adapter import NET
from motionloom.core.models.networks.predictor import PredictorConfig, PredictorSession
from motionloom.core.models.networks.shapes import predictor_shapes
from motionloom.core.models.predictor import Predictor
from motionloom.core.models.prior import Card
from tests.recorded.graphs import BARE, BODY, bare, graph, masked, random_weights


def network(config: PredictorConfig, seed: int, *, lively: float = 1.0) -> PredictorSession:
    """A predictor's network; ``lively``: how large what it answers is."""
    weights = random_weights(predictor_shapes(config), seed)
    for name in ("out.weight", "out.bias"):
        weights[name] *= np.float32(lively)
    named = {NET + name: value for name, value in weights.items()}
    return PredictorSession(config, named, graph("predictor", config))


def predictor(
    variant: str = "masked", *, levels: int = 1000, frames: int = 20, kept: int = 8, seed: int = 0
) -> Predictor:
    """A predictor of ``frames`` frames, 5 of them observed, at 20 fps."""
    told = variant == "masked"
    layout = BODY if told else BARE
    rng, shape = np.random.default_rng(seed), (kept, layout.channels)
    mean, std = 0.1 * rng.standard_normal(shape, np.float32), rng.random(shape, np.float32) + np.float32(0.5)
    pose = np.stack([mean[0], std[0]])
    if not told:
        mean, std, pose = np.zeros_like(mean), np.ones_like(std), np.stack([0 * mean[0], 0 * std[0] + 1])
    return Predictor(
        network(masked(BODY, kept, 16) if told else bare(kept), seed),
        cosine(levels),
        layout,
        Dct(frames, kept),
        5,
        20.0,
        "masked" if told else "published",
        mean,
        std,
        pose,
        Card("tiny", "do what you like", "random numbers", {"steps": 3}),
    )
