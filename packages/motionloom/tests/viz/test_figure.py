"""Which joints are drawn as arms, legs and trunk: the same whatever somebody does."""

import numpy as np
import pytest

from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.viz.figure import figure


def posed(turn: tuple[float, float, float, float], height: float) -> Motion:
    """The standing person, turned as a whole, the pelvis so high."""
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (20, 22, 1))
    rotations[:, 0] = turn
    root = np.zeros((20, 3))
    root[:, 1] = height
    return Motion(SMPL22, 20.0, root, rotations)


HALF = np.sqrt(0.5)


@pytest.mark.parametrize(
    "motion",
    [
        posed((1.0, 0.0, 0.0, 0.0), 0.95),
        posed((HALF, HALF, 0.0, 0.0), 0.3),
        posed((HALF, 0.0, 0.0, HALF), 0.2),
        posed((0.0, 1.0, 0.0, 0.0), 1.0),
    ],
    ids=["stands", "lies", "lies on a side", "stands on the hands"],
)
def test_a_body_is_the_same_body_however_it_lies(motion: Motion) -> None:
    drawn = figure(motion)
    assert {SMPL22.names[joint] for joint in drawn.chest} == {"left_shoulder", "right_shoulder", "spine3"}
    assert {SMPL22.names[joint] for joint in drawn.hips} == {"left_hip", "right_hip", "pelvis"}
    assert SMPL22.names.index("spine2") in drawn.trunk


def test_limbs_that_all_leave_one_joint_are_told_apart_by_where_they_reach() -> None:
    """A figure of sticks, whose arms and legs begin at one joint."""
    names = [
        "hips",
        *(f"{side} {part}" for side in ("left", "right") for part in ("arm", "elbow", "hand", "leg", "knee", "foot")),
    ]
    parents = [-1, 0, 1, 2, 0, 4, 5, 0, 7, 8, 0, 10, 11]
    arm, leg = [[0.2, 0.4, 0], [0.3, 0, 0], [0.3, 0, 0]], [[0.1, -0.1, 0], [0, -0.4, 0], [0, -0.4, 0]]
    mirrored = [[-x, y, z] for x, y, z in arm + leg]
    skeleton = Skeleton(tuple(names), tuple(parents), np.array([[0, 0, 0], *arm, *leg, *mirrored], float))
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (4, len(names), 1))
    drawn = figure(Motion(skeleton, 20.0, np.tile([0.0, 0.9, 0.0], (4, 1)), rotations))
    assert {names[joint] for joint in drawn.chest} >= {"left arm", "right arm"}
    assert {names[joint] for joint in drawn.hips} >= {"left leg", "right leg"}
