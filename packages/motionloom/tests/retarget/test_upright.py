"""Which way is up: recordings of people who lie, crawl, fall and turn over, as every program writes them."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.io import load
from motionloom.requests.export import UPS
from motionloom.retarget import joints22, to_smpl22
from motionloom.retarget.axes import CHILD
from motionloom.retarget.upright import AXES
from tests.shared import shared
from tests.tasks.test_edit import person

RECORDINGS = [
    *(f"data_more/accad/accad_Male{name}.bvh" for name in ("1_A11_CrawlForward", "2_A9_Lie")),
    *(f"data_more/keyed/{name}.bvh" for name in ("mesh2motion/sleeping", "mesh2motion/pushups", "cat_soulslike/roll")),
    *(f"data_third/cmu_jump/cmu_{name}.bvh" for name in ("140_01", "49_06", "90_17")),
    "data_more/keyed/kaykit/lie.bvh",
    "data/cmu/asf_amc/127/127_23.amc",
    "probes/turn4/handstand_tpose_yup.bvh",
    "probes/turn4/getup270_tpose_yup.bvh",
]


def yawed(motion: Motion, degrees: float) -> Motion:
    return motion.turned(rot.rotvec_to_quat(np.array([0.0, np.radians(degrees), 0.0])))


def tilted(motion: Motion, turn: np.ndarray) -> Motion:
    """A file with another axis up, rest pose and all."""
    local = rot.multiply(rot.multiply(turn, motion.rotations), rot.inverse(turn))
    skeleton = replace(motion.skeleton, offsets=rot.rotate(turn, motion.skeleton.offsets), poses=None)
    return Motion(skeleton, motion.fps, rot.rotate(turn, motion.root), local)


def collapsed(motion: Motion) -> Motion:
    """The same motion of a skeleton whose limbs all point along X at rest, as programs write that have no rest pose."""
    rest, bones = SMPL22.rest_positions(), np.tile(rot.IDENTITY, (22, 1))
    for joint, child in enumerate(CHILD):
        if child is not None:
            bones[joint] = rot.shortest_arc(np.eye(3)[0], rest[child] - rest[joint])
    above = bones[list(SMPL22.parents)]
    above[0] = rot.IDENTITY
    offsets = rot.rotate(rot.inverse(above), SMPL22.offsets)
    rotations = rot.multiply(rot.multiply(rot.inverse(above), motion.rotations), bones)
    return Motion(Skeleton(SMPL22.names, SMPL22.parents, offsets), motion.fps, motion.root, rotations)


def read_back(motion: Motion, folder: Path, up: str | None = None) -> tuple[np.ndarray, list[str]]:
    """The 22 joints of a motion that is written and read, and what was warned of."""
    path = save_bvh(motion, folder / "file.bvh", unit=0.01)
    with warnings.catch_warnings(record=True) as remarks:
        warnings.simplefilter("always")
        again = load(path, up=up)
    return joints22(again), [str(remark.message) for remark in remarks]


def to_axis(axis: str) -> np.ndarray:
    """The turn of a file with +Y up to one with this axis up."""
    return rot.inverse(rot.rotvec_to_quat(AXES[axis][1]))


def test_the_names_of_axes_are_those_of_the_option() -> None:
    assert tuple(AXES) == UPS
    for axis, turn in AXES.values():
        np.testing.assert_allclose(rot.rotate(rot.rotvec_to_quat(turn), axis), [0, 1, 0], atol=1e-12)


@pytest.mark.parametrize("name", RECORDINGS)
def test_nobody_is_silently_on_the_side(name: str, tmp_path: Path) -> None:
    """Four headings, Y or Z up, with a rest pose that stands, and with one that says nothing."""
    source = shared(name)
    recording = to_smpl22(load(source, fps=30.0 if source.suffix == ".amc" else None, up="y").thinned(100))
    floor = np.percentile(recording.positions()[..., 1].min(axis=1), 5)  # of the uniform person, who has other arms
    recording = replace(recording, root=recording.root - np.array([0, floor, 0]))
    for yaw, axis in ((0, "z"), (90, "z"), (180, "z"), (270, "z"), (90, "y")):
        motion, turn = yawed(recording, yaw), to_axis(axis)
        places, remarks = read_back(tilted(motion, turn), tmp_path)
        np.testing.assert_allclose(places, motion.positions(), atol=1e-4)
        assert axis == "y" or remarks
        places, remarks = read_back(tilted(collapsed(motion), turn), tmp_path)
        doubtful = any("not certain" in remark and "--up" in remark for remark in remarks)
        assert doubtful or np.abs(places - motion.positions()).max() < 1e-4
    told, _ = read_back(tilted(collapsed(recording), to_axis("z")), tmp_path, up="z")
    np.testing.assert_allclose(told, recording.positions(), atol=1e-4)


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("rest", ["stands", "collapsed", "stands along +Y"])
def test_a_walk_stands_up_from_every_axis(axis: str, rest: str, tmp_path: Path) -> None:
    walk = person(2.0, 30.0)
    walk = replace(walk, root=walk.root + np.array([0, 0.03 - walk.positions()[..., 1].min(), 0]))
    for yaw in (0, 90, 180, 270):
        motion = yawed(walk, yaw)
        file = collapsed(motion) if rest == "collapsed" else motion
        file = file.turned(to_axis(axis)) if rest == "stands along +Y" else tilted(file, to_axis(axis))
        places, remarks = read_back(file, tmp_path)
        right = np.abs(places - motion.positions()).max() < 1e-4
        assert right or any("not certain" in remark for remark in remarks)
        assert right or (rest == "stands along +Y" and axis not in "yz")
        assert len(remarks) == (axis != "y")


def test_somebody_who_lies_with_the_head_where_z_is_up_stays_lying_on_the_uniform_person(tmp_path: Path) -> None:
    """The rest pose is turned with the motion: nothing later takes the one for the other."""
    flat = rot.rotvec_to_quat(np.array([np.pi / 2, 0.0, 0.0]))
    lies = person(2.0, 30.0)
    lies = Motion(SMPL22, 30.0, lies.root * 0.02, np.tile(lies.rotations[:1], (60, 1, 1))).turned(flat)
    lies = replace(lies, root=lies.root + np.array([0, 0.02 - lies.positions()[..., 1].min(), 0]))
    for yaw in (0, 90, 180, 270):
        motion = yawed(lies, yaw)
        path = save_bvh(tilted(motion, to_axis("z")), tmp_path / "file.bvh")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            body = to_smpl22(load(path)).positions()
        assert np.ptp(body[..., 1]) < 0.6
