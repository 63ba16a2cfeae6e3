"""The published recipe: its walk, paddings, masks and coins, and that any predictor goes through it honestly."""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from motionloom.core.diffusion import Dct, Schedule, cosine, row_noise
from motionloom.core.errors import MotionloomError
from motionloom.core.methods.humanmac import (
    PARTS,
    Fixed,
    SwitchTarget,
    conditioned_samples,
    padded,
    published_completion,
    published_futures,
    published_levels,
)
from motionloom.core.models.predictor import Predictor
from motionloom_train.nets.predictor import TransLinear
from tests.noise import normal
from tests.recorded.tiny_predictor import predictor

SCHEDULE = cosine(1000)
VARIANTS = ["masked", "published"]


def some(*shape: int, seed: int = 0) -> np.ndarray:
    return normal(shape, seed)


@pytest.mark.parametrize("steps", [1, 10, 25, 40, 100, 500])
def test_the_walk_is_the_published_one(steps: int) -> None:
    """Times 1, 1 + 1000/S, ... and, before them, 0, 1, ...; index t is level t + 1."""
    times = [1 + i * (1000 // steps) for i in range(steps)]
    assert published_levels(SCHEDULE, steps) == [t + 1 for t in [0, *times]][::-1]


@pytest.mark.parametrize("levels", [2, 50, 1000])
def test_any_number_of_steps_gives_falling_levels_that_there_are(levels: int) -> None:
    schedule = cosine(levels)
    for steps in range(1, levels):
        walk = published_levels(schedule, steps)
        assert len(walk) == steps + 1
        assert walk[-1] == 1
        assert walk[0] <= levels
        assert all(a > b for a, b in pairwise(walk))


@pytest.mark.parametrize("steps", [0, -1, 1000, 5000])
def test_more_steps_than_levels_are_refused(steps: int) -> None:
    with pytest.raises(MotionloomError, match="steps"):
        published_levels(SCHEDULE, steps)


def test_paddings_are_the_index_lists_and_leave_the_observation_alone() -> None:
    observed = some(2, 3, 4)
    before = observed.copy()
    for padding, index in (("last", [0, 1, 2, 2, 2, 2]), ("repeat", [0, 1, 2, 0, 1, 2])):
        assert np.array_equal(padded(observed, 6, padding), observed[:, index])  # pyright: ignore[reportArgumentType]
    assert np.array_equal(
        padded(observed, 6, "zero"), np.concatenate([before, np.zeros((2, 3, 4), np.float32)], axis=1)
    )
    assert np.array_equal(observed, before)


@pytest.mark.parametrize(("frames", "padding"), [(2, "last"), (7, "repeat"), (2, "zero")])
def test_paddings_that_do_not_go_up_are_refused(frames: int, padding: str) -> None:
    with pytest.raises(MotionloomError):
        padded(some(1, 3, 4), frames, padding)  # pyright: ignore[reportArgumentType]


def complete(observed: np.ndarray, rows: int, *, basis: Dct | None = None, steps: int = 10, seed: int = 0, **how):
    """With a perfect guess of a motion that stands still at 0, and 48 channels."""
    basis = basis or Dct(20, 20)
    return published_completion(
        lambda x, level: np.zeros_like(x),
        observed,
        rows,
        basis=basis,
        schedule=SCHEDULE,
        noise=row_noise(range(seed, seed + rows)) if len(observed) == rows else _any_draw(seed),
        steps=steps,
        **how,
    )


def _any_draw(seed: int) -> Callable[[np.ndarray], np.ndarray]:
    rng = np.random.default_rng(seed)
    return lambda like: rng.standard_normal(like.shape, np.float32)


def test_some_noise_is_left_on_what_is_known() -> None:
    """One minus the share of signal at published index 0, its root, on every number of the observed frames."""
    observed = some(40, 5, 48)
    motion = complete(observed, 40)[1]
    left = motion[:, :5] - math.sqrt(1 - 4.12841e-5) * observed
    assert float(left.std()) == pytest.approx(math.sqrt(4.12841e-5), rel=0.03)
    assert float(np.abs(motion[:, 5:]).mean()) < 0.02


def test_without_completion_the_observation_has_no_say() -> None:
    a, b = (complete(some(2, 5, 48, seed=seed), 2, complete=False)[1] for seed in (1, 2))
    assert np.array_equal(a, b)


def test_part_control_holds_a_part_in_all_frames_and_shares_its_noise() -> None:
    motion = some(1, 20, 48)
    places = complete(motion[:, :5], 3, fixed=Fixed(motion, PARTS["left_arm"]))[1]
    held = slice(30, 39)  # the published channels 3 * 10 to 3 * 12 + 3
    np.testing.assert_allclose(
        places[..., held], np.broadcast_to(motion, (3, *motion.shape[1:]))[..., held], atol=0.05, rtol=0
    )
    assert np.array_equal(places[0, ..., held], places[1, ..., held])
    free = np.ones((48,), dtype=np.bool_)
    free[held] = False
    assert float(np.abs(places[:, 5:, free]).max()) < 0.1
    assert not np.array_equal(places[0, 5:, free], places[1, 5:, free])


def test_parts_are_the_published_ranges() -> None:
    assert list(PARTS.values()) == [(0, 3), (3, 6), (6, 10), (10, 13), (13, 16), (0, 6), (6, 16)]


@pytest.mark.parametrize("relax", [0, 0.0, 0.2, 5, 1.0, 10, 99])
def test_a_target_is_imposed_until_the_relaxed_steps(relax: float) -> None:
    """Counted by draws: the start, one per step, and one for the target in the steps before the last ones."""
    calls = 0

    def draw(like: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        return np.zeros_like(like)

    target = SwitchTarget(np.ones((1, 4, 48), np.float32), relax)
    _, motion = published_completion(
        lambda x, level: np.zeros_like(x),
        np.zeros((2, 5, 48), np.float32),
        2,
        basis=Dct(20, 20),
        schedule=SCHEDULE,
        noise=draw,
        steps=10,
        target=target,
    )
    imposed = max(10 - (relax if isinstance(relax, int) else round(10 * relax)), 0)
    assert calls == 1 + 10 + imposed
    assert bool(imposed) == (float(motion[:, -4:].mean()) > 1e-3)
    if imposed == 10:
        np.testing.assert_allclose(motion[:, -4:], np.ones((2, 4, 48), np.float32), atol=1e-3, rtol=0)


def test_a_target_longer_than_the_window_is_refused() -> None:
    with pytest.raises(MotionloomError, match="target"):
        complete(np.zeros((1, 5, 48), np.float32), 1, target=SwitchTarget(np.zeros((1, 21, 48), np.float32)))


@pytest.mark.parametrize(("count", "share", "told"), [(50, 0.5, 25), (50, 1.0, 50), (50, 0.0, 0), (10, 0.26, 3)])
def test_a_share_of_the_samples_is_conditioned_the_first_ones(count: int, share: float, told: int) -> None:
    assert conditioned_samples(count, share) == [True] * told + [False] * (count - told)


def test_the_published_coin_falls_as_often_as_asked() -> None:
    assert sum(conditioned_samples(4000, 0.3, coin=1)) == pytest.approx(1200, abs=4 * (4000 * 0.21) ** 0.5)
    assert (
        conditioned_samples(50, 0.5, coin=1)
        == conditioned_samples(50, 0.5, coin=1)
        != conditioned_samples(50, 0.5, coin=2)
    )
    assert all(conditioned_samples(50, 1.0, coin=3))
    assert not any(conditioned_samples(50, 0.0, coin=3))


# Futures of a predictor


def pasts(model: Predictor, windows: int = 3, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    steps = 0.05 * rng.normal(size=(windows, model.observed, model.layout.joints, 3)).cumsum(axis=1)
    return rng.normal(size=(windows, 1, model.layout.joints, 3)) + steps


@pytest.mark.parametrize("variant", VARIANTS)
def test_futures_have_their_shape_and_come_again(variant: str) -> None:
    model = predictor(variant)
    first, again = (published_futures(model, pasts(model), count=2, seed=5, steps=4) for _ in range(2))
    assert first.shape == (3, 2, 15, 4, 3)
    np.testing.assert_array_equal(first, again)
    assert np.abs(first[:, 0] - first[:, 1]).max() > 0.01
    assert np.abs(first - published_futures(model, pasts(model), count=2, seed=6, steps=4)).max() > 0.01


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_future_does_not_depend_on_the_others(variant: str) -> None:
    """Neither on how many rows go at a time, nor on the later windows and samples."""
    model = predictor(variant)
    whole = published_futures(model, pasts(model), count=4, seed=5, steps=4, told_share=0.5)
    np.testing.assert_allclose(
        published_futures(model, pasts(model), count=4, seed=5, steps=4, told_share=0.5, rows=5), whole, atol=1e-4
    )
    fewer = published_futures(model, pasts(model)[:2], count=2, seed=5, steps=4)
    np.testing.assert_allclose(fewer, whole[:2, :2], atol=1e-4)


def oracle(model: Predictor, answer: Callable[[np.ndarray], np.ndarray]) -> Predictor:
    """A predictor whose network names what it is answered by the clean state of all rows, as its variant asks."""

    class Perfect(TransLinear):
        def forward(
            self, x: np.ndarray, t: np.ndarray, condition: np.ndarray | None = None, keep: np.ndarray | None = None
        ) -> np.ndarray:
            clean = answer(x)
            if model.variant == "masked":
                return clean
            a, b = model.schedule.at(int(t[0]) + 1)
            return (x - a * clean) / b

    return replace(model, net=Perfect(model.net.config).eval())


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_perfect_guess_gives_the_true_future_but_for_the_noise_that_is_left(variant: str) -> None:
    """With every frequency kept, so that mixing loses nothing; without the root's way it stays where it was seen."""
    model = predictor(variant, kept=20)
    world = pasts(replace(model, observed=20), 1)
    if not model.layout.root:
        world += world[:, 4:5, :1] - world[:, :, :1]
    own = np.asarray(model.layout.encode(world, model.layout.place(world[:, 4]))).astype(np.float32)
    clean = model.to_state(own, own[:, 4])
    futures = published_futures(
        oracle(model, lambda x: np.broadcast_to(clean, x.shape)), world[:, :5], count=3, steps=20
    )
    off = futures - world[:, None, 5:]
    assert np.abs(off).max() < 0.06
    assert np.abs(off).max() > 1e-4


def test_the_published_manner_is_the_sampler_on_plain_tensors() -> None:
    """One row: the recorded runs hold for `published_completion`, and so for what predictors go through."""
    model, h = predictor("published"), 5
    past = pasts(model, 1)
    numbers = np.asarray(model.layout.encode(past, model.layout.place(past[:, -1]))).astype(np.float32)
    condition = model.basis.to_spectrum(padded(numbers, model.frames))
    seed = int(np.random.SeedSequence((7, 0, 0)).generate_state(1, np.uint64)[0] >> np.uint64(1))
    expected = published_completion(
        model.denoiser(condition),
        numbers,
        1,
        basis=model.basis,
        schedule=model.schedule,
        noise=row_noise([seed]),
        steps=6,
    )[1][:, h:]
    futures = published_futures(model, past, count=1, seed=7, steps=6)[:, 0]
    features = model.layout.encode(futures, model.layout.place(past[:, -1]))
    np.testing.assert_allclose(features, expected, atol=1e-4)


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_network_is_called_once_per_step_and_rows_are_conditioned_as_asked(variant: str) -> None:
    model, calls = predictor(variant), []

    class Spy(TransLinear):
        def forward(
            self, x: np.ndarray, t: np.ndarray, condition: np.ndarray | None = None, keep: np.ndarray | None = None
        ) -> np.ndarray:
            calls.append(
                (len(x), None if condition is None else len(condition), None if keep is None else keep.tolist())
            )
            return np.zeros_like(x)

    spy = replace(model, net=Spy(model.net.config).eval())
    published_futures(spy, pasts(model, 2), count=4, steps=6, told_share=0.5)
    assert calls == [(8, 8, [True, True, False, False] * 2)] * 6
    calls.clear()
    published_futures(spy, pasts(model, 2), count=4, steps=6)
    assert calls == [(8, 8, None)] * 6
    calls.clear()
    published_futures(spy, pasts(model, 2), count=4, steps=6, told_share=0.0, rows=5)
    assert [call[:2] for call in calls] == [(5, None)] * 6 + [(3, None)] * 6


@pytest.mark.parametrize("how", ["short", "long", "joints", "nan", "flat"])
def test_pasts_that_do_not_fit_are_refused(how: str) -> None:
    model = predictor()
    past = pasts(model)
    broken = past.copy()
    broken[0, 0, 0, 0] = np.nan
    wrong = {
        "short": past[:, 1:],
        "long": past.repeat(2, axis=1),
        "joints": past[:, :, 1:],
        "nan": broken,
        "flat": past[0],
    }
    with pytest.raises(MotionloomError, match="past"):
        published_futures(model, wrong[how], count=1, steps=2)


@pytest.mark.parametrize("wrong", [{"count": 0}, {"count": 1, "rows": 0}], ids=str)
def test_no_futures_are_refused(wrong: dict) -> None:
    model = predictor()
    with pytest.raises(MotionloomError, match="at least one"):
        published_futures(model, pasts(model), steps=2, **wrong)


def test_a_schedule_of_few_levels_has_no_hundred_steps() -> None:
    model = predictor()
    short: Schedule = cosine(50)
    with pytest.raises(MotionloomError, match="steps"):
        published_futures(replace(model, schedule=short), pasts(model), count=1)
