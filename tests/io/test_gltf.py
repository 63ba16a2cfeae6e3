"""GLB in and out: round trips, the Khronos validator, other people's files, hostile files."""

import base64
import copy
import json
import os
import shutil
import struct
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from motionloom import rotations as rot
from motionloom.errors import MotionloomError
from motionloom.io.body import body
from motionloom.io.gltf import load_glb, save_glb
from motionloom.motion import Motion
from motionloom.skeleton import SMPL22, Skeleton

QUICK = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def random_motion(seed: int, *, joints: int = 6, frames: int = 7, fps: float = 30.0, moving: bool = False) -> Motion:
    rng = np.random.default_rng(seed)
    parents = (-1, *(int(rng.integers(0, j)) for j in range(1, joints)))
    leaves = [j for j in range(1, joints) if j not in parents]
    ends = frozenset(leaves[: len(leaves) // 2])
    names = tuple(f"joint {j} ü" for j in range(joints))
    skeleton = Skeleton(names, parents, rng.normal(size=(joints, 3)), ends)
    turns = rot.normalize(rng.normal(size=(frames, joints, 4)))
    turns[:, list(ends)] = rot.IDENTITY
    moves = skeleton.offsets + rng.normal(size=(frames, joints, 3)) if moving else None
    return Motion(skeleton, fps, 10 * rng.normal(size=(frames, 3)), turns, moves)


def person(frames: int = 31, fps: float = 30.0) -> Motion:
    """Somebody who walks forward at 1 m/s without moving legs and lifts the left arm."""
    time = np.arange(frames) / fps
    turned = np.zeros((frames, 22, 3))
    turned[:, SMPL22.index("left_shoulder"), 2] = time
    root = np.stack([0 * time, np.full(frames, SMPL22.offsets[0, 1]), time], axis=-1)
    return Motion(SMPL22, fps, root, rot.rotvec_to_quat(turned))


# --- round trips -------------------------------------------------------------------------------------------------


@QUICK
@given(
    seed=st.integers(0, 10**6),
    joints=st.integers(1, 9),
    frames=st.integers(1, 12),
    fps=st.sampled_from([20.0, 30.0, 29.97, 30000 / 1001, 60.0, 120.0, 12.5, 1.0, 1000.0]),
    moving=st.booleans(),
    dressed=st.booleans(),
)
def test_round_trips_keep_places_names_and_rate(
    tmp_path: Path, seed: int, joints: int, frames: int, fps: float, moving: bool, dressed: bool
) -> None:
    motion = random_motion(seed, joints=joints, frames=frames, fps=fps, moving=moving)
    back = load_glb(save_glb([motion], tmp_path / "x.glb", body=dressed))
    assert back.fps == fps
    assert back.skeleton.names == motion.skeleton.names
    assert back.skeleton.parents == motion.skeleton.parents
    assert back.skeleton.ends == motion.skeleton.ends
    np.testing.assert_allclose(back.skeleton.offsets, motion.skeleton.offsets, atol=1e-6)
    np.testing.assert_allclose(back.positions(), motion.positions(), atol=1e-4)


@QUICK
@given(seeds=st.lists(st.integers(0, 10**6), min_size=2, max_size=4), dressed=st.booleans())
def test_several_people_keep_their_own_tree_length_and_rate(tmp_path: Path, seeds: list[int], dressed: bool) -> None:
    people = [random_motion(s, frames=3 + i, fps=20.0 + 10 * (i % 2)) for i, s in enumerate(seeds)]
    path = save_glb(people, tmp_path / "x.glb", body=dressed)
    for i, motion in enumerate(people):
        back = load_glb(path, person=i)
        assert back.fps == motion.fps
        np.testing.assert_allclose(back.positions(), motion.positions(), atol=1e-4)
    with pytest.raises(MotionloomError, match=f"{len(people)} people"):
        load_glb(path, person=len(people))


def test_ten_minutes_are_written_and_read_in_under_two_seconds_each(tmp_path: Path) -> None:
    motion = person(18_000)
    start = time.process_time()
    path = save_glb([motion], tmp_path / "x.glb")
    middle = time.process_time()
    back = load_glb(path)
    assert max(middle - start, time.process_time() - middle) < 2
    assert len(back) == 18_000
    np.testing.assert_allclose(back.root, motion.root, atol=1e-4)


# --- what is in the file -----------------------------------------------------------------------------------------


def floats(document: pygltflib.GLTF2, number: int) -> np.ndarray:
    accessor = document.accessors[number]
    view = document.bufferViews[accessor.bufferView]
    width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[accessor.type]
    data = document.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
    return np.frombuffer(data, "<f4").reshape(accessor.count, width)


def test_nodes_stand_in_rest_pose_and_the_bind_matrices_undo_it(tmp_path: Path) -> None:
    document = pygltflib.GLTF2().load(str(save_glb([person()], tmp_path / "x.glb")))
    assert document is not None
    skin = document.skins[0]
    assert [document.nodes[j].name for j in skin.joints] == list(SMPL22.names)
    assert all(document.nodes[j].rotation is None for j in skin.joints)
    binds = floats(document, skin.inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
    rest = np.concatenate([SMPL22.rest_positions(), np.ones((22, 1))], axis=-1)
    np.testing.assert_allclose(np.einsum("jab,jb->ja", binds, rest), np.tile([0, 0, 0, 1], (22, 1)), atol=1e-6)


def test_keys_have_exact_times_and_continuous_unit_quaternions(tmp_path: Path) -> None:
    motion = person(100, 24.0)
    signs = np.where(np.arange(100) % 2, -1.0, 1.0)[:, None, None]
    flipped = Motion(motion.skeleton, motion.fps, motion.root, 1.7 * signs * motion.rotations)
    document = pygltflib.GLTF2().load(str(save_glb([flipped], tmp_path / "x.glb")))
    assert document is not None
    animation = document.animations[0]
    for sampler, channel in zip(animation.samplers, animation.channels):
        np.testing.assert_array_equal(floats(document, sampler.input)[:, 0], (np.arange(100) / 24).astype("f4"))
        if channel.target.path == "rotation":
            q = floats(document, sampler.output)
            np.testing.assert_allclose(np.linalg.norm(q, axis=-1), 1, atol=1e-6)
            assert ((q[1:] * q[:-1]).sum(axis=-1) > 0).all()
    assert sum(c.target.path == "rotation" for c in animation.channels) == 22
    assert sum(c.target.path == "translation" for c in animation.channels) == 1


def test_the_body_is_closed_faces_outward_and_has_human_size() -> None:
    pieces = body(person())
    rest = SMPL22.rest_positions()
    for piece in pieces:
        a, b, c = (piece.points[piece.triangles[:, k]] for k in range(3))
        assert (np.cross(b - a, c - a) * (a - piece.points.mean(axis=0))).sum() > 0  # six times the volume
        edges = {(int(t[k]), int(t[(k + 1) % 3])) for t in piece.triangles for k in range(3)}
        assert {(b, a) for a, b in edges} == edges  # every edge is shared by two faces that turn alike
    points = np.concatenate([p.points + rest[p.joint] for p in pieces])
    tall, wide = np.ptp(points[:, 1]), np.ptp(points[:, 0])
    assert 1.5 < tall < 1.9
    assert 1.2 < wide < 2.0
    assert points[:, 1].min() > -0.08
    assert {p.side for p in pieces} == {-1, 0, 1, 2}


def validator() -> list[str]:
    """Command that checks a GLB and prints the validator's report, or a skip."""
    folder = os.environ.get("MOTIONLOOM_GLTF_VALIDATOR", "")
    node = shutil.which("node")
    if not node or not (Path(folder) / "index.js").is_file():
        pytest.skip("needs node, and MOTIONLOOM_GLTF_VALIDATOR naming the folder of the npm package gltf-validator")
    script = (
        "const [package_, file] = process.argv.slice(1);"
        "require(package_).validateBytes(new Uint8Array(require('fs').readFileSync(file)))"
        ".then(report => console.log(JSON.stringify(report.issues)));"
    )
    return [node, "-e", script, str(Path(folder).absolute())]


@pytest.mark.parametrize("dressed", [True, False])
def test_the_khronos_validator_finds_no_fault(tmp_path: Path, dressed: bool) -> None:
    command = validator()
    for name, motions in {
        "one": [person()],
        "two": [person(), random_motion(1, moving=True)],
        "still": [person(1)],
        "point": [random_motion(2, joints=1)],
        "many": [random_motion(3, joints=300, frames=2)],
    }.items():
        path = save_glb(motions, tmp_path / f"{name}.glb", body=dressed)
        printed = subprocess.run([*command, str(path)], capture_output=True, text=True, check=True, timeout=60).stdout
        report = json.loads(printed)
        assert (report["numErrors"], report["numWarnings"]) == (0, 0), report["messages"][:3]


# --- other people's files ----------------------------------------------------------------------------------------


class Foreign:
    """A small .gltf with embedded data, put together by hand."""

    def __init__(self, nodes: list[dict[str, Any]]) -> None:
        self.data = b""
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "nodes": nodes,
            "accessors": [],
            "bufferViews": [],
            "animations": [{"samplers": [], "channels": []}],
        }

    def add(self, values: Any, *, dtype: str = "<f4", **more: Any) -> int:
        array = np.asarray(values, dtype=dtype)
        array = array[:, None] if array.ndim == 1 else array
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": array.nbytes}
        kind = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[array.shape[1]]
        component = {"<f4": 5126, "<i2": 5122}[dtype]
        self.json["accessors"].append(
            {"bufferView": len(self.json["bufferViews"]), "componentType": component, "count": len(array), "type": kind}
            | more
        )
        self.json["bufferViews"].append(view)
        self.data += array.tobytes() + b"\0" * (-array.nbytes % 4)
        return len(self.json["accessors"]) - 1

    def key(self, node: int, path: str, times: Any, values: Any, *, mode: str = "LINEAR", **more: Any) -> "Foreign":
        animation = self.json["animations"][0]
        sampler = {"input": self.add(times), "output": self.add(values, **more), "interpolation": mode}
        animation["samplers"].append(sampler)
        target = {"node": node, "path": path}
        animation["channels"].append({"sampler": len(animation["samplers"]) - 1, "target": target})
        return self

    def write(self, folder: Path) -> Path:
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        path = folder / "foreign.gltf"
        path.write_text(json.dumps(self.json | {"buffers": [{"byteLength": len(self.data), "uri": uri}]}))
        return path


HALF = float(np.sqrt(0.5))
CHAIN = [{"name": "hip", "children": [1]}, {"name": "knee", "translation": [0, -1, 0]}]


def test_linear_keys_far_apart_turn_at_constant_speed(tmp_path: Path) -> None:
    file = Foreign(copy.deepcopy(CHAIN)).key(0, "rotation", [0, 1], [[0, 0, 0, 1], [0, 0, HALF, HALF]])
    motion = load_glb(file.write(tmp_path))
    assert (motion.fps, len(motion)) == (30.0, 31)
    angle = np.arange(31) / 30 * np.pi / 2
    np.testing.assert_allclose(
        motion.positions()[:, 1], np.stack([np.sin(angle), -np.cos(angle), 0 * angle], -1), atol=1e-6
    )


def test_linear_turns_take_the_shorter_way(tmp_path: Path) -> None:
    file = Foreign(copy.deepcopy(CHAIN)).key(0, "rotation", [0, 1], [[0, 0, 0, 1], [0, 0, -HALF, -HALF]])
    angle = 2 * np.arctan2(*np.abs(load_glb(file.write(tmp_path)).rotations[15, 0, [3, 0]]))
    assert angle == pytest.approx(np.pi / 4)


def test_step_keys_hold_until_the_next(tmp_path: Path) -> None:
    times = np.arange(4) / 25
    file = Foreign(copy.deepcopy(CHAIN)).key(0, "translation", [0, 2 / 25], [[0, 0, 0], [1, 0, 0]], mode="STEP")
    file.key(1, "rotation", times, np.tile([0, 0, 0, 1], (4, 1)))
    motion = load_glb(file.write(tmp_path))
    assert motion.fps == 25
    np.testing.assert_allclose(motion.root[:, 0], [0, 0, 1, 1])


def test_cubic_keys_follow_their_polynomial(tmp_path: Path) -> None:
    """A cubic Hermite spline reproduces x = t^3 - t exactly."""
    times = np.array([0.0, 0.5, 1.5])
    values, slopes = times**3 - times, 3 * times**2 - 1
    triples = np.zeros((9, 3))
    triples[0::3, 0] = triples[2::3, 0] = slopes
    triples[1::3, 0] = values
    motion = load_glb(
        Foreign(copy.deepcopy(CHAIN)).key(0, "translation", times, triples, mode="CUBICSPLINE").write(tmp_path)
    )
    t = np.arange(len(motion)) / motion.fps
    assert t[-1] == pytest.approx(1.5)
    np.testing.assert_allclose(motion.root[:, 0], t**3 - t, atol=1e-6)


def test_an_armature_that_turns_and_shrinks_is_folded_in(tmp_path: Path) -> None:
    """As Blender and Mixamo export: centimetres, Z up, under a node that makes metres with Y up."""
    nodes = [
        {
            "name": "Armature",
            "rotation": [-HALF, 0, 0, HALF],
            "scale": [0.01] * 3,
            "translation": [1, 0, 0],
            "children": [1],
        },
        {"name": "hip", "translation": [0, 0, 100], "children": [2]},
        {"name": "knee", "translation": [10, 0, -50]},
    ]
    file = Foreign(nodes)
    file.json["skins"] = [{"joints": [1, 2]}]
    file.key(1, "translation", [0, 1 / 30], [[0, 0, 100], [0, -20, 100]])
    file.key(0, "scale", [0, 1 / 30], [[0.01] * 3] * 2)  # keyed, but still
    motion = load_glb(file.write(tmp_path))
    assert motion.skeleton.names == ("hip", "knee")
    assert motion.translations is None
    np.testing.assert_allclose(motion.root, [[1, 1, 0], [1, 1, 0.2]], atol=1e-6)
    np.testing.assert_allclose(motion.positions()[:, 1], [[1.1, 0.5, 0], [1.1, 0.5, 0.2]], atol=1e-6)


def test_rest_rotations_and_matrices_are_honoured(tmp_path: Path) -> None:
    """A quarter turn about z at rest: the knee hangs at +x of the hip."""
    plain = Foreign([{"rotation": [0, 0, HALF, HALF], "children": [1]}, {"translation": [0, -1, 0]}])
    matrix = [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]
    scaled = Foreign([{"matrix": matrix, "children": [1]}, {"translation": [0, -0.5, 0]}])
    for file in (plain, scaled):
        file.key(1, "rotation", [0], [[0, 0, 0, 1]])
        file.json["skins"] = [{"joints": [0, 1]}]
        np.testing.assert_allclose(load_glb(file.write(tmp_path)).positions()[0], [[0, 0, 0], [1, 0, 0]], atol=1e-6)


def test_whole_number_rotations_are_scaled(tmp_path: Path) -> None:
    half = round(HALF * 32767)
    file = Foreign(copy.deepcopy(CHAIN))
    file.key(0, "rotation", [0, 0.04], [[0, 0, half, half]] * 2, dtype="<i2", normalized=True)
    np.testing.assert_allclose(load_glb(file.write(tmp_path)).positions()[0, 1], [1, 0, 0], atol=1e-4)


@pytest.mark.parametrize("fps", [23.976, 24, 25, 29.97, 30, 50, 59.94, 60, 90, 120, 240])
def test_the_rate_is_inferred_from_times_in_single_precision(tmp_path: Path, fps: float) -> None:
    for start, count in ((0.0, 2), (0.0, 5000), (100.0, 50)):
        times = start + np.arange(count) / fps
        file = Foreign(copy.deepcopy(CHAIN)).key(
            0, "translation", times, np.random.default_rng(0).normal(size=(count, 3))
        )
        motion = load_glb(file.write(tmp_path))
        assert motion.fps == pytest.approx(fps, rel=2e-5 if start == 0 else 1e-2)
        assert len(motion) == count or start > 0


def test_a_skeleton_without_animation_is_one_frame_at_rest(tmp_path: Path) -> None:
    file = Foreign(copy.deepcopy(CHAIN))
    file.json |= {"skins": [{"joints": [0, 1]}], "animations": []}
    motion = load_glb(file.write(tmp_path))
    assert len(motion) == 1
    assert motion.skeleton.names == ("hip", "knee")


def test_props_beside_the_skeleton_are_left_out_and_twins_renamed(tmp_path: Path) -> None:
    nodes = [
        {"name": "a", "children": [1, 2, 3]},
        {"name": "a", "translation": [0, 1, 0]},
        {"name": "sword", "mesh": 0, "scale": [1, 2, 3]},
        {"name": "a", "translation": [0, 1, 0]},
        {"name": "camera", "camera": 0},
    ]
    file = Foreign(nodes).key(4, "translation", [0, 1], [[0, 0, 0], [1, 1, 1]])
    file.json["skins"] = [{"joints": [3, 1, 0]}]
    assert load_glb(file.write(tmp_path)).skeleton.names == ("a", "a_2", "a_3")


# --- hostile files -----------------------------------------------------------------------------------------------


def broken(change: str) -> Foreign:
    """A sound file with one thing wrong."""
    file = Foreign(copy.deepcopy(CHAIN)).key(0, "rotation", [0, 0.04], [[0, 0, 0, 1]] * 2)
    exec(change, {"file": file, "j": file.json, "np": np})
    return file


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("j['nodes'][1]['children'] = [0]", "circle"),
        ("j['nodes'][1]['children'] = [1]", "two parents"),
        ("j['nodes'].append({'children': [1]})", "two parents"),
        ("j['nodes'][0]['children'] = [7]", "names none of its 2 nodes"),
        ("j['nodes'][0]['children'] = [True]", "names none"),
        ("j['nodes'][0]['scale'] = [1, 2, 1]", "scaled by"),
        ("j['nodes'][0]['scale'] = [0, 0, 0]", "scaled by"),
        ("j['nodes'][0]['scale'] = [-1, -1, -1]", "scaled by"),
        ("j['nodes'][0]['matrix'] = [1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]", "sheared"),
        ("j['nodes'][0]['matrix'] = [0] * 16", "flat"),
        ("j['nodes'][1]['translation'] = [0, 1e300, 0]", "finite"),
        ("j['nodes'][1]['translation'] = [0, 1e8, 0]", "check the units"),
        ("j['nodes'][1]['translation'] = 'up'", "3 finite numbers"),
        ("j['nodes'][0]['rotation'] = [0, 0, 0, 0]", "unit quaternion"),
        ("j['nodes'] = []", "nodes"),
        ("j['nodes'] = {'a': 1}", "list of objects"),
        ("j['accessors'][0]['count'] = 2**40", "claims"),
        ("j['accessors'][0]['count'] = 10**7", "beyond the end"),
        ("j['accessors'][0]['count'] = -1", "count"),
        ("j['accessors'][1]['count'] = 1", "1 values for 2 key times"),
        ("j['accessors'][1]['type'] = 'VEC3'", "must be VEC4"),
        ("j['accessors'][1]['componentType'] = 5130", "component type"),
        ("j['accessors'][1]['byteOffset'] = 8", "beyond the end"),
        ("j['accessors'][1]['sparse'] = {}", "sparse"),
        ("j['bufferViews'][1]['byteStride'] = 3", "stride"),
        ("j['bufferViews'][1]['byteLength'] = 10**9", "beyond the end"),
        ("j['bufferViews'][1]['buffer'] = 4", "buffers"),
        ("file.data = file.data[:8] + np.full(8, np.nan, '<f4').tobytes()", "not finite"),
        ("file.data = np.array([1, 0], '<f4').tobytes() + file.data[8:]", "do not rise"),
        ("file.data = np.array([0, 1e6], '<f4').tobytes() + file.data[8:]", "too large"),
        ("file.data = file.data[:8] + bytes(32)", "unit quaternion"),
        ("j['animations'][0]['samplers'][0]['interpolation'] = 'MAGIC'", "MAGIC"),
        ("j['animations'][0]['samplers'][0]['interpolation'] = 'CUBICSPLINE'", "values for"),
        ("j['animations'][0]['channels'][0]['sampler'] = 9", "samplers"),
        ("j['animations'] = []", "neither"),
        ("j['asset'] = {'version': '1.0'}", "version"),
        ("j['asset'] = 3", "version"),
        ("j['skins'] = [{'joints': []}]", "no joints"),
        ("j['skins'] = [{'joints': [5]}]", "nodes"),
        ("j['extensionsRequired'] = ['EXT_meshopt_compression']", "compress"),
        ("file.key(0, 'scale', [0, 0.04], [[1, 1, 1], [2, 2, 2]])", "changes through time"),
    ],
)
def test_wrong_files_are_refused_in_one_sentence(tmp_path: Path, change: str, words: str) -> None:
    with pytest.raises(MotionloomError, match=words) as caught:
        load_glb(broken(change).write(tmp_path))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300 + len(str(tmp_path))


@pytest.mark.parametrize(
    "uri", ["secret.bin", "../../etc/passwd", "/etc/passwd", "file:///etc/passwd", "http://a/b", 7]
)
def test_outside_files_are_never_followed(tmp_path: Path, uri: Any) -> None:
    (tmp_path / "secret.bin").write_bytes(bytes(100))
    path = broken("").write(tmp_path)
    content = json.loads(path.read_text())
    content["buffers"][0]["uri"] = uri
    path.write_text(json.dumps(content))
    with pytest.raises(MotionloomError, match="outside file"):
        load_glb(path)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"glTF",
        b"glTF" + struct.pack("<II", 2, 2**32 - 1) + bytes(20),
        b"glTF" + struct.pack("<II", 1, 32) + bytes(20),
        b"glTF" + struct.pack("<III", 2, 32, 2**32 - 1) + b"JSON" + bytes(12),
        b"glTF" + struct.pack("<III", 2, 32, 12) + b"BIN\0" + bytes(12),
        b"{",
        b"[]",
        b"null",
        b"\xff\xfe{}",
        b"[" * 100_000,
        b'{"asset": {"version": "2.0"}, "nodes": [{"translation": [NaN, 0, 0]}]}',
        b'{"asset": {"version": "2.0"}, "nodes": [{"translation": [' + b"9" * 5000 + b", 0, 0]}]}",
        b'{"asset": {"version": "2.0"}, "nodes": [{"translation": [1e999, 0, 0]}]}',
        bytes(range(256)),
    ],
)
def test_junk_is_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "x.glb"
    path.write_bytes(data)
    with pytest.raises(MotionloomError):
        load_glb(path)


def test_missing_files_and_folders_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "none.glb", tmp_path):
        with pytest.raises(MotionloomError):
            load_glb(path)


def test_every_truncation_is_refused(tmp_path: Path) -> None:
    data = save_glb([random_motion(0, joints=3, frames=2)], tmp_path / "x.glb", body=False).read_bytes()
    path = tmp_path / "cut.glb"
    for length in range(0, len(data), 29):
        path.write_bytes(data[:length])
        with pytest.raises(MotionloomError):
            load_glb(path)


def load_or_complaint(path: Path) -> Motion | str:
    try:
        return load_glb(path)
    except MotionloomError as error:
        return str(error)


def loads_or_complains(path: Path) -> None:
    result = load_or_complaint(path)
    if isinstance(result, str):
        assert "\n" not in result
    else:
        assert np.isfinite(result.positions()).all()


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(edits=st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), min_size=1, max_size=6))
def test_changed_bytes_give_a_motion_or_a_sentence(tmp_path: Path, edits: list[tuple[float, int]]) -> None:
    source = tmp_path / "sound.glb"
    if not source.exists():
        save_glb([random_motion(0, joints=3, frames=3, moving=True)], source)
    data = bytearray(source.read_bytes())
    for where, value in edits:
        data[int(where * len(data))] = value
    path = tmp_path / "mutant.glb"
    path.write_bytes(data)
    loads_or_complains(path)


def leaves(value: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Ways to every value in a JSON tree."""
    below = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [way for key, inner in below for way in [(*at, key), *leaves(inner, (*at, key))]]


NASTY = st.sampled_from(
    [
        None,
        True,
        -1,
        0,
        1,
        3,
        2**31,
        2**63,
        10**30,
        1e300,
        -0.5,
        "",
        "x",
        "\ud800",
        [],
        {},
        [0],
        [[]],
        {"a": 1},
        [None] * 4,
    ]
)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(edits=st.lists(st.tuples(st.integers(0, 10**6), NASTY), min_size=1, max_size=3))
def test_changed_declarations_give_a_motion_or_a_sentence(tmp_path: Path, edits: list[tuple[int, Any]]) -> None:
    file = Foreign(
        [{"name": "top", "scale": [2, 2, 2], "children": [1]}, {"children": [2], "rotation": [0, 0, 0, 1]}, {}]
    )
    file.json["skins"] = [{"joints": [1, 2], "skeleton": 1}]
    file.key(1, "rotation", [0, 0.04, 0.08], [[0, 0, 0, 1]] * 3).key(
        1, "translation", [0, 1], [[0, 0, 0]] * 2, mode="STEP"
    )
    file.key(2, "translation", [0, 1], [[0, 1, 0]] * 6, mode="CUBICSPLINE").key(0, "scale", [0], [[2, 2, 2]])
    path = file.write(tmp_path)
    content = json.loads(path.read_text())
    for number, value in edits:
        ways = leaves(content)
        if not ways:
            break
        *way, last = ways[number % len(ways)]
        place = content
        for key in way:
            place = place[key]
        place[last] = copy.deepcopy(value)
    path.write_text(json.dumps(content))
    loads_or_complains(path)


def test_deep_and_wide_trees_take_no_time(tmp_path: Path) -> None:
    deep = Foreign([{"children": [i + 1]} for i in range(9_999)] + [{}]).key(0, "rotation", [0], [[0, 0, 0, 1]])
    wide = Foreign([{"children": list(range(1, 9_999))}] + [{} for _ in range(9_999)]).key(
        0, "rotation", [0], [[0, 0, 0, 1]]
    )
    many = Foreign([{"children": [i + 1]} for i in range(9_999)] + [{}])
    many.json["skins"] = [{"joints": list(range(10_000))}] * 60
    for file in (deep, wide, many):
        start = time.process_time()
        load_or_complaint(file.write(tmp_path))
        assert time.process_time() - start < 10


# --- refusals when writing ---------------------------------------------------------------------------------------


def test_nothing_to_save_and_missing_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="no motion"):
        save_glb([], tmp_path / "x.glb")
    with pytest.raises(MotionloomError, match="nowhere"):
        save_glb([person(2)], tmp_path / "nowhere" / "x.glb")
    assert list(tmp_path.iterdir()) == []
