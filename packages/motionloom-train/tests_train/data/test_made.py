"""Gestures made on recorded bodies, held poses and joined clips: bones stay, hands reach their places."""

import numpy as np
import pytest

from motionloom.core.skeleton import SMPL22
from motionloom.kinematics import physics as ph
from motionloom_train.data import augment
from motionloom_train.data.made import GESTURES, hands_up, lower_arms, perform
from tests.kinematics import people

BONES = [(p, j) for j, p in enumerate(SMPL22.parents) if p >= 0]


def lengths(positions: np.ndarray) -> np.ndarray:
    return np.stack([np.linalg.norm(positions[:, j] - positions[:, p], axis=-1) for p, j in BONES], axis=-1)


@pytest.mark.parametrize("name", sorted(GESTURES))
def test_a_gesture_moves_arms_only_and_keeps_bones(name: str) -> None:
    body = people.standing(4.0)
    motion = perform(body, GESTURES[name], "left", fps=20.0, begin=0.5, rng=np.random.default_rng(0))
    np.testing.assert_allclose(lengths(motion), lengths(body), atol=1e-6)
    arms = [18, 19, 20, 21]
    rest = [
        j for j in range(22) if j not in arms and not (GESTURES[name].thrust[2] and j >= 9)
    ]  # a strike turns the chest
    np.testing.assert_array_equal(motion[:, rest], body[:, rest])
    assert np.abs(motion[:, arms] - body[:, arms]).max() > 0.1
    step = np.linalg.norm(np.diff(motion, axis=0), axis=-1).max()
    assert step * 20 < 6  # metres a second: no joint jumps


def test_claps_bring_the_wrists_together_again_and_again() -> None:
    motion = perform(people.standing(6.0), GESTURES["clap"], "left", fps=20.0, begin=0.5, rng=np.random.default_rng(1))
    gap = np.linalg.norm(motion[:, 20] - motion[:, 21], axis=-1)
    near = gap[30:-30] < 0.12
    assert np.count_nonzero(np.diff(near.astype(int)) == 1) >= 3


def test_a_hand_of_one_side_leaves_the_other_alone() -> None:
    body = people.standing(3.0)
    motion = perform(body, GESTURES["salute"], "right", fps=20.0, begin=0.5, rng=np.random.default_rng(2))
    np.testing.assert_array_equal(motion[:, [18, 20]], body[:, [18, 20]])
    assert motion[:, 21, 1].max() > body[:, 12, 1].max()


def test_lowered_arms_hang_below_the_chest() -> None:
    body = people.standing(3.0)
    raised = perform(body, GESTURES["arms up"], "left", fps=20.0, begin=0.5, rng=np.random.default_rng(0))[30:36]
    assert hands_up(raised)
    lowered = lower_arms(raised)
    assert not hands_up(lowered)
    np.testing.assert_allclose(lengths(lowered), lengths(raised), atol=1e-6)


def test_held_poses_go_on_from_the_clip_and_keep_what_is_on_the_floor() -> None:
    body = people.standing(2.0)
    longer = augment.with_pauses(body, 30, 50, fps=20.0, seed=1)
    assert len(longer) == len(body) + 80
    np.testing.assert_array_equal(longer[30 : 30 + len(body)], body)
    jumps = np.linalg.norm(np.diff(longer, axis=0), axis=-1)
    assert jumps.max() < max(np.linalg.norm(np.diff(body, axis=0), axis=-1).max(), 0.012) + 1e-6
    toes = longer[-50:, [10, 11]]
    assert np.ptp(toes, axis=0).max() < 0.004
    assert np.ptp(longer[-50:, 15], axis=0).max() > 0.004  # somebody alive


def test_somebody_who_walks_cannot_be_held_and_somebody_who_stands_can() -> None:
    assert not augment.can_hold(people.walking(1.3, 3.0), 20.0, end=True)
    assert augment.can_hold(people.standing(3.0), 20.0, end=True)


def test_joined_clips_go_on_where_the_first_ended_and_as_it_faced() -> None:
    first = people.standing(2.0)
    turn = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]], dtype=float)
    second = people.standing(2.0) @ turn.T + [5.0, 0.0, -3.0]
    both = augment.joined(first, second)
    assert both is not None
    assert len(both) == len(first) + len(second)
    assert np.linalg.norm(np.diff(both, axis=0), axis=-1).max() < 0.03
    assert abs(ph.heading(both)[-1] - ph.heading(first)[-1]) < 0.05


def test_clips_whose_poses_differ_are_not_joined() -> None:
    low = people.standing(1.0) * [1, 0.5, 1]
    assert augment.joined(people.standing(1.0), low) is None


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_punch_is_one_fast_thrust_of_its_hand(side: str) -> None:
    motion = perform(people.standing(4.0), GESTURES["punch"], side, fps=20.0, begin=0.7, rng=np.random.default_rng(3))
    reach = np.linalg.norm(motion[:, [20, 21]] - motion[:, [16, 17]], axis=-1)
    speed = ph.velocity(reach, 20.0)[24:45]  # while the guard is held
    own, other = (0, 1) if side == "left" else (1, 0)
    assert speed[:, own].max() > 1.5 > 0.5 > speed[:, other].max()
    forward = ph.in_body(motion)[:, [20, 21], 2]
    assert forward[24:45, own].max() > forward[24:45, other].max() + 0.2


@pytest.mark.parametrize(("name", "times"), [("arm up twice", 2), ("arm up three times", 3)])
def test_an_arm_goes_up_as_often_as_the_words_say(name: str, times: int) -> None:
    motion = perform(people.standing(6.0), GESTURES[name], "right", fps=20.0, begin=0.7, rng=np.random.default_rng(4))
    up = motion[:, 21, 1] > motion[:, 15, 1]
    assert np.count_nonzero(np.diff(up.astype(int)) == 1) == times
    assert not up[-1]


def test_hands_rest_on_the_hips_of_somebody_who_bends_forward() -> None:
    """A place seen from the shoulders would lie behind the thighs."""
    body = people.standing(4.0)
    lean = np.radians(35) * np.ones(len(body))
    above = [3, 6, 9, *range(12, 22)]
    offset = body[:, above] - body[:, :1]
    body[:, above] = body[:, :1] + np.stack(
        [offset[..., 0], np.cos(lean)[:, None] * offset[..., 1], np.sin(lean)[:, None] * offset[..., 1]], axis=-1
    )
    motion = perform(body, GESTURES["hands on hips"], "", fps=20.0, begin=0.5, rng=np.random.default_rng(5))
    waist = motion[40:55, [1, 2]] + [0.0, 0.12, 0.0]
    assert np.linalg.norm(motion[40:55, [20, 21]] - waist, axis=-1).max() < 0.22
