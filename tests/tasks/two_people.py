"""Two people for tests: a tiny prior whose block has much to say, and two different bodies that walk side by side."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from motionloom import rotations as rot
from motionloom.io import load
from motionloom.motion import Motion
from motionloom.nets.pair import Talk, fitting
from motionloom.tasks.splice import carried
from motionloom.train.export import pair_graph
from motionloom.train.modules import arrays
from motionloom.weights.adapter import fingerprint
from motionloom.weights.pair import PairBlock
from motionloom.weights.prior import Prior

CLIP = Path(__file__).parents[2] / "examples" / "clips" / "walk.bvh"


def block(prior: Prior, *, fresh: bool = False) -> PairBlock:
    """A block for a prior; unless ``fresh`` it has much to say."""
    with torch.random.fork_rng():
        torch.manual_seed(5)
        talk = Talk(fitting(prior.net.config), prior.net.config)
        with torch.no_grad():
            for value in () if fresh else talk.parameters():
                value.add_(torch.randn(value.shape) * 0.3)
    graph = pair_graph(talk.config, prior.net.config)
    return PairBlock("tiny", talk.config, arrays(talk), prior.card.name, fingerprint(prior.net), graph=graph)


def walkers(seconds: float, *, larger: float = 1.2, beside: float = 1.5, later: int = 5) -> tuple[Motion, Motion]:
    """Somebody who walks, and a larger one beside him, a bit later and turned by 0.3 radians."""
    clip = load(CLIP)
    count = round(seconds * clip.fps)
    second = clip.frames(later, later + count)
    bones = replace(second.skeleton, offsets=second.skeleton.offsets * larger)
    grown = Motion(bones, second.fps, second.root * larger, second.rotations)
    turn = rot.rotvec_to_quat(np.array([0.0, 0.3, 0.0]))
    level = np.array([1.0, 0.0, 1.0])
    return clip.frames(0, count), carried(grown, turn, grown.root[0] * level, clip.root[0] * level + [beside, 0, 0])
