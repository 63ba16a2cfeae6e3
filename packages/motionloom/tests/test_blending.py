"""Fades begin and end as they say, and take up what they are to take up."""

import numpy as np
import pytest

from motionloom.core import blending


@pytest.mark.parametrize(("fade", "flat"), [(blending.smoothstep, 1), (blending.smootherstep, 2)])
def test_steps_are_flat_at_both_ends(fade, flat: int) -> None:
    assert fade(np.array([-1, 0, 0.5, 1, 2])) == pytest.approx([0, 0, 0.5, 1, 1])
    small = 1e-3
    for value in (fade(np.array([small]))[0], 1 - fade(np.array([1 - small]))[0]):
        assert 0 < value < 12 * small ** (flat + 1)


@pytest.mark.parametrize("decay", [blending.cubic_decay, blending.quintic_decay])
def test_decays_begin_with_the_difference_and_its_slope_and_end_with_neither(decay) -> None:
    step = 1e-5
    (v0, c0), (v1, c1) = decay(0.0), decay(step)
    assert (v0, c0) == (1, 0)
    assert ((v1 - v0) / step, (c1 - c0) / step) == pytest.approx((0, 1), abs=1e-3)
    assert decay(1.0) == (0, 0)
    assert decay(1 - step) == pytest.approx((0, 0), abs=1e-8)


def test_hermite_weights_give_back_a_cubic() -> None:
    u = np.linspace(0, 1, 7)
    first, slope, last, end = blending.hermite(u)
    assert first * 2 + slope * -1 + last * 3 + end * 4 == pytest.approx(2 - u + u**3 * 1 + u**2 * 1)


def test_crossfades_are_strictly_between() -> None:
    mixed = blending.crossfade(np.zeros(3), np.ones(3), blending.shares(3))
    assert mixed == pytest.approx([0.25, 0.5, 0.75])
