"""Tables by names of joints: every joint of the person is found, on both sides, and chains lead to their bases."""

import pytest

from motionloom.core.skeleton import SMPL22
from motionloom.kinematics import costs

TABLES = (costs.BALL_TURN, costs.HINGE_TURN, costs.BONE_SWING, costs.SLACK, costs.REACH, costs.BASE)


def test_a_name_without_a_side_stands_for_both() -> None:
    assert costs.numbers("neck") == (SMPL22.index("neck"),)
    assert costs.numbers("knee") == (SMPL22.index("left_knee"), SMPL22.index("right_knee"))
    with pytest.raises(ValueError, match="tail"):
        costs.numbers("tail")


@pytest.mark.parametrize("table", TABLES)
def test_tables_treat_both_sides_alike(table) -> None:
    found, mirror = costs.by_number(table), SMPL22.mirror_pairs()
    assert all(found[mirror[joint]] == value for joint, value in found.items())


def test_reach_is_measured_from_a_joint_on_the_way_to_the_root() -> None:
    for joint, name in costs.by_number(costs.BASE).items():
        at, base = joint, costs.beside(joint, name)
        while at != base:
            at = SMPL22.parents[at]
            assert at >= 0, SMPL22.names[joint]


def test_every_joint_that_moves_turns_freely_or_bends() -> None:
    moved = {*costs.by_number(costs.BALL_TURN), *costs.by_number(costs.HINGE_TURN)}
    ends = {"head", "left_wrist", "right_wrist", "left_foot", "right_foot"}
    assert {SMPL22.names[joint] for joint in range(len(SMPL22)) if joint not in moved} == ends
