"""Two bones reach where they can, with the middle joint on the side of the pole."""

import numpy as np
import pytest

from motionloom.retarget.limbs import bend


def test_a_right_angled_limb_is_three_four_five() -> None:
    start, goal, pole = np.zeros(3), np.array([5.0, 0.0, 0.0]), np.array([0.3, 2.0, 0.0])
    middle, end = bend(start, goal, pole, upper=3.0, lower=4.0)
    assert np.allclose(middle, [1.8, 2.4, 0.0])
    assert np.allclose(end, goal)


def test_bones_keep_their_lengths_wherever_the_goal_is() -> None:
    random = np.random.default_rng(0)
    start, goal, pole = random.normal(size=(3, 500, 3))
    middle, end = bend(start, goal, pole, upper=0.4, lower=0.3)
    assert np.allclose(np.linalg.norm(middle - start, axis=-1), 0.4)
    assert np.allclose(np.linalg.norm(end - middle, axis=-1), 0.3)
    reachable = np.linalg.norm(goal - start, axis=-1)
    inside = (reachable > 0.1001) & (reachable < 0.6999)
    assert np.allclose(end[inside], goal[inside])


def test_a_goal_too_far_is_approached_on_the_straight_line() -> None:
    goal = np.array([0.0, -2.0, 0.0])
    middle, end = bend(np.zeros(3), goal, np.array([0.0, 0.0, 1.0]), upper=0.4, lower=0.4)
    assert np.allclose(end, [0.0, -0.8, 0.0], atol=1e-6)
    assert np.allclose(middle, [0.0, -0.4, 0.0], atol=1e-4)
    assert middle[2] >= 0.0


@pytest.mark.parametrize("size", [1e-3, 1.0, 50.0])
def test_only_the_direction_of_the_pole_counts(size: float) -> None:
    pole = size * np.array([0.0, 0.0, 1.0])
    middle, _ = bend(np.zeros(3), np.array([0.0, -0.6, 0.0]), pole, upper=0.4, lower=0.4)
    assert middle[2] == pytest.approx(np.sqrt(0.4**2 - 0.3**2))
