"""VRM animations, in and out."""

import json
import struct
from pathlib import Path

import numpy as np

from motionloom import io
from motionloom import rotations as rot
from motionloom.io.character import load_character
from motionloom.motion import Motion
from motionloom.retarget import joint_map, retarget, to_smpl22
from motionloom.skeleton import SMPL22
from tests.io.rigged import wave
from tests.shared import shared

REQUIRED = {"hips", "spine", "head"} | {  # VRMC_vrm-1.0: humanoid.humanBones, those that must be there
    side + bone
    for side in ("left", "right")
    for bone in ("UpperLeg", "LowerLeg", "Foot", "UpperArm", "LowerArm", "Hand")
}


def waving() -> Motion:
    return Motion(SMPL22, 30.0, np.tile(SMPL22.offsets[0], (40, 1)), rot.rotvec_to_quat(wave()))


def test_a_vrm_animation_holds_what_the_specification_asks(tmp_path: Path) -> None:
    path = io.save(waving(), tmp_path / "wave.vrma")
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    content = json.loads(data[20 : 20 + length])
    bones = content["extensions"]["VRMC_vrm_animation"]["humanoid"]["humanBones"]
    assert set(bones) >= REQUIRED
    assert content["extensionsUsed"] == ["VRMC_vrm_animation"]
    nodes = {bone["node"] for bone in bones.values()}
    for channel in content["animations"][0]["channels"]:
        target = channel["target"]
        assert target["path"] == "rotation" or target["node"] == bones["hips"]["node"]
        assert target["node"] in nodes
    assert all("rotation" not in content["nodes"][n] for n in nodes)


def test_a_vrm_animation_comes_back(tmp_path: Path) -> None:
    motion = waving()
    back = io.load(io.save(motion, tmp_path / "wave.vrma"))
    assert joint_map(back.skeleton).names()["left_knee"] == {"left_knee": 1.0}
    np.testing.assert_allclose(back.positions()[:, -22:], motion.positions(), atol=1e-5)


def test_somebody_elses_vrm_animation_moves_a_vrm_character(tmp_path: Path) -> None:
    motion = io.load(shared("rigs/vrma_idle.vrma"))
    person = to_smpl22(motion)
    assert 0.7 < person.positions()[:, 0, 1].mean() < 1.1
    character = load_character(shared("rigs/vrm1_example.vrm"))
    out = character.save(retarget(motion, character.skeleton), tmp_path / "idle.vrm", name="idle")
    assert len(io.load(out, clip="idle")) == len(motion)
