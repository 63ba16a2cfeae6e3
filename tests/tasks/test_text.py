"""Text to motion with a random prior: whose noise is whose, and what cannot be asked."""

import numpy as np
import pytest
import torch

from motionloom.checkpoint import Prior
from motionloom.errors import MotionloomError
from motionloom.motion import Motion
from motionloom.tasks.text import generate, sample_features
from tests.nets import tiny

FEW = {"seconds": 1.0, "steps": 3}


@pytest.fixture(scope="module")
def prior() -> Prior:
    return tiny.prior()


def features(prior: Prior, prompts: list[str], frames: list[int], seeds: list[int], guidance: float = 2.5):
    return sample_features(prior, prompts, frames, seeds=seeds, steps=4, guidance=guidance)


def test_a_row_is_the_same_in_any_company(prior: Prior) -> None:
    """Ten rows of two lengths (two batches of equal length, one with a remainder) against each row alone."""
    prompts = [f"a person {verb}" for verb in ("walks", "turns", "walks left", "jumps", "turns right")] * 2
    frames = [9, 9, 9, 13, 9, 9, 9, 9, 9, 9]
    together = features(prior, prompts, frames, list(range(10)))
    for row in (1, 3, 8, 9):
        alone = features(prior, [prompts[row]], [frames[row]], [row])[0]
        assert alone.shape == (frames[row], 263)
        torch.testing.assert_close(together[row], alone, rtol=0, atol=1e-5)


def test_motion_i_is_drawn_from_seed_plus_i(prior: Prior) -> None:
    """Two of each prompt from seed 5: the fourth is what seed 8 alone makes of the second prompt."""
    made = generate(prior, ["a person walks", "a person turns"], count=2, seed=5, clean=False, **FEW)
    alone = generate(prior, "a person turns", seed=8, clean=False, **FEW)[0]
    assert len(made) == 4
    np.testing.assert_allclose(made[3].positions(), alone.positions(), atol=1e-4)
    assert np.abs(made[2].positions() - made[3].positions()).max() > 1e-3


def test_seeds_and_prompts_matter_and_repetition_is_exact(prior: Prior) -> None:
    one = features(prior, ["a person walks"], [8], [1])[0]
    assert torch.equal(one, features(prior, ["a person walks"], [8], [1])[0])
    assert not torch.allclose(one, features(prior, ["a person walks"], [8], [2])[0])
    assert not torch.allclose(one, features(prior, ["a person turns left"], [8], [1])[0])


def test_no_guidance_ignores_the_prompt(prior: Prior) -> None:
    a, b = (features(prior, [text], [8], [1], guidance=0.0)[0] for text in ("a person walks", "a jump"))
    torch.testing.assert_close(a, b, rtol=0, atol=1e-5)


def test_lengths_and_rate_are_what_was_asked(prior: Prior) -> None:
    made = generate(prior, ["a person walks", "a person turns"], seconds=[0.5, 1.25], steps=2)
    assert [len(m) for m in made] == [10, 25]
    assert all(m.fps == 20 and isinstance(m, Motion) and len(m.skeleton) == 22 for m in made)
    assert len(generate(prior, "a person walks", seconds=np.float64(0.6), steps=1)[0]) == 12


def test_progress_counts_every_call(prior: Prior) -> None:
    said: list[tuple[int, int]] = []
    generate(prior, "a person walks", count=9, progress=lambda *pair: said.append(pair), seconds=0.3, steps=3)
    assert said == [(i, 6) for i in range(1, 7)]


@pytest.mark.parametrize(
    "asked",
    [
        {"prompts": ""},
        {"prompts": ["a person walks", " \t"]},
        {"prompts": []},
        {"count": 0},
        {"count": -1},
        {"seconds": 0},
        {"seconds": -2.0},
        {"seconds": float("nan")},
        {"seconds": float("inf")},
        {"seconds": 1e9},
        {"seconds": [1.0, 2.0]},
        {"seconds": []},
        {"solver": "euler"},
        {"steps": 0},
        {"steps": -3},
        {"steps": 51},
        {"steps": 2.5},
        {"guidance": float("nan")},
        {"guidance": 1e9},
        {"seed": -1},
        {"seed": 2**70},
    ],
    ids=str,
)
def test_what_cannot_be_asked_is_refused(prior: Prior, asked: dict) -> None:
    with pytest.raises(MotionloomError) as caught:
        generate(prior, **{"prompts": "a person walks", **asked})
    assert "\n" not in str(caught.value)


def test_other_features_are_not_decoded_yet() -> None:
    config = tiny.NetConfig(features=135, width=32, layers=1, heads=4, hidden=16, text=tiny.PUBLISHED.text)
    with pytest.raises(MotionloomError, match="135"):
        generate(tiny.prior(config), "walk")
