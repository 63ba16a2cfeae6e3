"""One value for all settings."""

import numpy as np
import pytest

from motionloom.core.diffusion import Denoiser, State
from motionloom.core.errors import MotionloomError
from motionloom.core.methods.edit import Observed
from motionloom.requests.sampling import PairSampling, PredictionSampling, Sampling
from motionloom.tasks.sampling import Batch, Rows, sample
from tests.recorded import tiny


@pytest.mark.parametrize(
    ("kind", "settings", "sentence"),
    [
        (Sampling, {"steps": 0}, "steps must be a whole number from 1 to 100,000; got 0"),
        (Sampling, {"steps": 2.5}, "steps must be a whole number .*; got 2.5"),
        (Sampling, {"solver": "euler"}, "solver is 'euler'; there are ddpm"),
        (Sampling, {"spacing": "wide"}, "spacing is 'wide' .*; there are index"),
        (Sampling, {"guidance": float("nan")}, "guidance must be -100 to 100, usually 1 to 7; got nan"),
        (Sampling, {"guidance": 101.0}, "guidance must .* got 101"),
        (Sampling, {"seed": -1}, "seed"),
        (Sampling, {"seed": (0, 2**62)}, "seed"),
        (Sampling, {"count": 0}, "count must .* got 0"),
        (Sampling, {"batch_size": 0}, "batch_size must .* got 0"),
        (PredictionSampling, {"temperature": 2.5}, "temperature"),
        (PairSampling, {"pair_guidance": 1.5}, "pair_guidance must be 0 to 1; got 1.5"),
    ],
)
def test_a_value_checks_itself(kind: type[Sampling], settings: dict, sentence: str) -> None:
    with pytest.raises(MotionloomError, match=sentence):
        kind(**settings)
    with pytest.raises(MotionloomError, match=sentence):
        kind.of(None, settings)


def test_single_settings_change_a_value() -> None:
    chosen = Sampling.of(Sampling(steps=7, seed=3), {"seed": np.int64(5)})
    assert (chosen.steps, chosen.seed, chosen.guidance) == (7, 5, Sampling().guidance)


@pytest.mark.parametrize(
    ("name", "hint"), [("step", "'steps'"), ("guidence", "'guidance'"), ("xyz", "the settings are")]
)
def test_a_setting_that_there_is_not_is_said(name: str, hint: str) -> None:
    with pytest.raises(TypeError, match=f"no setting '{name}'.*{hint}"):
        Sampling.of(None, {name: 1})


def test_what_another_kind_of_weights_takes_is_refused() -> None:
    """A predictor's temperature says nothing to a prior, and 24 steps are not what a predictor takes."""
    with pytest.raises(MotionloomError, match="PredictionSampling; got a Sampling"):
        PredictionSampling.of(Sampling(), {})  # type: ignore[arg-type]
    with pytest.raises(MotionloomError, match="Sampling; got a PredictionSampling"):
        Sampling.of(PredictionSampling(), {})


def test_seeds_of_motions_follow_each_other() -> None:
    assert Sampling(seed=5).seeds(3) == [5, 6, 7]
    with pytest.raises(MotionloomError, match="one person has one seed"):
        Sampling(seed=(1, 2)).seeds(1)


@pytest.mark.parametrize("slots", [0, 1])
def test_settled_states_are_smoothed_hold_what_is_observed_and_are_edited_once_more(slots: int) -> None:
    prior, levels = tiny.prior(), []

    def edit(denoise: Denoiser, batch: Batch) -> Denoiser:
        def edited(state: State, level: int) -> State:
            levels.append(level)
            return denoise(state, level) + (0 if level else 1)

        return edited

    mask = np.zeros((1, 12, len(prior.mean)), np.bool_)
    mask[:, :3] = True
    observed = Observed(np.full(mask.shape, 0.5, np.float32), mask)
    rows, how = Rows(["a person walks"], [12], [3], slots=slots), Sampling(steps=3)
    [(_, plain)] = sample(prior, rows, how, observed=observed)
    [(_, settled)] = sample(prior, rows, how, observed=observed, edits=[edit], corrected=True)
    smoothed = np.concatenate([plain[:slots], prior.smoothed(plain[slots:])])
    np.testing.assert_allclose(settled, np.where(mask[0], 0.5, smoothed) + 1, atol=1e-5)
    assert np.abs(smoothed - plain).max() > 1e-3
    assert (levels[-1], all(levels[:-1]), len(levels)) == (0, True, 4)
