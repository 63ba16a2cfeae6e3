"""export, view and info, as a stranger types them."""

import json
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import main
from motionloom.core.motion import Motion
from motionloom.core.rotations import IDENTITY, rotvec_to_quat
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.io.bvh import read_bvh, save_bvh
from tests.io.motions import largest_distance
from tests.io.test_asf import AMC, ASF


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch) -> Path:
    """Each test runs in an empty folder of its own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def walk() -> Motion:
    """Two seconds of a stiff person who glides forward 1 m/s and swings the left arm."""
    frames = 60
    root = np.tile(SMPL22.offsets[0], (frames, 1))
    root[:, 2] += np.arange(frames) / 30
    rotations = np.tile(IDENTITY, (frames, 22, 1))
    swing = np.zeros((frames, 3))
    swing[:, 2] = -np.abs(np.sin(np.arange(frames) / 5))  # downwards from the T-pose
    rotations[:, SMPL22.index("left_shoulder")] = rotvec_to_quat(swing)
    motion = Motion(SMPL22, 30, root, rotations)
    save_bvh(motion, "walk.bvh", order="XYZ", unit=0.01)
    return motion


def output_of(capsys: pytest.CaptureFixture[str]) -> str:
    return capsys.readouterr().out


@pytest.mark.parametrize("name", ["again.bvh", "a.npz", "a.glb"])
def test_export_keeps_the_motion(walk, name, capsys):
    assert main(["export", "walk.bvh", name]) == 0
    assert "60 frames, 2.00 s at 30 frames per second, 22 joints" in output_of(capsys)
    again = io.load(name)
    assert again.fps == 30
    assert largest_distance(walk, again) < 1e-4


def test_bvh_to_bvh_keeps_unit_and_order_unless_told(walk):
    assert main(["export", "walk.bvh", "a.bvh"]) == 0
    assert Path("a.bvh").read_text() == Path("walk.bvh").read_text()
    assert main(["export", "walk.bvh", "b.bvh", "--order", "YXZ", "--out-unit", "m"]) == 0
    file = read_bvh("b.bvh")
    assert file.unit == 1
    assert set(file.orders.values()) == {"YXZ"}
    assert largest_distance(walk, file.motion) < 1e-4


def test_a_file_is_not_exported_onto_itself(walk):
    assert main(["export", "walk.bvh", "walk.bvh", "--start", "1", "--force"]) == 2
    assert len(io.load("walk.bvh")) == 60


def test_fps_start_end_and_mirror_do_what_they_say(walk):
    options = ["--start", "0.5", "--end", "1.5", "--fps", "10", "--mirror"]
    assert main(["export", "walk.bvh", "a.npz", *options]) == 0
    expected = walk.crop(0.5, 1.5).mirror().resample(10)
    again = io.load("a.npz")
    assert len(again) == len(expected) == 10
    assert largest_distance(expected, again) < 1e-4


def test_the_unit_read_can_be_told(walk):
    assert main(["export", "walk.bvh", "a.npz", "--unit", "inch"]) == 0
    np.testing.assert_allclose(io.load("a.npz").root, walk.root * 2.54, atol=1e-4)


def test_z_up_is_turned(walk):
    turned = Motion(SMPL22, 30, walk.root[:, [0, 2, 1]] * [1, -1, 1], walk.rotations.copy())
    turned.rotations[:, 0] = rotvec_to_quat(np.array([np.pi / 2, 0, 0]))
    save_bvh(turned, "z.bvh")
    assert main(["export", "z.bvh", "a.npz", "--up", "z"]) == 0
    assert largest_distance(walk, io.load("a.npz")) < 1e-4


def test_a_retargeted_motion_has_the_joints_unit_and_order_of_the_skeleton_file(walk):
    stretched = Skeleton(SMPL22.names, SMPL22.parents, SMPL22.offsets * 1.1)
    save_bvh(Motion(stretched, 30, walk.root[:1], walk.rotations[:1]), "tall.bvh", order="YZX", unit=0.0254)
    assert main(["export", "walk.bvh", "a.bvh", "--skeleton", "tall.bvh"]) == 0
    file = read_bvh("a.bvh")
    assert file.unit == 0.0254
    assert set(file.orders.values()) == {"YZX"}
    lengths = dict(zip(file.motion.skeleton.names, file.motion.skeleton.bone_lengths()))
    assert lengths["left_knee"] == pytest.approx(1.1 * SMPL22.bone_lengths()[SMPL22.index("left_knee")], abs=1e-4)
    assert len(file.motion) == 60


def test_joints_without_telling_names_are_found_by_a_map(walk, capsys):
    blank = Skeleton(tuple(f"b{j}" for j in range(22)), SMPL22.parents, np.ones((22, 3)))
    save_bvh(Motion(blank, 30, walk.root[:1], walk.rotations[:1]), "blank.bvh")
    words = ["export", "walk.bvh", "a.bvh", "--skeleton", "blank.bvh"]
    assert main(words) == 2
    assert "--skeleton blank.bvh: the skeleton is not a humanoid" in capsys.readouterr().err
    Path("map.json").write_text(json.dumps({name: f"b{j}" for j, name in enumerate(SMPL22.names)}))
    assert main([*words, "--target-map", "map.json"]) == 0
    assert set(io.load("a.bvh").skeleton.names) >= set(blank.names)
    assert main(["export", "walk.bvh", "a.npz", "--target-map", "map.json"]) == 2


def test_acclaim_files_are_exported_with_their_skeleton_beside_them(capsys):
    Path("a.asf").write_text(ASF)
    Path("a_01.amc").write_text(AMC)
    assert main(["export", "a_01.amc", "a.bvh"]) == 0
    assert "120 frames per second are assumed" in capsys.readouterr().err
    assert io.load("a.bvh").fps == 120
    assert main(["export", "a_01.amc", "a.bvh", "--asf", "a.asf", "--source-fps", "60", "--fps", "30", "--force"]) == 0
    assert not capsys.readouterr().err
    assert io.load("a.bvh").fps == 30
    assert len(io.load("a.bvh")) == 1


def test_view_draws_beside_the_caller_and_says_where(walk, folder, capsys):
    (folder / "sub").mkdir()
    Path("walk.bvh").rename("sub/walk.bvh")
    assert main(["view", "sub/walk.bvh"]) == 0
    assert output_of(capsys) == "wrote walk.png\n"
    assert Path("walk.png").read_bytes().startswith(b"\x89PNG")
    assert main(["view", "sub/walk.bvh", "sub/walk.bvh", "--out", "two.gif", "--end", "0.2"]) == 0
    assert Path("two.gif").read_bytes().startswith(b"GIF8")


def test_info_tells_what_was_put_in(walk, capsys):
    assert main(["info", "walk.bvh", "--json"]) == 0
    info = json.loads(output_of(capsys))
    assert (info["skeleton"], info["joints"], info["frames"], info["fps"], info["unit"]) == (
        "SMPL-22",
        22,
        60,
        30,
        0.01,
    )
    assert info["seconds"] == 2
    assert info["names"] == list(dict.fromkeys(info["names"]))
    assert info["travel"] == pytest.approx(59 / 30, abs=1e-4)
    assert info["path"] == pytest.approx(59 / 30, abs=1e-4)
    assert info["height"] == pytest.approx(np.ptp(walk.positions()[0, :, 1]), abs=0.05)
    assert info["floor"] == pytest.approx(0, abs=1e-4)
    assert not info["problems"]
    assert info["happened"]["sentence"] == "moves 1.9 m forward"
    assert info["happened"]["counts"] == {}
    assert main(["info", "walk.bvh"]) == 0
    text = output_of(capsys)
    assert "60 frames, 2.00 s at 30 frames per second" in text
    assert "  happens   moves 1.9 m forward\n" in text


def test_info_of_what_is_no_person_tells_no_deeds(capsys):
    chain = Skeleton(("a", "b"), (-1, 0), np.ones((2, 3)))
    io.save(Motion(chain, 20, np.zeros((30, 3)), np.tile(IDENTITY, (30, 2, 1))), "chain.npz")
    assert main(["info", "chain.npz", "--json"]) == 0
    assert json.loads(output_of(capsys))["happened"] is None
    assert main(["info", "chain.npz"]) == 0
    assert "happens" not in output_of(capsys)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda m: Motion(SMPL22, 30, m.root + np.array([0, 0.4, 0]), m.rotations), "not on the floor"),
        (lambda m: Motion(SMPL22, 3, m.root, m.rotations), "3 frames per second is unusual"),
        (lambda m: m.frames(0, 1), "one frame only"),
        (lambda m: Motion(SMPL22, 30, m.root + 9 * (np.arange(60) == 30)[:, None], m.rotations), "jumps at frame 30"),
        (lambda m: flipped(m), "'head' turns by 180 degrees from frame 9 to 10"),
        (lambda m: Motion(small(), 30, m.root, m.rotations), "m tall"),
    ],
)
def test_info_sees_common_faults(walk, change, problem, capsys):
    io.save(change(walk), "bad.npz")
    assert main(["info", "bad.npz"]) == 0
    assert problem in output_of(capsys)


def flipped(motion: Motion) -> Motion:
    rotations = motion.rotations.copy()
    rotations[10, SMPL22.index("head")] = [0, 1, 0, 0]
    return Motion(SMPL22, 30, motion.root, rotations)


def small() -> Skeleton:
    return Skeleton(SMPL22.names, SMPL22.parents, SMPL22.offsets / 50)


MISTAKES = [
    (["export", "walk.bvh"], "one file to write is needed"),
    (["export", "walk.bvh", "walk.dae"], "its name must end in .bvh, .glb"),
    (["export", "no.bvh", "a.glb"], "cannot read no.bvh: No such file"),
    (["export", "a.glb", "walk.bvh"], "cannot read a.glb"),
    (["export", "walk.bvh", "no/a.bvh"], "does not exist; make it first"),
    (["export", ".", "a.bvh"], ". is a folder"),
    (["export", "walk.bvh", "."], "it is a folder"),
    (["export", "walk.bvh", "a.bvh", "--fps", "0"], "0.1 to 1,000 frames per second"),
    (["export", "walk.bvh", "a.bvh", "--fps", "1e9"], "0.1 to 1,000 frames per second"),
    (["export", "walk.bvh", "a.bvh", "--fps", "nan"], "0.1 to 1,000 frames per second"),
    (["export", "walk.bvh", "a.bvh", "--unit", "parsec"], "a unit is m, dm, cm"),
    (["export", "walk.bvh", "a.bvh", "--unit", "-1"], "a unit is m, dm, cm"),
    (["export", "walk.bvh", "a.bvh", "--order", "XYX"], "such as ZXY"),
    (["export", "walk.bvh", "a.glb", "--order", "XYZ"], "are for BVH files"),
    (["export", "walk.bvh", "a.bvh", "--start", "1.5", "--end", "0.5"], "cannot crop"),
    (["export", "walk.bvh", "a.bvh", "--end", "5"], "from a motion of 2.000 s"),
    (["export", "walk.bvh", "a.bvh", "--start", "-1"], "0 or more"),
    (["export", "walk.bvh", "a.bvh", "--skeleton", "smpl"], "--skeleton needs smpl22"),
    (["export", "walk.bvh", "a.bvh", "--skeleton", "no.bvh"], "cannot read no.bvh"),
    (["export", "walk.bvh", "a.bvh", "--asf", "no.asf"], "an ASF file is for AMC files"),
    (["view", "walk.bvh", "--out", "a.jpg"], "a picture ends in .png"),
    (["view", "no.bvh"], "cannot read no.bvh"),
    (["info", "walk.png"], "its name must end in .bvh, .amc"),
    (["info", "junk.bvh"], "does not begin with HIERARCHY"),
    (["info", "lonely.amc"], "name it with --asf"),
]


@pytest.mark.parametrize(("words", "message"), MISTAKES)
def test_a_mistake_is_one_sentence_code_2_and_no_file(walk, folder, words, message, capsys):
    Path("junk.bvh").write_text("hello")
    Path("lonely.amc").write_text(AMC)
    before = {p: p.read_bytes() for p in folder.rglob("*")}
    try:
        code = main(words)
    except SystemExit as stop:
        code = stop.code
    error = capsys.readouterr().err
    assert code == 2
    assert message in error
    assert error.count("\n") == 1
    assert {p: p.read_bytes() for p in folder.rglob("*")} == before
