"""USD text as USD's own library reads it: sizes, axes, time, joints and skinned meshes. Needs usd-core (pxr)."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.io import load, save, save_scene
from motionloom.io.character import load_character
from motionloom.io.gltf_mesh import read_surfaces
from motionloom.io.usda import joint_paths, save_usda
from motionloom.retarget import retarget
from tests.io.gltf_skin import Scene
from tests.io.rigged import Hero, wave
from tests.shared import shared

FPS, FRAMES = 24.0, 31


def waver(frames: int = FRAMES) -> Motion:
    way = np.arange(frames)[:, None] * [0.01, 0.0, 0.02]
    return Motion(SMPL22, FPS, SMPL22.offsets[0] + way, rot.rotvec_to_quat(wave(frames)))


def opened(path: Path) -> Any:
    pytest.importorskip("pxr", reason="usd-core is not installed: pip install motionloom[usd]")
    from pxr import Usd

    return Usd.Stage.Open(str(path))


def queries(stage: Any) -> list[tuple[Any, list[Any]]]:
    """USD's view of each person: the skeleton's query, and the points of each mesh as functions of time."""
    from pxr import Usd, UsdGeom, UsdSkel

    found = []
    for prim in stage.Traverse():
        if not prim.IsA(UsdSkel.Root):
            continue
        cache = UsdSkel.Cache()
        assert cache.Populate(UsdSkel.Root(prim), Usd.PrimDefaultPredicate)
        (bone,) = [p for p in Usd.PrimRange(prim) if p.IsA(UsdSkel.Skeleton)]
        query = cache.GetSkelQuery(UsdSkel.Skeleton(bone))

        def skinned(
            time: float, query: Any = query, cache: Any = cache, prim: Any = prim, kept: Any = stage
        ) -> np.ndarray:
            parts = []
            for mesh in (p for p in Usd.PrimRange(prim) if p.IsA(UsdGeom.Mesh)):
                points = UsdGeom.Mesh(mesh).GetPointsAttr().Get()
                moves = query.ComputeSkinningTransforms(time)
                assert cache.GetSkinningQuery(mesh).ComputeSkinnedPoints(moves, points, time)
                parts.append(np.array(points))
            return np.concatenate(parts)

        found.append((query, skinned))
    return found


def joints_at(query: Any, frame: int) -> np.ndarray:
    return np.array(query.ComputeJointSkelTransforms(frame))[:, 3, :3]


def test_usd_reads_unit_axis_time_and_joints(tmp_path: Path) -> None:
    motion = waver()
    stage = opened(save(motion, tmp_path / "wave.usda"))
    from pxr import UsdGeom

    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert stage.GetTimeCodesPerSecond() == FPS
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, FRAMES - 1)
    assert stage.GetDefaultPrim().GetName() == "motion"
    ((query, _),) = queries(stage)
    for frame in (0, 13, FRAMES - 1):
        np.testing.assert_allclose(joints_at(query, frame), motion.positions()[frame], atol=1e-5)
    assert list(query.GetJointOrder())[-1] == joint_paths(SMPL22)[-1]


def test_the_body_moves_with_its_joints(tmp_path: Path) -> None:
    motion = waver()
    ((_, skinned),) = queries(opened(save(motion, tmp_path / "wave.usda")))
    first, later = skinned(0), skinned(20)
    assert 1.5 < np.ptp(first[:, 1]) < 2.0
    assert np.abs(later - first).max() > 0.1
    apart = np.linalg.norm(later[:, None] - motion.positions()[20][None], axis=-1).min(axis=1)
    assert apart.max() < 0.35  # the middle of a thigh is so far from its ends


def test_two_people_are_two_roots_with_their_names(tmp_path: Path) -> None:
    one = waver()
    two = Motion(SMPL22, FPS, one.root + np.array([1.0, 0, 0]), one.rotations)
    stage = opened(save_scene([one, two], tmp_path / "pair.usda", names=["Ann B.", "Ann B."]))
    (first, _), (second, _) = queries(stage)
    np.testing.assert_allclose(joints_at(second, 5) - joints_at(first, 5), np.tile([1.0, 0, 0], (22, 1)), atol=1e-5)
    assert stage.GetPrimAtPath("/motion/Ann_B_")
    assert stage.GetPrimAtPath("/motion/Ann_B__2")


def same_mesh(path: Path, folder: Path) -> float:
    """Metres by which USD's skinning of the .usda differs from glTF's of the character's own file, the largest."""
    character = load_character(path)
    motion = retarget(waver(), character.skeleton)
    surfaces = read_surfaces(character)
    assert surfaces
    ((query, skinned),) = queries(opened(save_usda([motion], folder / "out.usda", surfaces=surfaces)))
    assert np.abs(joints_at(query, 13) - motion.positions()[13]).max() < 1e-4
    scene = Scene(character.save(motion, folder / f"out{path.suffix}", name="ours"))
    world = scene.worlds(scene.clip("ours"), np.array([13 / FPS]))
    points = np.concatenate([v[0] for v in scene.vertices(world, at_most=10**9).values()])
    return float(np.abs(points - skinned(13)).max())


def test_a_character_keeps_its_mesh(tmp_path: Path) -> None:
    assert same_mesh(Hero(seed=4).write(tmp_path / "hero.glb"), tmp_path) < 1e-4


def test_a_mesh_that_cannot_be_read_is_said(tmp_path: Path) -> None:
    hero = Hero(seed=4)
    [piece] = hero.json["meshes"][0]["primitives"]
    hero.json["accessors"][piece["attributes"]["POSITION"]]["sparse"] = {}
    character = load_character(hero.write(tmp_path / "hero.glb"))
    with pytest.warns(UserWarning, match="1 of its 1 pieces of mesh are left out"):
        assert read_surfaces(character, remark=True) == []


@pytest.mark.parametrize("name", ["kaykit_knight", "sophia", "robot_expressive", "gdbot"])
def test_other_peoples_characters_keep_their_meshes(tmp_path: Path, name: str) -> None:
    assert same_mesh(shared(f"rigs/{name}.glb"), tmp_path) < 1e-4


def test_names_become_paths_that_usd_takes(tmp_path: Path) -> None:
    names = ("Hüfte 1", "2:spine", "2 spine", 'quo"te\\', "Hüfte 1 ")
    skeleton = Skeleton(names, (-1, 0, 0, 2, 2), np.full((5, 3), 0.1))
    assert joint_paths(skeleton) == [
        "H_fte_1",
        "H_fte_1/_2_spine",
        "H_fte_1/_2_spine_2",
        "H_fte_1/_2_spine_2/quo_te_",
        "H_fte_1/_2_spine_2/H_fte_1_",
    ]
    motion = Motion(skeleton, FPS, np.zeros((2, 3)), np.tile(rot.IDENTITY, (2, 5, 1)))
    ((query, _),) = queries(opened(save(motion, tmp_path / "odd.usda")))
    assert list(query.GetSkeleton().GetJointNamesAttr().Get()) == list(names)


def test_a_chain_too_long_for_paths_is_refused() -> None:
    count = 2000
    skeleton = Skeleton(
        tuple(f"joint{k}" for k in range(count)), tuple(range(-1, count - 1)), np.full((count, 3), 0.001)
    )
    with pytest.raises(MotionloomError, match="too long"):
        joint_paths(skeleton)


def test_two_rates_are_refused_and_nothing_is_left(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="one frame rate"):
        save([waver(), waver().resample(12)], tmp_path / "two.usda")
    assert not list(tmp_path.iterdir())


def test_usda_is_written_and_not_read(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match=r"Blender turns it into a \.glb"):
        load(save(waver(), tmp_path / "wave.usda"))
