"""Two people who move without end: one world, the same again, each does what he is asked."""

import numpy as np
import pytest

from motionloom.live.live import motion_of
from motionloom.live.pair import LivePair
from motionloom.live.settings import Settings
from motionloom.weights.pair import PairBlock
from motionloom.weights.prior import Prior

FEW = Settings(steps=4, ahead=40, used=30)


@pytest.fixture(scope="module")
def prior() -> Prior:
    return Prior.load()


def run(prior: Prior, count: int) -> list[np.ndarray]:
    pair = LivePair(prior, PairBlock.load("duet", prior), seed=1, settings=FEW)
    pair.say("two people stand :: two people stand")
    frames = []
    for number in range(count):
        if number == 20:
            pair.people[1].steer(np.pi / 2, 1.2)
        frames.append(next(pair))
    return [motion_of([both[i] for both in frames], 20).positions() for i in (0, 1)]


def test_two_people_are_the_same_again_and_only_who_is_steered_goes(prior: Prior) -> None:
    first, second = run(prior, 70)
    again = run(prior, 70)
    assert np.array_equal(first, again[0])
    assert np.array_equal(second, again[1])
    gone = [places[-1, 0, [0, 2]] - places[45, 0, [0, 2]] for places in (first, second)]
    assert np.linalg.norm(gone[0]) < 0.6
    assert gone[1][0] == pytest.approx(1.44, abs=0.3)
    for places in (first, second):
        assert np.linalg.norm(np.diff(places, axis=0), axis=-1).max() * 20 < 9.0
