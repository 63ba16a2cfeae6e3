"""The uniform person of a recording: bodies that lie in the floor."""

import numpy as np
import pytest

from motionloom.core.features import humanml as hml
from motionloom_train.data.person import out_of_floor, uniform_person
from tests.kinematics import people


@pytest.fixture(scope="module")
def walk() -> np.ndarray:
    return hml.uniform(people.walking(1.2, 4.0))


def test_a_body_in_the_floor_is_raised_and_feet_do_not_count(walk: np.ndarray) -> None:
    lying = walk.copy()
    lying[..., 1] = 0.1 + 0.1 * (lying[..., 1] - 0.9)
    lying[:, 18, 1] = -0.17
    raised = out_of_floor(lying)
    assert raised[:, 18, 1] == pytest.approx(0, abs=1e-9)
    assert raised[:, 0, 1] - lying[:, 0, 1] == pytest.approx(0.17, abs=1e-9)
    sunk = walk.copy()
    sunk[:, [10, 11], 1] -= 0.1
    assert out_of_floor(sunk) is sunk


def test_who_falls_into_the_floor_stands_on_it_before(walk: np.ndarray) -> None:
    """Raised from beginning to end, somebody would float before a fall."""
    fallen = walk.copy()
    fallen[40:, :, 1] = 0.05 + 0.1 * (walk[40:, :, 1] - 0.9)
    fallen[40:, 12, 1] = -0.12
    raised = out_of_floor(fallen)
    assert np.array_equal(raised[:19], fallen[:19])
    assert raised[40:, 12, 1].min() >= -1e-9
    assert raised[45:, 12, 1].max() < 0.01
    assert np.abs(np.diff(raised[:, 0, 1] - fallen[:, 0, 1])).max() < 0.02


def test_the_uniform_person_starts_at_the_origin_at_20_per_second(walk: np.ndarray) -> None:
    person = uniform_person(np.repeat(walk, 3, axis=0) + np.array([3.0, 0.0, -2.0]), 60.0)
    assert len(person) == pytest.approx(len(walk), abs=1)
    assert person[0, 0, [0, 2]] == pytest.approx([0, 0], abs=1e-6)
