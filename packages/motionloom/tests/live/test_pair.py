"""Two people who move without end: one world, the same again, each does what he is asked."""

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.live.commands import Say, Steer
from motionloom.live.live import Live, motion_of
from motionloom.live.pair import LivePair
from motionloom.live.settings import Settings
from tests.live import people
from tests.live.people import QUICK
from tests.tasks.two_people import block

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


def test_what_is_asked_of_both_or_one_is_taken_and_makes_the_same_again() -> None:
    prior = people.prior()
    pair = LivePair(prior, block(prior), seed=2, settings=QUICK)
    pair.ask(Say("a person walks :: a person waves"))
    frames = [next(pair) for _ in range(9)]
    pair.ask(Steer(1.0, 1.0), 1)
    pair.ask(Say("a person jumps"))
    frames += [next(pair) for _ in range(6)]
    log = pair.taken
    assert log == [
        (0, Say("a person walks"), 0),
        (0, Say("a person waves"), 1),
        (9, Say("a person jumps"), 0),
        (9, Steer(1.0, 1.0), 1),
        (9, Say("a person jumps"), 1),
    ]
    again = LivePair(prior, block(prior), seed=2, settings=QUICK)
    for old in frames:
        for one in log:
            if one.frame == old[0].number:
                again.ask(one.command, one.person)
        assert all(np.array_equal(a.rotations, b.rotations) for a, b in zip(old, next(again), strict=True))


def test_nobody_else_and_no_third_sentence_can_be_asked() -> None:
    prior = people.prior()
    pair = LivePair(prior, block(prior), settings=QUICK)
    with pytest.raises(MotionloomError, match="no person 3"):
        pair.ask(Steer(), 2)
    with pytest.raises(MotionloomError, match="words for each person"):
        pair.say("a :: b :: c")
    with pytest.raises(MotionloomError, match="no person 2"):
        Live(prior, settings=QUICK).ask(Steer(), 1)


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
