"""Best of several seeds: which is kept, that it depends on its own motion alone, and what cannot be asked."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from motionloom.core.diffusion.sampling import row_seed
from motionloom.core.errors import MotionloomError
from motionloom.core.models.prior import Prior
from motionloom.requests.sampling import Sampling
from motionloom.tasks.best import Chooser, best_candidate
from motionloom.tasks.choosing import best_in_words
from motionloom.tasks.sampling import Rows, sample, with_best_seeds
from motionloom.tasks.text import finish, generate, sample_features
from tests.noise import normal
from tests.recorded import tiny

WALK, TURN = "a person walks", "a person turns left"
SAMPLING = Sampling(steps=5)
ROT6D = slice(67, 193)


@pytest.fixture(scope="module")
def prior() -> Prior:
    return tiny.prior()


def best(prior: Prior, prompts: list[str], seeds: list[int], choose: Chooser = best_in_words) -> list[int]:
    rows = Rows(prompts, [12] * len(seeds), seeds)
    return list(with_best_seeds(prior, rows, replace(SAMPLING, best_of=4), choose=choose).seeds)


class Verdict:
    """A judge with recorded answers."""

    def __init__(self, shares: Sequence[float]) -> None:
        self.shares = iter(shares)

    def share_met(self, text: str, positions: np.ndarray, fps: float) -> float:
        return next(self.shares)

    def asks_for_rest(self, text: str) -> bool:
        return True


def test_of_equals_the_one_nearest_to_the_mean_at_pure_noise_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the weights that ship. The mean is estimated here from other noise, 24 rows of it."""
    monkeypatch.setattr(
        "motionloom.tasks.best._candidate_ranks", lambda prior, prompt, estimates, judge: [()] * len(estimates)
    )
    prior, tried = Prior.load(), [7, *(row_seed(7, number) for number in range(1, 5))]
    noise = normal((24, 40, 263), 1)
    mean = prior.net(noise, 1000, prior.net.bind(prior.condition([TURN] * 24))).mean(0)
    halfway = dict(sample(prior, Rows([TURN] * 5, [40] * 5, tried), SAMPLING, halfway=True))
    away = [float(((halfway[i] - mean)[:, ROT6D] ** 2).mean()) for i in range(5)]
    assert sorted(away)[1] - min(away) > 1e-3  # no tie
    seeds = with_best_seeds(prior, Rows([TURN], [40], [7]), replace(SAMPLING, best_of=5)).seeds
    assert seeds == [tried[away.index(min(away))]]


@pytest.mark.parametrize(("met", "whole", "place"), [((0, 1, 0, 1), (1, 1, 1, 1), 1), ((1, 1, 1, 1), (0, 0, 1, 0), 2)])
def test_what_words_allow_to_check_comes_first_and_a_whole_body_second(
    prior: Prior, monkeypatch: pytest.MonkeyPatch, met: tuple[int, ...], whole: tuple[int, ...], place: int
) -> None:
    """Whatever is nearest to the mean. Two that do as much: the livelier."""
    bodies = iter(whole)
    far = iter([0.1, 0.2, 0.3, 0.2])
    monkeypatch.setattr("motionloom.tasks.best.wholeness", lambda _: next(bodies))
    monkeypatch.setattr("motionloom.tasks.best._distance", lambda *_: next(far))
    seeds = [7, *(row_seed(7, number) for number in range(1, 4))]
    assert best(prior, [WALK], [7], partial(best_candidate, judge=Verdict(met))) == [seeds[place]]


def test_halfway_gives_the_estimates_after_half_of_the_calls(prior: Prior) -> None:
    calls: list[tuple[int, int]] = []
    rows = Rows([WALK], [12], [3])
    states = dict(sample(prior, rows, SAMPLING, halfway=True, progress=lambda *pair: calls.append(pair)))
    assert calls == [(1, 3), (2, 3), (3, 3)]  # of five
    assert not np.allclose(states[0], dict(sample(prior, rows, SAMPLING))[0])


def test_the_choice_for_a_motion_depends_on_that_motion_alone(prior: Prior) -> None:
    together = best(prior, [WALK, TURN, WALK], [1, 2, 3])
    assert together == [best(prior, [p], [s])[0] for p, s in ((WALK, 1), (TURN, 2), (WALK, 3))]
    assert len({best(prior, [WALK], [seed])[0] == seed for seed in range(8)}) == 2  # sometimes its own, sometimes not


def test_what_is_made_is_what_the_best_seed_makes(prior: Prior) -> None:
    features = sample_features(prior, [WALK, TURN], [12, 12], seeds=[5, 6], steps=5, best_of=4)
    chosen = best(prior, [WALK, TURN], [5, 6])
    plain = sample_features(prior, [WALK, TURN], [12, 12], seeds=chosen, steps=5)
    np.testing.assert_allclose(features, plain, rtol=0, atol=1e-5)
    (motion,) = generate(prior, TURN, seconds=0.6, seed=6, foot_lock=False, steps=5, best_of=4, literal=True)
    expected = finish(prior, plain[1], foot_lock=False).positions()
    np.testing.assert_allclose(motion.positions(), expected, atol=1e-4)


def test_progress_sees_one_job(prior: Prior) -> None:
    reports: list[tuple[int, int]] = []
    generate(prior, WALK, seconds=0.6, steps=4, count=3, best_of=4, progress=lambda *pair: reports.append(pair))
    of = 2 * 2 + 4  # two batches of six and six candidates to half of the calls, and three motions
    assert reports == [(calls, of) for calls in range(1, of + 1)]


@pytest.mark.parametrize("count", [0, -1, 17, 2.5, True])
def test_numbers_that_cannot_be_tried_are_refused(prior: Prior, count) -> None:
    with pytest.raises(MotionloomError, match="best_of must be a whole number"):
        generate(prior, WALK, best_of=count)
