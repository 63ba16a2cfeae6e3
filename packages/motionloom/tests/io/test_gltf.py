"""GLB out and in: round trips, what is in the file, the Khronos validator."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pygltflib
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.io.gltf import load_glb, save_glb
from tests.io.gltf_files import person, random_motion
from tests.work import work

QUICK = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


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


def test_ten_minutes_are_written_and_read_with_the_work_of_two_seconds(tmp_path: Path) -> None:
    """Arrays go into the file and out of it whole; nothing is done frame by frame."""

    def counted(frames: int) -> tuple[int, int]:
        motion = person(frames)
        path = save_glb([motion], tmp_path / "x.glb")
        assert len(load_glb(path)) == frames
        return work(lambda: save_glb([motion], path)), work(lambda: load_glb(path))

    assert counted(18_000) == pytest.approx(counted(60), rel=0.05)
    motion = person(18_000)
    back = load_glb(save_glb([motion], tmp_path / "x.glb"))
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


# --- refusals when writing ---------------------------------------------------------------------------------------


def test_nothing_to_save_and_missing_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="no motion"):
        save_glb([], tmp_path / "x.glb")
    with pytest.raises(MotionloomError, match="nowhere"):
        save_glb([person(2)], tmp_path / "nowhere" / "x.glb")
    assert list(tmp_path.iterdir()) == []
