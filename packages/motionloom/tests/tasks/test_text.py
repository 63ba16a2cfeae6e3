"""Text to motion with a random prior: whose noise is whose, and what cannot be asked."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.features.babel import decode, facing
from motionloom.core.models.networks.text.protocol import TextEmbedding
from motionloom.core.models.networks.text.published import PublishedText
from motionloom.core.models.prior import Prior, load_prior, save_prior
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.tasks.supported import add_support
from motionloom.tasks.text import finish, generate, sample_features, to_motion
from tests.noise import normal
from tests.recorded import tiny
from tests.recorded.graphs import BABEL

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
        np.testing.assert_allclose(together[row], alone, rtol=0, atol=1e-5)


def test_motion_i_is_drawn_from_seed_plus_i(prior: Prior) -> None:
    """Two of each prompt from seed 5: the fourth is what seed 8 alone makes of the second prompt."""
    motions = generate(prior, ["a person walks", "a person turns"], count=2, seed=5, foot_lock=False, **FEW)
    alone = generate(prior, "a person turns", seed=8, foot_lock=False, **FEW)[0]
    assert len(motions) == 4
    np.testing.assert_allclose(motions[3].positions(), alone.positions(), atol=1e-4)
    assert np.abs(motions[2].positions() - motions[3].positions()).max() > 1e-3


def test_seeds_and_prompts_matter_and_repetition_is_exact(prior: Prior) -> None:
    one = features(prior, ["a person walks"], [8], [1])[0]
    assert np.array_equal(one, features(prior, ["a person walks"], [8], [1])[0])
    assert not np.allclose(one, features(prior, ["a person walks"], [8], [2])[0])
    assert not np.allclose(one, features(prior, ["a person turns left"], [8], [1])[0])


def test_no_guidance_ignores_the_prompt(prior: Prior) -> None:
    a, b = (features(prior, [text], [8], [1], guidance=0.0)[0] for text in ("a person walks", "a jump"))
    np.testing.assert_allclose(a, b, rtol=0, atol=1e-5)


def test_lengths_and_rate_are_what_was_asked(prior: Prior) -> None:
    motions = generate(prior, ["a person walks", "a person turns"], seconds=[0.5, 1.25], steps=2)
    assert [len(m) for m in motions] == [10, 25]
    assert all(m.fps == 20 and isinstance(m, Motion) and len(m.skeleton) == 22 for m in motions)
    assert len(generate(prior, "a person walks", seconds=np.float64(0.6), steps=1)[0]) == 12


def test_progress_counts_every_call(prior: Prior) -> None:
    reports: list[tuple[int, int]] = []
    generate(prior, "a person walks", count=9, progress=lambda *pair: reports.append(pair), seconds=0.3, steps=3)
    assert reports == [(i, 6) for i in range(1, 7)]


@pytest.mark.parametrize(
    "options",
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
def test_what_cannot_be_asked_is_refused(prior: Prior, options: dict) -> None:
    with pytest.raises(MotionloomError) as caught:
        generate(prior, **{"prompts": "a person walks", **options})
    assert "\n" not in str(caught.value)


def babel_prior(folder: Path, *, flags: bool) -> Prior:
    """A prior of the published BABEL form, saved and read back, with a text encoder that is there."""
    mean, text = np.zeros(135, np.float32), PublishedText("clip-77")
    prior = replace(tiny.prior(replace(BABEL, flags=flags)), mean=mean, std=mean + 1, text=text, fps=30.0)
    again = load_prior(save_prior(prior, folder / "babel.safetensors", half=False))
    assert again.text.name == "clip-77"
    return replace(again, text=Words())


class Words:
    """512 numbers for a text, the same for the same: as CLIP's tower gives them."""

    name, width = "words", 512

    def encode(self, texts: Sequence[str] | str) -> TextEmbedding:
        words = [texts] if isinstance(texts, str) else list(texts)
        pooled = np.stack([normal((512,), len(t)) for t in words])
        return TextEmbedding(pooled[:, None], np.ones((len(words), 1), dtype=np.bool_), pooled)


@pytest.mark.parametrize("flags", [False, True], ids=["plain", "transitions"])
def test_babel_weights_make_motions(tmp_path: Path, flags: bool) -> None:
    """Saved and read: 30 fps, the asked lengths, from over the origin, facing +Z, as the seed says."""
    prior = babel_prior(tmp_path, flags=flags)
    assert prior.net.config.flags is flags
    motions = generate(prior, ["walk", "turn left"], seconds=[0.5, 1.0], steps=3)
    assert [(len(m), m.fps, len(m.skeleton)) for m in motions] == [(15, 30, 22), (30, 30, 22)]
    raw = generate(prior, "turn left", seconds=1.0, steps=3, seed=1, foot_lock=False)[0]
    np.testing.assert_allclose(raw.root[0, [0, 2]], 0, atol=1e-9)
    np.testing.assert_allclose(facing(raw), [0, 0, 1], atol=1e-6)
    arms = [16, 17, 18, 19]
    np.testing.assert_allclose(motions[1].rotations[:, arms], raw.rotations[:, arms], atol=1e-5)


def test_babel_features_are_finished_as_its_codec_decodes_them(tmp_path: Path) -> None:
    """What is drawn is not smoothed (one frame per token), and becomes the codec's poses turned to +Z."""
    prior = babel_prior(tmp_path, flags=False)
    features = sample_features(prior, ["walk"], [20], seeds=[3], steps=2)[0]
    assert features.shape == (20, 135)
    whole = finish(prior, features, foot_lock=False)
    limbs = decode(features.astype(np.float64)).positions()
    bent = np.linalg.norm(limbs - limbs[:, :1], axis=-1)
    places = whole.positions()
    np.testing.assert_allclose(np.linalg.norm(places - places[:, :1], axis=-1), bent, atol=1e-6)
    np.testing.assert_allclose(whole.root[:, 1], features[:, 0], atol=1e-6)


def test_cleaning_holds_a_babel_foot_that_slides() -> None:
    """30 fps and no contact flags: somebody who stands and drifts 6 cm in a second ends with feet that do not."""
    numbers = np.zeros((45, 135))
    numbers[:, 3:9], numbers[:, 9:] = [1, 0, 0, 0, 0, -1], np.tile([1, 0, 0, 0, 1, 0], 21)
    numbers[:, 0], numbers[:, 1] = SMPL22.offsets[0, 1] - 0.02, 0.002  # a leg at full reach could not give way
    prior = replace(tiny.prior(BABEL), fps=30.0)
    raw, clean = (finish(prior, numbers, foot_lock=c).positions()[10:35, [7, 8, 10, 11]] for c in (False, True))
    assert np.linalg.norm(raw[-1] - raw[0], axis=-1).min() > 0.045
    assert np.linalg.norm(clean[-1] - clean[0], axis=-1).max() < 0.005


def test_a_walk_of_263_numbers_is_put_on_the_floor() -> None:
    """The choice by width leaves HumanML3D as `to_motion` makes it, but for what hangs in the air or is sunk."""
    prior = tiny.prior()
    features = sample_features(prior, ["a person walks"], [12], seeds=[0], steps=2)[0]
    expected = to_motion(features.astype(np.float64), 20.0)
    np.testing.assert_array_equal(finish(prior, features).positions(), add_support(expected).positions())
    raw = to_motion(features.astype(np.float64), 20.0, foot_lock=False)
    np.testing.assert_array_equal(finish(prior, features, foot_lock=False).positions(), raw.positions())


def test_other_features_are_refused_before_anything_is_drawn() -> None:
    """KIT's 251 numbers (21 joints, millimetres) are read as weights and not decoded."""
    kit = replace(tiny.prior(), mean=np.zeros(251, np.float32), std=np.ones(251, np.float32))
    with pytest.raises(MotionloomError, match="251"):
        generate(kit, "walk", progress=lambda *_: pytest.fail("drawn"))
