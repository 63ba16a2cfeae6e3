"""Steering on guesses of noise: what the corrected guess decodes to, and what must not change."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core.features import humanml
from motionloom.core.ground import GroundPose
from motionloom.core.models.prior import Prior
from motionloom.core.skeleton import SMPL22
from motionloom.edits.steering import Correction, corrected, toward
from motionloom.goals.goal import Goal
from motionloom.kinematics.physics import heading
from tests.noise import normal
from tests.recorded import tiny

WRIST, HEAD = SMPL22.index("right_wrist"), SMPL22.index("head")
LEVELS = (50, 25, 1)


@pytest.fixture(scope="module")
def prior() -> Prior:
    """Statistics like those of people: somebody with bent elbows, a velocity of a centimetre, places off by 5 cm."""
    mean, std = np.zeros((263,), np.float32), np.full(263, 0.05, np.float32)
    places = np.asarray(SMPL22.rest_positions()).astype(np.float32)
    places[[20, 21]] = places[[18, 19]] + np.array([0.0, 0.0, 0.26])
    mean[3], mean[4:67] = places[0, 1], places[1:].reshape(-1)
    mean[2], std[:3] = 0.03, np.array([0.01, 0.01, 0.01])
    return replace(tiny.prior(), mean=mean, std=std)


def guess(frames: int = 60, seed: int = 0) -> np.ndarray:
    """Smooth noise."""
    noise = normal((frames + 12, 263), seed)
    return 3 * np.lib.stride_tricks.sliding_window_view(noise, 13, axis=0).mean(-1)


def decoded(row: np.ndarray, prior: Prior, first: int = 0) -> np.ndarray:
    """Places by the published decoder, seen from where the root is at frame ``first``."""
    features = (row * prior.std + prior.mean).astype(np.float64)
    places = humanml.decode_positions(features)
    turn, root = humanml.recover_root(features)
    facing = -2 * np.arctan2(turn[first, 2], turn[first, 0])
    return GroundPose(float(root[first, 0]), float(root[first, 2]), float(facing)).from_world(places)


def asking(frames: int, joint: int, at: dict[int, tuple[float, float, float]]) -> Goal:
    goal = Goal.nothing(frames)
    for frame, place in at.items():
        goal.positions[frame, joint] = place
        goal.mask[frame, joint] = (True, joint != 0, True)
    return goal


def test_no_goal_is_the_same_guess_bit_for_bit(prior: Prior) -> None:
    row = guess()
    assert toward(Goal.nothing(60), prior)(row, 30) is row


@pytest.mark.parametrize("level", LEVELS)
def test_a_keyframe_of_the_pelvis_is_met(prior: Prior, level: int) -> None:
    goal = asking(60, 0, {40: (1.0, 0.0, 2.0)})
    after = decoded(toward(goal, prior)(guess(), level), prior)
    np.testing.assert_allclose(after[40, 0, [0, 2]], [1.0, 2.0], atol=1e-3)


@pytest.mark.parametrize("level", LEVELS)
def test_a_keyframe_bends_a_stretch_and_leaves_no_spike(prior: Prior, level: int) -> None:
    """A wrist 20 cm off: the largest second difference of the change is that of a curve, not of a spike (0.4)."""
    row = guess()
    before = decoded(row, prior)
    goal = asking(60, WRIST, {30: tuple(before[30, WRIST] + [0.0, 0.2, 0.0])})
    change = (decoded(toward(goal, prior)(row, level), prior) - before)[:, WRIST, 1]
    assert abs(change[30] - 0.2) < 1e-3
    assert np.abs(np.diff(change, n=2)).max() < 0.03
    assert abs(change[26]) > 0.05
    assert abs(change[0]) < 0.02


def test_the_elbow_follows_the_wrist_and_the_other_arm_does_not(prior: Prior) -> None:
    row = guess()
    before = decoded(row, prior)
    goal = asking(60, WRIST, {30: tuple(before[30, WRIST] + [0.0, 0.2, 0.0])})
    moved = np.linalg.norm(decoded(toward(goal, prior)(row, 1), prior) - before, axis=-1)[30]
    elbow, other = moved[SMPL22.index("right_elbow")], moved[SMPL22.index("left_elbow")]
    assert 0.05 < elbow < moved[WRIST]
    assert other < 0.3 * elbow


def test_a_head_that_goes_down_leaves_the_feet_where_they_are(prior: Prior) -> None:
    row = guess()
    before = decoded(row, prior)
    goal = asking(60, HEAD, {30: tuple(before[30, HEAD] - [0.0, 0.3, 0.0])})
    moved = (decoded(toward(goal, prior)(row, 1), prior) - before)[30, :, 1]
    assert moved[0] < -0.1
    assert np.abs(moved[[10, 11]]).max() < 0.03


def test_a_goal_that_is_drawn_already_changes_nothing(prior: Prior) -> None:
    row = guess()
    places = decoded(row, prior)
    goal = replace(Goal.nothing(60), positions=places)
    goal.mask[:, [0, WRIST]] = True
    np.testing.assert_allclose(toward(goal, prior)(row, 25), row, atol=1e-4)


def test_a_dense_path_is_followed_and_the_body_turns_with_it(prior: Prior) -> None:
    """A quarter circle of radius 1 m to the left: who walks ahead at 3 cm a frame still walks ahead on it."""
    frames = 60
    angle = np.linspace(0, np.pi / 2, frames)
    goal = asking(frames, 0, {k: (1 - np.cos(a), 0.0, np.sin(a)) for k, a in enumerate(angle)})
    row = toward(goal, prior)(np.zeros((frames, 263), np.float32), 25)
    after = decoded(row, prior)
    np.testing.assert_allclose(after[:, 0, [0, 2]], goal.positions[:, 0, [0, 2]], atol=0.01)
    np.testing.assert_allclose(heading(after)[15:50], angle[15:50], atol=0.15)


def test_facing_asked_is_faced(prior: Prior) -> None:
    goal = Goal.nothing(60)
    goal.facing[40:], goal.facing_mask[40:] = -1.2, True
    after = decoded(toward(goal, prior)(guess(), 25), prior)
    np.testing.assert_allclose(heading(after)[40:] - heading(after)[0], -1.2 - heading(after)[0], atol=0.1)


def test_a_goal_may_begin_inside_a_row(prior: Prior) -> None:
    """Frame 10 of a goal from frame 20 of the row is frame 30; what was before stays."""
    row = guess()
    goal = asking(100, 0, {10: (0.5, 0.0, 0.3)})
    changed = toward(goal, prior, first=20)(row, 1)
    np.testing.assert_allclose(decoded(changed, prior, 20)[30, 0, [0, 2]], [0.5, 0.3], atol=1e-3)
    np.testing.assert_allclose(changed[:1], row[:1], atol=0.3)


def planted(row: np.ndarray, prior: Prior, standing: slice) -> np.ndarray:
    """The guess with its left foot told to be in contact."""
    row = row.copy()
    row[standing, 259:261] = 1 / prior.std[259]
    return row


def test_a_foot_in_contact_stands_while_the_path_is_moved(prior: Prior) -> None:
    """A path of 3 cm a frame, aside too, moves the body; the toes told to stand do not slide, the others do."""
    row = planted(guess() / 5, prior, slice(20, 27))
    goal = asking(60, 0, {k: (0.3 * k / 60, 0.0, 0.03 * k) for k in range(60)})
    after = decoded(toward(goal, prior)(row, 25), prior)[20:27]
    slid = np.linalg.norm(np.diff(after[:, [10, 11]][..., [0, 2]], axis=0), axis=-1).max(axis=0)
    assert slid[0] < 0.2 * slid[1]
    np.testing.assert_allclose(after[:, 0, [0, 2]], goal.positions[20:27, 0, [0, 2]], atol=0.01)


def test_a_foot_in_contact_that_is_asked_elsewhere_goes_there(prior: Prior) -> None:
    row = planted(guess(), prior, slice(20, 50))
    place = decoded(row, prior)[30, 10] + [0.05, 0.03, 0.0]
    after = decoded(toward(asking(60, 10, {30: tuple(place)}), prior)(row, 1), prior)
    np.testing.assert_allclose(after[30, 10], place, atol=2e-3)


def test_the_displacements_stay_those_of_the_places(prior: Prior) -> None:
    """The joint velocities change by as much as the displacements that the places show."""
    row = guess()
    goal = asking(60, 0, {40: (1.0, 0.0, 2.0)})
    changed = toward(goal, prior)(row, 25)
    before, after = ((part * prior.std + prior.mean).astype(np.float64) for part in (row, changed))
    steps = humanml.displacements(after) - humanml.displacements(before)
    velocities = (after - before)[:-1, 193:259].reshape(-1, 22, 3)
    np.testing.assert_allclose(velocities, steps, atol=1e-5)


def test_what_is_out_of_reach_moves_limbs_by_less_than_a_metre(prior: Prior) -> None:
    row = guess()
    before = decoded(row, prior)
    goal = asking(60, WRIST, {30: tuple(before[30, WRIST] + [0.0, 50.0, 0.0])})
    assert np.abs(decoded(toward(goal, prior)(row, 25), prior) - before).max() < 1.0


def test_rows_are_corrected_alone(prior: Prior) -> None:
    """Each row gets its own correction; a row without one is the network's guess bit for bit."""
    rows = np.stack([guess(seed=0), guess(seed=1), guess(seed=2)])
    change: Correction = toward(asking(60, 0, {40: (1.0, 0.0, 2.0)}), prior)
    edited = corrected(lambda state, level: rows, [None, change, None])(rows, 25)
    assert np.array_equal(edited[[0, 2]], rows[[0, 2]])
    assert np.array_equal(edited[1], change(rows[1], 25))
    denoise = lambda state, level: rows  # noqa: E731
    assert corrected(denoise, [None, None, None]) is denoise
    with pytest.raises(ValueError, match="per row"):
        corrected(denoise, [change])(rows, 25)


def test_many_targets_are_thinned_and_still_met(prior: Prior, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motionloom.edits.steering.MOST", 100)
    row, other = guess(seed=0), guess(seed=1)
    goal = replace(Goal.nothing(60), positions=decoded(other, prior))
    goal.mask[:, [WRIST, HEAD, 7, 8]] = True
    after = decoded(toward(goal, prior)(row, 1), prior)
    assert np.linalg.norm((after - goal.positions)[:, [WRIST, HEAD]], axis=-1).mean() < 0.03
