"""A predictor of the 22 joints with random weights that moves people a little: half a second seen, a second made."""

import numpy as np

from motionloom.core.diffusion import Dct, sqrt
from motionloom.core.features.positions import SMPL_LAYOUT
from motionloom.core.models.predictor import Predictor
from motionloom.core.models.prior import Card
from tests.recorded.graphs import PREDICTORS
from tests.recorded.tiny_predictor import network

OBSERVED, FRAMES, FPS, FREQUENCIES = 15, 45, 30.0, 16


def small_predictor(*, lively: float = 0.03) -> Predictor:
    """``lively``: how far people leave their last pose, about in metres."""
    spread = np.tile((FRAMES**0.5 / (1 + np.arange(FREQUENCIES)[:, None]) ** 2).astype(np.float32), 66)
    pose = np.stack([np.zeros(66, np.float32), np.ones(66, np.float32)])
    return Predictor(
        network(PREDICTORS["small"], 4, lively=lively),
        sqrt(1000),
        SMPL_LAYOUT,
        Dct(FRAMES, FREQUENCIES),
        OBSERVED,
        FPS,
        "masked",
        np.zeros((FREQUENCIES, 66), np.float32),
        spread,
        pose,
        Card("small"),
    )
