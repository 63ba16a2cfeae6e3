"""The clips that the commands run beside, a tiny network, and futures whose way is known."""

from pathlib import Path

import numpy as np

from motionloom.cli import main
from motionloom.core.diffusion import Dct, linear
from motionloom.core.features.positions import SMPL_LAYOUT
from motionloom.core.models.predictor import Predictor
from motionloom.core.models.prior import Card
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from tests.recorded.graphs import PREDICTORS
from tests.recorded.tiny_predictor import network

FREQUENCIES, OBSERVED, FRAMES, FPS = 24, 15, 75, 30.0


def tiny_predictor() -> Predictor:
    """Random weights that move a person a little: half a second seen, two seconds made."""
    zeros = np.zeros((FREQUENCIES, 66), np.float32)
    pose = np.stack([np.zeros(66, np.float32), np.ones(66, np.float32)])
    return Predictor(
        network(PREDICTORS["larger"], 3),
        linear(100),
        SMPL_LAYOUT,
        Dct(FRAMES, FREQUENCIES),
        OBSERVED,
        FPS,
        "masked",
        zeros,
        zeros + np.float32(0.01),
        pose,
        Card("tiny"),
    )


def larger() -> Skeleton:
    return Skeleton(SMPL22.names, SMPL22.parents, 1.1 * SMPL22.offsets)


CLIPS = {"past.bvh", "kick.bvh", "other.bvh"}


def file_names(place: str = ".") -> set[str]:
    return {path.name for path in Path(place).iterdir()} - CLIPS


def future(past: Motion, seconds: float, number: int) -> Motion:
    """The person goes on along +Z, at ``number`` + 1 metres a second, in the past's last pose."""
    count = round(seconds * past.fps)
    root = past.root[-1] + np.arange(1, count + 1)[:, None] / past.fps * [0, 0, number + 1]
    return Motion(past.skeleton, past.fps, root, np.repeat(past.rotations[-1:], count, axis=0))


def run(weights: str, *words: str) -> int:
    return main([*words, "--weights", weights])
