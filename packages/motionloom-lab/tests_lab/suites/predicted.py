"""People who wave, as recordings, and tiny predictors of them that know nothing."""

import numpy as np
import torch

from motionloom.core.diffusion import SCHEDULES, Dct
from motionloom.core.features.positions import SMPL_LAYOUT, Layout
from motionloom.core.models.networks.predictor import PredictorConfig
from motionloom.core.models.predictor import Predictor, condition_shape
from motionloom.core.models.prior import Card
from motionloom.core.skeleton import SMPL22
from motionloom_train.data.prediction import Protocol, Recording
from motionloom_train.modules import predictor_session
from motionloom_train.nets.predictor import TransLinear

FPS, SEEN, AHEAD = 30.0, 10, 14
OFFSETS = np.array(
    [
        [0, 0.9, 0],
        [0.1, -0.1, 0],
        [-0.1, -0.1, 0],
        [0, 0.12, 0],
        [0, -0.4, 0],
        [0, -0.4, 0],
        [0, 0.13, 0],
        [0, -0.4, 0],
        [0, -0.4, 0],
        [0, 0.1, 0],
        [0, -0.05, 0.12],
        [0, -0.05, 0.12],
        [0, 0.2, 0],
        [0.07, 0.1, 0],
        [-0.07, 0.1, 0],
        [0, 0.1, 0.05],
        [0.12, 0, 0],
        [-0.12, 0, 0],
        [0.27, 0, 0],
        [-0.27, 0, 0],
        [0.25, 0, 0],
        [-0.25, 0, 0],
    ]
)


def waving(frames: int, speed: float = 1.0, phase: float = 0.0) -> np.ndarray:
    """(frames, 22, 3): somebody glides forward and swings every bone, whose length stays."""
    t = np.arange(frames) / FPS
    angle = 0.4 * np.sin(2 * np.pi * 0.7 * t * speed + phase)
    cos, sin = np.cos(angle), np.sin(angle)
    places = np.zeros((frames, 22, 3))
    for j, parent in enumerate(SMPL22.parents):
        x, y, z = OFFSETS[j]
        bone = np.stack([x * np.ones(frames), y * cos - z * sin, y * sin + z * cos], axis=-1)
        if parent < 0:
            places[:, j] = np.stack([0 * t, 0.9 + 0 * t, speed * t], axis=-1)
        else:
            places[:, j] = places[:, parent] + bone
    return places


def protocol(takes: int = 3, frames: int = 60, *, name: str = "own") -> Protocol:
    """A data set of people who wave at other speeds; all splits have some."""
    splits = ("train", "val", "test")
    recordings = tuple(
        Recording(
            f"{split}{k}",
            f"s{k}",
            "wave" if k % 2 else "swing",
            split,
            waving(frames, 0.6 + 0.4 * k + 0.1 * n, 0.9 * k).astype(np.float32),
        )
        for n, split in enumerate(splits)
        for k in range(takes)
    )
    return Protocol(name, FPS, SEEN, AHEAD, SMPL_LAYOUT, recordings, "made up")


def predictor(
    seed: int = 0,
    *,
    kept: int = 5,
    layout: Layout = SMPL_LAYOUT,
    seen: int = SEEN,
    ahead: int = AHEAD,
    fps: float = FPS,
) -> Predictor:
    """Random weights, of the variant ``told``."""
    config = PredictorConfig(layout.channels, kept, 2, 16, 2, 0.0, condition_shape(layout, kept), True)
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        net = TransLinear(config)
        for value in net.parameters():
            value.data.add_(0.05 * torch.randn_like(value))
    nothing = np.zeros((kept, layout.channels), dtype=np.float32)
    pose = np.stack([nothing[0], np.ones_like(nothing[0])])
    return Predictor(
        predictor_session(net.eval().requires_grad_(False)),
        SCHEDULES["cosine"](1000),
        layout,
        Dct(seen + ahead, kept),
        seen,
        fps,
        "masked",
        nothing,
        0.1 + np.ones_like(nothing),
        pose,
        Card("tiny", data="made up"),
    )
