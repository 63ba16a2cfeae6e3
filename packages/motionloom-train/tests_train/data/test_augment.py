"""Loops, curves, films run backwards and mixed arms, against what they promise."""

import numpy as np
import pytest

from motionloom.core.features import humanml as hml
from motionloom.core.features.layout import LAYOUT
from motionloom.kinematics import physics as ph
from motionloom_train.data import augment
from tests.core.features.people import wander
from tests.kinematics import people

FPS = 20.0
LEGS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11)


@pytest.fixture(scope="module")
def walk() -> np.ndarray:
    return hml.encode(hml.canonical(hml.uniform(people.walking(1.2, 4.0))), heading="corrected")


@pytest.mark.parametrize("frames", [60, 100, 200, 333])
def test_a_loop_has_the_asked_length_and_joins_without_a_jump(walk: np.ndarray, frames: int) -> None:
    """No step between two frames is larger than the largest of the recording (plus the blended difference)."""
    looped = augment.loop(walk, frames)
    assert looped is not None
    assert looped.shape == (frames, 263)
    ric = LAYOUT["ric"]
    largest = np.abs(np.diff(walk[:, ric], axis=0)).max()
    assert np.abs(np.diff(looped[:, ric], axis=0)).max() < 1.3 * largest
    travelled = hml.decode_positions(looped.astype(np.float64))[:, 0, 2]
    pace = hml.decode_positions(walk.astype(np.float64))[-1, 0, 2] / (len(walk) - 1)
    assert travelled[-1] == pytest.approx(pace * (frames - 1), rel=0.05)


def test_a_motion_that_never_recurs_is_not_looped() -> None:
    """The person falls forward more and more: no pose comes twice."""
    p = people.standing(3.0)
    rise = np.linspace(0, 1, len(p))[:, None]
    p[:, :, 2] += rise * np.arange(22)[None] * 0.2
    features = hml.encode(p, heading="corrected")
    assert augment.loop(features[:16], 100) is None
    assert augment.loop(features, 100, limit=0.001) is None


@pytest.mark.parametrize("rate", [0.4, -0.4])
def test_a_bent_walk_turns_by_the_rate(walk: np.ndarray, rate: float) -> None:
    """``rate`` radians per second to the left, the speed kept, limbs unchanged but where smoothing meets the ends."""
    bent = augment.bend(walk, rate / FPS)
    positions = hml.decode_positions(bent.astype(np.float64))
    turned = np.unwrap(ph.heading(positions))
    assert turned[-1] - turned[0] == pytest.approx(rate * (len(bent) - 1) / FPS, rel=0.05)
    assert ph.travel(positions, FPS) == pytest.approx(
        ph.travel(hml.decode_positions(walk.astype(np.float64)), FPS), rel=0.05
    )
    np.testing.assert_allclose(
        bent[20:-20, 4:67], walk[20:-21, 4:67] if len(bent) < len(walk) else walk[20:-20, 4:67], atol=0.03
    )


def test_reversed_twice_is_the_film_and_the_argument_is_left_alone() -> None:
    p = people.walking(1.0)
    back = augment.reversed_in_time(p)
    np.testing.assert_array_equal(augment.reversed_in_time(back), p)
    assert back[-1, 0, 2] < back[0, 0, 2]


def test_worn_arms_keep_the_legs_and_carry_the_gesture() -> None:
    """Legs and trunk are the body's bit for bit; arms are the other's, turned to the body's heading."""
    body, arms = wander(1).positions(), people.standing(4.0)
    arms[:, (18, 20), 1] += 0.8
    before = body.copy()
    worn = augment.wear_arms(body, arms)
    assert len(worn) == min(len(body), len(arms))
    np.testing.assert_array_equal(worn[:, LEGS], body[: len(worn), LEGS])
    np.testing.assert_array_equal(body, before)
    for hand, spine in ((20, 9), (21, 9)):
        own = np.linalg.norm(arms[: len(worn), hand] - arms[: len(worn), spine], axis=-1)
        np.testing.assert_allclose(np.linalg.norm(worn[:, hand] - worn[:, spine], axis=-1), own, atol=1e-9)
        np.testing.assert_allclose(
            worn[:, hand, 1] - worn[:, spine, 1], (arms[:, hand, 1] - arms[:, spine, 1])[: len(worn)]
        )
