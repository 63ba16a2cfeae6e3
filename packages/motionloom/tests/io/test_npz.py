"""NPZ: exact round trips, plain positions, and archives that lie."""

import io as stdio
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from motionloom import io
from motionloom.cli import main
from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.files.npz_writer import save_npz
from motionloom.core.motion import Motion
from motionloom.core.rotations import IDENTITY
from motionloom.core.skeleton import SMPL22, Poses
from motionloom.io.character import load_character
from motionloom.io.npz import load_npz, read_array
from motionloom.retarget import retarget, to_smpl22
from motionloom.retarget.upright import AXES
from tests.io.motions import motions
from tests.io.rigged import Hero


def walk() -> Motion:
    return io.load(Path(__file__).parents[4] / "examples" / "clips" / "walk.bvh")


def still(frames: int = 3) -> Motion:
    return Motion(SMPL22, 30, np.zeros((frames, 3)), np.tile(IDENTITY, (frames, 22, 1)))


@settings(deadline=None, max_examples=50)
@given(motion=motions())
def test_random_motions_come_back_exactly(tmp_path_factory, motion):
    path = tmp_path_factory.mktemp("npz") / "a.npz"
    again = load_npz(save_npz(motion, path))
    assert again.skeleton == motion.skeleton
    assert again.fps == motion.fps
    np.testing.assert_array_equal(again.root, motion.root)
    np.testing.assert_array_equal(again.rotations, motion.rotations)
    if motion.translations is None:
        assert again.translations is None
    else:
        np.testing.assert_array_equal(again.translations, motion.translations)


def test_what_the_file_of_a_body_says_of_it_comes_back(tmp_path):
    """Feet that know their soles, joints that a VRM names, and the poses of a BVH are needed by `retarget`."""
    turns = np.tile(IDENTITY, (2, 22, 1))
    body = replace(
        SMPL22,
        on_floor=True,
        humanoid={"left_knee": "left_ankle", "head": "neck"},
        soles={7: np.arange(6.0).reshape(2, 3), 8: np.ones((1, 3))},
        poses=Poses(np.ones((2, 3)), turns, np.zeros((2, 22, 3))),
    )
    again = load_npz(save_npz(replace(still(), skeleton=body), tmp_path / "a.npz")).skeleton
    assert again.on_floor
    assert again.humanoid == body.humanoid
    assert again.soles.keys() == body.soles.keys()
    assert all(np.array_equal(again.soles[joint], body.soles[joint]) for joint in body.soles)
    assert again.poses is not None
    for name in ("root", "rotations", "translations"):
        np.testing.assert_array_equal(getattr(again.poses, name), getattr(body.poses, name))


def test_a_body_out_of_an_archive_is_retargeted_as_the_one_in_memory(tmp_path):
    hero = load_character(Hero().write(tmp_path / "hero.glb"))
    moving = retarget(walk(), hero.skeleton)
    stored = load_npz(save_npz(moving, tmp_path / "hero.npz"))
    np.testing.assert_allclose(to_smpl22(stored).positions(), to_smpl22(moving).positions(), atol=1e-9)
    np.testing.assert_allclose(retarget(walk(), stored.skeleton).positions(), moving.positions(), atol=1e-9)


def test_the_groups_of_our_own_skeleton_come_back(tmp_path):
    assert io.load(io.save(still(), tmp_path / "a.npz")).skeleton.groups == SMPL22.groups


def test_numpy_reads_the_documented_arrays_without_pickle(tmp_path):
    motion = still()
    with np.load(io.save(motion, tmp_path / "a.npz"), allow_pickle=False) as arrays:
        assert int(arrays["version"]) == 1
        assert tuple(arrays["names"]) == SMPL22.names
        np.testing.assert_allclose(arrays["positions"], motion.positions(), atol=1e-6)
        assert set(arrays) == {
            "version",
            "names",
            "parents",
            "offsets",
            "ends",
            "fps",
            "root",
            "rotations",
            "positions",
            "on_floor",
        }


def test_plain_positions_are_read_where_they_say_their_rate(tmp_path):
    pytest.importorskip("motionloom.core.body.ik")
    motion = still(8)
    np.savez(tmp_path / "a.npz", positions=motion.positions(), fps=20)
    again = io.load(tmp_path / "a.npz")
    assert again.fps == 20
    assert np.abs(again.positions() - motion.positions()).max() < 0.02
    np.savez(tmp_path / "b.npz", positions=motion.positions())
    with pytest.raises(MotionloomError, match="give the frame rate"):
        io.load(tmp_path / "b.npz")
    assert io.load(tmp_path / "b.npz", fps=25).fps == 25


def joints(path: Path, axis: str = "y", unit: float = 1.0, places: np.ndarray | None = None) -> np.ndarray:
    """Plain positions of a walk with another axis up and in another unit; gives the places in metres, +Y up."""
    places = to_smpl22(walk()).positions() if places is None else places
    turned = rot.rotate(rot.inverse(rot.rotvec_to_quat(AXES[axis][1])), places)
    np.savez(path, joints=turned.astype(np.float32) / unit, fps=30)
    return places


@pytest.mark.parametrize("axis", AXES)
def test_plain_positions_with_another_axis_up_are_refused_until_it_is_told(tmp_path, axis, capsys):
    places = joints(tmp_path / "a.npz", axis)
    if axis != "y":
        with pytest.raises(MotionloomError, match=f"--up {axis}"):
            io.load(tmp_path / "a.npz")
        for words in (("export", "a.npz", "b.bvh"), ("info", "a.npz"), ("view", "a.npz")):
            line = [word if "." not in word else str(tmp_path / word) for word in words]
            assert main(line) == 2
            assert f"--up {axis}" in capsys.readouterr().err
    again = io.load(tmp_path / "a.npz", up=axis).positions()
    assert np.abs(again - places).max() < 0.1
    assert main(["export", str(tmp_path / "a.npz"), str(tmp_path / "b.npz"), "--up", axis]) == 0
    np.testing.assert_allclose(io.load(tmp_path / "b.npz").positions(), again, atol=1e-5)


@pytest.mark.parametrize("unit", [0.01, 0.001, 0.0254, 0.3048, 0.0254 / 0.45])
def test_plain_positions_in_another_unit_are_refused_until_it_is_told(tmp_path, unit, capsys):
    places = joints(tmp_path / "a.npz", unit=unit)
    for words in (["export", str(tmp_path / "a.npz"), str(tmp_path / "b.npz")], ["info", str(tmp_path / "a.npz")]):
        assert main(words) == 2
        assert "--unit" in capsys.readouterr().err
        assert main([*words, "--unit", str(unit)]) == 0
    assert np.abs(io.load(tmp_path / "b.npz").positions() - places).max() < 0.1


def test_positions_of_somebody_who_lies_are_read_with_a_remark(tmp_path):
    """Who lies at full length may as well stand with another axis up."""
    lies = still(30).positions()[..., [0, 2, 1]] * [1.0, 1.0, -1.0]
    lies[..., 1] -= lies[..., 1].min()
    joints(tmp_path / "a.npz", places=lies)
    with pytest.warns(UserWarning, match="not certain which way is up.*--up"):
        assert np.ptp(io.load(tmp_path / "a.npz").positions()[..., 1]) < 0.6


def test_a_motion_with_rotations_is_in_metres_by_its_format(tmp_path):
    with pytest.raises(MotionloomError, match="in metres by its format"):
        io.load(io.save(still(), tmp_path / "a.npz"), unit=0.01)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"root": np.full((3, 3), np.nan)}, "'root' has numbers that are not finite"),
        ({"rotations": np.full((3, 22, 4), np.inf)}, "'rotations' has numbers that are not finite"),
        ({"rotations": np.zeros((3, 22, 4))}, "unit quaternions"),
        ({"rotations": np.zeros((4, 22, 4))}, "'rotations' must have the shape"),
        ({"rotations": None}, "no array 'rotations'|'positions' but|positions"),
        ({"root": np.zeros((0, 3)), "rotations": np.zeros((0, 22, 4))}, "at least one"),
        ({"parents": np.arange(22)}, "only root"),
        ({"parents": np.zeros(22)}, "'parents' must have the shape"),
        ({"names": np.array(["a"] * 22)}, "unique"),
        ({"names": np.arange(22)}, "'names' must have the shape"),
        ({"ends": np.array([99])}, "joints that do not exist"),
        ({"fps": np.array(0.0)}, "frame rate"),
        ({"fps": np.array(-30)}, "frame rate"),
        ({"fps": np.array("thirty")}, "'fps' must have the shape"),
        ({"version": np.array(7)}, "version 7"),
        ({"on_floor": np.array(2.0)}, "'on_floor' must have the shape"),
        ({"humanoid": np.array([["head", "nobody"]])}, "'humanoid' must pair joints"),
        ({"humanoid": np.array(["head", "neck"])}, "'humanoid' must have the shape"),
        ({"sole_joints": np.array([22]), "sole_points": np.zeros((1, 3))}, "joints that do not exist"),
        ({"sole_joints": np.array([7])}, "no array 'sole_points'"),
        ({"pose_root": np.zeros((1, 3)), "pose_rotations": np.zeros((1, 22, 4))}, "'pose_rotations' must be unit"),
        ({"pose_root": np.zeros((0, 3)), "pose_rotations": np.zeros((0, 22, 4))}, "'pose_root' has no pose"),
        ({"offsets": np.zeros((21, 3))}, "'offsets' must have the shape"),
        ({"offsets": np.array([{"a": 1}], dtype=object)}, "pickled objects are never read"),
    ],
)
def test_archives_that_make_no_sense_are_refused(tmp_path, change, message):
    with np.load(io.save(still(), tmp_path / "a.npz")) as arrays:
        changed = {k: v for k, v in ({**arrays, **change}).items() if v is not None}
    if "rotations" in change and change["rotations"] is None:
        del changed["positions"]
    np.savez(tmp_path / "b.npz", **changed)
    with pytest.raises(MotionloomError, match=message) as caught:
        io.load(tmp_path / "b.npz")
    assert "b.npz" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_pickle_is_never_run(tmp_path):
    class Bomb:
        def __reduce__(self):
            return (print, ("boom",))

    np.savez(tmp_path / "a.npz", rotations=np.array([Bomb()], dtype=object), allow_pickle=True)
    with pytest.raises(MotionloomError, match="pickled objects are never read"):
        io.load(tmp_path / "a.npz")


def test_a_shape_that_promises_more_than_is_there_is_refused_at_once(tmp_path):
    header = stdio.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**12, 22, 4)})
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("rotations.npy", header.getvalue())
    with pytest.raises(MotionloomError, match="damaged"):
        io.load(tmp_path / "a.npz")


@pytest.mark.parametrize(
    "shape",
    ["(" * 3000 + ")" * 3000, "-" * 9000 + "1", "1" + "+1" * 4000, "not " * 2400 + "1", "a" + ".a" * 4000, "~" * 9000],
)
def test_a_head_that_would_take_the_interpreters_stack_is_refused_before_it_is_parsed(tmp_path, shape):
    """NumPy reads heads as Python; what is deep ended in a RecursionError or MemoryError that a sentence hid."""
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode().ljust(9990) + b"\n"
    (tmp_path / "a.npy").write_bytes(b"\x93NUMPY\x01\0" + len(head).to_bytes(2, "little") + head)
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.write(tmp_path / "a.npy", "rotations.npy")
    for read in (lambda: read_array(tmp_path / "a.npy"), lambda: io.load(tmp_path / "a.npz")):
        with pytest.raises(MotionloomError, match="ValueError") as refused:
            read()
        assert isinstance(refused.value.__context__, ValueError)


def test_an_archive_that_unpacks_to_gigabytes_is_refused_before_unpacking(tmp_path):
    from motionloom.io.npz import read_arrays

    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("rotations.npy", bytes(20_000_000))
    with pytest.raises(MotionloomError, match="unpacks to more"):
        read_arrays(tmp_path / "a.npz", max_bytes=10_000_000)
