"""Who has a person's body and who has not: the rest pose, people bent in every way, real people, and folded ones."""

from pathlib import Path

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.skeleton import SMPL22
from motionloom.io import load
from motionloom.kinematics.physics import J
from motionloom.kinematics.wholeness import ENOUGH, angles, broken_frames, shoulders_below, whole_frames, wholeness
from motionloom.retarget import joints22, to_smpl22
from tests.kinematics import people
from tests.shared import shared

REST = SMPL22.rest_positions()[None]
DRAWN = (
    np.array(
        [
            [0, 88, 0],
            [7, 88, 8],
            [-6, 87, 8],
            [0, 86, -13],
            [11, 49, 10],
            [-10, 49, 10],
            [0, 100, -11],
            [15, 6, 6],
            [-13, 6, 6],
            [-1, 106, -10],
            [17, 0, 19],
            [-14, 0, 19],
            [-1, 127, -5],
            [7, 117, -7],
            [-8, 117, -7],
            [-1, 137, -1],
            [17, 110, -5],
            [-19, 108, -5],
            [25, 87, -10],
            [-26, 84, -10],
            [25, 61, -2],
            [-25, 60, -3],
        ]
    )[None]
    / 100
)
"""Centimetres: "a person stands still" of weights that had learned from folded recordings (seed 0, after 2 s)."""


def turned(positions: np.ndarray, joints: list[str], pivot: str, degrees: float) -> np.ndarray:
    """Some joints turned about another one, forwards about the x axis."""
    numbers, centre = [J[name] for name in joints], positions[:, [J[pivot]]]
    turn = rot.rotvec_to_quat(np.array([np.radians(degrees), 0.0, 0.0]))
    result = positions.copy()
    result[:, numbers] = rot.rotate(turn, positions[:, numbers] - centre) + centre
    return result


def wrong(positions: np.ndarray) -> set[str]:
    return {name for name, frames in broken_frames(positions).items() if frames.any()}


def test_the_rest_pose_and_somebody_who_stands_are_whole() -> None:
    assert whole_frames(REST).all()
    assert wholeness(people.standing()) == wholeness(people.walking(1.2)) == 1.0


def test_somebody_who_lies_or_stands_on_the_head_is_as_whole_as_upright() -> None:
    for degrees in (90.0, -90.0, 180.0):
        assert whole_frames(turned(REST, list(SMPL22.names), "pelvis", degrees)).all()


def test_a_drawn_person_with_a_folded_pelvis_is_not_whole() -> None:
    assert {"pelvis", "trunk"} <= wrong(DRAWN)
    assert angles(DRAWN).pelvis[0] == pytest.approx(56, abs=2)


@pytest.mark.parametrize(
    ("joints", "pivot", "degrees", "part"),
    [
        (["left_ankle", "left_foot"], "left_knee", -60.0, "knees"),
        (["right_ankle", "right_foot"], "right_knee", 175.0, "knees"),
        (["head"], "spine2", 150.0, "head"),
    ],
)
def test_a_joint_bent_as_nobody_bends_is_told(joints: list[str], pivot: str, degrees: float, part: str) -> None:
    assert part in wrong(turned(people.standing(0.1), joints, pivot, degrees))


def test_shoulders_halfway_down_the_ribs_are_not_whole() -> None:
    person = people.standing(0.1)
    arms = [J[f"{side}_{joint}"] for side in ("left", "right") for joint in ("shoulder", "elbow", "wrist")]
    low = person.copy()
    low[:, arms, 1] -= 0.09
    assert wrong(person) == set()
    assert wrong(low) == {"shoulders"}
    assert shoulders_below(low)[0] - shoulders_below(person)[0] == pytest.approx(0.09 / 0.55, abs=0.01)


def test_knees_bend_to_the_back_and_elbows_to_the_front() -> None:
    person = people.standing(0.1)
    assert wrong(turned(person, ["left_ankle", "left_foot"], "left_knee", 140.0)) == set()
    assert wrong(turned(person, ["left_wrist"], "left_elbow", -150.0)) == set()
    assert wrong(turned(person, ["left_wrist"], "left_elbow", -175.0)) == {"elbows"}
    assert angles(turned(person, ["left_wrist"], "left_elbow", -90.0)).elbows[0, 0] == pytest.approx(90)


def test_nothing_of_size_place_or_heading_counts() -> None:
    person = people.walking(1.2)
    other = people.spun(person, np.linspace(0, 7, len(person))) * 3.1 + [1.0, -2.0, 5.0]
    for here, there in zip(broken_frames(person).values(), broken_frames(other).values(), strict=True):
        np.testing.assert_array_equal(here, there)


POSTURES = (
    "data/cmu/asf_amc/49/49_07.amc",  # a cartwheel
    "data/cmu/asf_amc/127/127_23.amc",  # a dive and a roll
    "data/cmu/asf_amc/14/14_30.amc",  # sits with an ankle on the other knee
    "data/bandai/dataset-1/dataset-1_bow_normal_001.bvh",
    "data_more/accad/accad_Male2_A11_Crawl.bvh",
    "data_more/accad/accad_Male2_A9_Lie.bvh",
    "data_more/accad/accad_Male1_A8_CrouchToLie.bvh",
    "data_more/accad_female/acf_crawl_forward.bvh",
    "data_more/ui_prmd/ui_m05_s06_r06-08.bvh",  # sits down on a chair
    "data_more/cmu/asf_amc/88/88_01.amc",  # a backflip
    "data_third/g1_moves/g1_B_BowKarate.bvh",
)


@pytest.mark.parametrize("path", POSTURES, ids=lambda path: Path(path).stem)
def test_people_who_lie_crawl_sit_bow_and_tumble_are_whole(path: str) -> None:
    """On their own skeletons, and as the uniform person."""
    metres = {"ui_prmd": 1.0, "accad_female": 1.0}.get(Path(path).parent.name, 0.01)
    bvh = path.endswith(".bvh")
    motion = load(shared(path), fps=None if bvh else 30.0, unit=metres if bvh else None)
    assert wholeness(joints22(motion)) >= ENOUGH
    assert wholeness(to_smpl22(motion).positions()) >= ENOUGH
