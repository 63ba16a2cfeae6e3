"""Changes of the whole body made by rule on somebody who stands."""

import numpy as np
import pytest

from motionloom.core.skeleton import SMPL22
from motionloom.kinematics import physics as ph
from motionloom_train.data.postures import assume, postures
from tests.kinematics import people

FPS = 20.0
BONES = [(child, parent) for child, parent in enumerate(SMPL22.parents) if parent >= 0]


def body() -> np.ndarray:
    """Somebody who stands still for ten seconds, arms hanging."""
    return np.tile(people.walking(0.0, 1.0)[:1], (200, 1, 1))


def motions_of(action: str, seed: int = 0, turned: float = 0.0) -> list[np.ndarray]:
    standing = ph.turned(body(), turned)
    matches = [p for p in postures(standing, np.random.default_rng(seed)) if p.action == action]
    assert matches
    return [assume(standing, posture, fps=FPS, begin=0.5) for posture in matches]


@pytest.mark.parametrize("seed", range(4))
def test_bones_keep_their_lengths_and_nobody_sinks_or_jerks(seed: int) -> None:
    standing = body()
    for posture in postures(standing, np.random.default_rng(seed)):
        p = assume(standing, posture, fps=FPS, begin=0.5)
        for child, parent in BONES:
            length = np.linalg.norm(p[:, child] - p[:, parent], axis=-1)
            np.testing.assert_allclose(length, length[0], atol=2e-3, err_msg=f"{posture.action} {child}")
        assert p[..., 1].min() > standing[..., 1].min() - 0.04, posture.action
        assert np.abs(np.diff(p, axis=0)).max() * FPS < 4.5, posture.action
        np.testing.assert_allclose(p[:10], standing[:10], atol=0.01, err_msg=posture.action)


def test_who_kneels_has_a_knee_on_the_floor_and_stays() -> None:
    for p in motions_of("kneel"):
        knees = p[:, [4, 5], 1].min(axis=1)
        assert knees[0] > 0.35
        assert knees[-80:].max() < 0.1
        assert 0.3 < p[-1, 0, 1] < 0.65


def test_hands_reach_the_toes_with_straight_knees() -> None:
    (p,) = motions_of("touch toes")
    low = int(p[:, 20, 1].argmin())
    assert np.linalg.norm(p[low, [20, 21]] - p[low, [10, 11]], axis=-1).max() < 0.25
    assert p[low, 0, 1] > 0.8 * p[0, 0, 1]
    np.testing.assert_allclose(p[-1], body()[-1], atol=0.02)


def test_swaying_moves_the_chest_and_not_the_feet() -> None:
    (p,) = motions_of("sway")
    assert np.ptp(p[:, 9, 0]) > 0.18
    assert np.ptp(p[:, [7, 8]], axis=0).max() < 0.02


def test_a_posture_follows_where_the_person_faces() -> None:
    (plain,), (turned,) = motions_of("high step"), motions_of("high step", turned=1.0)
    np.testing.assert_allclose(ph.turned(plain, 1.0), turned, atol=1e-6)
    assert plain[:, 7, 1].max() > plain[:, 8, 1].max() + 0.3  # the left side, as its words say


def test_who_crouches_stays_low_on_both_feet() -> None:
    for p in motions_of("crouch"):
        assert p[0, 0, 1] - p[-80:, 0, 1].max() > 0.3
        assert np.ptp(p[:, [7, 8]], axis=0).max() < 0.02


def test_who_balances_stands_on_the_side_that_the_words_say() -> None:
    (p,) = motions_of("balance with arms out")
    assert p[-60:, 7, 1].min() > p[-60:, 8, 1].max() + 0.12  # on the right leg


@pytest.mark.parametrize(("action", "times"), [("one squat", 1), ("two squats", 2), ("three squats", 3)])
def test_squats_are_as_many_as_their_words_say(action: str, times: int) -> None:
    (p,) = motions_of(action)
    low = p[:, 0, 1] < p[0, 0, 1] - 0.25
    assert np.count_nonzero(np.diff(low.astype(int)) == 1) == times
    np.testing.assert_allclose(p[-1], p[0], atol=0.01)
