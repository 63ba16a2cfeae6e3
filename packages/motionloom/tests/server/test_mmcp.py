"""MMCP through the SDK's own client: what its parser reads is what was asked."""

import copy
from typing import Any

import numpy as np
import pytest

pytest.importorskip("motionmcp", reason="needs the extra 'mmcp': pip install 'motionloom[mmcp]'")
pytest.importorskip("fastapi", reason="needs the extra 'mmcp': pip install 'motionloom[mmcp]'")

from motionmcp import client

from motionloom.core import rotations as rot
from motionloom.core.skeleton import SMPL22
from motionloom.retarget.named import named_skeleton
from motionloom.server.mmcp.rigs import read_rig
from tests.server.serving import Server

QUICK = {"seed": 1, "diffusion_steps": 6}
WHOLE: dict[str, Any] = {"protocol_version": "1.0", "model": "motionloom", "options": QUICK}


def url(server: Server) -> str:
    return f"http://127.0.0.1:{server.port}"


@pytest.fixture(scope="module")
def model(server: Server) -> dict[str, Any]:
    return client.get_capabilities(url(server))["models"][0]


def draw(server: Server, model: dict[str, Any], **fields: Any) -> list[dict[str, Any]]:
    """The samples as the SDK's parser reads them, with ``places`` (frames, joints, 3) of its own rotations."""
    body = WHOLE | {"skeleton": model["canonical_skeleton"]} | fields
    samples = client.parse_gltf_samples(client.generate(url(server), body))
    for sample in samples:
        sample["places"] = posed(sample, body["skeleton"]["joints"])
    return samples


def posed(sample: dict[str, Any], joints: list[dict[str, Any]]) -> np.ndarray:
    """Forward kinematics as glTF says it: each joint's rest translation and its rotation, in its parent's frame."""
    names, turns = list(sample["joint_names"]), np.asarray(sample["local_rot_mats"], dtype=np.float64)
    root = np.asarray(sample["posed_joints"])[:, names.index(joints[0]["name"])]
    world, places = np.empty_like(turns), np.empty((*turns.shape[:2], 3))
    for joint in joints:
        own = names.index(joint["name"])
        if joint["parent"] is None:
            world[:, own], places[:, own] = turns[:, own], root
            continue
        above = names.index(joint["parent"])
        world[:, own] = world[:, above] @ turns[:, own]
        places[:, own] = places[:, above] + world[:, above] @ np.asarray(joint["rest_translation"])
    return places


def text(prompt: str = "a person walks", frames: int = 40) -> dict[str, Any]:
    return {"type": "text", "prompt": prompt, "duration_frames": frames}


def place(sample: dict[str, Any], joint: str) -> np.ndarray:
    return sample["places"][:, list(sample["joint_names"]).index(joint)]


def test_it_is_found_at_the_root_and_under_its_prefix(server: Server, model: dict[str, Any]) -> None:
    below = client.get_capabilities(url(server) + "/mmcp")
    assert below["models"][0] == model
    assert {"text", "unconditioned", "pose", "motion_reference"} <= set(model["supported_segments"])
    assert server.json("GET", "/capabilities")[1]["tasks"]


def test_its_document_is_given_and_no_page_that_loads_scripts_from_elsewhere(server: Server) -> None:
    status, api = server.json("GET", "/mmcp/openapi.json")
    assert (status, "/generate" in api["paths"]) == (200, True)
    assert [server.ask("GET", f"/mmcp/{page}")[0] for page in ("docs", "redoc")] == [404, 404]


def test_a_seed_makes_the_same_samples_again_and_each_is_another(server: Server, model: dict[str, Any]) -> None:
    first, second = draw(server, model, segments=[text()], options={**QUICK, "num_samples": 2})
    (again,) = draw(server, model, segments=[text()])
    assert np.abs(first["places"] - again["places"]).max() < 1e-4
    assert np.abs(first["places"] - second["places"]).max() > 0.05


def test_segments_add_up_at_any_frame_rate(server: Server, model: dict[str, Any]) -> None:
    segments = [text(frames=60), {"type": "unconditioned", "duration_frames": 47}]
    (motion,) = draw(server, model, segments=segments, timing={"fps": 30})
    assert (motion["num_frames"], motion["fps"]) == (107, 30)


def test_a_path_and_a_hand_are_where_they_were_asked(server: Server, model: dict[str, Any]) -> None:
    path = {"type": "root_path", "frames": [0, 30, 59], "positions_xz": [[1, 0], [1.5, 1], [1, 2]]}
    hand = {"type": "effector_target", "joint": "left_wrist", "frames": [30], "positions": [[1.9, 1.2, 1.2]]}
    (motion,) = draw(server, model, segments=[text(frames=60)], constraints=[path, hand], timing={"fps": 30})
    assert np.abs(place(motion, "pelvis")[[0, 30, 59]][:, [0, 2]] - path["positions_xz"]).max() < 0.03
    assert np.linalg.norm(place(motion, "left_wrist")[30] - [1.9, 1.2, 1.2]) < 0.03


def test_a_path_leads_through_several_segments(server: Server, model: dict[str, Any]) -> None:
    path = {"type": "root_path", "frames": [0, 79], "positions_xz": [[0, 0], [0, 3]], "heading_radians": [0, 0]}
    (motion,) = draw(server, model, segments=[text(), text("a person jumps")], constraints=[path])
    assert np.abs(place(motion, "pelvis")[-1, [0, 2]] - [0, 3]).max() < 0.05


def test_constraints_alone_are_enough(server: Server, model: dict[str, Any]) -> None:
    path = {"type": "root_path", "frames": [0, 39], "positions_xz": [[0, 0], [0, 2]]}
    (motion,) = draw(server, model, duration_frames=40, constraints=[path])
    assert np.abs(place(motion, "pelvis")[-1, [0, 2]] - [0, 2]).max() < 0.05


def test_a_pose_with_a_place_is_taken_there(server: Server, model: dict[str, Any]) -> None:
    (source,) = draw(server, model, segments=[text("a person raises both arms")])
    turns = xyzw(source["local_rot_mats"][20])
    pose = {
        "type": "pose_keyframe",
        "frame": 30,
        "joint_rotations": dict(zip(source["joint_names"], turns)),
        "root_position": [0.5, float(place(source, "pelvis")[20, 1]), 1.0],
    }
    (motion,) = draw(server, model, segments=[text(frames=60)], constraints=[pose])
    own = source["places"][20] - place(source, "pelvis")[20]
    there = motion["places"][30] - [0.5, place(source, "pelvis")[20, 1], 1.0]
    assert np.linalg.norm(own - there, axis=-1).mean() < 0.06


def test_a_pose_without_a_place_is_taken_where_the_person_is(server: Server, model: dict[str, Any]) -> None:
    (source,) = draw(server, model, segments=[text("a person raises both arms")])
    turns = dict(zip(source["joint_names"], xyzw(source["local_rot_mats"][20])))
    pose = {"type": "pose_keyframe", "frame": 30, "joint_rotations": turns}
    (free,) = draw(server, model, segments=[text(frames=60)])
    (motion,) = draw(server, model, segments=[text(frames=60)], constraints=[pose])
    raised, target = (
        place(one, "left_wrist")[at, 1] - place(one, "pelvis")[at, 1] for one, at in ((motion, 30), (source, 20))
    )
    assert raised == pytest.approx(target, abs=0.15)
    assert np.linalg.norm(place(motion, "pelvis")[30] - place(free, "pelvis")[30]) < 0.5


def test_a_pose_segment_is_one_frame(server: Server, model: dict[str, Any]) -> None:
    (motion,) = draw(server, model, segments=[{"type": "pose", "prompt": "a person raises both arms"}])
    assert motion["num_frames"] == 1


def test_a_loop_ends_as_it_begins(server: Server, model: dict[str, Any]) -> None:
    (motion,) = draw(server, model, segments=[text(frames=60)], options={**QUICK, "loop": True})
    turns = np.asarray(motion["local_rot_mats"])
    assert np.abs(turns[0, 1:] - turns[-1, 1:]).max() < 1e-3
    assert place(motion, "pelvis")[-1, 1] == pytest.approx(place(motion, "pelvis")[0, 1], abs=1e-4)


def test_planted_feet_stand_on_the_ground_under_them(server: Server, model: dict[str, Any]) -> None:
    points = [[x / 4, z / 4, 0.4 if z > 3 else 0.0] for x in range(-6, 7) for z in range(-6, 20)]
    segments = [text(frames=60)]
    (flat,) = draw(server, model, segments=segments)
    (motion,) = draw(server, model, segments=segments, constraints=[{"type": "ground_height", "points": points}])
    raised = np.minimum(place(motion, "left_foot")[:, 1], place(motion, "right_foot")[:, 1])
    before = np.minimum(place(flat, "left_foot")[:, 1], place(flat, "right_foot")[:, 1])
    far = place(flat, "pelvis")[:, 2] > 1.6
    assert far.any()
    assert (raised - before)[far].mean() == pytest.approx(0.4, abs=0.06)
    assert abs((raised - before)[:10].mean()) < 0.06


def test_a_performance_is_like_its_reference_but_no_copy(server: Server, model: dict[str, Any]) -> None:
    (source,) = draw(server, model, segments=[text("a person walks forward")])
    like = {
        "type": "motion_reference",
        "duration_frames": 50,
        "joint_names": list(source["joint_names"]),
        "fps": 20,
        "rotations": [xyzw(frame) for frame in source["local_rot_mats"]],
        "root_positions": place(source, "pelvis").tolist(),
    }
    (motion,) = draw(server, model, segments=[like, text(frames=30)])
    assert motion["num_frames"] == 80
    apart = motion["places"][:40] - source["places"]
    assert np.abs(apart).max() > 0.02
    speed = np.linalg.norm(np.diff(motion["places"], axis=0), axis=-1) * 20
    assert speed[45:55].max() < 12  # nobody jumps from one segment to the next


def other_rig(size: float = 1.2) -> dict[str, Any]:
    """Mixamo's skeleton, larger, with rest rotations as rigs have them."""
    skeleton, generator = named_skeleton("mixamo"), np.random.default_rng(5)
    world = rot.normalize(generator.normal(size=(len(skeleton), 4)))
    joints = []
    for joint, (name, parent) in enumerate(zip(skeleton.names, skeleton.parents, strict=True)):
        above = world[parent] if parent >= 0 else rot.IDENTITY
        local = rot.multiply(rot.inverse(above), world[joint])
        offset = size * rot.rotate(rot.inverse(above), skeleton.offsets[joint])
        joints.append(
            {
                "name": name,
                "parent": None if parent < 0 else skeleton.names[parent],
                "rest_translation": offset.tolist(),
                "rest_rotation": np.roll(local, -1).tolist(),
            }
        )
    return {"joints": joints}


def test_rest_rotations_are_taken_out_and_put_back() -> None:
    rig = read_rig(other_rig()["joints"])
    generator = np.random.default_rng(6)
    turns = np.roll(rot.normalize(generator.normal(size=(3, len(rig.skeleton), 4))), -1, axis=-1)
    motion = rig.motion(rig.skeleton.names, turns, np.zeros((3, 3)), 20.0)
    again = rig.rotations_of(motion)
    assert np.abs(np.abs((turns * again).sum(-1)) - 1).max() < 1e-9
    assert np.abs(rig.skeleton.offsets[1:] - 1.2 * named_skeleton("mixamo").offsets[1:]).max() < 1e-9


def test_motion_comes_on_the_clients_own_rig_in_its_size(server: Server, model: dict[str, Any]) -> None:
    path = {"type": "root_path", "frames": [0, 39], "positions_xz": [[0, 0], [0, 2.4]]}
    (motion,) = draw(server, model, segments=[text()], constraints=[path], skeleton=other_rig())
    hips = place(motion, "mixamorig:Hips")
    assert np.abs(hips[-1, [0, 2]] - [0, 2.4]).max() < 0.08
    toes = np.minimum(place(motion, "mixamorig:LeftToeBase")[:, 1], place(motion, "mixamorig:RightToeBase")[:, 1])
    assert -0.05 < toes.min() < 0.1
    heads = place(motion, "mixamorig:Head")[:, 1]
    assert (heads > 1.4).all()  # 1.2 times a person, upright, whatever its bones' axes


def broken() -> list[tuple[dict[str, Any], str]]:
    bad = {"type": "effector_target", "joint": "tail", "frames": [0], "positions": [[0, 0, 0]]}
    box = {"joints": [{"name": "box", "parent": None, "rest_translation": [0, 0, 0], "rest_rotation": [0, 0, 0, 1]}]}
    nan = {"joints": [{**joint, "rest_translation": [1e9, 0, 0]} for joint in other_rig()["joints"]]}
    far = {"type": "root_path", "frames": [0, 39], "positions_xz": [[0, 0], [0, 500]]}
    return [
        ({"segments": [text()], "constraints": [bad]}, "unknown_joint"),
        ({"segments": [text()], "model": "other"}, "unknown_model"),
        ({"segments": [text()], "protocol_version": "9.0"}, "version_unsupported"),
        ({"segments": [text(frames=10**6)]}, "invalid_options"),
        ({"segments": [{"type": "dance"}]}, "schema_validation"),
        ({"segments": [text()], "skeleton": box}, "invalid_request"),
        ({"segments": [text()], "skeleton": nan}, "invalid_request"),
        ({"segments": [text()], "constraints": [far]}, "invalid_request"),
        ({"segments": [text(), {"type": "pose", "prompt": "a"}]}, "invalid_request"),
    ]


@pytest.mark.parametrize(("fields", "code"), broken())
def test_what_cannot_be_asked_comes_in_the_envelope(
    server: Server, model: dict[str, Any], fields: dict[str, Any], code: str
) -> None:
    with pytest.raises(client.MmcpError) as refused:
        client.generate(url(server), WHOLE | {"skeleton": model["canonical_skeleton"]} | copy.deepcopy(fields))
    assert refused.value.code == code
    assert str(refused.value)


def test_other_sites_are_refused_in_the_envelope(server: Server) -> None:
    status, answer = server.json("POST", "/generate", {}, headers={"Origin": "http://evil.example"})
    assert (status, answer["error"]["code"]) == (403, "forbidden")


def xyzw(matrices: Any) -> list[list[float]]:
    """Rotation matrices (..., 3, 3) as quaternions x, y, z, w."""
    from motionmcp.gltf import matrices_to_quats

    return matrices_to_quats(np.asarray(matrices)).tolist()


def test_the_canonical_skeleton_is_the_uniform_person(model: dict[str, Any]) -> None:
    rig = read_rig(model["canonical_skeleton"]["joints"])
    assert rig.uniform
    assert rig.skeleton == SMPL22
