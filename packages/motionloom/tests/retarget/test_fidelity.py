"""Copies of made-up people against themselves: what size, place, heading and build change, and what a fold does."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.io import load
from motionloom.retarget import joints22, to_smpl22
from motionloom.retarget.fidelity import compare
from tests.kinematics import people
from tests.shared import shared

SPINE_UP = [3, 6, 9, *range(12, 22)]


@pytest.fixture(scope="module")
def walk() -> np.ndarray:
    return people.walking(1.2)


def tilted(positions: np.ndarray, joints: list[int], degrees: float) -> np.ndarray:
    """Some joints turned by an angle, forward about the middle of the hips."""
    middle = positions[:, [1, 2]].mean(axis=1, keepdims=True)
    turn = rot.rotvec_to_quat(np.array([np.radians(degrees), 0.0, 0.0]))
    result = positions.copy()
    result[:, joints] = rot.rotate(turn, positions[:, joints] - middle) + middle
    return result


def test_another_size_place_and_heading_are_no_error(walk: np.ndarray) -> None:
    other = people.spun(walk, np.full(len(walk), 2.0)) * 1.3 + [5.0, 0.2, -3.0]
    seen = compare(walk, other)
    assert max(spread.high for spread in (*seen.directions.values(), *seen.by_leg.values())) < 0.01
    assert seen.faults() == []


@pytest.mark.parametrize("axes", [(2, 0, 1), (1, 2, 0)])  # the old z becomes x, y and z in turn
def test_a_recording_with_another_axis_up_is_set_upright(walk: np.ndarray, axes: tuple[int, ...]) -> None:
    assert compare(walk[..., axes], walk).directions["all"].high < 0.01


@pytest.mark.parametrize("degrees", [12.0, 35.0])
def test_a_trunk_that_leans_is_told_by_its_angle(walk: np.ndarray, degrees: float) -> None:
    seen = compare(walk, tilted(walk, [0, *SPINE_UP], degrees))
    assert seen.directions["trunk"].median == pytest.approx(degrees, abs=0.1)
    assert seen.directions["thigh"].high < 0.1
    assert any(fault.startswith("trunk") for fault in seen.faults())


def test_a_folded_pelvis_is_told_though_all_else_is_straight(walk: np.ndarray) -> None:
    """The fault that a quarter of the recordings once had: hips in front of the pelvis instead of under it."""
    seen = compare(walk, tilted(walk, [0], -88.0))
    assert seen.directions["pelvis"].median > 55
    assert seen.directions["all"].high < 0.1
    (fault,) = seen.faults()
    assert fault.startswith("pelvis")


def bending(walk: np.ndarray, place: tuple[float, float], follows: float = 0.4) -> np.ndarray:
    """Somebody who walks and bends down by 80 degrees, the pelvis by a share of it.

    place: metres up and ahead of the hips at which the joint called pelvis is on this rig, where nothing bends.
    """
    result = walk.copy()
    result[:, 0] = walk[:, [1, 2]].mean(axis=1) + np.array([0.0, *place])
    lean = 80 * np.sin(np.linspace(0, np.pi, len(walk))) ** 2
    for frame, degrees in enumerate(lean):
        one = slice(frame, frame + 1)
        result[one] = tilted(tilted(result[one], SPINE_UP, degrees), [0], follows * degrees)
    return result


PLACES = {
    "behind and above": (0.041, -0.034),
    "ahead and above": (0.05, 0.03),
    "high": (0.15, -0.01),
    "behind": (0.0, -0.06),
    "below": (-0.05, -0.03),
    "far below": (-0.09, 0.0),
}
"""Of rigs on which everybody bends alike."""


@pytest.mark.parametrize("place", PLACES.values(), ids=PLACES)
def test_where_a_rig_has_its_pelvis_is_no_error(walk: np.ndarray, place: tuple[float, float]) -> None:
    body = bending(walk, (0.09, -0.005))
    seen = compare(bending(walk, place), body)
    assert seen.directions["pelvis"].high < 0.1
    assert seen.faults() == []


@pytest.mark.parametrize("place", PLACES.values(), ids=PLACES)
@pytest.mark.parametrize("fault", ["folded", "does not follow", "a side lower"])
def test_a_pelvis_that_moves_otherwise_is_told_on_every_rig(
    walk: np.ndarray, place: tuple[float, float], fault: str
) -> None:
    body = bending(walk, (0.09, -0.005), follows=1.8 if fault == "does not follow" else 0.4)
    if fault == "folded":
        body = tilted(body, [0], 88.0)
    if fault == "a side lower":
        body[:, 0] += [0.06, -0.02, 0.0]
    faults = compare(bending(walk, place), body).faults()
    assert any(text.startswith("pelvis") for text in faults)


def test_an_arm_that_hangs_on_one_side_alone_is_a_fault(walk: np.ndarray) -> None:
    raised = walk.copy()
    raised[:, [18, 20]] = walk[:, [16]] + [[0.27, 0.0, 0.0], [0.53, 0.0, 0.0]]
    seen = compare(walk, raised)
    assert seen.directions["forearm"].high == pytest.approx(90, abs=0.5)
    assert any("forearm" in fault for fault in seen.faults())


def test_longer_arms_are_no_error(walk: np.ndarray) -> None:
    long = walk.copy()
    for shoulder, elbow, wrist in ((16, 18, 20), (17, 19, 21)):
        for joint in (elbow, wrist):
            long[:, joint] = walk[:, shoulder] + 1.3 * (walk[:, joint] - walk[:, shoulder])
    seen = compare(walk, long)
    assert seen.places["wrist"].high < 0.1
    assert seen.by_leg["wrist"].median == pytest.approx(0.3 * 53, abs=1)
    assert seen.faults() == []


@pytest.mark.parametrize(("degrees", "fault"), [(15.0, False), (60.0, True)])
def test_feet_may_slope_otherwise_but_not_stand_on_heels(walk: np.ndarray, degrees: float, fault: bool) -> None:
    bent = walk.copy()
    turn = rot.rotvec_to_quat(np.array([-np.radians(degrees), 0.0, 0.0]))
    for ankle, toe in ((7, 10), (8, 11)):
        bent[:, toe] = walk[:, ankle] + rot.rotate(turn, walk[:, toe] - walk[:, ankle])
    assert any("foot" in text for text in compare(walk, bent).faults()) is fault


def test_motions_of_unlike_length_or_without_legs_are_refused(walk: np.ndarray) -> None:
    with pytest.raises(MotionloomError, match="same moments"):
        compare(walk, walk[1:])
    with pytest.raises(MotionloomError, match="legs have no length"):
        compare(np.zeros_like(walk), walk)


def test_a_recording_on_the_uniform_person_is_a_true_copy_and_one_with_its_pelvis_turned_is_not() -> None:
    motion = load(shared("data/bandai/dataset-2/dataset-2_walk_normal_002.bvh"), unit=0.01)
    person = to_smpl22(motion)
    assert compare(joints22(motion), person.positions()).faults() == []
    turns = person.rotations.copy()
    fold = rot.rotvec_to_quat(np.array([np.radians(-80.0), 0.0, 0.0]))
    turns[:, 0] = rot.multiply(turns[:, 0], fold)
    for joint in (1, 2, 3):  # everything on the pelvis stays as it was
        turns[:, joint] = rot.multiply(rot.inverse(fold), turns[:, joint])
    assert compare(joints22(motion), replace(person, rotations=turns).positions()).faults()
