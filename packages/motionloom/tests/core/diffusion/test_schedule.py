"""Levels: how much signal and noise, and which of them a short walk visits."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core.diffusion import SPACINGS, cosine, from_betas, levels, linear
from tests.core.diffusion.exact import shared_draw


@pytest.mark.parametrize(
    ("steps", "first", "kept_first", "kept_last"),
    [(1000, 4.1284e-5, 0.9999587, 2.429e-9), (50, 1.7475e-3, 0.9982525, 9.712e-7)],
)
def test_cosine_has_the_anchors_of_the_published_code(steps, first, kept_first, kept_last):
    schedule = cosine(steps)
    assert schedule.betas[0].item() == pytest.approx(first, rel=1e-4)
    assert schedule.betas[-1].item() == pytest.approx(0.999, abs=1e-12)
    assert schedule.alpha_bar[1].item() == pytest.approx(kept_first, rel=1e-7)
    assert schedule.alpha_bar[-1].item() == pytest.approx(kept_last, rel=1e-3)


def test_cosine_signal_in_between_is_the_published_one():
    signal = cosine(1000).signal
    expected = {899: 0.1552, 799: 0.3067, 699: 0.4507, 499: 0.7027, 299: 0.8871}
    assert {t: round(signal[t + 1].item(), 4) for t in expected} == expected


@pytest.mark.parametrize("schedule", [cosine(50), linear(1000), from_betas("own", [0.1, 0.5])])
def test_level_0_is_clean_and_signal_and_noise_share_the_variance(schedule):
    assert schedule.at(0) == (1.0, 0.0)
    assert schedule.signal.dtype == np.float64
    np.testing.assert_allclose(schedule.signal**2 + schedule.noise**2, np.ones_like(schedule.signal), atol=1e-5)
    ratios = [schedule.log_snr(level) for level in range(schedule.steps + 1)]
    assert ratios[0] == math.inf
    assert all(a > b for a, b in pairwise(ratios))


def test_rows_are_noised_to_their_own_levels():
    schedule, draw = cosine(20), shared_draw(0)
    clean, noise = (draw(np.empty((3, 4, 2), np.float32)) for _ in range(2))
    together = schedule.noised(clean, np.array([0, 7, 20]), noise)
    for row, level in enumerate([0, 7, 20]):
        np.testing.assert_allclose(together[row], schedule.noised(clean[row], level, noise[row]), atol=1e-5)
    assert together.dtype == np.float32
    assert np.array_equal(together[0], clean[0])


@given(data=st.data(), top=st.integers(1, 300), spacing=st.sampled_from(SPACINGS))
def test_a_walk_goes_from_the_top_to_0_in_as_many_strictly_falling_moves_as_asked(data, top, spacing):
    steps = data.draw(st.integers(1, top))
    walk = levels(cosine(top), steps, spacing=spacing)
    assert (walk[0], walk[-1], len(walk)) == (top, 0, steps + 1)
    assert all(t > s for t, s in pairwise(walk))


def test_spacings_are_even_in_the_level_in_its_root_and_in_log_snr():
    assert levels(cosine(1000), 5) == [1000, 800, 600, 400, 200, 0]
    assert levels(cosine(1000), 5, spacing="early") == [1000, 960, 840, 640, 360, 0]
    assert levels(cosine(1000), 5, spacing="quadratic") == [1000, 640, 360, 160, 40, 0]
    schedule = linear(10_000)
    ratios = [schedule.log_snr(level) for level in levels(schedule, 9, spacing="snr")[:-1]]
    gaps = [b - a for a, b in pairwise(ratios)]
    assert gaps == pytest.approx([(ratios[-1] - ratios[0]) / 8] * 8, rel=0.1)


@pytest.mark.parametrize("spacing", SPACINGS)
def test_a_schedule_that_ends_without_signal_can_be_walked(spacing):
    walk = levels(from_betas("no signal left", [0.1, 0.3, 0.5, 1.0]), 2, spacing=spacing)
    assert (walk[0], walk[-1]) == (4, 0)


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (lambda: cosine(0), "at least one step"),
        (lambda: linear(-1), "at least one step"),
        (lambda: from_betas("bad", [0.1, float("nan")]), "bad"),
        (lambda: from_betas("empty", []), "empty"),
        (lambda: levels(cosine(10), 11), "1 to 10"),
        (lambda: levels(cosine(10), 0), "1 to 10"),
        (lambda: levels(cosine(10), 5, spacing="even"), "index, early, quadratic, snr"),
        (lambda: cosine(10).at(11), "no level 11"),
        (lambda: cosine(10).at(-1), "no level -1"),
        (
            lambda: cosine(10).noised(
                np.zeros((2, 1, 1), np.float32), np.array([3, -1]), np.zeros((2, 1, 1), np.float32)
            ),
            "no level -1",
        ),
    ],
)
def test_mistakes_are_named(mistake, words):
    with pytest.raises(ValueError, match=words):
        mistake()
