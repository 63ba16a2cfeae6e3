"""Paths: closed forms of speed, place and facing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom.goals.paths import along, curve, even, lengths_along, root_path, through


def places(goal) -> np.ndarray:
    return goal.positions[:, 0, ::2]


@pytest.mark.parametrize(
    ("name", "length", "end"),
    [("line", 4, (0, 4)), ("circle", 4 * np.pi, (0, 0)), ("figure_eight", 4 * np.pi, (0, 0)), ("s", 2 * np.pi, (4, 0))],
    ids=["line", "circle", "figure_eight", "s"],
)
def test_named_curves_have_their_length_and_end(name: str, length: float, end: tuple[float, float]) -> None:
    points = curve(name, 4.0)
    assert lengths_along(points)[-1] == pytest.approx(length, rel=1e-4)
    assert points[-1] == pytest.approx(end, abs=1e-9)
    assert np.ptp(curve(name, 4.0)[:, 0]) == pytest.approx(0 if name == "line" else 4, abs=1e-4)
    assert points[1, 1] > 0  # it sets out along +Z
    assert curve(name, 4.0, turn="right")[1, 0] <= 0 <= points[1, 0]


def test_somebody_on_a_circle_turns_evenly_to_the_left() -> None:
    """After a quarter of a circle of 2 m the person is 1 m to the left, 1 m ahead, and faces left."""
    goal = root_path(curve("circle", 2.0), frames=101, smooth=False)
    assert places(goal)[25] == pytest.approx([1, 1], abs=1e-3)
    assert goal.facing == pytest.approx(np.linspace(0, 2 * np.pi, 101), abs=1e-3)
    steps = np.linalg.norm(np.diff(places(goal), axis=0), axis=-1)
    assert steps == pytest.approx(2 * np.pi / 100, rel=1e-3)
    assert goal.mask.sum() == 202


def test_a_stop_is_a_stop_and_nothing_overshoots() -> None:
    goal = root_path([[0, 0], [0, 2], [0, 2], [0, 3]], [0, 2, 3, 5], frames=101)
    z = places(goal)[:, 1]
    assert (z[40:61] == 2).all()
    assert (np.diff(z) >= 0).all()
    assert (z[0], z[-1]) == (0, 3)
    assert (goal.facing == 0).all()


@given(st.lists(st.tuples(st.floats(0.1, 2), st.floats(-3, 3)), min_size=1, max_size=8))
def test_between_two_times_a_coordinate_on_a_line_stays_between_its_points(steps: list[tuple[float, float]]) -> None:
    """Whatever the points: monotone pieces, and the points themselves are met."""
    times, points = np.cumsum([0.0, *(s[0] for s in steps)]), np.cumsum([0.0, *(s[1] for s in steps)])
    at = np.sort(np.concatenate([np.linspace(0, times[-1], 301), times]))
    places = through(points[:, None], times, at)[:, 0]
    assert places[np.searchsorted(at, times)] == pytest.approx(points, abs=1e-9)
    piece = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    assert (places >= np.minimum(points[piece], points[piece + 1]) - 1e-9).all()
    assert (places <= np.maximum(points[piece], points[piece + 1]) + 1e-9).all()


def test_a_turned_path_is_the_path_of_turned_points() -> None:
    """The curve through points does not care for the axes."""
    points, times = np.random.default_rng(0).normal(size=(6, 2)), np.array([0, 1, 1.5, 3, 3.2, 4])
    turn = np.array([[0.6, 0.8], [-0.8, 0.6]])
    at = np.linspace(0, 4, 81)
    assert np.allclose(through(points @ turn, times, at), through(points, times, at) @ turn)
    assert np.allclose(even(points @ turn, at / 4), even(points, at / 4) @ turn)


def test_straight_lines_have_corners_where_the_points_are() -> None:
    goal = root_path([[0, 0], [0, 2], [2, 2]], frames=81, smooth=False, facing="free")
    assert places(goal)[[20, 40, 60]].tolist() == [[0, 1], [0, 2], [1, 2]]
    assert not goal.facing_mask.any()


def test_frames_before_and_after_the_times_are_free() -> None:
    goal = root_path([[0, 0], [0, 1]], [1.0, 2.0], frames=61)
    assert np.flatnonzero(goal.mask[:, 0, 0]).tolist() == list(range(20, 41))
    goal = root_path([[0, 0], [0, 1]], frames=61, span=(0.5, 1.0))
    assert np.flatnonzero(goal.mask[:, 0, 0]).tolist() == list(range(10, 21))


def test_somebody_turns_while_standing_not_in_a_frame() -> None:
    """From +Z to +X in the second of the stop; at a corner without a stop within half a second."""
    stop = root_path([[0, 0], [0, 2], [0, 2], [2, 2]], [0, 2, 3, 5], frames=101, smooth=False)
    assert stop.facing[[20, 80]] == pytest.approx([0, np.pi / 2])
    assert stop.facing[50] == pytest.approx(np.pi / 4, abs=0.1)
    corner = root_path([[0, 0], [0, 2], [2, 2]], [0, 2.5, 5], frames=101, smooth=False)
    assert np.abs(np.diff(corner.facing)).max() < np.pi / 2 / 10


def test_facings_in_degrees_turn_as_written() -> None:
    goal = root_path([[0, 0], [0, 1], [0, 2]], [0, 1, 2], frames=41, facing=[0, 360, 0])
    assert np.degrees(goal.facing[[0, 10, 20, 30]]) == pytest.approx([0, 180, 360, 180])
    assert np.degrees(root_path([[0, 0], [0, 1]], frames=5, facing=-90).facing) == pytest.approx([-90] * 5)


def test_a_path_that_goes_nowhere_faces_nowhere() -> None:
    goal = root_path([[1, 2]], frames=5)
    assert places(goal).tolist() == [[1, 2]] * 5
    assert not goal.facing_mask.any()
    assert (along(np.zeros((4, 2)), 20) == 0).all()


def test_nobody_runs_faster_than_twelve_metres_a_second() -> None:
    with pytest.raises(MotionloomError, match=r"30\.0 m long and asks for 15\.0 m/s.*at least 2\.50 s"):
        root_path([[0, 0], [0, 30]], frames=41)
    with pytest.raises(MotionloomError, match=r"from 1\.00 to 2\.00 s"):
        root_path([[0, 0], [0, 1], [0, 14]], [0, 1, 2], frames=41)
    assert root_path([[0, 0], [0, 23]], frames=41).mask.any()


@pytest.mark.parametrize(
    ("points", "times"),
    [
        ([], None),
        ([[0, 0, 0]], None),
        ([[0, np.nan]], None),
        ([[0, 0], [1, 1]], [0.0]),
        ([[0, 0], [1, 1]], [1.0, 1.0]),
        ([[0, 0], [1, 1]], [7.0, 8.0]),
    ],
    ids=["none", "three", "nan", "times", "same", "late"],
)
def test_points_that_are_no_path_are_refused(points: list, times: list[float] | None) -> None:
    with pytest.raises(MotionloomError):
        root_path(points, times, frames=41)
