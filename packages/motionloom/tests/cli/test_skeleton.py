"""`--skeleton`: every command that makes motion puts it on the user's own character."""

import base64
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import main, skeletons
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.ground import turned
from motionloom.core.motion import Motion, ground_pose
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.io.character import load_character
from motionloom.io.gltf import load_glb
from motionloom.io.gltf_read import open_glb
from motionloom.kinematics.gestures import Seat
from motionloom.retarget import to_smpl22
from tests.cli.predict.clips import tiny_predictor
from tests.cli.said import complaint
from tests.io.gltf_skin import Scene
from tests.io.rigged import Hero, wave
from tests.io.test_bind_pose import place
from tests.io.test_character import check_only_one_animation_is_new
from tests.retarget.test_toes import heels_up, with_tips
from tests.tasks.test_edit import person

TINY = ("--steps", "2", "--no-foot-lock")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs beside a character with a clip and a walk."""
    monkeypatch.chdir(tmp_path)
    Hero().clip("wave", 0.5 * wave(20)).write(tmp_path / "hero.glb")
    save_bvh(person(2.0, 30.0), "walk.bvh")
    return tmp_path


def check(out: str, name: str) -> None:
    check_only_one_animation_is_new(Path("hero.glb"), Path(out))
    assert open_glb(out).clips == ["wave", name]


def test_export_puts_a_walk_on_a_character() -> None:
    assert main(["export", "walk.bvh", "--skeleton", "hero.glb", "--out", "moving.glb"]) == 0
    check("moving.glb", "walk")
    assert main(["export", "walk.bvh", "moving.glb", "--skeleton", "hero.glb", "--clip-name", "go", "--replace"]) == 0
    assert open_glb("moving.glb").clips == ["go"]


def test_export_writes_the_characters_own_mesh_into_a_usda() -> None:
    assert main(["export", "walk.bvh", "moving.usda", "--skeleton", "hero.glb"]) == 0
    text = Path("moving.usda").read_text()
    assert 'def Mesh "body_0"' in text
    assert text.count("def Mesh") == 1


def test_a_character_that_lies_at_rest_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    lying = Hero()
    lying.json["nodes"][22]["rotation"] = [-(0.5**0.5), 0, 0, 0.5**0.5]
    lying.write(Path("lying.glb"))
    assert main(["export", "walk.bvh", "--skeleton", "lying.glb", "--out", "moving.glb"]) == 0
    assert "does not stand along +Y at rest" in capsys.readouterr().err
    body = to_smpl22(load_glb("moving.glb")).positions()
    assert (body[:, 15, 1] - body[:, 0, 1]).min() > 0.3
    assert main(["export", "walk.bvh", "--skeleton", "hero.glb", "--out", "other.glb"]) == 0
    assert "+Y" not in capsys.readouterr().err


def with_positions(path: str, unit: float, offsets: float, noise: float) -> np.ndarray:
    """A person whose bones stand in position channels; the OFFSETs are so many times as long. Gives the bones in the
    file's unit."""
    bones = SMPL22.offsets / unit
    children = {j: [k for k, parent in enumerate(SMPL22.parents) if parent == j] for j in range(22)}

    def joint(j: int) -> list[str]:
        offset = " ".join(f"{v:.8f}" for v in offsets * bones[j])
        channels = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
        inside = [line for k in children[j] for line in joint(k)] or ["End Site { OFFSET 0 0 0 }"]
        return [f"{'JOINT' if j else 'ROOT'} {SMPL22.names[j]} {{", f"OFFSET {offset}", channels, *inside, "}"]

    rng, walk = np.random.default_rng(3), person(1.0, 20.0)
    rows = np.zeros((len(walk), 22, 6))
    rows[..., :3] = bones + rng.normal(0, noise, (len(walk), 22, 3)) * np.linalg.norm(bones, axis=1)[None, :, None]
    rows[:, 0, :3] = walk.root / unit
    order = lines_order(children)
    text = ["HIERARCHY", *joint(0), "MOTION", f"Frames: {len(walk)}", "Frame Time: 0.05"]
    text += [" ".join(f"{v:.8f}" for v in row[order].ravel()) for row in rows]
    Path(path).write_text("\n".join(text) + "\n")
    return np.linalg.norm(bones, axis=1)


def lines_order(children: dict[int, list[int]]) -> list[int]:
    """The joints in the order of the file."""
    order, stack = [], [0]
    while stack:
        order.append(stack.pop())
        stack += reversed(children[order[-1]])
    return order


@pytest.mark.parametrize("unit", [1.0, 0.01, 0.001, 0.0254, 0.0254 / 0.45])
@pytest.mark.parametrize(("offsets", "noise"), [(0.0, 0.0), (0.0, 0.02), (0.1, 1e-6), (1.0, 1e-3)])
def test_a_character_whose_bones_stand_in_position_channels_comes_out_at_its_size(
    unit: float, offsets: float, noise: float
) -> None:
    bones = with_positions("own.bvh", unit, offsets, noise)
    for words in ((), ("--unit", str(unit))):
        assert main(["export", "walk.bvh", "out.bvh", "--skeleton", "own.bvh", "--force", *words]) == 0
        skeleton = io.load("out.bvh", unit=1.0).skeleton
        lengths = skeleton.bone_lengths()[[skeleton.index(name) for name in SMPL22.names[1:]]]
        np.testing.assert_allclose(lengths, bones[1:], rtol=0.05)
        assert io.load("out.bvh").root[:, 1].mean() == pytest.approx(0.95, abs=0.1)


@pytest.mark.parametrize(
    "words",
    [
        ("generate", "a person walks", "--seconds", "1"),
        ("compose", "a person walks", "a person turns", "--seconds", "2"),
        ("control", "a person walks", "--follow", "left_wrist", "--from", "walk.bvh"),
        ("edit", "walk.bvh", "a person waves", "--between", "0.5", "1.5"),
    ],
)
def test_commands_that_draw_write_the_character(weights: str, words: tuple[str, ...]) -> None:
    line = [*words, "--weights", weights, *TINY, "--skeleton", "hero.glb", "--clip-name", "ours"]
    assert main([*line, "--out", "out.glb"]) == 0
    check("out.glb", "ours")


def test_predictions_are_put_on_the_character(tmp_path: Path) -> None:
    from motionloom.core.models.predictor import save_predictor

    weights = str(save_predictor(tiny_predictor(), tmp_path / "tiny.safetensors"))
    more = ["--weights", weights, "--steps", "2", "--skeleton", "hero.glb", "--clip-name", "ours", "--count", "2"]
    assert main(["predict", "walk.bvh", "--seconds", "0.5", "--no-picture", "--out", "futures", *more]) == 0
    for number in (0, 1):
        check(f"futures/future_0{number}.glb", "ours")
    assert main(["switch", "walk.bvh", "walk.bvh", "--out", "out.glb", *more]) == 0
    check("out_1.glb", "ours")


def test_the_character_itself_is_not_written_over(capsys: pytest.CaptureFixture[str]) -> None:
    before = Path("hero.glb").read_bytes()
    assert main(["export", "walk.bvh", "--skeleton", "hero.glb", "--out", "hero.glb"]) == 2
    assert "is the character itself" in complaint(capsys)
    assert Path("hero.glb").read_bytes() == before


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--root", "hips"), "--root goes with a --skeleton"),
        (("--replace",), "--replace goes with a --skeleton"),
        (("--at", "origin"), "--at goes with a --skeleton"),
        (("--skeleton", "walk.bvh", "--at", "origin"), "for .glb, .gltf and .vrm characters"),
        (("--skeleton", "walk.bvh", "--replace"), "for .glb, .gltf and .vrm characters"),
        (("--skeleton", "hero.txt"), "--skeleton needs"),
    ],
)
def test_what_does_not_go_together_is_refused(
    words: tuple[str, ...], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "walk.bvh", "out.bvh", *words]) == 2
    assert sentence in complaint(capsys)
    assert not Path("out.bvh").exists()


def test_info_lists_clips_and_clip_picks_one(capsys: pytest.CaptureFixture[str]) -> None:
    Hero().clip("wave", wave(20)).clip("run", wave(30)).write(Path("two.glb"))
    assert main(["info", "two.glb", "--clip", "run"]) == 0
    output = capsys.readouterr().out
    assert "1  wave, 0.63 s" in output
    assert "30 frames" in output
    assert main(["export", "two.glb", "two.bvh"]) == 0
    assert "2 clips" in complaint(capsys)


def test_edit_and_predict_read_one_clip_of_a_character(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    Hero().clip("wave", wave(20)).clip("run", wave(60)).write(Path("two.glb"))
    more = ["--weights", weights, *TINY, "--out", "out.bvh"]
    assert main(["edit", "two.glb", "waves", "--clip", "run", "--between", "0.5", "1.5", *more]) == 0
    assert len(io.load("out.bvh")) == 60
    assert "none was chosen" not in capsys.readouterr().err


# The root bone -------------------------------------------------------------------------------------------------------


def _paths(mode: str) -> tuple[np.ndarray, np.ndarray]:
    """(frames, 3) of the root bone and of the hips of a walk that is exported with ``--root``."""
    hero = Hero()
    hero.json["skins"][0]["joints"].append(22)
    matrices = hero.values(hero.json["skins"][0]["inverseBindMatrices"], 16)
    hero.json["skins"][0]["inverseBindMatrices"] = hero.add(np.vstack([matrices, np.eye(4).ravel()]), 5126, "MAT4")
    hero.write(Path("rooted.glb"))
    assert main(["export", "walk.bvh", "--skeleton", "rooted.glb", "--root", mode, "--out", "out.glb"]) == 0
    motion = load_glb("out.glb")
    places = motion.positions()
    return places[:, motion.skeleton.index("root")], places[:, motion.skeleton.index("pelvis")]


def test_a_root_bone_stays_on_the_ground() -> None:
    walk = to_smpl22(io.load("walk.bvh")).root
    way = (walk - [SMPL22.offsets[0, 0], 0, SMPL22.offsets[0, 2]]) * [1, 0, 1]
    for mode, root, hips in (("motion", way, way), ("hips", 0 * way, way), ("in-place", 0 * way, 0 * way)):
        bone, pelvis = _paths(mode)
        np.testing.assert_allclose(bone, root, atol=3e-3)
        np.testing.assert_allclose(pelvis[:, [0, 2]], hips[:, [0, 2]], atol=3e-3)
        np.testing.assert_allclose(pelvis[:, 1], walk[:, 1], atol=1e-2)


def test_the_same_three_in_a_bvh() -> None:
    offsets = np.vstack([np.zeros(3), SMPL22.offsets])
    skeleton = Skeleton(("base", *SMPL22.names), (-1, *(p + 1 for p in SMPL22.parents)), offsets)
    turns = np.tile([1.0, 0, 0, 0], (1, 23, 1))
    save_bvh(Motion(skeleton, 30.0, np.zeros((1, 3)), turns), "rooted.bvh")
    places = {}
    for mode in ("motion", "hips", "in-place"):
        assert main(["export", "walk.bvh", "out.bvh", "--skeleton", "rooted.bvh", "--root", mode]) == 0
        places[mode] = io.load("out.bvh").positions()[:, :2]
    np.testing.assert_allclose(places["motion"][:, 1], places["hips"][:, 1], atol=1e-5)
    np.testing.assert_allclose(places["motion"][:, 0, 1], 0, atol=2e-3)
    np.testing.assert_allclose(np.ptp(places["hips"][:, 0], axis=0), 0, atol=1e-5)
    assert np.ptp(places["motion"][:, 0, 2]) > 0.5
    assert np.ptp(places["in-place"][:, 1, 2]) < 1e-5


def test_toe_tips_of_a_bvh_skeleton_stay_out_of_the_floor() -> None:
    tips = with_tips()
    turns = np.tile([1.0, 0, 0, 0], (1, len(tips), 1))
    save_bvh(Motion(tips, 30.0, np.zeros((1, 3)), turns), "tips.bvh")
    save_bvh(heels_up(), "heels.bvh")
    assert main(["export", "heels.bvh", "out.bvh", "--skeleton", "tips.bvh"]) == 0
    assert io.load("out.bvh").positions()[..., 1].min() > -0.01


# Several clips in one file -------------------------------------------------------------------------------------------


def test_several_motions_become_clips_of_one_file() -> None:
    """In one call, behind those that were there, or in their place."""
    save_bvh(person(1.0, 20.0), "run.bvh")
    line = ["export", "walk.bvh", "run.bvh", "--skeleton", "hero.glb", "--out", "out.glb"]
    assert main(line) == 0
    assert open_glb("out.glb").clips == ["wave", "walk", "run"]
    assert [round(seconds, 2) for _, seconds in open_glb("out.glb").lengths] == [0.63, 1.97, 0.95]
    assert main([*line, "--clip-name", "go", "--clip-name", "wave", "--force"]) == 0
    assert open_glb("out.glb").clips == ["wave", "go", "wave_2"]
    assert main([*line, "--clip-name", "go", "--replace", "--force"]) == 0
    assert open_glb("out.glb").clips == ["go", "go_2"]
    one = load_glb("out.glb", clip="go_2")
    assert main(["export", "run.bvh", "alone.glb", "--skeleton", "hero.glb", "--replace"]) == 0
    np.testing.assert_allclose(one.positions(), load_glb("alone.glb").positions(), atol=1e-6)


def test_what_one_of_our_clips_moves_is_held_in_the_others(tmp_path: Path) -> None:
    character = load_character("hero.glb")
    still = Motion(
        character.skeleton,
        20.0,
        np.tile(character.skeleton.offsets[0], (5, 1)),
        np.tile([1.0, 0, 0, 0], (5, len(character.skeleton), 1)),
    )
    turns = still.rotations.copy()
    finger = character.skeleton.index("finger")
    turns[:, finger] = [0.5, 0.5, 0.5, 0.5]
    scene = Scene(character.save_clips([(replace(still, rotations=turns), "a"), (still, "b")], tmp_path / "two.glb"))
    moved = {channel["target"]["node"] for channel in scene.clip("b")["channels"]}
    assert character.nodes[finger] in moved


def test_generate_writes_all_its_motions_into_one_file(weights: str) -> None:
    line = ["generate", "a person walks", "a person turns", "--seconds", "1", "--weights", weights, *TINY]
    assert main([*line, "--skeleton", "hero.glb", "--one-file", "--out", "out.glb", "--out", "film.npz"]) == 0
    assert open_glb("out.glb").clips == ["wave", "a person walks", "a person turns"]
    assert sorted(path.name for path in Path().glob("film*")) == ["film_0.npz", "film_1.npz"]
    names = ["--clip-name", "walk", "--clip-name", "turn"]
    assert main([*line, "--skeleton", "hero.glb", *names, "--out", "each.glb"]) == 0
    assert [open_glb(f"each_{k}.glb").clips[-1] for k in (0, 1)] == ["walk", "turn"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("walk.bvh", "walk.bvh", "--out", "out.bvh"), "2 motions go into one file as animations of a character"),
        (("walk.bvh",), "one file to write is needed"),
        (("walk.bvh", "out.glb", "--skeleton", "hero.glb", "--clip-name", "a", "--clip-name", "b"), "needs one --clip"),
    ],
)
def test_clips_that_cannot_be_are_refused(
    words: tuple[str, ...], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", *words]) == 2
    assert sentence in complaint(capsys)
    assert not list(Path().glob("out*"))


# Where it stands -----------------------------------------------------------------------------------------------------


def begins(path: str, clip: str) -> np.ndarray:
    """(3,) where the hips of a clip of a character begin, x and z, and its facing in degrees from +Z to the left."""
    scene = Scene(Path(path))
    worlds = scene.worlds(scene.clip(clip), np.zeros(1))[0, :, :3, 3]
    names = [node.get("name") for node in scene.nodes]
    left, right, hips = (worlds[names.index(name)] for name in ("left_hip", "right_hip", "pelvis"))
    return np.array([hips[0], hips[2], np.degrees(np.arctan2(right[2] - left[2], left[0] - right[0]))])


def test_clips_start_where_the_character_stands_and_faces(capsys: pytest.CaptureFixture[str]) -> None:
    place(Hero()).clip("wave", 0.5 * wave(20)).write(Path("there.glb"))
    save_bvh(replace(person(2.0, 30.0), root=np.array([4.0, 0.0, -2.0]) + person(2.0, 30.0).root), "far.bvh")
    for source in ("walk.bvh", "far.bvh"):
        assert main(["export", source, "out.glb", "--skeleton", "there.glb", "--clip-name", "new"]) == 0
        assert "stands at x 3.00, z 1.00 m and faces 90 degrees" in capsys.readouterr().err
        np.testing.assert_allclose(begins("out.glb", "new"), [3.0, 1.0, 90.0], atol=0.5)
        np.testing.assert_allclose(begins("out.glb", "new")[:2], [3.0, 1.0], atol=1e-3)
        line = ["export", source, "out.glb", "--skeleton", "there.glb", "--clip-name", "new"]
        assert main([*line, "--at", "origin"]) == 0
        np.testing.assert_allclose(begins("out.glb", "new"), [0.0, 0.0, 0.0], atol=0.5)
        assert "stands at" not in capsys.readouterr().err
        assert main(["export", source, "out.glb", "--skeleton", "hero.glb", "--clip-name", "new"]) == 0
        np.testing.assert_allclose(
            begins("out.glb", "new")[:2], to_smpl22(io.load(source)).root[0, [0, 2]], atol=1e-3
        )  # one at the origin keeps the place of the motion


def test_a_characters_own_clip_stays_where_it_is() -> None:
    place(Hero()).clip("wave", 0.5 * wave(20)).write(Path("there.glb"))
    assert main(["export", "there.glb", "out.glb", "--skeleton", "there.glb", "--clip-name", "new"]) == 0
    np.testing.assert_allclose(begins("out.glb", "new"), begins("there.glb", "wave"), atol=1e-2)


def test_one_that_faces_away_does_so_in_its_clips() -> None:
    """As avatars of VRM 0 do."""
    hero = Hero()
    hero.json["nodes"][22]["rotation"] = [0.0, 1.0, 0.0, 0.0]
    hero.write(Path("away.glb"))
    assert main(["export", "walk.bvh", "out.glb", "--skeleton", "away.glb", "--clip-name", "new"]) == 0
    x, z, facing = begins("out.glb", "new")
    assert abs(facing) == pytest.approx(180.0, abs=0.5)
    ends = load_glb("out.glb", clip="new").root[-1]
    walk = to_smpl22(io.load("walk.bvh"))
    way = turned(walk.root[-1] - walk.root[0], np.pi - ground_pose(walk.positions()[0]).facing)
    np.testing.assert_allclose(ends[[0, 2]] - [x, z], way[[0, 2]], atol=0.02)


def test_two_people_keep_their_places_to_each_other() -> None:
    place(Hero()).write(Path("there.glb"))
    target = skeletons.Target("there.glb", load_character("there.glb").skeleton, character=load_character("there.glb"))
    one = person(2.0, 30.0)
    other = replace(one, root=np.array([0.0, 0.0, 1.5]) + one.root)
    first, second = target.retarget_all([one, other])
    np.testing.assert_allclose((second.root - first.root)[:, [0, 2]], np.tile([1.5, 0.0], (len(one), 1)), atol=1e-6)


def test_without_a_name_the_character_itself_is_written(weights: str) -> None:
    assert (
        main(["generate", "a person walks", "--seconds", "1", "--weights", weights, *TINY, "--skeleton", "hero.glb"])
        == 0
    )
    check("motion.glb", "a person walks")
    assert not Path("motion.bvh").exists()


def test_a_vrm_is_also_written_as_the_glb_that_it_is() -> None:
    Path("hero.glb").rename("hero.vrm")
    assert main(["export", "walk.bvh", "--skeleton", "hero.vrm", "--out", "moving.vrm"]) == 0
    assert main(["export", "walk.bvh", "--skeleton", "hero.vrm", "--out", "moving.glb"]) == 0
    assert Path("moving.glb").read_bytes() == Path("moving.vrm").read_bytes()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("walk.bvh", "moving.glb", "--skeleton", "hero.glb", "--clip", "wave"), "--clip-name names the one"),
        (("hero.glb", "wave.bvh", "--clip", "wawe"), "did you mean 'wave'?"),
        (("walk.bvh", "moving.glb", "--skeleton", "hero.gltf"), "give a name that ends in .gltf"),
    ],
)
def test_what_is_mixed_up_is_said(words: tuple[str, ...], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Also that a .gltf's character does not go lost in a .glb of a mannequin."""
    hero = Hero()
    uri = "data:application/octet-stream;base64," + base64.b64encode(bytes(hero.data)).decode()
    content = hero.json | {"buffers": [{"byteLength": len(hero.data), "uri": uri}]}
    Path("hero.gltf").write_text(json.dumps(content))
    assert main(["export", *words]) == 2
    assert sentence in complaint(capsys)
    assert not Path("moving.glb").exists()


def test_a_seat_is_as_high_and_far_as_the_character_needs(
    weights: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("motionloom.cli.generate.seats", lambda *_: [Seat(0.0, 1.0, 0.4, 0.1, -0.2)])
    Hero(size=1.3).write(Path("giant.glb"))
    line = ["generate", "a person sits", "--seconds", "1", "--weights", weights, *TINY]
    assert main([*line, "--skeleton", "giant.glb"]) == 0
    assert "a seat 0.52 m high belongs at x 0.13, z -0.26 m" in capsys.readouterr().err
    assert main([*line, "--out", "uniform.bvh"]) == 0
    assert "a seat 0.40 m high" in capsys.readouterr().err


def test_a_character_that_is_only_read_is_said_not_to_come_out(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "hero.glb", "body.glb"]) == 0
    assert "--skeleton hero.glb writes that character" in capsys.readouterr().err
    assert main(["export", "body.glb", "again.glb"]) == 0
    assert main(["export", "hero.glb", "hero.bvh"]) == 0
    assert main(["export", "hero.glb", "more.glb", "--skeleton", "hero.glb"]) == 0
    assert "simple body" not in capsys.readouterr().err
