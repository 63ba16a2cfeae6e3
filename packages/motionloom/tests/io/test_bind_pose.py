"""A character that was saved in the middle of an animation: it stands as its mesh was bound, not as its nodes are."""

import copy
from pathlib import Path

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.io.character import load_character
from motionloom.io.gltf import load_glb
from motionloom.retarget import retarget
from tests.io.gltf_skin import Scene
from tests.io.rigged import Hero, wave

QUARTER = [0.0, 0.5**0.5, 0.0, 0.5**0.5]


def lean(hero: Hero, degrees: float, *, lower: float = 0.0) -> Hero:
    """The topmost joint's node turned about the world's X, and lower."""
    node = hero.json["nodes"][0]
    turn = rot.rotvec_to_quat(np.radians([degrees, 0.0, 0.0]))
    node["rotation"] = np.roll(rot.multiply(turn, np.roll(np.array(node["rotation"]), 1)), -1).tolist()
    node["translation"] = (np.array(node["translation"]) - [0.0, lower, 0.0]).tolist()
    return hero


def stopped(hero: Hero, angles: np.ndarray) -> Hero:
    """Every node left in a pose: rotation vectors (22, 3) against its rest, in the world's axes."""
    for j in range(22):
        above = hero.parents[j]
        base = rot.IDENTITY if above < 0 else hero.turns[above]
        local = rot.multiply(rot.inverse(base), rot.multiply(rot.rotvec_to_quat(angles[j]), hero.turns[j]))
        hero.json["nodes"][j]["rotation"] = np.roll(local, -1).tolist()
    return hero


def place(hero: Hero) -> Hero:
    """The whole scene under a node that stands at (3, 0, 1) and is turned by a quarter to the left."""
    scene = hero.json["scenes"][0]
    placed = {"name": "placed", "translation": [3.0, 0.0, 1.0], "rotation": QUARTER, "children": scene["nodes"]}
    hero.json["nodes"].append(placed)
    scene["nodes"] = [len(hero.json["nodes"]) - 1]
    return hero


def rest_of(path: Path) -> np.ndarray:
    """(22, 3) the body's joints at rest."""
    skeleton = load_character(path).skeleton
    return skeleton.rest_positions()[[skeleton.index(name) for name in SMPL22.names]]


def moving(path: Path, out: Path) -> np.ndarray:
    """(frames, vertices, 3) of the character's mesh with a clip that is written into its file."""
    character = load_character(path)
    motion = Motion(SMPL22, 30.0, np.tile(SMPL22.offsets[0], (20, 1)), rot.rotvec_to_quat(0.5 * wave(20)))
    character.save(retarget(motion, character.skeleton), out, name="ours")
    scene = Scene(out)
    worlds = scene.worlds(scene.clip("ours"), np.arange(20) / 30.0)
    (found,) = scene.vertices(worlds).values()
    return found


@pytest.mark.parametrize(
    ("degrees", "lower", "pose"), [(25.0, 0.0, 0.0), (0.0, 0.1, 0.0), (10.0, 0.05, 1.0), (-25.0, 0.0, 1.0)]
)
def test_a_file_saved_in_the_middle_of_an_animation_stands_upright(
    tmp_path: Path, degrees: float, lower: float, pose: float
) -> None:
    """Its mesh moves to the millimetre as that of the file that was saved at rest."""
    still = moving(Hero().write(tmp_path / "still.glb"), tmp_path / "a.glb")
    posed = lean(stopped(Hero(), pose * wave()[9]), degrees, lower=lower).write(tmp_path / "posed.glb")
    np.testing.assert_allclose(rest_of(posed), SMPL22.rest_positions(), atol=1e-5)
    np.testing.assert_allclose(moving(posed, tmp_path / "b.glb"), still, atol=1e-3)


def test_one_that_is_placed_somewhere_stands_there(tmp_path: Path) -> None:
    """Whether its nodes are at rest or in a pose."""
    there = np.array([3.0, 0.0, 1.0]) + rot.rotate(np.roll(np.array(QUARTER), 1), SMPL22.rest_positions())
    np.testing.assert_allclose(rest_of(place(Hero()).write(tmp_path / "a.glb")), there, atol=1e-5)
    posed = lean(stopped(Hero(), wave()[9]), 15.0, lower=0.06)
    np.testing.assert_allclose(rest_of(place(posed).write(tmp_path / "b.glb")), there, atol=1e-5)


def test_one_that_is_placed_by_its_topmost_joint_stands_there(tmp_path: Path) -> None:
    hero = Hero()
    node = hero.json["nodes"][0]
    turn = rot.rotvec_to_quat(np.array([0.0, np.pi / 2, 0.0]))
    node["rotation"] = np.roll(rot.multiply(turn, np.roll(np.array(node["rotation"]), 1)), -1).tolist()
    node["translation"] = [3.0, node["translation"][1], 1.0]
    hips = np.array([3.0, SMPL22.offsets[0, 1], 1.0])
    there = hips + rot.rotate(turn, SMPL22.rest_positions() - SMPL22.offsets[0])
    np.testing.assert_allclose(rest_of(hero.write(tmp_path / "hero.glb")), there, atol=1e-5)


def test_a_second_skin_is_bound_where_the_body_is(tmp_path: Path) -> None:
    """Hair that comes first and hangs on a head that is turned in the file."""
    hero = Hero()
    matrices = hero.values(hero.json["skins"][0]["inverseBindMatrices"], 16)
    own = hero.add(matrices[[12, 15]], 5126, "MAT4")
    hero.json["skins"].insert(0, {"joints": [12, 15], "inverseBindMatrices": own})
    hero.json["nodes"][24]["skin"] = 1
    hero.json["nodes"].append({"name": "hair", "mesh": 0, "skin": 0})
    stopped(hero, wave()[9])
    np.testing.assert_allclose(rest_of(hero.write(tmp_path / "hero.glb")), SMPL22.rest_positions(), atol=1e-5)


def test_a_quantised_mesh_is_bound_as_it_was(tmp_path: Path) -> None:
    """Its space has a size and a place of its own, which the inverse bind matrices undo."""
    hero = Hero()
    skin = hero.json["skins"][0]
    inverse = hero.values(skin["inverseBindMatrices"], 16).reshape(-1, 4, 4).transpose(0, 2, 1)
    back = np.diag([0.002, 0.002, 0.002, 1.0])
    back[:3, 3] = [-1.0, -0.2, -0.5]
    packed = (inverse @ back).transpose(0, 2, 1).reshape(-1, 16)
    packed[:, [3, 7, 11]], packed[:, 15] = 0.0, 1.0
    skin["inverseBindMatrices"] = hero.add(packed, 5126, "MAT4")
    lying = copy.deepcopy(hero)
    np.testing.assert_allclose(rest_of(hero.write(tmp_path / "a.glb")), SMPL22.rest_positions(), atol=1e-5)
    lean(stopped(lying, wave()[9]), 25.0)
    np.testing.assert_allclose(rest_of(lying.write(tmp_path / "b.glb")), SMPL22.rest_positions(), atol=1e-5)


def test_a_mesh_that_was_made_lying_is_left_to_its_nodes(tmp_path: Path) -> None:
    """Made with Z up and stood up by its topmost joint: no node above the skeleton says so."""
    hero = Hero()
    skin = hero.json["skins"][0]
    inverse = hero.values(skin["inverseBindMatrices"], 16).reshape(-1, 4, 4).transpose(0, 2, 1)
    stand = np.eye(4)
    stand[:3, :3] = rot.quat_to_matrix(rot.rotvec_to_quat(np.array([-np.pi / 2, 0.0, 0.0])))
    packed = (inverse @ stand).transpose(0, 2, 1).reshape(-1, 16)
    packed[:, [3, 7, 11]], packed[:, 15] = 0.0, 1.0
    skin["inverseBindMatrices"] = hero.add(packed, 5126, "MAT4")
    np.testing.assert_allclose(rest_of(hero.write(tmp_path / "a.glb")), SMPL22.rest_positions(), atol=1e-5)


def test_matrices_with_a_damaged_last_row_are_read_as_they_are_meant(tmp_path: Path) -> None:
    hero = Hero()
    skin = hero.json["skins"][0]
    damaged = hero.values(skin["inverseBindMatrices"], 16).copy()
    damaged[:, [3, 7, 11, 15]] = 0.0
    skin["inverseBindMatrices"] = hero.add(damaged, 5126, "MAT4")
    np.testing.assert_allclose(rest_of(hero.write(tmp_path / "a.glb")), SMPL22.rest_positions(), atol=1e-5)


def test_a_mesh_under_absurd_scales_changes_nothing(tmp_path: Path) -> None:
    hero = lean(Hero(), 25.0)
    first = len(hero.json["nodes"])
    hero.json["nodes"] += [{"scale": [9e8] * 3, "children": [first + k + 1]} for k in range(40)]
    hero.json["nodes"] += [{"mesh": 0, "skin": 0}]
    hero.json["scenes"][0]["nodes"].append(first)
    with np.errstate(all="raise", under="ignore"):
        skeleton = load_glb(hero.write(tmp_path / "a.glb")).skeleton
    body = [skeleton.index(name) for name in SMPL22.names]
    np.testing.assert_allclose(skeleton.rest_positions()[body], SMPL22.rest_positions(), atol=1e-5)
