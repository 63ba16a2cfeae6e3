"""Recorded and made-up duets, as far as they are measured."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motionloom.core.models.adapter import fingerprint
from motionloom.core.models.pair import PairBlock
from motionloom_train.data.pairs import Pair
from motionloom_train.export import pair_graph
from motionloom_train.modules import arrays
from motionloom_train.nets.pair import Talk, fitting
from tests.kinematics.people import standing, walking


def couple(seconds: float, apart: float = 1.0, speed: float = 1.0) -> np.ndarray:
    """(2, frames, 22, 3): two who walk side by side."""
    one = walking(speed, seconds) if speed else standing(seconds)
    return np.stack([one, one + np.array([apart, 0.0, 0.0])])


def pair_of(positions: np.ndarray, name: str = "p", split: str = "val", captions: Sequence[str] = ()) -> Pair:
    return Pair(name, split, tuple(captions), "own", "do what you like", positions)


def block_over(prior) -> PairBlock:
    talk = Talk(fitting(prior.net.config), prior.net.config)
    graph = pair_graph(talk.config, prior.net.config)
    return PairBlock("b", talk.config, arrays(talk), "tiny", fingerprint(prior.net), graph=graph)


@dataclass(frozen=True)
class Person:
    """As much of a motion as is measured."""

    places: np.ndarray

    def positions(self) -> np.ndarray:
        return self.places


def partners(apart: float, seconds: float = 12.0, wave: float = 0.2) -> np.ndarray:
    """(2, frames, 22, 3): two who face each other and come and go together."""
    a = standing(seconds)
    b = a * np.array([-1.0, 1.0, -1.0])
    way = wave * np.sin(np.arange(len(a)) / 7.0)[:, None, None] * np.array([1.0, 0.0, 0.0])
    return np.stack([a + way, b + way + np.array([0.0, 0.0, apart])])


RECORDED = [
    pair_of(partners(apart), f"r{n}", split, ["two people dance", "a couple dances"])
    for n, (apart, split) in enumerate([(0.9, "train"), (1.0, "train"), (1.1, "train"), (1.05, "val")])
]
