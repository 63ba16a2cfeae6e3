"""The loop: what it visits, what it yields, and that noise belongs to rows."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core.diffusion import (
    SOLVERS,
    cosine,
    levels,
    masked_noise,
    restart,
    row_noise,
    run,
    sample,
)
from tests.core.diffusion.exact import shared_draw, wavy

SCHEDULE = cosine(40)
KNOWN = [[0.27437130, 0.09358235, -0.10971181, -0.21990466], [-1.2224977, -2.1383154, -0.06472305, -0.70555127]]


def made(seeds, *, name="ddpm", tokens=6, lengths=None):
    draw = row_noise(seeds, lengths)
    x = draw(np.empty((len(seeds), tokens, 3), np.float32))
    return run(wavy, x, levels=levels(SCHEDULE, 10), solver=SOLVERS[name], schedule=SCHEDULE, noise=draw)


@settings(deadline=None, max_examples=25)
@given(
    seeds=st.lists(st.integers(0, 2**63 - 1), min_size=1, max_size=5),
    name=st.sampled_from(sorted(SOLVERS)),
    randomness=st.randoms(use_true_random=False),
)
def test_a_row_is_bit_for_bit_the_same_alone_in_a_batch_and_in_any_order(seeds, name, randomness):
    together = made(seeds, name=name)
    shuffled = randomness.sample(range(len(seeds)), len(seeds))
    again = made([seeds[i] for i in shuffled], name=name)
    for place, i in enumerate(shuffled):
        assert np.array_equal(again[place], together[i])
        assert np.array_equal(made([seeds[i]], name=name)[0], together[i])


def test_a_row_with_a_length_is_the_same_under_any_padding():
    padded = made([1, 2], tokens=9, lengths=[4, 9])
    assert np.array_equal(padded[0, :4], made([1], tokens=4)[0])
    assert np.array_equal(padded[1], made([2], tokens=9)[0])


def test_row_noise_is_standard_normal_new_in_every_draw_and_different_between_rows():
    draw = row_noise([0, 1])
    first, second = (draw(np.empty((2, 100, 100), np.float32)) for _ in range(2))
    numbers = np.stack([first, second]).reshape(4, -1)
    np.testing.assert_allclose(np.cov(numbers), np.eye(4), atol=0.05, rtol=0)
    np.testing.assert_allclose(numbers.mean(1), np.zeros((4,), np.float32), atol=0.05, rtol=0)


def test_row_noise_takes_type_and_shape_of_its_argument():
    noise = row_noise([3])(np.empty((1, 2, 3, 4), dtype=np.float64))
    assert (noise.dtype, noise.shape) == (np.float64, (1, 2, 3, 4))
    assert np.array_equal(noise.astype(np.float32), row_noise([3])(np.empty((1, 2, 3, 4), np.float32)))


def test_row_noise_is_that_of_pcg64_on_every_machine():
    """The numbers of NumPy's generator for a known seed, written down; its rejections may round in the last place."""
    noise = row_noise([2**62 - 1, 5])(np.empty((2, 1, 4), np.float32))
    np.testing.assert_allclose(noise[:, 0], KNOWN, rtol=1e-6)


def test_the_walk_visits_its_levels_guess_then_move_then_edit():
    events = []

    def denoise(x, level):
        events.append(("guess", level))
        return x + level

    def constrain(x, level):
        events.append(("edit", level))
        return x * 0 + level

    x = np.zeros((1, 1, 1), np.float32)
    walk = sample(
        denoise,
        x,
        levels=[9, 4, 0],
        solver=SOLVERS["ddim"],
        schedule=SCHEDULE,
        noise=np.zeros_like,
        constrain=constrain,
    )
    assert events == []
    snapshots = [(level, state.item(), clean.item()) for level, state, clean in walk]
    assert events == [("guess", 9), ("edit", 4), ("guess", 4), ("edit", 0)]
    assert snapshots == [(4, 4.0, 9.0), (0, 0.0, 8.0)]


def test_a_walk_of_one_level_is_no_walk():
    x = np.ones((1, 2, 3), np.float32)
    assert run(wavy, x, levels=[7], solver=SOLVERS["dpm2m"], schedule=SCHEDULE, noise=np.zeros_like) is x


@pytest.mark.parametrize("walk", [[], [3, 3], [1, 2], [41, 0], [3, -1]])
def test_levels_that_do_not_fall_or_do_not_exist_are_refused_before_anything_runs(walk):
    with pytest.raises(ValueError, match="level"):
        sample(
            wavy,
            np.zeros((1, 1, 1), np.float32),
            levels=walk,
            solver=SOLVERS["ddpm"],
            schedule=SCHEDULE,
            noise=np.zeros_like,
        )


def test_a_run_changes_none_of_its_arguments_and_keeps_their_type():
    x = shared_draw(0)(np.empty((2, 3, 4), dtype=np.float32))
    before, walk = x.copy(), levels(SCHEDULE, 5)
    for solver in SOLVERS.values():
        end = run(wavy, x, levels=walk, solver=solver, schedule=SCHEDULE, noise=row_noise([0, 1]))
        assert end.dtype == np.float32
        assert np.array_equal(x, before)


def test_a_restart_keeps_what_the_level_leaves_of_the_data():
    clean = np.full((1, 200, 200), 3.0)
    noisy = restart(clean, SCHEDULE, 12, row_noise([5]))
    signal, noise = SCHEDULE.at(12)
    assert noisy.mean().item() == pytest.approx(3 * signal, abs=0.02)
    assert noisy.std().item() == pytest.approx(noise, abs=0.02)
    assert np.array_equal(restart(clean, SCHEDULE, 0, row_noise([5])), clean)


def test_masked_noise_is_zero_where_the_mask_holds():
    mask = np.array([True, False])
    noise, plain = (
        draw(np.empty((1, 3, 2), np.float32)) for draw in (masked_noise(row_noise([1]), mask), row_noise([1]))
    )
    assert np.array_equal(noise[..., 0], np.zeros((1, 3), np.float32))
    assert np.array_equal(noise[..., 1], plain[..., 1])


@pytest.mark.parametrize(
    "mistake",
    [lambda: row_noise([1, 2])(np.empty((3, 1, 1), np.float32)), lambda: row_noise([1, 2], [4])],
    ids=["rows", "lengths"],
)
def test_seeds_that_do_not_fit_the_rows_are_refused(mistake):
    with pytest.raises(ValueError, match="seeds"):
        mistake()
