"""Poses of hands: fingers bend towards the palm by the angles that are said, whatever a rig's rest is."""

from pathlib import Path

import numpy as np
import pytest

from motionloom.cli import main
from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.io.bvh import load_bvh
from motionloom.retarget.hands import POSES, pose_hands
from tests.io.rigged import wave
from tests.shared import shared

FINGERS = ("Index", "Middle", "Ring", "Pinky")


def handed(names: tuple[str, ...] = FINGERS, *, curl: float = 0.0) -> Skeleton:
    """The uniform person with a thumb and fingers of three joints and a tip each, bent by ``curl`` radians a joint."""
    joints, parents, offsets = list(SMPL22.names), list(SMPL22.parents), [*SMPL22.offsets]
    for side, out in (("left", 1.0), ("right", -1.0)):
        for number, name in enumerate(names):
            parent = SMPL22.index(f"{side}_wrist")
            place = np.array([0.09 * out, 0.0, 0.03 - 0.02 * number])
            for k in range(4):
                joints.append(f"{side}Hand{name}{k + 1}")
                parents.append(parent)
                offsets.append(place)
                parent, angle = len(joints) - 1, -out * curl * (k + 1)
                place = 0.03 * np.array([out * np.cos(angle), out * np.sin(angle), 0.0])
        parent, place = SMPL22.index(f"{side}_wrist"), np.array([0.02 * out, 0.0, 0.04])
        for k in range(4):
            joints.append(f"{side}HandThumb{k + 1}")
            parents.append(parent)
            offsets.append(place)
            parent, place = len(joints) - 1, np.array([0.02 * out, 0.0, 0.02])
    return Skeleton(tuple(joints), tuple(parents), np.array(offsets))


def still(skeleton: Skeleton) -> Motion:
    return Motion(skeleton, 30.0, np.tile(SMPL22.offsets[0], (2, 1)), np.tile(rot.IDENTITY, (2, len(skeleton), 1)))


def bones(motion: Motion, finger: str) -> np.ndarray:
    """(3, 3) unit directions of a finger's bones in the first frame."""
    places = motion.positions()[0]
    line = places[[motion.skeleton.index(f"{finger}{k}") for k in (1, 2, 3, 4)]]
    return np.diff(line, axis=0) / np.linalg.norm(np.diff(line, axis=0), axis=1, keepdims=True)


@pytest.mark.parametrize("curl", [0.0, 0.3])
def test_fingers_bend_down_from_a_t_pose_by_their_angles(curl: float) -> None:
    made = pose_hands(still(handed(curl=curl)), "fist")
    for side, out in (("left", 1.0), ("right", -1.0)):
        for finger in FINGERS:
            first, second, third = bones(made, f"{side}Hand{finger}")
            assert first[1] < -0.95
            assert np.degrees(np.arccos(first @ second)) == pytest.approx(99, abs=3)
            assert np.degrees(np.arccos(second @ third)) == pytest.approx(61, abs=3)
            assert second[0] * out < 0  # back towards the wrist


def test_a_flat_hand_is_straight_and_a_relaxed_one_between() -> None:
    reach = {}
    for pose in ("flat", "relaxed", "fist"):
        made = pose_hands(still(handed(curl=0.4)), pose)
        places = made.positions()[0]
        wrist, tip = (places[made.skeleton.index(n)] for n in ("left_wrist", "leftHandMiddle4"))
        reach[pose] = float(np.linalg.norm(tip - wrist))
        if pose == "flat":
            np.testing.assert_allclose(bones(made, "leftHandMiddle"), np.tile([1.0, 0, 0], (3, 1)), atol=0.02)
    assert reach["flat"] > reach["relaxed"] > reach["fist"] + 0.03


def test_both_hands_are_mirrored() -> None:
    made = pose_hands(still(handed()), "relaxed")
    places = made.positions()[0]
    for k, name in enumerate(made.skeleton.names[22:], start=22):
        if name.startswith("left"):
            other = places[made.skeleton.index(name.replace("left", "right"))]
            wrists = places[[SMPL22.index("left_wrist"), SMPL22.index("right_wrist")]]
            np.testing.assert_allclose(places[k] - wrists[0], (other - wrists[1]) * [-1, 1, 1], atol=1e-6)


def test_fingers_counted_the_other_way_close_to_the_same_side() -> None:
    named = pose_hands(still(handed()), "fist")
    other = pose_hands(still(handed(("finger4_", "finger3_", "finger2_", "finger1_"))), "fist")
    np.testing.assert_allclose(other.positions(), named.positions(), atol=0.006)


def test_the_rest_of_the_body_and_as_is_stay() -> None:
    skeleton = handed()
    turns = np.tile(rot.IDENTITY, (40, len(skeleton), 1))
    turns[:, :22] = rot.rotvec_to_quat(wave())
    motion = Motion(skeleton, 30.0, np.tile(SMPL22.offsets[0], (40, 1)), turns)
    assert pose_hands(motion, "as-is") is motion
    np.testing.assert_array_equal(pose_hands(motion, "fist").rotations[:, :22], turns[:, :22])


def test_hands_without_fingers_and_other_poses_are_refused() -> None:
    with pytest.raises(MotionloomError, match="no fingers"):
        pose_hands(still(SMPL22), "fist")
    with pytest.raises(MotionloomError, match="relaxed, fist, flat, as-is"):
        pose_hands(still(handed()), "claw")  # type: ignore[arg-type]


def test_the_command_poses_hands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_bvh(still(handed()), tmp_path / "hero.bvh")
    save_bvh(still(SMPL22), tmp_path / "walk.bvh")
    words = ["export", str(tmp_path / "walk.bvh"), str(tmp_path / "out.bvh"), "--hands", "fist"]
    assert main([*words, "--skeleton", str(tmp_path / "hero.bvh")]) == 0
    assert bones(load_bvh(tmp_path / "out.bvh"), "leftHandMiddle")[0][1] < -0.9
    assert main([*words, "--skeleton", "smpl22", "--force"]) == 2
    assert "no fingers" in capsys.readouterr().err
    assert main([*words, "--force"]) == 2
    assert "goes with a --skeleton" in capsys.readouterr().err


RIGS = (
    "sophia.glb",
    "gdbot.glb",
    "robot_expressive.glb",
    "rpm_walk.glb",
    "m2m_mixamo.glb",
    "ue_m2m_skel.glb",
    "vroid.vrm",
    "vrm1_example.vrm",
    "daz_cmu_mocapnet.bvh",
    "cmu_iclone.bvh",
)


@pytest.mark.parametrize("name", RIGS)
def test_fists_of_other_peoples_rigs_end_near_their_palms(name: str) -> None:
    """Finger tips come nearer to the wrist, and nobody's finger goes through the back of the hand."""
    from motionloom.io import load
    from motionloom.io.character import load_character
    from motionloom.retarget.anatomy import read_body
    from motionloom.retarget.hands import _read_hand

    path = shared(f"rigs/{name}")
    skeleton = load(path).skeleton if path.suffix == ".bvh" else load_character(path).skeleton
    body = read_body(skeleton)
    motion = Motion(skeleton, 30.0, np.zeros((1, 3)), np.tile(rot.IDENTITY, (1, len(skeleton), 1)))
    reach = {}
    for pose in POSES[1:3]:
        places = pose_hands(motion, pose).positions()[0]
        for side in (0, 1):
            hand = _read_hand(body, side)
            assert hand is not None
            for finger in hand.fingers:
                wrist = body.places(places[None], np.tile(rot.IDENTITY, (1, len(skeleton), 1)))[0, 20 + side]
                reach[pose, side, finger] = places[finger[-1]] - wrist
                if pose == "fist":
                    assert reach[pose, side, finger] @ hand.palm > (places[finger[0]] - wrist) @ hand.palm
    for (pose, side, finger), apart in reach.items():
        if pose == "fist":
            assert np.linalg.norm(apart) < np.linalg.norm(reach["flat", side, finger])
