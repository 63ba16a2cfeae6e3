"""An hour of long motion needs no more memory than its first minutes, whatever the network."""

import tracemalloc
from collections.abc import Iterator, Sequence

import numpy as np
import pytest

from motionloom.core.diffusion import cosine
from motionloom.core.models.networks.prior_condition import Bound, Condition
from motionloom.core.models.networks.sizes import NetConfig
from motionloom.core.models.networks.text.protocol import TextEmbedding
from motionloom.core.models.prior import Card, Prior
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.goals.segment import Segment
from motionloom.tasks import body
from motionloom.tasks.body import Places
from motionloom.tasks.long import compose_stream

SEGMENTS, SECONDS = 720, 5.0


class Words:
    """A text encoder that says the same about everything."""

    name, width = "same", 8

    def encode(self, texts: Sequence[str]) -> TextEmbedding:
        rows = len(texts)
        return TextEmbedding(
            np.ones((rows, 3, 8), np.float32), np.ones((rows, 3), dtype=np.bool_), np.ones((rows, 8), np.float32)
        )


class Halves:
    """A network whose estimate is half of its input."""

    config = NetConfig(variant="modulated", features=263, width=16, layers=1, heads=2, hidden=16, text=8, patch=4)
    modulated = True

    def bind(self, cond: Condition) -> Bound:
        rows, words = cond.words.shape
        keys = np.zeros((rows, 1, 2, words, 8), np.float32)
        nothing = np.zeros((rows, 0, 0), np.float32)
        return Bound(cond.pooled, keys, keys, cond.words[:, None, None], cond.lengths, cond.flags, nothing)

    def __call__(self, x: np.ndarray, level: np.ndarray, bound: Bound) -> np.ndarray:
        return np.float32(0.5) * x


@pytest.fixture
def prior(monkeypatch: pytest.MonkeyPatch) -> Prior:
    """A network whose guess is its input, and bodies that only stand where the pelvis is: nothing here costs time."""

    def standing(places: Places, fps: float, *, foot_lock: bool = True) -> Motion:
        turns = np.zeros((len(places), 22, 4))
        turns[..., 3] = 1.0
        return Motion(SMPL22, fps, places.positions[:, 0], turns)

    monkeypatch.setattr(body, "solve", standing)
    mean, std = np.zeros(263, np.float32), np.full(263, 0.01, np.float32)
    return Prior(Halves(), cosine(20), mean, std, Words(), Card("tiny"))  # type: ignore[arg-type]


@pytest.mark.slow
def test_an_hour_of_720_segments_runs_in_constant_memory(prior: Prior) -> None:
    """The most traced memory, arrays and all, in each third of the hour is that in the first."""
    count = 0

    def segments() -> Iterator[Segment]:
        nonlocal count
        for number in range(SEGMENTS):
            count = number + 1
            yield Segment(f"segment {number}", SECONDS)

    frames, third, sizes = 0, SEGMENTS * SECONDS * 20 / 3, []
    tracemalloc.start()
    try:
        for number, piece in enumerate(compose_stream(prior, segments(), steps=2)):
            frames += len(piece)
            if number % 4 == 0:  # rows come out in bunches: what is alive goes up and down with them
                ahead = count - frames / (20 * SECONDS)  # segments are read as the walk gets there
                traced = tracemalloc.get_traced_memory()[0] / 2**20
                sizes.append((frames // third, traced, ahead))
        peak = tracemalloc.get_traced_memory()[1] / 2**20
    finally:
        tracemalloc.stop()
    assert frames == SEGMENTS * SECONDS * 20
    most = [np.max([row[1:] for row in sizes if row[0] == part], axis=0) for part in range(3)]
    for later in most[1:]:
        assert (later <= 1.05 * most[0] + [0.2, 0]).all(), most
    assert most[0][1] < 60
    assert peak < 100
