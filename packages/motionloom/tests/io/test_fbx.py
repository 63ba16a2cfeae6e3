"""FBX by way of Blender: how it is found, what is said where it is not, and, where it is, the way out and back."""

import os
import re
import shlex
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from motionloom.cli import main
from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.io import blender, load, open_character, save
from motionloom.retarget import retarget
from tests.cli.said import complaint
from tests.io.rigged import Hero, wave


def waver() -> Motion:
    way = np.arange(31)[:, None] * [0.01, 0.0, 0.02]
    return Motion(SMPL22, 24.0, SMPL22.offsets[0] + way, rot.rotvec_to_quat(wave(31)))


@pytest.fixture
def no_blender(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine without Blender, whatever this one has."""
    monkeypatch.delenv(blender.VARIABLE, raising=False)
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)


def stand_in(folder: Path, body: str) -> Path:
    """A program that is called as Blender is: its last words are the file read, the file made and the rate."""
    script = folder / "stand-in"
    program = f"import shutil, sys\nsource, made, fps = sys.argv[-3:]\n{body}\n"
    words = shlex.join([sys.executable, "-c", program])  # the first line of a script cannot name a path with blanks
    script.write_text(f'#!/bin/sh\nexec {words} "$@"\n')
    script.chmod(0o755)
    return script


@pytest.mark.usefixtures("no_blender")
def test_without_blender_one_sentence_says_what_to_do(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save(waver(), tmp_path / "walk.bvh")
    (tmp_path / "in.fbx").write_bytes(b"Kaydara FBX Binary")
    for words in (("walk.bvh", "out.fbx"), ("in.fbx", "out.bvh"), ("walk.bvh", "out.glb", "--skeleton", "in.fbx")):
        assert main(["export", *(str(tmp_path / w) if "." in w else w for w in words)]) == 2
        assert "--blender PATH" in complaint(capsys)
    assert {p.name for p in tmp_path.iterdir()} == {"walk.bvh", "in.fbx"}


def test_a_program_that_is_not_there_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save(waver(), tmp_path / "walk.bvh")
    words = ["export", str(tmp_path / "walk.bvh"), str(tmp_path / "out.fbx"), "--blender", "/nowhere/blender"]
    assert main(words) == 2
    assert "no program /nowhere/blender" in complaint(capsys)


def test_what_blender_makes_is_read_under_the_files_own_name(tmp_path: Path) -> None:
    Hero().clip("wave", wave()).clip("run", wave(20)).write(tmp_path / "made.glb")
    (tmp_path / "in.fbx").write_bytes(b"something")
    with blender.using(stand_in(tmp_path, f"shutil.copyfile({str(tmp_path / 'made.glb')!r}, made)")):
        assert len(load(tmp_path / "in.fbx", clip="run")) == 20
        with pytest.raises(MotionloomError, match=r"in\.fbx has no clip 'jump'"):
            load(tmp_path / "in.fbx", clip="jump")
        with pytest.warns(UserWarning, match=r"in\.fbx has 2 clips"):
            load(tmp_path / "in.fbx")


def test_a_character_of_an_fbx_is_read_under_its_name_and_needs_no_file(tmp_path: Path) -> None:
    hero = Hero()
    hero.json["nodes"].append({"name": "helmet", "mesh": 0})
    hero.json["scenes"][0]["nodes"].append(25)
    hero.write(tmp_path / "made.glb")
    (tmp_path / "in.fbx").write_bytes(b"something")
    copies = stand_in(tmp_path, f"shutil.copyfile({str(tmp_path / 'made.glb')!r}, made)")
    with blender.using(copies), pytest.warns(UserWarning, match=r"in\.fbx: 'helmet' hang on no bone"):
        character = open_character(tmp_path / "in.fbx")
    assert not character.path.exists()
    assert load(character.save(retarget(waver(), character.skeleton), tmp_path / "moving.glb")).fps == 24.0


def test_what_blender_gets_is_a_glb_and_its_rate(tmp_path: Path) -> None:
    body = "assert source.endswith('.glb') and fps == '24.0'\nshutil.copyfile(source, made)"
    with blender.using(stand_in(tmp_path, body)):
        out = save(waver(), tmp_path / "out.fbx")
    assert out.read_bytes()[:4] == b"glTF"


def test_folders_may_have_blanks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """That of the program, of Python and of the files."""
    folder = tmp_path / "a folder"
    folder.mkdir()
    (folder / "python").symlink_to(sys.executable)
    monkeypatch.setattr(sys, "executable", str(folder / "python"))
    with blender.using(stand_in(folder, "shutil.copyfile(source, made)")):
        assert save(waver(), folder / "out.fbx").read_bytes()[:4] == b"glTF"


@pytest.mark.parametrize(
    "body", ["print('Error: bad header')\nsys.exit(1)", "print('Error: bad header')", "open(made, 'w')"]
)
def test_a_failure_of_blender_is_one_sentence_and_leaves_nothing(tmp_path: Path, body: str) -> None:
    with (
        blender.using(stand_in(tmp_path, body)),
        pytest.raises(MotionloomError, match=r"Blender could not convert .*(bad header|ended with 0)"),
    ):
        save(waver(), tmp_path / "out.fbx")
    assert [p.name for p in tmp_path.iterdir()] == ["stand-in"]


@pytest.fixture
def installed() -> Path | None:
    """A Blender that is really there."""
    named = os.environ.get(blender.VARIABLE) or os.environ.get("MOTIONLOOM_BLENDER_PYTHON")
    if named:
        return Path(named)
    try:
        blender.find_blender()
    except MotionloomError:
        pytest.skip(f"needs Blender: one on the path, {blender.VARIABLE}, or bpy")
    found = shutil.which("blender")
    return Path(found) if found else None


@pytest.mark.blender
def test_a_motion_comes_back_from_an_fbx(tmp_path: Path, installed: Path | None) -> None:
    motion = waver()
    with blender.using(installed):
        back = load(save(motion, tmp_path / "wave.fbx"))
    meshes = re.findall(rb"(\w+)\x00\x01Geometry", (tmp_path / "wave.fbx").read_bytes())
    assert len(meshes) == 1, "the body, and nothing that Blender's importer adds to draw bones with"
    assert back.fps == pytest.approx(24, rel=1e-3)
    assert len(back) == len(motion)
    places, found = motion.positions(), back.positions()
    for j, name in enumerate(SMPL22.names):
        np.testing.assert_allclose(found[:, back.skeleton.index(name)], places[:, j], atol=2e-3)


@pytest.mark.blender
def test_a_character_goes_out_as_fbx_and_comes_back(tmp_path: Path, installed: Path | None) -> None:
    Hero().clip("wave", 0.5 * wave()).write(tmp_path / "hero.glb")
    save(waver(), tmp_path / "walk.bvh")
    more = [] if installed is None else ["--blender", str(installed)]
    out = str(tmp_path / "out.fbx")
    assert main(["export", str(tmp_path / "walk.bvh"), out, "--skeleton", str(tmp_path / "hero.glb"), *more]) == 0
    walk, direct, again = (str(tmp_path / name) for name in ("walk.bvh", "direct.glb", "again.glb"))
    assert main(["export", walk, direct, "--skeleton", str(tmp_path / "hero.glb"), "--clip-name", "ours"]) == 0
    assert main(["export", walk, again, "--skeleton", out, "--clip-name", "ours", *more]) == 0
    wanted, made = load(direct, clip="ours"), load(again, clip="ours")
    for name in SMPL22.names:
        apart = made.positions()[:, made.skeleton.index(name)] - wanted.positions()[:, wanted.skeleton.index(name)]
        assert np.linalg.norm(apart, axis=-1).max() < 5e-3
