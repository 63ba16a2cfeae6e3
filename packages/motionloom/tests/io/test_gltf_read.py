"""glTF files as other people write them: interpolation, rest poses, units, rates, props."""

import copy
from pathlib import Path

import numpy as np
import pytest

from motionloom.io.gltf import load_glb
from tests.io.gltf_files import CHAIN, HALF, Foreign


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


def test_a_scale_that_changes_moves_what_hangs_below(tmp_path: Path) -> None:
    """Squash and stretch: bones change their length with the scale above them."""
    file = Foreign(copy.deepcopy(CHAIN)).key(0, "scale", [0, 0.04], [[1, 1, 1], [1, 2, 1]])
    np.testing.assert_allclose(load_glb(file.write(tmp_path)).positions()[:, 1], [[0, -1, 0], [0, -2, 0]], atol=1e-6)


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
