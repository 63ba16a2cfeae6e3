"""A predictor of the 22 joints with random weights that moves people a little: half a second seen, a second made."""

import torch

from motionloom.diffusion import Dct, sqrt
from motionloom.features.positions import SMPL_LAYOUT
from motionloom.nets.predictor import NetConfig, TransLinear
from motionloom.weights.predictor import Predictor, condition_shape
from motionloom.weights.prior import Card

OBSERVED, FRAMES, FPS, KEPT = 15, 45, 30.0, 16


def small_predictor(*, lively: float = 0.03) -> Predictor:
    """``lively``: how far people leave their last pose, about in metres."""
    with torch.random.fork_rng():
        torch.manual_seed(4)
        config = NetConfig(
            66, KEPT, layers=2, width=16, heads=2, condition=condition_shape(SMPL_LAYOUT, KEPT), beside=True
        )
        net = TransLinear(config)
        with torch.no_grad():
            for value in net.parameters():
                value.add_(0.2 * torch.randn_like(value))
            for value in net.out.parameters():
                value.mul_(lively)
    spread = FRAMES**0.5 / (1 + torch.arange(KEPT)[:, None]) ** 2 * torch.ones(66)
    pose = torch.stack([torch.zeros(66), torch.ones(66)])
    return Predictor(
        net.eval().requires_grad_(False), sqrt(1000), SMPL_LAYOUT, Dct(FRAMES, KEPT), OBSERVED, FPS, "masked",
        torch.zeros(KEPT, 66), spread, pose, Card("small"),
    )  # fmt: skip
