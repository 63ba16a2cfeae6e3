"""The extension in Blender (`scenarios.py`), against a real server. Needs bpy, here or in another Python.

``MOTIONLOOM_BLENDER_PYTHON`` names a Python interpreter that can import bpy; without it bpy is looked for in this one.
"""

import os
import socket
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.io import load
from motionloom.retarget import retarget
from motionloom.retarget.named import named_skeleton
from tests.addon.studio import ROOT, SOURCES, Studio, archive
from tests.io.in_blender import VARIABLE, python_with_bpy
from tests.io.rigify import make_rig
from tests.server.serving import running
from tests.shared import shared

pytestmark = pytest.mark.blender
ENDS = [SMPL22.index(f"{side}_{part}") for side in ("left", "right") for part in ("wrist", "ankle", "foot")]


@pytest.fixture(scope="module")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Studio]:
    pytest.importorskip("starlette", reason="needs the extra 'studio': pip install 'motionloom[studio]'")
    if python_with_bpy() is None:
        pytest.skip(f"needs bpy, here or in the Python named by {VARIABLE}")
    folder = tmp_path_factory.mktemp("addon")
    with running(folder / "project") as server:
        yield Studio(server, archive(folder), folder)


def in_blender(places: np.ndarray, *, turn: float = 0.0, at: tuple[float, float, float] = (0, 0, 0)) -> np.ndarray:
    """Places (..., 3) with +Y up as Blender has them: Z up, turned by degrees about it, moved."""
    cos, sin = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    x, y, z = places[..., 0], -places[..., 2], places[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=-1) + np.array(at)


def test_the_manifest_is_of_this_release() -> None:
    """Version, licence, and every module in the archive that `make blender` writes."""
    manifest = tomllib.loads((SOURCES / "blender_manifest.toml").read_text())
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert manifest["version"] == project["version"]
    assert manifest["license"] == [f"SPDX:{project['license']}"]
    subprocess.run(["make", "--no-print-directory", "-B", "blender"], cwd=ROOT, check=True, capture_output=True)
    held = set(zipfile.ZipFile(ROOT / "out" / "motionloom-blender.zip").namelist())
    assert held == {path.name for path in SOURCES.iterdir() if path.is_file()} | {"LICENSE"}


def test_hands_and_feet_are_where_the_server_has_them(studio: Studio) -> None:
    """On an object that is turned, moved and a hundredth in size, whose bones are rolled at random; takes; undo."""
    found = studio.play("places", fps=20, turn=37, size=0.01, prompt="a person walks and waves")
    job = studio.server.draw(task="generate", prompt="a person walks and waves", seconds=2.0, seed=4, count=2, steps=6)
    for name, result in zip(("first", "second"), job["results"], strict=True):
        wanted = in_blender(studio.motion(result)["positions"], turn=37, at=(3, -2, 0.5))
        np.testing.assert_allclose(np.array(found[name])[:, ENDS], wanted[:, ENDS], atol=3e-3)
        exact = studio.motion(result, f"?skeleton={found['character']}&root=motion")
        order = [list(exact["names"]).index(joint) for joint in SMPL22.names]
        wanted = in_blender(exact["positions"][:, order], turn=37, at=(3, -2, 0.5))
        np.testing.assert_allclose(found[name], wanted, atol=1e-4)
    assert [seed for _, seed, _ in found["takes"]] == [4, 5]
    assert found["last"] == 40.0
    assert found["left"] == [0, 0]


@pytest.mark.parametrize("rig", ["mixamo", "unreal", "vrm"])
def test_rigs_of_other_bones_and_sizes(studio: Studio, rig: str) -> None:
    """As the library itself puts the motion on that skeleton; another rate of the scene."""
    skeleton: Skeleton = named_skeleton(rig)
    given = {"names": skeleton.names, "parents": skeleton.parents, "places": skeleton.rest_positions().tolist()}
    found = studio.play("places", fps=40, turn=-120, size=1.3, prompt="a person runs", **given)
    [result] = studio.server.draw(task="generate", prompt="a person runs", seconds=2.0, seed=4, steps=6)["results"]
    exact = studio.motion(result, f"?skeleton={found['character']}&root=motion")
    order = [list(exact["names"]).index(name) for name in skeleton.names]
    wanted = in_blender(exact["positions"][:, order], turn=-120, at=(3, -2, 0.5))
    np.testing.assert_allclose(np.array(found["first"])[: 2 * len(wanted) - 1 : 2], wanted, atol=1e-4)


def test_characters_of_others(studio: Studio) -> None:
    """Files as Blender imports them: every hand and foot is where the server puts that character's."""
    names = ("gdbot.glb", "sophia.glb", "kaykit_knight.glb", "ue_m2m_anim.glb", "mixamo_cozy.bvh", "xia.bvh")
    for name in names:
        found = studio.play("imported", file=str(shared("rigs") / name))
        [result] = studio.server.draw(task="generate", prompt="a person walks", seconds=2.0, seed=1, steps=6)["results"]
        exact = studio.motion(result, f"?skeleton={found['character']}&root=motion")
        order = [list(exact["names"]).index(bone) for bone in found["names"]]
        turn, origin = np.array(found["turn"]), np.array(found["origin"])
        wanted = exact["positions"][:, order] @ turn.T + origin
        np.testing.assert_allclose(found["places"], wanted, atol=1e-3, err_msg=name)
        assert np.ptp(np.array(found["places"]), axis=0).max() > 0.3, name


def test_a_path_a_hand_and_blocks(studio: Studio) -> None:
    """The hips follow the curve, the hand is at its empty while it is to be there, on a body a fifth larger."""
    found = studio.play("goals", target=[0.3, -2.0, 1.2])
    (begin, *_, end), hands = np.array(found["ends"])[:, 0], np.array(found["ends"])[1:4, 1]
    np.testing.assert_allclose(begin[:2], found["path"][0][:2], atol=0.05)
    np.testing.assert_allclose(end[:2], found["path"][-1][:2], atol=0.1)
    np.testing.assert_allclose(hands, [found["target"]] * 3, atol=0.005)
    assert found["remark"] == ""
    assert found["pieces"] == [["a person walks", 1, 61], ["a person walks on", 61, 119]]


def test_keyed_poses_are_passed_through(studio: Studio) -> None:
    """At their frames, where they were."""
    found = studio.play("poses")
    assert found["frames"] == [1, 31]
    np.testing.assert_allclose(found["got"], found["wanted"], atol=0.01)


def test_frames_are_made_anew_and_all_around_them_stays(studio: Studio) -> None:
    """Of a motion that was changed by hand; the take before is still there."""
    found = studio.play("redo")
    before, after = np.array(found["before"]), np.array(found["after"])
    np.testing.assert_array_equal(after[:29], before[:29])
    np.testing.assert_array_equal(after[60:], before[60:])
    assert np.abs(after - before)[35:55].max() > 0.2
    assert np.abs(np.diff(after, axis=0)).max() < 0.3
    np.testing.assert_array_equal(found["again"], before)
    assert found["kept"]
    assert "Frames 60 to 400 are not inside of" in found["refused"]


def test_two_people_meet_in_the_world_of_the_first(studio: Studio) -> None:
    """Wherever the second armature stood; as actions and as strips."""
    found = studio.play("pair")
    [result] = studio.server.draw(task="duet", prompt="two people shake hands", seconds=2.0, seed=2, steps=6)["results"]
    for number, name in enumerate(("first", "second")):
        wanted = studio.motion(result, f"?person={number}")["positions"]
        wanted = in_blender(wanted, turn=90, at=(2, 1, 0))
        np.testing.assert_allclose(np.array(found[name])[:, ENDS], wanted[:39, ENDS], atol=5e-3)
    assert found["strips"] == [[["two people shake hands", 1.0, 40.0]]] * 2
    np.testing.assert_allclose(found["nla"], found["first"], atol=1e-6)


def test_a_loop_as_strips(studio: Studio) -> None:
    """A strip for each block, and the last frame leads to the first; removed again with all that it made."""
    found = studio.play("loop")
    assert found["cyclic"]
    assert found["strips"] == [["a person stands", 1.0, 31.0], ["a person waves", 31.0, 60.0]]
    whole = np.array(found["whole"])
    steps = np.linalg.norm(np.diff(whole[:60], axis=0), axis=-1).max(axis=1)
    assert np.linalg.norm(whole[59] - whole[0], axis=-1).max() < 2 * steps.max()
    assert found["left"] == [0, 0, 0]


def test_rigify(studio: Studio) -> None:
    """Keys on the controls; deform bones, fingers and face among them, are where the server has them."""
    found = studio.play("rig", blend=str(make_rig(studio.folder / "hero.blend")))
    [result] = studio.server.draw(task="generate", prompt="a person walks forward", seconds=2.0, seed=1, steps=6)[
        "results"
    ]
    exact = studio.motion(result, f"?skeleton={found['character']}&root=motion")
    order = [list(exact["names"]).index(name) for name in found["names"]]
    wanted = in_blender(exact["positions"][[0, 9, 19, 29, 39]][:, order], turn=30, at=(1, 1, 0))
    np.testing.assert_allclose(found["first"], wanted, atol=1e-3)
    assert {"torso", "hand_fk.L", "foot_fk.R", "head", "upper_arm_parent.L"} <= set(found["keyed"])
    assert not any(name.startswith(("DEF-", "ORG-", "MCH-")) for name in found["keyed"])
    first, second = np.array(found["first"]), np.array(found["second"])
    np.testing.assert_allclose(second[[0, 1, 3, 4]], first[[0, 1, 3, 4]], atol=1e-4)
    assert np.abs(second[2] - first[2]).max() > 0.01


def test_what_is_wrong_is_said_in_a_sentence(studio: Studio) -> None:
    """And changes nothing."""
    found = studio.play("refusals")
    said = {
        "nothing": "No armature is selected",
        "words": "There are no words",
        "stretched": "Hero is stretched or mirrored (scale 1, 2, 1)",
        "no_motion": "Hero has no motion that could be changed",
        "high": "9.00 m high, out of anybody's reach",
        "late": "Frame 900 of the goal 'Target' is outside of the motion, which takes frames 1 to 49",
        "no_path": "Goals and poses in several blocks need a path",
        "nobody": "Armature: the skeleton is not a humanoid that can be read",
        "away": "No motionloom server answers at http://127.0.0.1:9",
        "program": "There is no program '/nowhere/motionloom'",
    }
    for name, sentence in said.items():
        assert sentence in found[name], name
        assert "\n" not in found[name], name
    assert found["changed"] == [0, 0]


def test_blender_starts_the_server_and_cancels_a_job(studio: Studio, tmp_path: Path) -> None:
    """Then it makes a motion, and ends the server that it started."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    command = Path(sys.executable).with_name("motionloom")
    given = {"command": str(command), "folder": str(tmp_path / "project"), "sources": os.environ.get("PYTHONPATH", "")}
    found = studio.play("serve", f"http://127.0.0.1:{port}", **given)
    assert "Cancelled: nothing was changed" in found["cancelled"]
    assert found["takes"] == 1
    assert found["ended"]


def test_the_library_agrees(studio: Studio) -> None:
    """What the server puts on a skeleton is what `retarget` makes: it is no mistake of both that agrees above."""
    [result] = studio.server.draw(task="generate", prompt="a person runs", seconds=2.0, seed=4, steps=6)["results"]
    path = studio.folder / "project" / "motions" / f"{result['id']}.npz"
    person = replace(load(path), skeleton=SMPL22)  # the server's knows where its soles are, one from a file does not
    wanted = retarget(person, named_skeleton("mixamo"), root="motion").positions()
    got = studio.motion(result, "?skeleton=mixamo&root=motion")["positions"]
    np.testing.assert_allclose(got, wanted, atol=5e-3)
