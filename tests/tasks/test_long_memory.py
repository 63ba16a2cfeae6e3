"""An hour of long motion needs no more memory than its first minutes, whatever the network."""

import gc
import tracemalloc
from collections.abc import Iterator, Sequence

import numpy as np
import pytest
import torch

from motionloom.diffusion import cosine
from motionloom.goals.segment import Segment
from motionloom.motion import Motion
from motionloom.nets.prior import NetConfig, PriorNet
from motionloom.nets.text import TextEmbedding
from motionloom.skeleton import SMPL22
from motionloom.tasks import body
from motionloom.tasks.body import Places
from motionloom.tasks.long import compose
from motionloom.weights.prior import Card, Prior

SEGMENTS, SECONDS = 720, 5.0


class Words:
    """A text encoder that says the same about everything."""

    name, width = "same", 8

    def encode(self, texts: Sequence[str]) -> TextEmbedding:
        rows = len(texts)
        return TextEmbedding(torch.ones(rows, 3, 8), torch.ones(rows, 3, dtype=torch.bool), torch.ones(rows, 8))


@pytest.fixture
def prior(monkeypatch: pytest.MonkeyPatch) -> Iterator[Prior]:
    """A network whose guess is its input, and bodies that only stand where the pelvis is: nothing here costs time."""

    def stands(places: Places, fps: float, *, foot_lock: bool = True) -> Motion:
        turns = np.zeros((len(places), 22, 4))
        turns[..., 3] = 1.0
        return Motion(SMPL22, fps, places.positions[:, 0], turns)

    net = PriorNet(
        NetConfig(variant="modulated", features=263, width=16, layers=1, heads=2, hidden=16, text=8, patch=4)
    )
    monkeypatch.setattr(net, "forward", lambda x, level, bound: 0.5 * x)
    monkeypatch.setattr(body, "solve", stands)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield Prior(net.eval(), cosine(20), torch.zeros(263), torch.full((263,), 0.01), Words(), Card("tiny"))
    torch.set_num_threads(threads)


def tensors() -> tuple[int, int]:
    """How many tensors are alive, and their bytes."""
    alive = [thing for thing in gc.get_objects() if type(thing) is torch.Tensor]
    return len(alive), sum(thing.numel() * thing.element_size() for thing in alive)


@pytest.mark.slow
def test_an_hour_of_720_segments_runs_in_constant_memory(prior: Prior) -> None:
    """The most tensors, bytes of them and traced memory in each third of the hour are those in the first."""
    asked = 0

    def segments() -> Iterator[Segment]:
        nonlocal asked
        for number in range(SEGMENTS):
            asked = number + 1
            yield Segment(f"segment {number}", SECONDS)

    frames, third, seen = 0, SEGMENTS * SECONDS * 20 / 3, []
    gc.collect()
    before = tensors()
    tracemalloc.start()
    try:
        for number, piece in enumerate(compose(prior, segments(), steps=2)):
            frames += len(piece)
            if number % 4 == 0:  # rows come out in bunches: what is alive goes up and down with them
                now = tensors()
                ahead = asked - frames / (20 * SECONDS)  # segments are read as the walk gets there
                traced = tracemalloc.get_traced_memory()[0] / 2**20
                seen.append((frames // third, now[0] - before[0], (now[1] - before[1]) / 2**20, traced, ahead))
        peak = tracemalloc.get_traced_memory()[1] / 2**20
    finally:
        tracemalloc.stop()
    assert frames == SEGMENTS * SECONDS * 20
    most = [np.max([row[1:] for row in seen if row[0] == part], axis=0) for part in range(3)]
    for later in most[1:]:
        assert (later <= 1.05 * most[0] + [0, 0, 0.2, 0]).all(), most
    assert most[0][3] < 60
    assert peak < 100
