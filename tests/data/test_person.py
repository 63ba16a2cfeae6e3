"""The uniform person of a recording: feet that its skeleton has turned up, bodies that lie in the floor."""

import numpy as np
import pytest

from motionloom.data.person import levelled_feet, out_of_floor, uniform_person
from motionloom.features import humanml as hml
from tests.kinematics import people

TOES = [10, 11]


def _with_elevation(positions: np.ndarray, angle: float) -> np.ndarray:
    """Every planted foot raised about its side axis by ``angle`` radians, toes upward, as a wrong rest pose does."""
    result = positions.copy()
    for knee, ankle, toe in ((4, 7, 10), (5, 8, 11)):
        shin, foot = positions[:, knee] - positions[:, ankle], positions[:, toe] - positions[:, ankle]
        side = np.cross(foot, shin)
        side /= np.linalg.norm(side, axis=-1, keepdims=True)
        result[:, toe] = positions[:, ankle] + foot * np.cos(angle) + np.cross(side, foot) * np.sin(angle)
    return result


@pytest.fixture(scope="module")
def walk() -> np.ndarray:
    return hml.uniform(people.walking(1.2, 4.0))


def _elevation(positions: np.ndarray) -> float:
    foot = positions[:, TOES] - positions[:, [7, 8]]
    return float(np.degrees(np.median(np.arcsin(foot[..., 1] / np.linalg.norm(foot, axis=-1)))))


@pytest.mark.parametrize("wrong", [50.0, 65.0])
def test_feet_that_a_skeleton_turns_up_are_laid_flat(walk: np.ndarray, wrong: float) -> None:
    """They point down again as feet do, the toes stand on y = 0, and nothing but the height of the rest changes."""
    bad = _with_elevation(walk, np.radians(wrong))
    assert _elevation(bad) > 10
    good = levelled_feet(bad)
    assert _elevation(good) == pytest.approx(-25, abs=6)
    assert abs(np.percentile(good[:, TOES, 1].min(-1), 20)) < 0.02
    body = [k for k in range(22) if k not in TOES]
    moved = (good - bad)[:, body]
    assert np.abs(moved - moved[0, 0] * [0, 1, 0]).max() < 1e-9
    foot = np.linalg.norm(good[:, 10] - good[:, 7], axis=-1)
    assert foot == pytest.approx(np.linalg.norm(bad[:, 10] - bad[:, 7], axis=-1), abs=1e-9)


def test_feet_that_are_right_stay_as_they_are(walk: np.ndarray) -> None:
    assert levelled_feet(walk) is walk
    tiptoe = walk.copy()
    tiptoe[:, TOES, 1] -= 0.05
    assert levelled_feet(tiptoe) is tiptoe


def test_one_raised_foot_is_a_pose_and_no_fault(walk: np.ndarray) -> None:
    bad = _with_elevation(walk, np.radians(60.0))
    bad[:, 11] = walk[:, 11]
    assert levelled_feet(bad) is bad


def test_a_body_in_the_floor_is_raised_and_feet_do_not_count(walk: np.ndarray) -> None:
    lying = walk.copy()
    lying[..., 1] = 0.1 + 0.1 * (lying[..., 1] - 0.9)
    lying[:, 18, 1] = -0.17
    raised = out_of_floor(lying)
    assert raised[:, 18, 1] == pytest.approx(0, abs=1e-9)
    assert raised[:, 0, 1] - lying[:, 0, 1] == pytest.approx(0.17, abs=1e-9)
    sunk = walk.copy()
    sunk[:, TOES, 1] -= 0.1
    assert out_of_floor(sunk) is sunk


def test_the_uniform_person_starts_at_the_origin_at_20_per_second(walk: np.ndarray) -> None:
    person = uniform_person(np.repeat(walk, 3, axis=0) + np.array([3.0, 0.0, -2.0]), 60.0)
    assert len(person) == pytest.approx(len(walk), abs=1)
    assert person[0, 0, [0, 2]] == pytest.approx([0, 0], abs=1e-6)
