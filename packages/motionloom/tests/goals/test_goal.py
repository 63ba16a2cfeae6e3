"""Goals as values: turning the world, putting targets together, where the person starts."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom.core.ground import GroundPose
from motionloom.core.motion import ground_pose
from motionloom.core.skeleton import SMPL22
from motionloom.goals.goal import (
    Goal,
    joined,
    merged,
    overlaid,
    start_of,
    turn_between,
)

PLACES = st.builds(GroundPose, *[st.floats(-50, 50)] * 2, st.floats(-7, 7))


def asking(frame: int, joint: str, place: list[float], frames: int = 10) -> Goal:
    goal = Goal.nothing(frames)
    goal.positions[frame, SMPL22.index(joint)] = place
    goal.mask[frame, SMPL22.index(joint)] = True
    return goal


def facing(frame: int, angle: float, frames: int = 10) -> Goal:
    goal = Goal.nothing(frames)
    goal.facing[frame], goal.facing_mask[frame] = angle, True
    return goal


def test_a_quarter_turn_sends_forward_to_the_left() -> None:
    """+Z becomes +X, +X becomes -Z, and the height stays."""
    quarter = GroundPose(1.0, 2.0, np.pi / 2)
    assert np.allclose(quarter.to_world([[0, 5, 1], [1, 0, 0]]), [[2, 5, 2], [1, 0, 1]])


@given(PLACES, st.lists(st.floats(-9, 9), min_size=3, max_size=3))
def test_to_the_world_and_back_is_nothing(place: GroundPose, point: list[float]) -> None:
    assert np.allclose(place.from_world(place.to_world(point)), point, atol=1e-9)
    assert np.allclose(place.to_world(place.from_world(point)), point, atol=1e-9)


@given(PLACES, PLACES)
def test_a_goal_seen_from_two_places_is_the_same_goal(first: GroundPose, second: GroundPose) -> None:
    """Seen from the second as the first sees it, it is what the second sees."""
    goal = replace(merged(asking(3, "head", [1, 2, 3]), facing(3, 0.5)), start=GroundPose(1, 2, 0.25))
    here = goal.relative_to(first).relative_to(second.seen_from(first))
    there = goal.relative_to(second)
    assert np.allclose(here.positions[goal.mask], there.positions[goal.mask], atol=1e-8)
    assert np.allclose(turn_between(here.facing[3], there.facing[3]), 0, atol=1e-9)
    assert here.start is not None
    assert there.start is not None
    assert np.allclose([here.start.x, here.start.z], [there.start.x, there.start.z], atol=1e-8)


def test_one_horizontal_coordinate_cannot_be_turned() -> None:
    goal = asking(0, "head", [1, 2, 3])
    goal.mask[0, 15, 0] = False
    assert goal.relative_to(GroundPose(1, 1, 0.0)).positions[0, 15, 1] == 2
    with pytest.raises(MotionloomError, match="only one of x and z"):
        goal.relative_to(GroundPose(0, 0, 1.0))


def test_parts_of_a_goal_keep_their_frames() -> None:
    goal = replace(asking(3, "head", [1, 2, 3]), start=GroundPose(1, 0, 0))
    assert goal.crop(2, 5).mask[1, 15].all()
    assert goal.crop(2, 5).start is None
    assert goal.crop(0, 5).start == goal.start
    assert goal.padded(4, 2).mask[7, 15].all()
    assert len(goal.padded(4, 2)) == 16
    assert goal.padded(1, 0).start is None
    assert goal.padded(0, 1).start == goal.start
    assert goal.joints == ("head",)
    assert Goal.nothing(3).empty


def test_both_targets_are_in_merged_goals() -> None:
    both = merged(asking(3, "head", [1, 2, 3]), merged(asking(4, "neck", [4, 5, 6]), facing(2, 1.5)))
    assert both.positions[3, 15].tolist() == [1, 2, 3]
    assert both.positions[4, 12].tolist() == [4, 5, 6]
    assert (both.mask.sum(), both.facing[2], both.facing_mask.sum()) == (6, 1.5, 1)


@pytest.mark.parametrize(
    ("second", "sentence"),
    [
        (asking(3, "head", [1, 2.02, 3]), "head at 0.15 s .* 0.02 m apart"),
        (facing(3, 0.3), "at 0.15 s .* 17 degrees apart"),
        (replace(Goal.nothing(10), start=GroundPose(0, 1, 0)), "start in two places 1.00 m and 0 degrees"),
        (Goal.nothing(9), "10 and 9 frames"),
    ],
    ids=["place", "facing", "start", "length"],
)
def test_contradictions_are_reported(second: Goal, sentence: str) -> None:
    first = replace(merged(asking(3, "head", [1, 2, 3]), facing(3, 0)), start=GroundPose())
    with pytest.raises(MotionloomError, match=sentence):
        merged(first, second)


def test_agreeing_goals_are_no_contradiction() -> None:
    """A whole turn is no turn."""
    first, second = merged(asking(3, "head", [1, 2, 3]), facing(3, 0)), facing(3, 2 * np.pi)
    assert merged(first, merged(second, asking(3, "head", [1.005, 2, 3]))).positions[3, 15, 0] == 1


def test_the_place_of_a_goal() -> None:
    """Told, then asked at frame 0, then the way that the path sets out; where nobody asks, the origin."""
    path = Goal.nothing(10)
    path.positions[:, 0, 0] = 3 + np.arange(10) * 0.04
    path.positions[:, 0, 2] = -1 - np.arange(10) * 0.04
    path.mask[:, 0, ::2] = True
    assert start_of(path) == GroundPose(3, -1, pytest.approx(3 * np.pi / 4))
    assert start_of(merged(path, facing(0, 1.0))) == GroundPose(3, -1, 1.0)
    assert start_of(replace(path, start=GroundPose(1, 2, 3))) == GroundPose(1, 2, 3)
    assert start_of(Goal.nothing(4)) == start_of(path.crop(4, 9).padded(1, 0)) == GroundPose()


@given(PLACES)
def test_a_whole_pose_says_where_the_person_stands(place: GroundPose) -> None:
    goal = Goal.nothing(2)
    goal.positions[0], goal.mask[0] = place.to_world(SMPL22.rest_positions()), True
    start = start_of(goal)
    assert (start.x, start.z) == pytest.approx((place.x, place.z), abs=1e-9)
    assert abs(turn_between(start.facing, place.facing)) < 1e-3


def test_the_left_side_is_left_of_where_a_body_faces() -> None:
    """Seen from above the left hip and shoulder of somebody who faces +X are at -Z."""
    places = np.zeros((22, 3))
    places[[1, 16], 2], places[[2, 17], 2] = -0.2, 0.2
    assert ground_pose(places).facing == pytest.approx(np.pi / 2)


def test_goals_of_the_wrong_shape_or_not_finite_are_refused() -> None:
    goal = asking(0, "head", [1, 2, 3])
    with pytest.raises(MotionloomError, match="fit each other"):
        replace(goal, facing=np.zeros(3))
    with pytest.raises(MotionloomError, match="not finite"):
        replace(goal, positions=np.full((10, 22, 3), np.nan))


def test_joined_goals_are_one_behind_the_other() -> None:
    """Cut anywhere and joined, a goal is itself; the second's start is nobody's."""
    goal = replace(merged(asking(3, "head", [1, 2, 3]), facing(6, 0.5)), start=GroundPose(1, 2, 3))
    for cut in range(1, 10):
        again = joined(goal.crop(0, cut), replace(goal.crop(cut, 10), start=GroundPose(9, 9, 9)))
        assert np.array_equal(again.positions, goal.positions)
        assert np.array_equal(again.mask, goal.mask)
        assert np.array_equal(again.facing, goal.facing)
        assert np.array_equal(again.facing_mask, goal.facing_mask)
        assert again.start == goal.start
    assert len(joined(Goal.nothing(2), Goal.nothing(5))) == 7


def test_of_overlaid_goals_the_first_one_counts() -> None:
    first, second = (
        merged(asking(3, "head", [1, 2, 3]), facing(2, 1.5)),
        merged(asking(3, "head", [7, 8, 9]), facing(2, 0)),
    )
    first.mask[3, 15, 1] = False
    both = overlaid(first, merged(second, merged(asking(4, "neck", [4, 5, 6]), facing(5, 0.25))))
    assert both.positions[3, 15].tolist() == [1, 8, 3]
    assert both.positions[4, 12].tolist() == [4, 5, 6]
    assert (both.facing[2], both.facing[5], both.mask.sum(), both.facing_mask.sum()) == (1.5, 0.25, 6, 2)
    here, there = (replace(goal, start=GroundPose(x)) for goal, x in ((first, 1.0), (second, 2.0)))
    assert [overlaid(*pair).start for pair in ((here, there), (first, there), (here, second))] == [
        GroundPose(1.0),
        GroundPose(2.0),
        GroundPose(1.0),
    ]


def test_placing_a_goal_turns_and_moves_it() -> None:
    """One ahead of somebody at (5, 7) who faces +X is at (6, 7), and a facing of 0.5 is a quarter turn more."""
    goal = replace(merged(asking(3, "head", [0, 2, 1]), facing(3, 0.5)), start=GroundPose(1, 0, 0.25))
    placed = goal.placed(GroundPose(5, 7, np.pi / 2))
    assert placed.positions[3, 15] == pytest.approx([6, 2, 7])
    assert placed.facing[3] == pytest.approx(0.5 + np.pi / 2)
    assert placed.start == GroundPose(pytest.approx(5), pytest.approx(6), pytest.approx(0.25 + np.pi / 2))


@given(PLACES)
def test_a_goal_placed_and_seen_from_there_is_itself(place: GroundPose) -> None:
    goal = merged(asking(3, "head", [1, 2, 3]), facing(3, 0.5))
    again = goal.placed(place).relative_to(place)
    assert np.allclose(again.positions[goal.mask], goal.positions[goal.mask], atol=1e-8)
    assert again.facing[3] == pytest.approx(0.5)
