"""A prior as a function: the network's own drawing, or what is exported."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import torch

from motionloom.core.diffusion import cosine
from motionloom.core.features import humanml
from motionloom.core.models.networks.text.protocol import TextEmbedding
from motionloom.core.models.prior import Card, Prior
from motionloom.kinematics.physics import bone_length_error
from motionloom.tasks.text import generate, sample_features
from motionloom_lab.suites.commands import sampling_of
from motionloom_lab.suites.harness import generator
from motionloom_train.modules import prior_session
from motionloom_train.nets.prior import NetConfig, PriorNet
from tests.kinematics.people import walking


class Words:
    """A text encoder that says the same about everything."""

    name, width = "same", 8

    def encode(self, texts: Sequence[str]) -> TextEmbedding:
        rows = len(texts)
        return TextEmbedding(
            np.ones((rows, 3, 8), np.float32), np.ones((rows, 3), bool), np.ones((rows, 8), np.float32)
        )


@pytest.fixture
def prior() -> Prior:
    """An untrained network around the features of a walk: people that tremble."""
    torch.manual_seed(0)
    net = PriorNet(NetConfig(variant="modulated", width=16, layers=1, heads=2, hidden=16, text=8, patch=4))
    features = humanml.encode(walking(1.0), heading="corrected")
    return Prior(prior_session(net), cosine(50), features.mean(0), features.std(0) + 0.01, Words(), Card("tiny"))


def test_row_i_comes_from_seed_plus_i_and_has_the_length_asked_for(prior: Prior) -> None:
    make = generator(prior, steps=2)
    both, fps = make(["a", "a"], seconds=2.0, seed=3)
    (second,), _ = make(["a"], seconds=2.0, seed=4)
    assert fps == 20
    assert [p.shape for p in both] == [(40, 22, 3)] * 2
    assert np.allclose(both[1], second, atol=1e-4)
    assert not np.allclose(both[0], both[1], atol=1e-2)


def test_finished_motions_have_constant_bones_and_drawn_ones_need_not(prior: Prior) -> None:
    (drawn,), _ = generator(prior, steps=2)(["a"], seconds=2.0, seed=0)
    (finished,), _ = generator(prior, steps=2, finished=True)(["a"], seconds=2.0, seed=0)
    assert bone_length_error(finished) < 1e-9 < bone_length_error(drawn)


def test_what_is_finished_is_what_generate_makes(prior: Prior) -> None:
    """Actions one after the other, and lengths as they were asked for; the network's own is one motion of the words."""
    prompt = "a person walks forward, then sits down"
    finished, _ = generator(prior, steps=2, finished=True)(["a", prompt], seconds=4.0, seed=5)
    expected = generate(prior, ["a", prompt], seconds=4.0, seed=5, steps=2)
    for positions, motion in zip(finished, expected, strict=True):
        np.testing.assert_array_equal(positions, motion.positions())
    own, _ = generator(prior, steps=2)([prompt], seconds=4.0, seed=6)
    [features] = sample_features(prior, [prompt], [80], seeds=[6], steps=2)
    np.testing.assert_array_equal(own[0], humanml.decode_positions(features.astype(np.float64)))


@pytest.mark.parametrize(
    ("options", "finished"),
    [
        ({"prompts": "basic"}, True),
        ({"prompts": "basic", "sampled": True}, False),
        ({}, False),
        ({"finished": True}, True),
    ],
)
def test_obedience_judges_what_is_written_and_realism_what_is_sampled(options: dict[str, Any], finished: bool) -> None:
    assert sampling_of({"weights": "default", **options})["finished"] is finished
