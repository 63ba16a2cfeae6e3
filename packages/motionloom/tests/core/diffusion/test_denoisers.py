"""Edits of the guess: guidance, inpainting, noise prediction, blending."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core.diffusion import SOLVERS, blend, cosine, from_noise, guide, inpaint, levels, rising, row_noise, run
from tests.core.diffusion.exact import TILTED, shared_draw, wavy

SCHEDULE = cosine(40)
SHAPE = (3, 4, 2)


def net(x, level, cond):
    """A network that treats rows alone; a condition is one number per row."""
    return np.tanh(x * cond[:, None, None]) + 0.01 * level * cond[:, None, None]


def some(seed=0):
    return shared_draw(seed)(np.empty(SHAPE, np.float32))


COND, NULL = np.array([0.3, -1.0, 2.0]), np.array([0.0, 0.5, 0.1])


@given(scales=st.lists(st.floats(-5, 10, width=32), min_size=3, max_size=3))
def test_guidance_is_u_plus_s_times_c_minus_u_for_each_row(scales):
    guided, x = guide(net, COND, NULL, np.array(scales)), some()
    answer = guided(x, 7)
    for row, s in enumerate(scales):
        c, u = (net(x[row : row + 1], 7, k[row : row + 1])[0] for k in (COND, NULL))
        np.testing.assert_allclose(answer[row], u + s * (c - u), atol=1e-5, rtol=1e-5)


def test_guidance_is_one_call_on_a_doubled_batch_and_one_plain_call_at_0_and_1():
    calls = []

    def counted(x, level, cond):
        calls.append(len(x))
        return net(x, level, cond)

    x = some()
    for scale, expected in [
        (2.5, [6]),
        (0.0, [3]),
        (1.0, [3]),
        (np.ones((3,), np.float32), [3]),
        (np.array([1.0, 0.0, 1.0]), [6]),
    ]:
        calls.clear()
        guide(counted, COND, NULL, scale)(x, 3)
        assert calls == expected, scale
    assert np.array_equal(guide(net, COND, NULL, 1.0)(x, 3), net(x, 3, COND))
    assert np.array_equal(guide(net, COND, NULL, 0.0)(x, 3), net(x, 3, NULL))


def test_a_scale_may_depend_on_the_level():
    x = some()
    guided = guide(net, COND, NULL, lambda level: [0.0, 1.0, 2.5, 4.0][level])
    for level, scale in enumerate([0.0, 1.0, 2.5, 4.0]):
        assert np.array_equal(guided(x, level), guide(net, COND, NULL, scale)(x, level))


@pytest.mark.parametrize(
    ("scale", "expected"),
    [(2.5, [5.5, 5.5, 4.0, 2.5, 2.5]), (1.0, [1.0] * 5), (0.0, [0.0] * 5), (-2.0, [-2.0] * 5)],
)
def test_guidance_rises_below_three_tenths_of_the_levels(scale, expected):
    at = rising(scale, 1000, 3.0)
    np.testing.assert_allclose([at(level) for level in (0, 100, 200, 300, 999)], expected)


def test_a_row_gets_its_own_answer_whatever_the_scales_of_the_others():
    x, scales = some(), np.array([1.0, 0.0, 4.0])
    mixed = guide(net, COND, NULL, scales)(x, 3)
    for row in range(3):
        one = slice(row, row + 1)
        assert np.array_equal(guide(net, COND[one], NULL[one], scales[one])(x[one], 3), mixed[one])


@pytest.mark.parametrize("scale", [0.0, 1.0])
def test_scales_0_and_1_are_exact_beside_other_rows_even_where_the_two_passes_differ_a_lot(scale):
    far, x = 1e5 * NULL, some()
    mixed = guide(lambda x, level, cond: x * cond[:, None, None], COND, far, np.array([scale, scale, 3.0]))(x, 3)
    plain = x * (COND if scale else far)[:, None, None]
    assert np.array_equal(mixed[:2], plain[:2])


class Words(NamedTuple):
    pooled: np.ndarray
    mask: np.ndarray


def test_conditions_of_several_parts_are_joined_row_by_row():
    def reads(x, level, cond):
        (words, lengths), nothing = cond
        assert isinstance(words, Words)
        assert nothing is None
        return x * words.pooled[:, None, None] + lengths[:, None, None] * words.mask[:, None, None]

    true, false = np.ones((3,), dtype=np.bool_), np.zeros((3,), dtype=np.bool_)
    lengths = np.array([4, 3, 2])
    answer = guide(
        reads, ((Words(COND, true), lengths), None), ((Words(NULL, false), lengths), None), np.full((3,), 2.0)
    )(some(), 1)
    c = some() * COND[:, None, None] + lengths[:, None, None]
    np.testing.assert_allclose(answer, 2 * c - some() * NULL[:, None, None], atol=1e-5)


def test_conditions_that_cannot_be_joined_and_wrong_scales_are_refused():
    with pytest.raises(TypeError, match="join"):
        guide(net, "run", "", 2.0)
    assert guide(lambda x, level, cond: x * len(cond), "run", "", 2.0, join=str.__add__)(some(), 1) is not None
    with pytest.raises(ValueError, match="2 guidance scales for 3 rows"):
        guide(net, COND, NULL, np.array([1.0, 2.0]))(some(), 1)
    with pytest.raises(ValueError, match="finite"):
        guide(net, COND, NULL, float("nan"))


masks = st.lists(st.booleans(), min_size=24, max_size=24).map(lambda bits: np.array(bits).reshape(SHAPE))


@settings(deadline=None, max_examples=25)
@given(mask=masks, name=st.sampled_from(sorted(SOLVERS)), soft=st.booleans())
def test_a_run_ends_exactly_on_what_is_inpainted(mask, name, soft):
    known, draw = some(9), row_noise([1, 2, 3])
    denoise = inpaint(wavy, known, mask.astype(np.float32) if soft else mask)
    end = run(denoise, some(), levels=levels(SCHEDULE, 6), solver=SOLVERS[name], schedule=SCHEDULE, noise=draw)
    assert np.array_equal(end[mask], known[mask])


@pytest.mark.parametrize("mask", [np.zeros((2,), np.float32), np.zeros((4, 1), dtype=np.bool_)])
def test_an_empty_mask_changes_nothing(mask):
    assert np.array_equal(inpaint(wavy, some(9), mask)(some(), 5), wavy(some(), 5))


@given(weight=st.floats(0, 1, width=32))
def test_a_soft_mask_mixes_linearly(weight):
    mixed = inpaint(wavy, some(9), np.array(weight))(some(), 5)
    np.testing.assert_allclose(mixed, (1 - weight) * wavy(some(), 5) + weight * some(9), atol=1e-5)


def test_inpainting_does_not_let_nan_of_the_hidden_side_through():
    known, mask = some(9), np.array([True, False])
    known[..., 1] = np.nan
    assert np.isfinite(inpaint(wavy, known, mask)(some(), 5)).all()


@pytest.mark.parametrize("level", [1, 20, 40])
def test_a_noise_predictor_becomes_the_denoiser_it_stands_for(level):
    denoise, x = TILTED.denoiser(SCHEDULE), some().astype(np.float64)

    def predicts_noise(x, level):
        signal, noise = SCHEDULE.at(level)
        return (x - signal * denoise(x, level)) / noise

    np.testing.assert_allclose(from_noise(predicts_noise, SCHEDULE)(x, level), denoise(x, level), atol=1e-9, rtol=1e-9)


def test_blending_with_s_and_1_minus_s_is_guidance():
    c, u = (guide(net, k, k, 1.0) for k in (COND, NULL))
    np.testing.assert_allclose(blend([c, u], [2.5, -1.5])(some(), 6), guide(net, COND, NULL, 2.5)(some(), 6), atol=1e-5)


def test_blending_weights_may_depend_on_level_and_feature():
    ones, twos = (lambda x, level, n=n: np.full_like(x, n) for n in (1.0, 2.0))
    feature = np.array([1.0, 0.0])
    blended = blend([ones, twos], [lambda level: level * feature, 1 - feature])
    assert np.array_equal(blended(some(), 5), np.broadcast_to([5.0, 2.0], SHAPE))


@pytest.mark.parametrize(("denoisers", "weights"), [([], []), ([wavy], [0.5, 0.5])])
def test_blending_without_a_weight_for_each_is_refused(denoisers, weights):
    with pytest.raises(ValueError, match="one weight per denoiser"):
        blend(denoisers, weights)
