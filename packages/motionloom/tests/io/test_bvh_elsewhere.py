"""Our BVH files as other programs read them: each convention in plain Python, and bvhio where it is installed."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.files.bvh_writer import is_tip, tip
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.io.bvh import load_bvh, save_bvh
from tests.io.rigged import wave


@dataclass
class Bone:
    """A joint as a reader of the format sees it."""

    name: str
    parent: int
    offset: np.ndarray = field(default_factory=lambda: np.zeros(3))
    channels: tuple[str, ...] = ()


def parsed(path: Path) -> tuple[list[Bone], np.ndarray]:
    """Joints and End Sites, and the numbers (frames, channels) behind them."""
    bones: list[Bone] = []
    line: list[int] = []
    head, _, body = path.read_text().partition("MOTION\n")
    for words in (row.split() for row in head.splitlines()[1:]):
        if words[0] in ("ROOT", "JOINT", "End"):
            bones.append(Bone(words[1] if words[0] != "End" else "", line[-1] if line else -1))
        elif words[0] == "{":
            line.append(len(bones) - 1)
        elif words[0] == "}":
            line.pop()
        elif words[0] == "OFFSET":
            bones[-1].offset = np.array(words[1:], float)
        else:
            bones[-1].channels = tuple(words[2:])
    return bones, np.array([row.split() for row in body.splitlines()[2:]], float)


def posed(bones: list[Bone], numbers: np.ndarray, *, adds: bool) -> dict[str, np.ndarray]:
    """(3,) world places in one frame; position channels are added to the OFFSET, or replace it."""
    world: list[tuple[np.ndarray, np.ndarray]] = []
    found, at = {}, 0
    for bone in bones:
        place, turn = bone.offset.copy(), np.eye(3)
        moves = [c for c in bone.channels if c.endswith("position")]
        if moves and not adds:
            place = np.zeros(3)
        for channel in bone.channels:
            axis, value = "XYZ".index(channel[0]), float(numbers[at])
            at += 1
            if channel.endswith("position"):
                place[axis] += value
            else:
                turn = turn @ rot.quat_to_matrix(rot.rotvec_to_quat(np.radians(value) * np.eye(3)[axis]))
        above, base = world[bone.parent] if bone.parent >= 0 else (np.eye(3), np.zeros(3))
        world.append((above @ turn, base + above @ place))
        if bone.name:
            found[bone.name] = world[-1][1]
    return found


def walker() -> Motion:
    way = np.arange(40)[:, None] * [0.01, 0.002, 0.02]
    return Motion(SMPL22, 30.0, SMPL22.offsets[0] + way, rot.rotvec_to_quat(wave()))


# Blender's importer, assimp's and bvhio take position channels for the joint's place, three.js adds its OFFSET to them.
@pytest.mark.parametrize("adds", [False, True], ids=["Blender, assimp, bvhio", "three.js"])
def test_everybody_sees_the_person_where_it_is(tmp_path: Path, adds: bool) -> None:
    motion = walker()
    bones, numbers = parsed(save_bvh(motion, tmp_path / "walk.bvh"))
    for frame in (0, 17, 39):
        places = posed(bones, numbers[frame], adds=adds)
        for j, name in enumerate(SMPL22.names):
            np.testing.assert_allclose(places[name], motion.positions()[frame, j], atol=2e-5)


def test_bvhio_sees_the_person_where_it_is(tmp_path: Path) -> None:
    bvhio = pytest.importorskip("bvhio", reason="bvhio is not installed: pip install bvhio")
    motion = walker()
    root = bvhio.readAsHierarchy(str(save_bvh(motion, tmp_path / "walk.bvh")))
    for frame in (0, 17, 39):
        root.loadPose(frame)
        places = {joint.Name: joint.PositionWorld.to_tuple() for joint, _, _ in root.layout()}
        for j, name in enumerate(SMPL22.names):
            np.testing.assert_allclose(places[name], motion.positions()[frame, j], atol=2e-5)


def test_end_sites_have_a_length_and_point_on(tmp_path: Path) -> None:
    bones, _ = parsed(save_bvh(walker(), tmp_path / "walk.bvh"))
    ends = {bones[b.parent].name: (b.offset, bones[b.parent].offset) for b in bones if not b.name}
    assert set(ends) == {"left_foot", "right_foot", "head", "left_wrist", "right_wrist"}
    for name, (end, bone) in ends.items():
        assert 0.02 < np.linalg.norm(end) < 0.2
        if name.endswith("foot"):
            assert end[1] == 0  # along the ground, not into it
            assert end[2] > 0
        else:
            assert end @ bone > 0.999 * np.linalg.norm(end) * np.linalg.norm(bone)


@pytest.mark.parametrize("unit", [1.0, 0.01, 0.0254])
def test_our_end_sites_are_no_joints_when_they_are_read(tmp_path: Path, unit: float) -> None:
    back = load_bvh(save_bvh(walker(), tmp_path / "walk.bvh", unit=unit))
    assert set(back.skeleton.names) == set(SMPL22.names)
    assert not back.skeleton.ends


def test_other_peoples_end_sites_stay(tmp_path: Path) -> None:
    for end in ((0.0, 0.1, 0.0), (0.0, 0.05, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0414, 0.0)):
        ends = Skeleton(("hips", "chest", "chest End Site"), (-1, 0, 1), [[0, 1, 0], [0, 0.1, 0], end], frozenset({2}))
        turns = np.tile(rot.IDENTITY, (1, 3, 1))
        back = load_bvh(save_bvh(Motion(ends, 30.0, np.zeros((1, 3)), turns), tmp_path / "a.bvh", unit=0.01), unit=0.01)
        assert back.skeleton.names == ends.names


def test_a_tip_is_known_again_after_rounding() -> None:
    rng = np.random.default_rng(0)
    for scale in (0.01, 0.1, 1.0, 40.0):
        for bone in rng.normal(size=(200, 3)) * scale:
            for level in (False, True):
                written = np.round(tip(np.round(bone, 6), level=level), 6)
                assert is_tip(np.round(bone, 6).tolist(), written.tolist())
                assert not is_tip(np.round(bone, 6).tolist(), (0.5 * bone).tolist())
