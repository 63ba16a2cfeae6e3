"""A user's own character: its file in, the same file out with one more animation, and the mesh as it should be."""

import copy
import functools
import json
import struct
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.io.character import load_character
from motionloom.io.gltf import load_glb
from motionloom.io.gltf_mesh import read_surfaces
from motionloom.retarget import joint_map, retarget
from tests.io.gltf_skin import Scene
from tests.io.rigged import Hero, wave
from tests.io.round_trip import errors, onto
from tests.shared import shared


def parts_of(path: Path) -> tuple[dict, bytes, list[tuple[bytes, bytes]]]:
    """JSON, binary part and all further chunks."""
    data, at, found = path.read_bytes(), 12, []
    while at < len(data):
        (length,) = struct.unpack_from("<I", data, at)
        found.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + length]))
        at += 8 + length
    binary = next((part for kind, part in found if kind == b"BIN\0"), b"")
    return json.loads(found[0][1]), binary, [chunk for chunk in found if chunk[0] not in (b"JSON", b"BIN\0")]


def check_only_one_animation_is_new(before: Path, after: Path) -> None:
    """All that was there is there, in the same places; what is behind it belongs to the one new animation."""
    old, old_data, old_chunks = parts_of(before)
    new, new_data, new_chunks = parts_of(after)
    animation = new["animations"][-1]
    assert new["animations"][:-1] == old.get("animations", [])
    fresh = {sampler[key] for sampler in animation["samplers"] for key in ("input", "output")}
    assert fresh == set(range(len(old.get("accessors", [])), len(new["accessors"])))
    assert {new["accessors"][a]["bufferView"] for a in fresh} == {len(old.get("bufferViews", []))}
    view = new["bufferViews"][-1]
    assert view["buffer"] == 0
    assert view["byteOffset"] >= old["buffers"][0]["byteLength"]
    stripped = copy.deepcopy(new)
    del stripped["animations"], stripped["bufferViews"][-1]
    stripped["accessors"] = stripped["accessors"][: len(old["accessors"])]
    stripped["buffers"][0]["byteLength"] = old["buffers"][0]["byteLength"]
    old.pop("animations", None)
    assert stripped == old
    assert list(stripped) == list(old)  # even the order of what is in it
    length = old["buffers"][0]["byteLength"]
    assert new_data[:length] == old_data[:length]
    assert new_chunks == old_chunks


# By hand -------------------------------------------------------------------------------------------------------------


def test_a_character_with_turned_bones_moves_as_it_did(tmp_path: Path) -> None:
    """Whatever way bones are turned at rest, the mesh comes back: nothing is wrung."""
    for seed in range(3):
        path = Hero(seed=seed).clip("wave", 0.5 * wave(seed=seed)).write(tmp_path / "hero.glb")
        motion, out = onto(path, tmp_path / "moving.glb")
        found = errors(path, out, 0, motion)
        assert found["all"] < 1.0
        assert found["twist"] < 1.0


def test_the_skeleton_is_at_rest_as_the_file_is(tmp_path: Path) -> None:
    skeleton = load_character(Hero().write(tmp_path / "hero.glb")).skeleton
    body = [skeleton.index(name) for name in SMPL22.names]
    np.testing.assert_allclose(skeleton.rest_positions()[body], SMPL22.rest_positions(), atol=1e-6)


def test_nothing_but_one_animation_is_new(tmp_path: Path) -> None:
    path = Hero().clip("wave", wave()).write(tmp_path / "hero.glb", others=[(b"ABCD", b"1234")])
    _, out = onto(path, tmp_path / "moving.glb")
    check_only_one_animation_is_new(path, out)
    _, twice = onto(out, tmp_path / "twice.glb", clip="wave")
    check_only_one_animation_is_new(out, twice)
    assert [a["name"] for a in parts_of(twice)[0]["animations"]] == ["wave", "ours", "ours_2"]


def test_a_rig_of_meshes_without_clips_gets_its_first(tmp_path: Path) -> None:
    path = Hero().write(tmp_path / "hero.glb")
    character = load_character(path)
    out = character.save(retarget(load_glb(path), character.skeleton), tmp_path / "out.glb")
    check_only_one_animation_is_new(path, out)


def test_replace_leaves_only_ours(tmp_path: Path) -> None:
    path = Hero().clip("wave", wave()).write(tmp_path / "hero.glb")
    character = load_character(path)
    character.save(retarget(load_glb(path), character.skeleton), tmp_path / "out.glb", name="wave", replace=True)
    assert [a["name"] for a in parts_of(tmp_path / "out.glb")[0]["animations"]] == ["wave"]


def test_bones_that_are_not_driven_keep_their_rest(tmp_path: Path) -> None:
    path = Hero().clip("wave", wave()).write(tmp_path / "hero.glb")
    _, out = onto(path, tmp_path / "moving.glb")
    new = parts_of(out)[0]
    assert 23 not in {channel["target"]["node"] for channel in new["animations"][-1]["channels"]}


def test_a_mesh_with_fewer_bind_matrices_than_joints_is_left_out_and_told(tmp_path: Path) -> None:
    hero = Hero()
    hero.json["accessors"][hero.json["skins"][0]["inverseBindMatrices"]]["count"] -= 1
    with pytest.warns(UserWarning, match="1 of its 1 pieces of mesh are left out"):
        assert read_surfaces(load_character(hero.write(tmp_path / "hero.glb")), remark=True) == []


def test_what_another_clip_moves_has_one_key_at_rest(tmp_path: Path) -> None:
    """Programs that go from clip to clip leave a node where the last clip had it, unless the next one says."""
    hero = Hero().clip("wave", wave())
    animation = hero.json["animations"][0]
    keys = hero.add(np.tile([0.0, 1.0, 0.0], (40, 1)), 5126, "VEC3")
    animation["samplers"].append({"input": animation["samplers"][0]["input"], "output": keys})
    animation["channels"].append({"sampler": 22, "target": {"node": 23, "path": "translation"}})
    path = hero.write(tmp_path / "hero.glb")
    _, out = onto(path, tmp_path / "moving.glb")
    check_only_one_animation_is_new(path, out)
    scene = Scene(out)
    ours = scene.clip("ours")
    (held,) = [c for c in ours["channels"] if c["target"] == {"node": 23, "path": "translation"}]
    np.testing.assert_allclose(scene.values(ours["samplers"][held["sampler"]]["output"]), [[0.05, 0.02, 0.01]])
    assert scene.values(ours["samplers"][held["sampler"]]["input"]).tolist() == [[0.0]]
    pose = load_character(path)
    still = Motion(pose.skeleton, 30.0, np.zeros((1, 3)), np.tile(rot.IDENTITY, (1, len(pose.skeleton), 1)))
    check_only_one_animation_is_new(path, pose.save(still, tmp_path / "pose.glb"))  # one frame needs no second clock


@pytest.mark.parametrize("value", [functools.reduce(lambda inner, _: [inner], range(700), []), float("inf")])
def test_json_that_could_not_be_written_again_is_refused(tmp_path: Path, value: object) -> None:
    """Depths that run out of stack, and 1e999, which Python reads as infinity: in parts that are only carried along."""
    hero = Hero()
    hero.json["extras"] = {"far": value}
    path = hero.write(tmp_path / "hero.glb")
    data = path.read_bytes()
    path.write_bytes(data.replace(b"Infinity", b"   1e999"))
    with pytest.raises(MotionloomError, match="JSON part cannot be read"):
        load_character(path)


def test_last_bones_may_be_stretched_or_mirrored_and_others_not(tmp_path: Path) -> None:
    for scale in ([1.0, 2.0, 1.0], [-1.0, 1.0, 1.0]):
        hero = Hero().clip("wave", 0.5 * wave())
        hero.json["nodes"][23]["scale"] = scale
        motion, out = onto(path := hero.write(tmp_path / "hero.glb"), tmp_path / "moving.glb")
        assert errors(path, out, 0, motion)["all"] < 1.0
        hero.json["nodes"][20]["scale"] = scale
        with pytest.raises(MotionloomError, match=r"'left_wrist', is scaled .* apply scales"):
            load_character(hero.write(tmp_path / "hero.glb"))


def test_soles_that_dip_raise_the_whole_character_but_no_leap(tmp_path: Path) -> None:
    """Heels that are 3 cm in the floor while toes are planted come out of it; 8 cm are a pose in the air and stay."""
    character = load_character(Hero().write(tmp_path / "hero.glb"))
    rest = min(s.points[:, 1].min() for s in read_surfaces(character))
    for angle, raised in ((-0.7, True), (-1.4, False)):
        turns = np.zeros((30, 22, 3))
        turns[:, [7, 8], 0] = angle
        standing = Motion(SMPL22, 30.0, np.tile(SMPL22.offsets[0], (30, 1)), rot.rotvec_to_quat(turns))
        lower = standing.positions()[0, 10, 1] - SMPL22.rest_positions()[10, 1]
        made = retarget(replace(standing, root=standing.root - [0.0, lower, 0.0]), character.skeleton)
        scene = Scene(character.save(made, tmp_path / "out.glb", name="ours"))
        places = scene.vertices(scene.worlds(scene.clip("ours"), np.arange(30) / 30.0))
        low = min(vertices[..., 1].min() for vertices in places.values())
        assert (low > rest - 0.01) == raised, (angle, low, rest)


def test_soles_of_one_that_was_made_with_z_up_stay_out_of_the_floor_too(tmp_path: Path) -> None:
    turns = np.zeros((30, 22, 3))
    turns[:, [7, 8], 0] = -0.7
    standing = Motion(SMPL22, 30.0, np.tile(SMPL22.offsets[0], (30, 1)), rot.rotvec_to_quat(turns))
    lower = standing.positions()[0, 10, 1] - SMPL22.rest_positions()[10, 1]
    standing = replace(standing, root=standing.root - np.array([0.0, lower, 0.0]))
    lying = Hero()
    lying.json["nodes"][22]["rotation"] = [0.5**0.5, 0.0, 0.0, 0.5**0.5]
    lowest = []
    for hero in (Hero(), lying):
        character = load_character(hero.write(tmp_path / "hero.glb"))
        out = character.save(retarget(standing, character.skeleton), tmp_path / "out.glb", name="ours")
        scene = Scene(out)
        places = scene.vertices(scene.worlds(scene.clip("ours"), np.arange(30) / 30.0))
        lowest.append(min(vertices[..., 1].min() for vertices in places.values()))
    assert lowest[1] == pytest.approx(lowest[0], abs=2e-3)


def said(hero: Hero, path: Path) -> str:
    """What is remarked on a character as it is read."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        load_character(hero.write(path))
    return "; ".join(str(one.message) for one in caught)


def test_what_does_not_move_with_the_character_is_said(tmp_path: Path) -> None:
    assert said(Hero(), tmp_path / "hero.glb") == ""
    loose = Hero()
    loose.json["nodes"] += [{"name": "helmet", "mesh": 0}, {"name": "shield", "mesh": 0}, {"name": "ring", "mesh": 0}]
    loose.json["scenes"][0]["nodes"] += [25, 26]
    loose.json["nodes"][23]["children"] = [27]
    assert "'helmet', 'shield' hang on no bone and stay" in said(loose, tmp_path / "loose.glb")
    two = Hero()
    count = len(two.json["nodes"])
    for node in copy.deepcopy(two.json["nodes"]):
        node["children"] = [child + count for child in node.get("children", [])]
        two.json["nodes"].append(
            {key: value for key, value in node.items() if value != []} | ({"skin": 1} if "skin" in node else {})
        )
    skin = two.json["skins"][0]
    two.json["skins"].append(skin | {"joints": [joint + count for joint in skin["joints"]]})
    assert "holds 2 skeletons; the one of 'pelvis' moves" in said(two, tmp_path / "two.glb")


def test_soles_that_are_not_known_are_said(tmp_path: Path) -> None:
    squeezed = Hero()
    squeezed.json["meshes"][0]["primitives"][0]["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0}}
    del squeezed.json["accessors"][squeezed.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]["bufferView"]
    assert "its soles are not known" in said(squeezed, tmp_path / "draco.glb")
    high = Hero()
    high.json["nodes"][22]["translation"] = [0.0, 3.0, 0.0]
    assert "does not stand on the floor at rest, so that its soles" in said(high, tmp_path / "high.glb")


def test_feet_on_controls_are_carried_along(tmp_path: Path) -> None:
    """Feet that hang on the root instead of on their shins, as in rigs made for IK, stay on their legs."""
    hang = {"left_ankle": "pelvis", "right_ankle": "pelvis"}
    path = Hero(hang=hang).write(tmp_path / "hero.glb")
    character = load_character(path)
    assert character.skeleton.parents[character.skeleton.index("left_ankle")] == character.skeleton.index("left_knee")
    turns = rot.rotvec_to_quat(wave())
    time = np.arange(40)[:, None]
    motion = Motion(SMPL22, 30.0, SMPL22.offsets[0] + 0.01 * time * [0, 0, 1], turns)
    made = retarget(motion, character.skeleton)
    out = character.save(made, tmp_path / "out.glb", name="ours")
    scene = Scene(out)
    places = scene.worlds(scene.clip("ours"), np.arange(40) / 30.0)[..., :3, 3][:, list(character.nodes)]
    np.testing.assert_allclose(places, made.positions(), atol=1e-5)


def test_where_the_mesh_was_bound_is_the_rest(tmp_path: Path) -> None:
    """Nodes left in a pose by the last editor: the T-pose is in the inverse bind matrices."""
    hero = Hero()
    for j, angle in ((1, 0.7), (16, -1.2), (18, 0.9)):
        old = np.roll(np.array(hero.json["nodes"][j]["rotation"]), 1)
        turned = rot.multiply(old, rot.rotvec_to_quat(np.array([angle, 0.3, 0.0])))
        hero.json["nodes"][j]["rotation"] = np.roll(turned, -1).tolist()
    skeleton = load_character(hero.write(tmp_path / "hero.glb")).skeleton
    body = [skeleton.index(name) for name in SMPL22.names]
    np.testing.assert_allclose(skeleton.rest_positions()[body], SMPL22.rest_positions(), atol=1e-5)


def test_clips_are_chosen_by_name_or_number_and_never_silently(tmp_path: Path) -> None:
    path = Hero().clip("wave", wave()).clip("2", wave(20)).clip("run", wave(30)).write(tmp_path / "hero.glb")
    assert [len(load_glb(path, clip=clip)) for clip in ("wave", 2, "2", 3, "run")] == [40, 20, 20, 30, 30]
    with pytest.warns(UserWarning, match="3 clips"):
        assert len(load_glb(path)) == 40
    for wrong in ("jump", 0, 4, "9" * 30):
        with pytest.raises(MotionloomError, match="no clip"):
            load_glb(path, clip=wrong)


def test_the_newest_of_ours_is_read_where_none_is_chosen(tmp_path: Path) -> None:
    """At its own rate, whatever the clips before it have."""
    path = Hero().clip("wave", wave()).write(tmp_path / "hero.glb")
    for name, frames, fps in (("one", 25, 24.0), ("two", 33, 60.0)):
        character = load_character(path)
        turns = np.tile(rot.IDENTITY, (frames, len(character.skeleton), 1))
        still = Motion(character.skeleton, fps, np.tile(character.skeleton.offsets[0], (frames, 1)), turns)
        path = character.save(still, tmp_path / f"{name}.glb", name=name)
    with pytest.warns(UserWarning, match=r"3 clips .* number 3, 'two', the newest of this program's, is read"):
        found = load_glb(path)
    assert (len(found), found.fps) == (33, 60.0)
    assert load_glb(path, clip="one").fps == 24.0


def test_a_humanoid_map_is_read_and_not_guessed(tmp_path: Path) -> None:
    hero = Hero()
    for node in hero.json["nodes"][:22]:
        node["name"] = f"bone {node['extras']['number']}"
    bones = {"hips": 0, "spine": 3, "chest": 6, "neck": 12, "head": 15}
    for side, first in (("left", 0), ("right", 1)):
        limbs = {"UpperLeg": 1, "LowerLeg": 4, "Foot": 7, "Toes": 10, "UpperArm": 16, "LowerArm": 18, "Hand": 20}
        bones |= {side + name: number + first for name, number in limbs.items()}
    one = {"VRMC_vrm": {"humanoid": {"humanBones": {name: {"node": n} for name, n in bones.items()}}}}
    zero = {"VRM": {"humanoid": {"humanBones": [{"bone": name, "node": n} for name, n in bones.items()]}}}
    for extensions in (one, zero):
        hero.json["extensions"] = extensions
        skeleton = load_character(hero.write(tmp_path / "hero.vrm")).skeleton
        assert joint_map(skeleton).names()["right_elbow"] == {"bone 19": 1.0}


def test_another_skeleton_and_another_suffix_are_refused(tmp_path: Path) -> None:
    character = load_character(Hero().write(tmp_path / "hero.glb"))
    still = Motion(SMPL22, 30.0, np.zeros((1, 3)), np.tile(rot.IDENTITY, (1, 22, 1)))
    with pytest.raises(MotionloomError, match="not on the skeleton"):
        character.save(still, tmp_path / "out.glb")
    with pytest.raises(MotionloomError, match=r"name it \*\.glb"):
        character.save(retarget(still, character.skeleton), tmp_path / "out.vrm")
    assert not list(tmp_path.glob("out*"))


# Other people's ------------------------------------------------------------------------------------------------------

# The robot's head falls off when it dies; the knight's shoulders leave its body when it swings a sword with both hands.
RIGS = (
    (
        "kaykit_knight.glb",
        ("Walking_A", "Running_A", "Idle", "PickUp", "Sit_Chair_Idle", "Jump_Full_Short", "Lie_Idle"),
    ),
    ("rpm_walk.glb", ("M_Walk_001",)),
    ("m2m_mixamo.glb", ("Idle", "T-Pose", "Walking")),
    ("ue_m2m_anim.glb", ("YMCA",)),
    ("robot_expressive.glb", ("Robot_Walking", "Robot_Running", "Robot_Dance", "Robot_Jump", "Robot_Wave")),
    ("gdbot.glb", ("Idle", "run", "walk", "jump", "fall", "ground_impact", "simple_punch")),
    ("sophia.glb", ("EdgeGrab", "Fall", "Idle", "Jump", "Run", "RunTiltL", "RunTiltR", "WallSlide")),
)


@pytest.mark.parametrize(("name", "clip"), [(name, clip) for name, clips in RIGS for clip in clips])
def test_a_rigs_own_clip_comes_back_from_the_uniform_person(tmp_path: Path, name: str, clip: str) -> None:
    path = shared(f"rigs/{name}")
    motion, out = onto(path, tmp_path / "out.glb", clip=clip)
    found = errors(path, out, [a.get("name") for a in Scene(path).json["animations"]].index(clip), motion)
    assert found["twist"] < 20
    assert found.get("all", 0) < 4
    assert max(found.get(part, 0) for part in ("head", "hands", "feet")) < 6
    check_only_one_animation_is_new(path, out)


@pytest.mark.parametrize("name", ["ue_m2m_skel.glb", "vrm1_example.vrm", "vroid.vrm"])
def test_rigs_without_a_clip_get_one(tmp_path: Path, name: str) -> None:
    path = shared(f"rigs/{name}")
    character = load_character(path)
    turns = rot.rotvec_to_quat(wave())
    motion = retarget(Motion(SMPL22, 30.0, np.tile(SMPL22.offsets[0], (40, 1)), turns), character.skeleton)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        out = character.save(motion, tmp_path / f"out{path.suffix}", name="ours")
    check_only_one_animation_is_new(path, out)
    scene = Scene(out)
    places = scene.worlds(scene.clip("ours"), np.arange(40) / 30.0)[..., :3, 3][:, list(character.nodes)]
    np.testing.assert_allclose(places, motion.positions(), atol=1e-4)
