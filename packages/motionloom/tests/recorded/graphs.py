"""Graphs of tiny networks, recorded in `graphs.safetensors`, and weights for them.

The product's tests run where PyTorch is not installed, so graphs are exported beforehand, by
`python -m tests_train.record_graphs`. A graph holds no weights: any of its sizes go with it.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file

from motionloom.core.features.positions import SMPL_LAYOUT, Layout
from motionloom.core.models.networks.pair import PairConfig
from motionloom.core.models.networks.predictor import PredictorConfig
from motionloom.core.models.networks.sizes import NetConfig
from motionloom.core.models.predictor import condition_shape

FILE = Path(__file__).with_name("graphs.safetensors")
TEXT = {"width": 64, "hidden": 96, "layers": 2}
"""Sizes of the text encoder."""
MODULATED = NetConfig(
    variant="modulated", width=32, layers=2, heads=2, hidden=48, text=TEXT["width"], patch=4, dropout=0.0
)
PUBLISHED = NetConfig(width=32, layers=2, heads=4, hidden=48, text=TEXT["width"], dropout=0.0)
BABEL = replace(PUBLISHED, features=135, text=512)
"""BABEL's numbers, with the vectors of CLIP."""
PRIORS = {
    "modulated": MODULATED,
    "published": PUBLISHED,
    "other sizes": replace(MODULATED, hidden=40),
    "babel": BABEL,
    "transitions": replace(BABEL, flags=True),
    "flags": replace(PUBLISHED, flags=True),
}
BODY = Layout(("root", "left", "right", "head"), (-1, 0, 0, 0), (0, 2, 1, 3), ((1, 2),))
"""The root's way is a part of it, and it is turned to the facing."""
BARE = Layout(BODY.names, BODY.parents, BODY.pairs, root=False, z_up=True)
"""As published: no way, +Z up."""


def masked(layout: Layout, kept: int, width: int) -> PredictorConfig:
    """Sizes of a predictor that is told what is known."""
    return PredictorConfig(
        layout.channels, kept, layers=2, width=width, heads=2, condition=condition_shape(layout, kept), beside=True
    )


def bare(kept: int) -> PredictorConfig:
    """Sizes of a predictor of the published variant."""
    return PredictorConfig(BARE.channels, kept, layers=2, width=16, heads=2)


PREDICTORS = {
    "masked": masked(BODY, 8, 16),
    "masked, 20 tokens": masked(BODY, 20, 16),
    "published": bare(8),
    "published, 20 tokens": bare(20),
    "small": masked(SMPL_LAYOUT, 16, 16),
    "larger": masked(SMPL_LAYOUT, 24, 32),
}


def block_of(prior: NetConfig) -> PairConfig:
    """Sizes of a two-person block behind the last layer of a prior."""
    return PairConfig(1, prior.layers, prior.width, prior.heads, prior.hidden)


BLOCKS = {"modulated": (block_of(MODULATED), MODULATED)}


def graph(name: str, *configs: NetConfig | PairConfig | PredictorConfig) -> bytes:
    """The recorded graph of a network of these sizes."""
    return load_graphs()[label(name, *configs)]


def label(name: str, *configs: NetConfig | PairConfig | PredictorConfig) -> str:
    """A graph's name in the file; dropout is none of the graph's business."""
    sizes = [{key: value for key, value in asdict(config).items() if key != "dropout"} for config in configs]
    return " ".join([name, *(json.dumps(one) for one in sizes)])


@cache
def load_graphs() -> dict[str, bytes]:
    """Every recorded graph, by its label."""
    return {name: values.tobytes() for name, values in load_file(FILE).items()}


def random_weights(shapes: Mapping[str, tuple[int, ...]], seed: int) -> dict[str, np.ndarray]:
    """Weights none of which is zero, so that every part of a network matters."""
    rng, made = np.random.default_rng(seed), {}
    for name, shape in shapes.items():
        spread = 0.75 / shape[-1] ** 0.5 if len(shape) > 1 else 0.1
        made[name] = rng.standard_normal(shape, np.float32) * np.float32(spread)
        if "norm" in name and name.endswith("weight") and len(shape) == 1:
            made[name] += 1
    return made
