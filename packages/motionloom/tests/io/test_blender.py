"""Blender as a stranger: what it sees in our GLB and BVH files. Needs bpy, here or in another Python.

``MOTIONLOOM_BLENDER_PYTHON`` names a Python interpreter that can import bpy; without it bpy is looked for in this one.
"""

import importlib.util
import json
import os
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.io import save
from motionloom.io.character import load_character
from motionloom.retarget import retarget
from motionloom.retarget.named import NAMED, named_skeleton
from tests.io.in_blender import VARIABLE, Job, Shown, apart, python_with_bpy, shown
from tests.io.rigged import Hero, wave
from tests.shared import shared

pytestmark = pytest.mark.blender

# Runs inside Blender: import a file the way a user does, then write down every joint on every asked frame.
SCRIPT = """
import json, sys
import bpy
file, out, fps, frames = sys.argv[1], sys.argv[2], int(sys.argv[3]), json.loads(sys.argv[4])
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps = fps
if file.endswith(".glb"):
    bpy.ops.import_scene.gltf(filepath=file)
else:
    bpy.ops.import_anim.bvh(filepath=file, update_scene_fps=True, update_scene_duration=True)
people = []
for armature in (o for o in bpy.data.objects if o.type == "ARMATURE"):
    joints = []
    for frame in frames:
        scene.frame_set(frame)
        bpy.context.view_layer.update()
        joints.append({b.name: list(armature.matrix_world @ b.head) for b in armature.pose.bones})
    rest = {b.name: list(armature.matrix_world @ b.head_local) for b in armature.data.bones}
    people.append({"joints": joints, "rest": rest})
meshes = []
for mesh in (o for o in bpy.data.objects if o.type == "MESH" and o.find_armature()):
    scene.frame_set(frames[0])
    solid = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
    points = [list(solid.matrix_world @ v.co) for v in solid.data.vertices]
    meshes.append([[min(p[k] for p in points) for k in range(3)], [max(p[k] for p in points) for k in range(3)]])
ranges = [list(a.frame_range) for a in bpy.data.actions]
result = {"fps": scene.render.fps / scene.render.fps_base, "people": people, "meshes": meshes, "ranges": ranges}
with open(out, "w") as stream:
    json.dump(result, stream)
"""


def blender(file: Path, frames: list[int], fps: int = 30) -> dict[str, Any]:
    python = os.environ.get("MOTIONLOOM_BLENDER_PYTHON", sys.executable)
    if python == sys.executable and importlib.util.find_spec("bpy") is None:
        pytest.skip("needs bpy, here or in the Python named by MOTIONLOOM_BLENDER_PYTHON")
    out = file.with_suffix(".json")
    command = [python, "-c", SCRIPT, str(file), str(out), str(fps), json.dumps(frames)]
    subprocess.run(command, check=True, capture_output=True, timeout=180)
    return json.loads(out.read_text())


def walker(frames: int = 61, fps: float = 30.0) -> Motion:
    """Somebody who glides along an arc, turning left from +Z towards +X, and lifts the left arm."""
    time = np.arange(frames) / fps
    turned = np.zeros((frames, 22, 3))
    turned[:, 0, 1] = 0.5 * time
    turned[:, SMPL22.index("left_shoulder"), 2] = 0.6 * time
    height = np.full(frames, SMPL22.offsets[0, 1])
    root = np.stack([2 - 2 * np.cos(0.5 * time), height, 2 * np.sin(0.5 * time)], axis=-1)
    return Motion(SMPL22, fps, root, rot.rotvec_to_quat(turned))


def ours(blenders: dict[str, list[float]]) -> np.ndarray:
    """(22, 3): Blender's Z up and front at -Y to ours, joints in order."""
    places = np.array([blenders[name] for name in SMPL22.names])
    return np.stack([places[:, 0], places[:, 2], -places[:, 1]], axis=-1)


def test_blender_sees_the_glb_where_and_when_we_put_it(tmp_path: Path) -> None:
    motion = walker()
    seen = blender(save(motion, tmp_path / "walk.glb"), [0, 15, 30, 60])
    assert len(seen["people"]) == 1
    assert seen["ranges"] == [[0.0, 60.0]]
    for frame, joints in zip((0, 15, 30, 60), seen["people"][0]["joints"]):
        np.testing.assert_allclose(ours(joints), motion.positions()[frame], atol=1e-4)
    np.testing.assert_allclose(ours(seen["people"][0]["rest"]), SMPL22.rest_positions(), atol=1e-4)


def test_blender_sees_a_glb_of_another_rate_in_real_time(tmp_path: Path) -> None:
    motion = walker(41, 20.0)
    seen = blender(save(motion, tmp_path / "walk.glb"), [60], fps=30)
    np.testing.assert_allclose(ours(seen["people"][0]["joints"][0]), motion.positions()[40], atol=1e-4)


def test_blender_sees_a_body_of_human_size_that_faces_its_front(tmp_path: Path) -> None:
    seen = blender(save(walker(), tmp_path / "walk.glb"), [0])
    low, high = (np.array(corner) for corner in seen["meshes"][0])
    assert 1.5 < high[2] - low[2] < 1.9
    assert abs(low[2]) < 0.08
    joints = seen["people"][0]["joints"][0]
    assert joints["left_foot"][1] < joints["left_ankle"][1]  # toes point to -Y, Blender's front
    assert joints["left_wrist"][0] > 0.5


def test_blender_sees_two_people(tmp_path: Path) -> None:
    one = walker()
    two = Motion(SMPL22, 30.0, one.root + np.array([1.0, 0, 0]), one.rotations)
    seen = blender(save([one, two], tmp_path / "pair.glb"), [30])
    roots = sorted(ours(p["joints"][0])[0].tolist() for p in seen["people"])
    np.testing.assert_allclose(roots, sorted([one.root[30].tolist(), two.root[30].tolist()]), atol=1e-4)


def test_blender_sees_the_bvh_with_its_rate_height_facing_and_path(tmp_path: Path) -> None:
    motion = walker()
    seen = blender(save(motion, tmp_path / "walk.bvh"), [1, 31, 61], fps=24)
    assert seen["fps"] == pytest.approx(30, rel=1e-3)
    for frame, joints in zip((0, 30, 60), seen["people"][0]["joints"]):
        np.testing.assert_allclose(ours(joints), motion.positions()[frame], atol=1e-3)
    rest = ours(seen["people"][0]["rest"])
    assert 1.5 < np.ptp(rest[:, 1]) < 1.9


# Characters ----------------------------------------------------------------------------------------------------------


def waver() -> Motion:
    """Somebody who goes ahead and waves with everything."""
    way = np.arange(40)[:, None] * [0.002, 0.0, 0.02]
    return Motion(SMPL22, 30.0, SMPL22.offsets[0] + way, rot.rotvec_to_quat(wave()))


def as_glb_and_bvh(path: Path, folder: Path) -> tuple[Motion, Path, Path]:
    """The waver on a character: the motion, the character's own file with it, and the same as BVH."""
    character = load_character(path)
    made = retarget(waver(), character.skeleton)
    out = character.save(made, folder / f"out{path.suffix}", name="ours")
    return made, out.rename(folder / f"{path.stem}_ours.glb"), save(made, folder / f"{path.stem}.bvh")


def check_in_blender(made: dict[str, tuple[Motion, Path, Path]]) -> None:
    """Every vertex to 1 mm, as the glTF specification has it, and every joint of the BVH."""
    frames = (0, 17, 39)
    jobs = [Job(glb, frames, clip="ours") for _, glb, _ in made.values()]
    jobs += [Job(bvh, tuple(f + 1 for f in frames)) for _, _, bvh in made.values()]
    seen = shown(jobs)
    for (name, (motion, glb, _)), of_glb, of_bvh in zip(made.items(), seen[: len(made)], seen[len(made) :]):
        assert not of_glb.error, (name, of_glb.error)
        largest, count = apart(glb, "ours", frames, 30.0, of_glb)
        assert count
        assert largest < 1e-3, name
        check_joints(name, motion, of_bvh, frames)


def check_joints(name: str, motion: Motion, seen: Shown, frames: tuple[int, ...]) -> None:
    assert not seen.error, (name, seen.error)
    places = motion.positions()[list(frames)]
    for j, joint in enumerate(motion.skeleton.names):
        if j not in motion.skeleton.ends:
            np.testing.assert_allclose(seen.bones[joint], places[:, j], atol=1e-3, err_msg=f"{name}: {joint}")


@pytest.fixture
def bpy_is_there() -> None:
    if python_with_bpy() is None:
        pytest.skip(f"needs bpy, here or in the Python named by {VARIABLE}")


@pytest.mark.usefixtures("bpy_is_there")
def test_blender_sees_our_own_characters_to_a_millimetre(tmp_path: Path) -> None:
    """Turned bones, feet on controls, other clips that would leave their pose behind, another size."""
    heroes = {
        "turned": Hero(seed=3),
        "other_clip": Hero(seed=4).clip("other", wave(seed=5)),
        "feet_on_controls": Hero(hang={"left_ankle": "pelvis", "right_ankle": "pelvis"}),
        "giant": Hero(size=1.3),
    }
    paths = {name: hero.write(tmp_path / f"{name}.glb") for name, hero in heroes.items()}
    check_in_blender({name: as_glb_and_bvh(path, tmp_path) for name, path in paths.items()})


@pytest.mark.usefixtures("bpy_is_there")
def test_blender_sees_the_skeletons_that_have_a_name(tmp_path: Path) -> None:
    motions = {name: retarget(waver(), named_skeleton(name)) for name in NAMED}
    frames = (0, 17, 39)
    jobs = [Job(save(m, tmp_path / f"{name}.bvh"), tuple(f + 1 for f in frames)) for name, m in motions.items()]
    for (name, motion), seen in zip(motions.items(), shown(jobs)):
        check_joints(name, motion, seen, frames)


@pytest.mark.usefixtures("bpy_is_there")
def test_blender_sees_characters_of_others_to_a_millimetre(tmp_path: Path) -> None:
    names = ("gdbot", "kaykit_knight", "robot_expressive", "sophia", "ue_m2m_anim", "vrm1_example")
    found = {path.stem: path for path in shared("rigs").iterdir() if path.suffix in (".glb", ".vrm")}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_in_blender({name: as_glb_and_bvh(found[name], tmp_path) for name in names})
