"""Several people in one file: one world frame in a GLB, everybody in one picture or film."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from motionloom import io
from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.viz.overlay import tint


def dancer(frames: int, fps: float, *, side: float) -> Motion:
    """Somebody who goes round the origin at a metre's distance, on one side (+1) or the other (-1)."""
    angle = np.arange(frames) / fps
    turns = np.zeros((frames, 22, 3))
    turns[:, 0, 1] = angle
    turns[:, SMPL22.index("left_shoulder"), 2] = 0.3 * side * angle
    root = np.stack([side * np.sin(angle), np.full(frames, 0.95), side * np.cos(angle)], axis=-1)
    return Motion(SMPL22, fps, root, rot.rotvec_to_quat(turns))


def parsed(path: Path) -> tuple[dict[str, Any], bytes]:
    """A GLB's JSON and binary part, taken apart by hand."""
    data = path.read_bytes()
    magic, version, total, length = struct.unpack_from("<4sIII", data)
    assert (magic, version, total) == (b"glTF", 2, len(data))
    return json.loads(data[20 : 20 + length]), data[20 + length + 8 :]


def roots(path: Path) -> dict[str, np.ndarray]:
    """The root's keyed places (frames, 3) by the name of the node over it."""
    content, binary = parsed(path)
    above = {child: node["name"] for node in content["nodes"] for child in node.get("children", [])}
    found = {}
    animation = content["animations"][0]
    for channel in animation["channels"]:
        if channel["target"]["path"] == "translation":
            accessor = content["accessors"][animation["samplers"][channel["sampler"]]["output"]]
            view = content["bufferViews"][accessor["bufferView"]]
            part = binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
            found[above[channel["target"]["node"]]] = np.frombuffer(part, "<f4").reshape(accessor["count"], 3)
    return found


def test_people_in_a_glb_keep_their_distance_and_names(tmp_path: Path) -> None:
    pair = [dancer(30, 30.0, side=1), dancer(30, 30.0, side=-1)]
    path = io.save_scene(pair, tmp_path / "x.glb", names=["Ann", "Bó"])
    places = roots(path)
    assert list(places) == ["Ann", "Bó"]
    np.testing.assert_allclose(np.linalg.norm(places["Ann"] - places["Bó"], axis=-1), 2.0, atol=1e-5)
    content, _ = parsed(path)
    assert len(content["skins"]) == len(content["meshes"]) == 2
    assert not set(content["skins"][0]["joints"]) & set(content["skins"][1]["joints"])
    assert all("translation" not in content["nodes"][top] for top in content["scenes"][0]["nodes"])


def test_everybody_in_a_glb_is_read_back_where_and_when_they_were(tmp_path: Path) -> None:
    people = [dancer(30, 30.0, side=1), dancer(12, 20.0, side=-1), dancer(7, 60.0, side=0.5)]
    back = io.load_scene(io.save_scene(people, tmp_path / "x.glb"))
    assert [(len(m), m.fps) for m in back] == [(30, 30.0), (12, 20.0), (7, 60.0)]
    for motion, read in zip(people, back):
        np.testing.assert_allclose(read.positions(), motion.positions(), atol=1e-5)
    np.testing.assert_allclose(io.load(tmp_path / "x.glb").root, people[0].root, atol=1e-6)


@pytest.mark.parametrize("suffix", [".bvh", ".npz"])
def test_formats_of_one_person_say_to_give_each_their_own_file(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(MotionloomError, match="each its own file"):
        io.save_scene([dancer(3, 30.0, side=1)] * 2, tmp_path / f"x{suffix}")
    assert list(tmp_path.iterdir()) == []
    alone = io.save_scene([dancer(3, 30.0, side=1)], tmp_path / f"x{suffix}")
    assert [len(m) for m in io.load_scene(alone)] == [3]


def test_a_picture_of_a_scene_shows_everybody_in_their_own_colour(tmp_path: Path) -> None:
    path = io.save_scene([dancer(9, 30.0, side=s) for s in (1, -1)], tmp_path / "x.png", names=["a", "b"])
    picture = np.asarray(Image.open(path)).astype(int)
    for i in range(2):
        assert (np.abs(picture - np.array(tint(i))).max(axis=-1) <= 4).sum() > 500


def test_a_film_of_a_scene_is_one_view_and_not_two(tmp_path: Path) -> None:
    """Side by side each half would hold one person; in one scene both colours cross the middle as they go round."""
    pair = [dancer(4, 1.0, side=s) for s in (1, -1)]
    film = Image.open(io.save_scene(pair, tmp_path / "x.gif", captions=["round", "round"]))
    sides = []
    for frame in (0, 3):  # nearly half a turn later each stands where the other was
        film.seek(frame)
        picture = np.asarray(film.convert("RGB")).astype(int)
        columns = [np.nonzero(np.abs(picture - np.array(tint(i))).max(axis=-1) <= 12)[1].mean() for i in range(2)]
        sides.append(np.sign(columns[0] - columns[1]))
    assert sides[0] == -sides[1] != 0


@pytest.mark.parametrize("what", ["names", "captions"])
def test_labels_of_another_count_are_refused(tmp_path: Path, what: str) -> None:
    for suffix in (".glb", ".png"):
        with pytest.raises(MotionloomError, match=what):
            io.save_scene([dancer(3, 30.0, side=1)], tmp_path / f"x{suffix}", **{what: ["a", "b"]})


def test_nobody_makes_no_scene(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError):
        io.save_scene([], tmp_path / "x.glb")
