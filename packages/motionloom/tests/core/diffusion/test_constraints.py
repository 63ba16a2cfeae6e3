"""Edits of the state: observing, handshakes, chains."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core.diffusion import (
    DDPM,
    SOLVERS,
    chain,
    cosine,
    handshake,
    inpaint,
    levels,
    masked_noise,
    observe,
    row_noise,
    run,
)
from tests.core.diffusion.exact import shared_draw, wavy

SCHEDULE = cosine(40)


def some(*shape, seed=0):
    return shared_draw(seed)(np.empty(shape, np.float32))


@pytest.mark.parametrize("level", [0, 1, 17, 40])
def test_observed_numbers_carry_the_levels_share_of_signal_and_noise(level):
    x, known, noise = some(2, 4, 3), some(2, 4, 3, seed=1), some(2, 4, 3, seed=2)
    mask = np.array([True, False, True])
    held = observe(known, mask, SCHEDULE, lambda like: noise)(x, level)
    signal, sigma = SCHEDULE.at(level)
    np.testing.assert_allclose(held[..., mask], signal * known[..., mask] + sigma * noise[..., mask], atol=1e-5)
    assert np.array_equal(held[..., ~mask], x[..., ~mask])


def test_observing_without_noise_is_ancestral_sampling_whose_noise_is_masked():
    known, mask = some(1, 4, 3), np.array([True, False, False])
    start, walk, denoise = some(1, 4, 3, seed=1), range(40, -1, -1), inpaint(wavy, known, mask)
    hold = observe(known, mask, SCHEDULE, np.zeros_like)
    held, filtered = (
        run(denoise, hold(start, 40), levels=walk, solver=DDPM, schedule=SCHEDULE, noise=draw, constrain=constrain)
        for draw, constrain in [(row_noise([1]), hold), (masked_noise(row_noise([1]), mask), None)]
    )
    np.testing.assert_allclose(held, filtered, atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("name", SOLVERS)
def test_a_run_that_observes_ends_on_the_known_data(name):
    known, mask, draw = some(2, 4, 3), np.array([[True], [False], [False], [True]]), row_noise([1, 2])
    end = run(
        wavy,
        some(2, 4, 3, seed=1),
        levels=levels(SCHEDULE, 8),
        solver=SOLVERS[name],
        schedule=SCHEDULE,
        noise=draw,
        constrain=observe(known, mask, SCHEDULE, draw),
    )
    assert np.array_equal(end[:, [0, 3]], known[:, [0, 3]])


def slowly_joined(x, lengths, overlap):
    """The rule, number by number."""
    x = x.copy()
    for i in range(1, len(lengths)):
        for j in range(overlap):
            a, end = j / overlap, lengths[i - 1] - overlap + j
            joined = (1 - a) * x[i - 1, end] + a * x[i, j]
            x[i - 1, end] = joined
            x[i, j] = joined
    return x


@given(data=st.data(), overlap=st.integers(1, 4), rows=st.integers(1, 4))
def test_a_handshake_joins_the_end_of_each_row_with_the_beginning_of_the_next(data, overlap, rows):
    lengths = data.draw(st.lists(st.integers(2 * overlap, 12), min_size=rows, max_size=rows))
    x = some(rows, 12, 2)
    before = x.copy()
    joined = handshake(lengths, overlap)(x, 3)
    np.testing.assert_allclose(joined, slowly_joined(x, lengths, overlap), atol=1e-5)
    for i in range(1, rows):
        assert np.array_equal(joined[i - 1, lengths[i - 1] - overlap : lengths[i - 1]], joined[i, :overlap])
    assert np.array_equal(x, before)


@pytest.mark.parametrize(
    ("lengths", "overlap", "words"),
    [([5, 5], 0, "positive"), ([5, 2], 3, "fit into rows"), ([5, 5, 5], 2, "2 rows"), ([5, 9], 2, "8 tokens")],
)
def test_handshakes_that_do_not_fit_are_refused(lengths, overlap, words):
    with pytest.raises(ValueError, match=words):
        handshake(lengths, overlap)(some(2, 8, 1), 3)


def test_a_chain_applies_its_constraints_in_order_and_an_empty_one_nothing():
    x = some(1, 2, 2)
    assert np.array_equal(chain(lambda x, level: x + level, lambda x, level: 2 * x)(x, 3), 2 * (x + 3))
    assert chain()(x, 3) is x
