"""A predictor of the 22 joints with random weights that moves people a little: half a second seen, a second made."""

import numpy as np
import torch

from motionloom.diffusion import Dct, sqrt
from motionloom.features.positions import SMPL_LAYOUT
from motionloom.nets.predictor import TransLinear
from motionloom.runtime.predictor import PredictorConfig
from motionloom.train.modules import predictor_session
from motionloom.weights.predictor import Predictor, condition_shape
from motionloom.weights.prior import Card

OBSERVED, FRAMES, FPS, KEPT = 15, 45, 30.0, 16


def small_predictor(*, lively: float = 0.03) -> Predictor:
    """``lively``: how far people leave their last pose, about in metres."""
    with torch.random.fork_rng():
        torch.manual_seed(4)
        config = PredictorConfig(
            66, KEPT, layers=2, width=16, heads=2, condition=condition_shape(SMPL_LAYOUT, KEPT), beside=True
        )
        net = TransLinear(config)
        with torch.no_grad():
            for value in net.parameters():
                value.add_(0.2 * torch.randn_like(value))
            for value in net.out.parameters():
                value.mul_(lively)
    spread = np.tile((FRAMES**0.5 / (1 + np.arange(KEPT)[:, None]) ** 2).astype(np.float32), 66)
    pose = np.stack([np.zeros(66, np.float32), np.ones(66, np.float32)])
    return Predictor(
        predictor_session(net.eval().requires_grad_(False)),
        sqrt(1000),
        SMPL_LAYOUT,
        Dct(FRAMES, KEPT),
        OBSERVED,
        FPS,
        "masked",
        np.zeros((KEPT, 66), np.float32),
        spread,
        pose,
        Card("small"),
    )
