"""three.js as a stranger: its loader and mixer on our GLB files, and three-vrm on our VRM animations, in Node.

``MOTIONLOOM_NODE_MODULES`` names a folder ``node_modules`` that has them; without it that of the studio is used.
"""

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.motion import Motion
from motionloom.io import save
from motionloom.io.character import load_character
from motionloom.retarget import retarget
from tests.io.rigged import Hero, wave
from tests.io.test_blender import waver
from tests.shared import shared
from tests.tab.made import NODE, STUDIO

pytestmark = pytest.mark.slow
FRAMES = (0, 7, 17, 39)


def play(folder: Path, file: Path, clip: str, motion: Motion, *packages: str) -> dict:
    """What three.js shows of a file at `FRAMES`; skips the test where it is not installed."""
    modules = Path(os.environ.get("MOTIONLOOM_NODE_MODULES", STUDIO / "node_modules"))
    node = str(NODE) if NODE.is_file() else shutil.which("node")
    lacking = [name for name in ("three", *packages) if not (modules / name).is_dir()]
    if node is None or lacking:
        pytest.skip(
            f"needs Node.js and {', '.join(lacking) or 'three'}: npm install three {' '.join(packages)}".rstrip()
            + ", and MOTIONLOOM_NODE_MODULES naming its folder node_modules (three alone: make page)"
        )
    (folder / "node_modules").symlink_to(modules.absolute())
    script = shutil.copy(Path(__file__).with_name("play.mjs"), folder)
    command = [node, str(script), str(file), clip, *(repr(frame / motion.fps) for frame in FRAMES)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert ended.returncode == 0, ended.stderr[-2000:]
    (shown,) = [line for line in ended.stdout.splitlines() if line.startswith("SHOWN ")]
    return json.loads(shown.removeprefix("SHOWN "))


def check(shown: dict, motion: Motion, *, atol: float, least: int = 22) -> None:
    """Every joint that has a bone is where the motion has it, and `least` joints have."""
    assert shown["length"] == pytest.approx((len(motion) - 1) / motion.fps, abs=1e-4)
    for frame, bones in zip(FRAMES, shown["bones"], strict=True):
        names = [joint for joint in motion.skeleton.names if joint in bones]
        assert len(names) >= least
        seen = np.array([bones[joint] for joint in names])
        places = motion.positions()[frame, [motion.skeleton.index(joint) for joint in names]]
        np.testing.assert_allclose(seen, places, atol=atol, err_msg=f"frame {frame}")


def test_three_plays_a_person_where_we_put_it(tmp_path: Path) -> None:
    motion = waver()
    check(play(tmp_path, save(motion, tmp_path / "person.glb"), "motion", motion), motion, atol=1e-5)


def test_three_plays_a_character_with_turned_bones(tmp_path: Path) -> None:
    character = load_character(Hero(seed=4).clip("other", wave(seed=5)).write(tmp_path / "hero.glb"))
    motion = retarget(waver(), character.skeleton)
    file = character.save(motion, tmp_path / "moving.glb", name="ours")
    check(play(tmp_path, file, "ours", motion), motion, atol=1e-5)


def test_three_vrm_plays_a_vrm_animation_on_an_avatar(tmp_path: Path) -> None:
    """The animation's file and the avatar's own file with that clip show the same."""
    avatar = shared("rigs/vrm1_example.vrm")
    motion = retarget(waver(), load_character(avatar).skeleton)
    animation = save(motion, tmp_path / "wave.vrma")
    shown = play(tmp_path, avatar, str(animation), motion, "@pixiv/three-vrm", "@pixiv/three-vrm-animation")
    parts = set(motion.skeleton.humanoid.values())
    bones = [{name: place for name, place in frame.items() if name in parts} for frame in shown["bones"]]
    check(shown | {"bones": bones}, motion, atol=1e-3, least=len(parts))
    assert len(parts) >= 19
