"""Two people for tests: a tiny prior whose block has much to say, and two different bodies that walk side by side."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.models.adapter import fingerprint
from motionloom.core.models.networks.shapes import pair_shapes
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.io import load
from motionloom.tasks.splice import move_rigidly
from tests.recorded.graphs import block_of, graph, random_weights

CLIP = Path(__file__).parents[4] / "examples" / "clips" / "walk.bvh"


def block(prior: Prior, *, fresh: bool = False) -> PairBlock:
    """A block for a prior; unless ``fresh`` it has much to say."""
    config = block_of(prior.net.config)
    weights = random_weights(pair_shapes(config, prior.net.config), 5)
    for name, value in weights.items():
        if fresh and name.split(".")[0] in ("out", "place"):
            value[:] = 0
    graphs = graph("pair", config, prior.net.config)
    return PairBlock("tiny", config, weights, prior.card.name, fingerprint(prior.net), graph=graphs)


def walkers(seconds: float, *, larger: float = 1.2, beside: float = 1.5, later: int = 5) -> tuple[Motion, Motion]:
    """Somebody who walks, and a larger one beside him, a bit later and turned by 0.3 radians."""
    clip = load(CLIP)
    count = round(seconds * clip.fps)
    second = clip.frames(later, later + count)
    bones = replace(second.skeleton, offsets=second.skeleton.offsets * larger)
    grown = Motion(bones, second.fps, second.root * larger, second.rotations)
    turn = rot.rotvec_to_quat(np.array([0.0, 0.3, 0.0]))
    level = np.array([1.0, 0.0, 1.0])
    return clip.frames(0, count), move_rigidly(
        grown, turn, grown.root[0] * level, clip.root[0] * level + [beside, 0, 0]
    )
