"""A skeleton is a checked tree, and SMPL22 is a person."""

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.skeleton import HUMANML_BONE_LENGTHS, SMPL22, Skeleton

REST = dict(zip(SMPL22.names, SMPL22.rest_positions()))


def chain(*names: str) -> Skeleton:
    return Skeleton(names, tuple(range(-1, len(names) - 1)), np.ones((len(names), 3)))


def test_smpl22_has_the_published_bone_lengths() -> None:
    assert np.allclose(SMPL22.bone_lengths()[1:], HUMANML_BONE_LENGTHS)


def test_smpl22_stands_on_the_floor_in_a_t_pose_facing_z_with_its_left_at_x() -> None:
    assert min(place[1] for place in REST.values()) == pytest.approx(0.0, abs=0.005)
    assert REST["left_wrist"][0] > 0.6 > -0.6 > REST["right_wrist"][0]
    assert REST["left_wrist"][1] == pytest.approx(REST["left_shoulder"][1])
    assert (REST["left_foot"] - REST["left_ankle"])[2] > 0.1
    assert 1.3 < REST["head"][1] < 1.7


def test_smpl22_is_the_same_on_both_sides_up_to_the_published_lengths() -> None:
    pairs = list(SMPL22.mirror_pairs())
    assert np.allclose(SMPL22.offsets[pairs] * [-1, 1, 1], SMPL22.offsets, atol=0.01)


def test_mirror_pairs_are_their_own_inverse_and_swap_the_groups() -> None:
    pairs = SMPL22.mirror_pairs()
    assert [pairs[p] for p in pairs] == list(range(22))
    assert {pairs[j] for j in SMPL22.groups["left_arm"]} == set(SMPL22.groups["right_arm"])
    assert pairs[SMPL22.index("spine1")] == SMPL22.index("spine1")


@pytest.mark.parametrize(
    ("left", "right"),
    [
        ("mixamorig:LeftUpLeg", "mixamorig:RightUpLeg"),
        ("thigh_l", "thigh_r"),
        ("upper_leg_l", "upper_leg_r"),
        ("lower_leg.l", "lower_leg.r"),
        ("Bip01 L Clavicle", "Bip01 R Clavicle"),
        ("lfemur", "rfemur"),
        ("LHipJoint", "RHipJoint"),
        ("UpperArm_L", "UpperArm_R"),
        ("J_Bip_L_LowerLeg", "J_Bip_R_LowerLeg"),
        ("leftEye End Site", "rightEye End Site"),
    ],
)
def test_sides_are_read_from_names(left: str, right: str) -> None:
    skeleton = chain("root", left, right, "lowerback")
    assert skeleton.mirror_pairs() == (0, 2, 1, 3)


def test_groups_and_names_resolve_in_skeleton_order_without_doubles() -> None:
    assert SMPL22.resolve(["head", "left_leg", "left_knee"]) == (1, 4, 7, 10, 15)


def test_an_unknown_joint_lists_the_joints() -> None:
    with pytest.raises(MotionloomError, match=r"no joint 'lwrist'; the joints are pelvis, left_hip"):
        SMPL22.index("lwrist")


@pytest.mark.parametrize(
    ("names", "parents", "offsets", "said"),
    [
        ((), (), np.zeros((0, 3)), "at least one"),
        (("a", "b"), (-1,), np.zeros((2, 3)), "as many"),
        (("a", "a"), (-1, 0), np.zeros((2, 3)), "unique"),
        (("a", "b"), (-1, -1), np.zeros((2, 3)), "only root"),
        (("a", "b", "c"), (-1, 2, 1), np.zeros((3, 3)), "before children"),
        (("a", "b"), (-1, 0), np.full((2, 3), np.nan), "finite"),
    ],
)
def test_what_is_no_tree_is_refused(names: tuple, parents: tuple, offsets: np.ndarray, said: str) -> None:
    with pytest.raises(MotionloomError, match=said):
        Skeleton(names, parents, offsets)


def test_equal_skeletons_are_equal_by_value() -> None:
    again = Skeleton(SMPL22.names, SMPL22.parents, SMPL22.offsets.copy())
    assert again == SMPL22
    assert again != Skeleton(SMPL22.names, SMPL22.parents, SMPL22.offsets * 2)


def test_children_and_rest_positions_follow_the_tree() -> None:
    assert SMPL22.children(9) == (12, 13, 14)
    assert [SMPL22.children(j) for j in range(22)] == [
        tuple(k for k in range(22) if SMPL22.parents[k] == j) for j in range(22)
    ]
    assert np.allclose(chain("a", "b", "c").rest_positions(), [[1, 1, 1], [2, 2, 2], [3, 3, 3]])
