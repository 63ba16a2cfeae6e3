"""Godot as a stranger: it imports our GLB files without a window and plays them. Needs Debian's `godot3-server`."""

import json
import os
import shutil
import subprocess
from pathlib import Path
from time import sleep

import numpy as np
import pytest

from motionloom.core.motion import Motion
from motionloom.io import save
from motionloom.io.character import load_character
from motionloom.retarget import retarget
from tests.io.rigged import Hero, wave
from tests.io.test_blender import waver

pytestmark = pytest.mark.slow
HERE = Path(__file__).parent
FRAMES = (0, 7, 17, 39)
SETTINGS = """[remap]
importer="scene"
type="PackedScene"

[params]
animation/fps={fps}
animation/optimizer/enabled=false
"""
"""What docs/engines/godot.md has its reader set in the import dock."""


@pytest.fixture(scope="module")
def godot() -> str:
    found = os.environ.get("MOTIONLOOM_GODOT") or shutil.which("godot3-server")
    if not found:
        pytest.skip("needs Godot 3 without a window: apt-get install godot3-server (or MOTIONLOOM_GODOT names it)")
    return found


def project(folder: Path, files: list[tuple[Path, float]]) -> Path:
    """A project of these files, with the rate of each in its import settings."""
    folder.mkdir()
    (folder / "project.godot").write_text('config_version=4\n\n[application]\n\nconfig/name="motionloom"\n')
    shutil.copy(HERE / "play.gd", folder)
    for path, fps in files:
        shutil.copy(path, folder)
        (folder / f"{path.name}.import").write_text(SETTINGS.format(fps=round(fps)))
    return folder


def run_editor(godot: str, folder: Path, count: int) -> None:
    """Let the editor import the project's files, then end it: without a window it does not end by itself."""
    environment = os.environ | {"HOME": str(folder)}
    command = [godot, "--path", str(folder), "--editor", "--quit"]
    with (folder / "editor.log").open("w") as log:
        editor = subprocess.Popen(command, env=environment, stdout=log, stderr=log)
    try:
        for _ in range(600):
            if len(list((folder / ".import").glob("*.md5"))) == count or editor.poll() is not None:
                break
            sleep(0.2)
    finally:
        editor.kill()
        editor.wait()
    assert len(list((folder / ".import").glob("*.scn"))) == count, (folder / "editor.log").read_text()[-2000:]


def play(godot: str, folder: Path, name: str, seconds: list[float]) -> dict:
    command = [godot, "--path", str(folder), "-s", "play.gd", name, *(repr(at) for at in seconds)]
    environment = os.environ | {"HOME": str(folder)}
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=False)
    (shown,) = [line for line in ended.stdout.splitlines() if line.startswith("SHOWN ")]
    return json.loads(shown.removeprefix("SHOWN "))


def test_godot_plays_a_person_and_a_character_where_we_put_them(godot: str, tmp_path: Path) -> None:
    """A body of ours, and a character whose bones have turned axes and that has another clip already."""
    character = load_character(Hero(seed=4).clip("other", wave(seed=5)).write(tmp_path / "hero.glb"))
    motions: dict[str, Motion] = {"person.glb": waver(), "moving.glb": retarget(waver(), character.skeleton)}
    save(motions["person.glb"], tmp_path / "person.glb")
    character.save(motions["moving.glb"], tmp_path / "moving.glb", name="ours")
    folder = project(tmp_path / "project", [(tmp_path / name, m.fps) for name, m in motions.items()])
    run_editor(godot, folder, len(motions))
    for file, motion in motions.items():
        shown = play(godot, folder, file, [frame / motion.fps for frame in FRAMES])
        assert shown["length"] == pytest.approx((len(motion) - 1) / motion.fps, abs=1e-4)
        for frame, bones in zip(FRAMES, shown["bones"], strict=True):
            places = {name.replace("_", ""): place for name, place in bones.items()}  # Godot 3 calls spine1 spine_1
            joints = [j for j, name in enumerate(motion.skeleton.names) if name.replace("_", "") in places]
            assert len(joints) >= 22
            seen = np.array([places[motion.skeleton.names[j].replace("_", "")] for j in joints])
            np.testing.assert_allclose(seen, motion.positions()[frame, joints], atol=1e-4, err_msg=f"{file}, {frame}")
