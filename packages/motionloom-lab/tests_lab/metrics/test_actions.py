"""The row of numbers: every number has a meaning, and directions do not depend on how the world is turned."""

import numpy as np
import pytest

from motionloom_lab.metrics.actions import MEANING, measure
from tests.kinematics.people import FPS, circling, jumping, moved, spun, standing, walking


def test_every_number_is_explained_and_every_explanation_has_a_number() -> None:
    assert set(measure(standing(), FPS)) == set(MEANING)


@pytest.mark.parametrize("frames", [1, 2, 5])
def test_very_short_clips_give_finite_numbers(frames: int) -> None:
    assert np.isfinite(list(measure(standing()[:frames], FPS).values())).all()


@pytest.mark.parametrize("person", [walking(1.2), circling(1.0, 1.0), jumping(0.3)], ids=["walk", "circle", "jump"])
def test_nothing_changes_when_the_world_is_turned_and_moved(person: np.ndarray) -> None:
    angle, shift = 1.1, np.array([3.0, 0.0, -2.0])
    sin, cos = np.sin(angle), np.cos(angle)
    matrix = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    there = measure(person @ matrix.T + shift, FPS)
    assert there == pytest.approx(measure(person, FPS), abs=2e-4)


def test_backwards_and_sideways_are_told_from_forward() -> None:
    back = measure(moved(spun(standing(), np.full(80, np.pi)), np.linspace(0, 2, 80)[:, None] * [0, 0, 1.0]), FPS)
    side = measure(moved(standing(), np.linspace(0, 2, 80)[:, None] * [1.0, 0, 0]), FPS)
    assert back["advance"] == pytest.approx(-2, rel=0.05)
    assert back["facing_share"] == pytest.approx(-1, rel=0.05)
    assert (side["sidestep"], side["side_share"]) == pytest.approx((2, 1), rel=0.05)
    assert abs(side["facing_share"]) < 0.01


def test_standing_is_at_rest_in_every_number_of_movement() -> None:
    row = measure(standing(), FPS)
    still = ("travel", "pace", "turn", "winding", "flights", "steps", "hops", "wave_swings", "punch_speed", "rise")
    assert row["stir"] == 0
    assert [row[name] for name in still] == [0] * len(still)
