"""VRM animations, in and out."""

import json
import struct
from pathlib import Path

import numpy as np

from motionloom import io
from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.io.character import load_character
from motionloom.retarget import joint_map, retarget, to_smpl22
from tests.io.gltf_skin import Scene
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


def played(path: Path, height: float) -> np.ndarray:
    """(frames, 3) the way of an avatar's hips, that are so high at rest, by the specification's scale."""
    scene = Scene(path)
    hips = scene.json["extensions"]["VRMC_vrm_animation"]["humanoid"]["humanBones"]["hips"]["node"]
    (clip,) = scene.json["animations"]
    (moved,) = [c for c in clip["channels"] if c["target"] == {"node": hips, "path": "translation"}]
    way = scene.values(clip["samplers"][moved["sampler"]]["output"])
    return way * height / scene.worlds(None, np.zeros(1))[0, hips, 1, 3]


def test_an_avatar_goes_as_far_as_with_the_clip_in_its_own_file(tmp_path: Path) -> None:
    """Its hips are 12 cm lower over its legs than the uniform person's, under a bone on the ground."""
    offsets = np.concatenate([[[0.0, 0.0, 0.0]], SMPL22.offsets])
    offsets[1, 1] -= 0.12
    offsets[[2, 3, 4], 1] += 0.12
    names = ("root", *(f"bone {j}" for j in range(22)))
    parts = {part: f"bone {SMPL22.index(part)}" for part in SMPL22.names}
    avatar = Skeleton(names, (-1, *(p + 1 for p in SMPL22.parents)), offsets, humanoid=parts, on_floor=True)
    walk = waving()
    walk = Motion(SMPL22, 30.0, walk.root + np.linspace(0, 3, 40)[:, None] * [0.3, 0.0, 1.0], walk.rotations)
    own = retarget(walk, avatar)
    path = io.save(own, tmp_path / "walk.vrma")
    hips = own.positions()[:, avatar.index("bone 0")]
    np.testing.assert_allclose(played(path, avatar.rest_positions()[1, 1]), hips, atol=1e-5)
    back = io.load(path)
    moved = back.positions()[:, [back.skeleton.index(f"bone {j}") for j in range(22)]]
    np.testing.assert_allclose(moved, own.positions()[:, 1:], atol=1e-5)


def test_a_real_avatar_goes_as_far_too(tmp_path: Path) -> None:
    skeleton = load_character(shared("rigs/vrm1_example.vrm")).skeleton
    walk = waving()
    own = retarget(
        Motion(SMPL22, 30.0, walk.root + np.arange(40)[:, None] * [0.0, 0.0, 0.05], walk.rotations), skeleton
    )
    hips = skeleton.index(skeleton.humanoid["pelvis"])
    found = played(io.save(own, tmp_path / "walk.vrma"), skeleton.rest_positions()[hips, 1])
    np.testing.assert_allclose(found, own.positions()[:, hips], atol=1e-4)


def test_somebody_elses_vrm_animation_moves_a_vrm_character(tmp_path: Path) -> None:
    motion = io.load(shared("rigs/vrma_idle.vrma"))
    person = to_smpl22(motion)
    assert 0.7 < person.positions()[:, 0, 1].mean() < 1.1
    character = load_character(shared("rigs/vrm1_example.vrm"))
    out = character.save(retarget(motion, character.skeleton), tmp_path / "idle.vrm", name="idle")
    assert len(io.load(out, clip="idle")) == len(motion)
