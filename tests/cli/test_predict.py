"""predict and switch, as a stranger types them: with quick makers in the network's place, and with a tiny network."""

import json
import signal
from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np
import pytest
import torch

from motionloom import cli, io
from motionloom.checkpoint import Card, save_prior
from motionloom.cli import futures, main
from motionloom.cli import predict as command
from motionloom.diffusion import Dct, linear
from motionloom.errors import MotionloomError
from motionloom.features.positions import SMPL_LAYOUT
from motionloom.io import stream
from motionloom.io.bvh import read_bvh
from motionloom.io.bvh_writer import save_bvh
from motionloom.motion import Motion
from motionloom.nets.predictor import NetConfig, TransLinear
from motionloom.predictor import Predictor, save_predictor, told_shape
from motionloom.skeleton import SMPL22, Skeleton
from motionloom.tasks import predict as task
from motionloom.tasks.predict import HeldPart
from tests.nets import tiny
from tests.tasks.test_edit import person, rig

KEPT, OBSERVED, FRAMES, FPS = 24, 15, 75, 30.0


def tiny_predictor() -> Predictor:
    """Random weights that move a person a little: half a second seen, two seconds made."""
    torch.manual_seed(3)
    shape = told_shape(SMPL_LAYOUT, KEPT)
    net = TransLinear(NetConfig(channels=66, kept=KEPT, layers=2, width=32, heads=2, told=shape, beside=True)).eval()
    zeros = torch.zeros(KEPT, 66)
    pose = torch.stack([torch.zeros(66), torch.ones(66)])
    return Predictor(
        net.requires_grad_(False), linear(100), SMPL_LAYOUT, Dct(FRAMES, KEPT), OBSERVED, FPS, "told",
        zeros, zeros + 0.01, pose, Card("tiny"),
    )  # fmt: skip


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(save_predictor(tiny_predictor(), tmp_path_factory.mktemp("weights") / "tiny.safetensors"))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs beside two clips in centimetres with angles in another order, one of which is on another body."""
    monkeypatch.chdir(tmp_path)
    if "predict" not in cli.FAMILIES:
        monkeypatch.setattr(cli, "FAMILIES", (*cli.FAMILIES, "predict"))
    save_bvh(person(1.0, 30.0), "past.bvh", order="XYZ", unit=0.01)
    save_bvh(person(1.5, 30.0), "kick.bvh", order="XYZ", unit=0.01)
    other = person(1.0, 30.0)
    save_bvh(Motion(_larger(), 30.0, other.root, other.rotations), "other.bvh")
    return tmp_path


def _larger() -> Skeleton:
    return Skeleton(SMPL22.names, SMPL22.parents, 1.1 * SMPL22.offsets)


CLIPS = {"past.bvh", "kick.bvh", "other.bvh"}


def written(place: str = ".") -> set[str]:
    return {path.name for path in Path(place).iterdir()} - CLIPS


def future(past: Motion, seconds: float, number: int) -> Motion:
    """The person goes on along +Z, at ``number`` + 1 metres a second, in the past's last pose."""
    count = round(seconds * past.fps)
    root = past.root[-1] + np.arange(1, count + 1)[:, None] / past.fps * [0, 0, number + 1]
    return Motion(past.skeleton, past.fps, root, np.repeat(past.rotations[-1:], count, axis=0))


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> dict:
    """What the commands asked of the tasks, which make simple motions and stop where they are told."""
    seen: dict = {"stop": None, "problem": KeyboardInterrupt}

    def predict(predictor, past, *, count, seconds, seed, hold, guidance, root, clean, progress, **walk):
        seen.update(past=past, count=count, seconds=seconds, seed=seed, hold=hold, guidance=guidance, root=root)
        seen.update(clean=clean, walk=walk)
        progress(1, 1)
        return [stream.joined([past, future(past, seconds, i)]) for i in range(count)]

    def predict_pieces(predictor, past, *, seconds, number, seed, hold, guidance, root, clean, **walk):
        seen.update(past=past, seconds=seconds, seed=seed, hold=hold, root=root, clean=clean, walk=walk)
        if (number, -1) == seen["stop"]:
            raise seen["problem"]
        yield past
        whole = future(past, seconds, number)
        for piece, at in enumerate(range(0, len(whole), 300)):
            if (number, piece) == seen["stop"]:
                raise seen["problem"]
            yield whole.frames(at, at + 300)

    def switch(predictor, past, target, *, count, seconds, seed, facing, guidance, clean, **walk):
        seen.update(past=past, target=target, count=count, seconds=seconds, facing=facing, walk=walk)
        still = [replace(one, translations=None) for one in (past, target)]
        return [stream.joined([still[0], future(past, seconds, i), still[1]]) for i in range(count)]

    for made in (predict, predict_pieces, switch):
        monkeypatch.setattr(task, made.__name__, made)
    return seen


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list:
    """What was drawn over each other, instead of the slow drawing."""
    from motionloom.io import overlay

    seen: list = []

    def draw_futures(past, futures, path, *, caption, lead):
        seen.append((past, futures, path.name, caption))
        path.write_bytes(b"drawn")
        return path

    monkeypatch.setattr(overlay, "draw_futures", draw_futures)
    return seen


def run(weights: str, *words: str) -> int:
    return main([*words, "--weights", weights])


# Files -----------------------------------------------------------------------------------------------------------


def test_a_folder_holds_one_file_per_future_a_picture_and_a_film(weights, asked, drawn, capsys):
    """All in the past's own manner, and drawn from where the past ends."""
    assert run(weights, "predict", "past.bvh", "--seconds", "2", "--count", "3", "--out", "futures/") == 0
    names = ["future_00.bvh", "future_01.bvh", "future_02.bvh", "overview.png", "overlay.mp4"]
    assert written("futures") == set(names)
    assert written() == {"futures"}
    said = capsys.readouterr()
    assert said.out.splitlines() == [f"wrote futures/{name}" for name in names]
    assert said.err == "note: of the 1.00 s of the past the predictor sees the last 0.50\n"
    own, file = read_bvh(Path("past.bvh")), read_bvh(Path("futures/future_01.bvh"))
    assert (file.unit, dict(file.orders)) == (own.unit, dict(own.orders))
    assert (file.motion.fps, file.motion.skeleton, len(file.motion)) == (own.motion.fps, own.motion.skeleton, 90)
    np.testing.assert_allclose(file.motion.positions()[:30], own.motion.positions(), atol=1e-6)
    np.testing.assert_allclose(file.motion.root[-1] - own.motion.root[-1], [0, 0, 4], atol=1e-5)
    past, several, _, caption = drawn[0]
    assert (len(past), [len(one) for one in several], caption) == (30, [60] * 3, "past")
    np.testing.assert_allclose(several[2].root[0] - past.root[-1], [0, 0, 3 / 30], atol=1e-5)
    assert [name for *_, name, _ in drawn] == names[3:]


def test_lines_ask_what_the_tasks_take(weights, asked):
    words = ["predict", "past.bvh", "--horizon", "3", "--out", "a.npz", "--seed", "5", "--guidance", "1.5"]
    walk = ["--steps", "4", "--temperature", "0"]
    assert run(weights, *words, *walk, "--no-root", "--raw", "--count", "2") == 0
    keys = ("seconds", "count", "seed", "walk", "guidance", "root", "clean", "hold")
    assert [asked[key] for key in keys] == [3, 2, 5, {"steps": 4, "temperature": 0}, 1.5, False, False, None]
    assert run(weights, "predict", "past.bvh", "--no-picture") == 0
    assert [asked[key] for key in keys] == [2, 10, 0, {}, 1, True, True, None]
    assert run(weights, "predict", "past.bvh", "--horizon", "40", "--out", "a.bvh", "--temperature", "0.5") == 0
    assert asked["walk"] == {"temperature": 0.5}
    assert run(weights, "switch", "past.bvh", "past.bvh", "--out", "a.bvh", "--temperature", "2") == 0
    assert asked["walk"] == {"temperature": 2}
    assert written("futures") == {f"future_{i:02d}.bvh" for i in range(10)}


def test_formats_are_chosen_by_name_or_by_the_files_ending(weights, asked, drawn, capsys):
    assert run(weights, "predict", "past.bvh", "--count", "2", "--format", "npz", "--format", "glb", "--json") == 0
    names = {"future_00.npz", "future_01.npz", "future_00.glb", "future_01.glb", "overview.png", "overlay.mp4"}
    assert written("futures") == names
    about = json.loads(capsys.readouterr().out)
    assert {Path(file).name for file in about["files"]} == names
    assert (about["seconds"], about["count"], about["seed"]) == (2, 2, 0)
    assert run(weights, "predict", "past.bvh", "--count", "2", "--out", "a.glb", "--out", "all.mp4") == 0
    assert written() == {"futures", "a_0.glb", "a_1.glb", "all.mp4"}
    assert len(io.load("a_1.glb")) == 90


def test_a_thousand_futures_are_told_in_few_lines(weights, asked, capsys, monkeypatch):
    monkeypatch.setattr(futures, "write_futures", lambda *a, **k: [])
    monkeypatch.setattr(command, "write_futures", lambda wanted, *a, **k: wanted[0].files)
    assert run(weights, "predict", "past.bvh", "--count", "1000", "--no-picture", "--out", "f") == 0
    said = capsys.readouterr().out.splitlines()
    assert (said[0], said[-1]) == ("wrote f/future_000.bvh", "... and 960 more; --json lists all")


def test_a_folder_that_is_there_keeps_what_else_is_in_it(weights, asked):
    Path("futures").mkdir()
    Path("futures/notes.txt").write_text("mine")
    Path("futures/future_00.bvh").write_text("old")
    assert run(weights, "predict", "past.bvh", "--count", "1", "--no-picture") == 0
    assert written("futures") == {"notes.txt", "future_00.bvh"}
    assert len(io.load("futures/future_00.bvh")) == 90


def test_a_part_of_a_file_can_be_the_past(weights, asked):
    assert run(weights, "predict", "past.bvh", "--start", "0.2", "--end", "0.7", "--out", "a.npz", "--count", "1") == 0
    assert len(asked["past"]) == 15


@pytest.mark.parametrize("problem", [KeyboardInterrupt, MotionloomError("the disk is full")])
@pytest.mark.parametrize("out", ["futures", "old", "a.npz"])
def test_what_cannot_be_finished_leaves_nothing(weights, asked, monkeypatch, problem, out):
    """Neither a new folder nor a file in an old one, also where only the last picture fails."""
    from motionloom.io import overlay

    def fails(*_, **__):
        raise problem

    Path("old").mkdir()
    monkeypatch.setattr(overlay, "draw_futures", fails)
    outs = ["--out", out] + (["--out", "all.png"] if out == "a.npz" else [])
    assert run(weights, "predict", "past.bvh", "--count", "2", *outs) == (130 if problem is KeyboardInterrupt else 2)
    assert written() == {"old"}
    assert written("old") == set()


# Parts that are held ---------------------------------------------------------------------------------------------


def test_parts_are_held_from_the_line_and_from_a_file(weights, asked):
    Path("m.json").write_text('{"hold": [{"joints": ["head"], "frames": [[0, 15]]}, {"joints": ["root"], "to": 0.5}]}')
    words = ["predict", "past.bvh", "--seconds", "1", "--count", "1", "--out", "a.npz", "--from", "kick.bvh"]
    assert run(weights, *words, "--hold", "left_arm,lower_body", "--hold", "neck", "--mask", "m.json") == 0
    head, root, line = asked["hold"].parts
    assert [k for k in range(30) if any(a <= (k + 1) / 30 <= b for a, b in head.spans)] == list(range(15))
    assert (root, line) == (HeldPart(("root",), ((0, 0.5),)), HeldPart(("left_arm", "lower_body", "neck")))
    assert (len(asked["hold"].source), asked["hold"].source.skeleton) == (45, asked["past"].skeleton)
    assert run(weights, *words, "--hold", "left_arm", "--from-time", "0.5") == 0
    kick = io.load("kick.bvh")
    np.testing.assert_allclose(asked["hold"].source.root, kick.root[15:], atol=1e-9)
    assert run(weights, *words, "--hold", "left_arm", "--seconds", "1.5") == 0  # as long as there is anything


def test_a_source_at_another_rate_or_on_another_body_comes_along_if_that_is_asked(weights, asked):
    save_bvh(person(1.5, 60.0), "kick.bvh", unit=0.01)
    words = ["predict", "past.bvh", "--seconds", "1", "--count", "1", "--out", "a.npz", "--hold", "head"]
    assert run(weights, *words, "--from", "kick.bvh") == 0
    assert (asked["hold"].source.fps, len(asked["hold"].source)) == (asked["past"].fps, 45)
    assert run(weights, *words, "--from", "other.bvh", "--retarget") == 0
    assert asked["hold"].source.skeleton == asked["past"].skeleton


def test_the_last_digits_of_a_file_make_no_other_skeleton(weights, asked):
    clip = person(1.5, 30.0)
    nudged = replace(SMPL22, offsets=SMPL22.offsets + 2e-5)
    save_bvh(replace(clip, skeleton=nudged, fps=30.0003), "kick.bvh")
    words = ["predict", "past.bvh", "--seconds", "1", "--count", "1", "--out", "a.npz", "--hold", "head"]
    assert run(weights, *words, "--from", "kick.bvh") == 0
    source = asked["hold"].source
    assert (source.skeleton, source.fps, len(source)) == (asked["past"].skeleton, asked["past"].fps, 45)


# Futures of any length -------------------------------------------------------------------------------------------


def test_a_long_horizon_is_written_while_it_is_made(weights, asked, drawn, capsys):
    """In the past's own manner too; pictures show its first seconds."""
    assert run(weights, "predict", "past.bvh", "--horizon", "40", "--count", "2", "--seed", "7") == 0
    assert written("futures") == {"future_00.bvh", "future_01.bvh", "overview.png", "overlay.mp4"}
    file = read_bvh(Path("futures/future_01.bvh"))
    assert (len(file.motion), file.unit, set(file.orders.values())) == (1230, pytest.approx(0.01), {"XYZ"})
    np.testing.assert_allclose(np.diff(file.motion.root[29:, 2]), 2 / 30, atol=1e-5)
    assert asked["seed"] == 7
    past, several, _, caption = drawn[0]
    assert (len(past), [len(one) for one in several], caption) == (30, [300, 300], "past")
    np.testing.assert_allclose(several[1].root[0] - past.root[-1], [0, 0, 2 / 30], atol=1e-5)
    assert capsys.readouterr().out.splitlines()[:2] == [
        "wrote futures/future_00.bvh: 41.00 s", "wrote futures/future_01.bvh: 41.00 s",
    ]  # fmt: skip


def test_pictures_of_a_long_past_show_its_end(weights, asked, drawn):
    save_bvh(person(12.0, 30.0), "past.bvh", unit=0.01)
    assert run(weights, "predict", "past.bvh", "--horizon", "31", "--count", "1") == 0
    past, several, *_ = drawn[0]
    assert (len(past), len(several[0])) == (60, 300)
    np.testing.assert_allclose(past.root[-1], io.load("past.bvh").root[-1], atol=1e-5)


@pytest.mark.parametrize("name", ["futures", "a.bvh", "a.npz"])
def test_an_interruption_leaves_what_was_finished(weights, asked, drawn, name, capsys):
    asked["stop"] = (1, 2)
    assert run(weights, "predict", "past.bvh", "--horizon", "40", "--count", "3", "--out", name, "--json") == 130
    files = [f"futures/future_0{i}.bvh" for i in (0, 1)] if name == "futures" else [f"a_{i}{name[1:]}" for i in (0, 1)]
    assert [len(io.load(file)) for file in files] == [1230, 630]
    assert written("futures" if name == "futures" else ".") == {Path(file).name for file in files}
    said = capsys.readouterr()
    kept = f"{files[0]}, 41.00 s, {files[1]}, 21.00 s"
    assert said.err == f"motionloom: interrupted; what was finished is in {kept} of 41.00 s\n"
    assert json.loads(said.out)["files"] == files


def test_a_real_ctrl_c_is_such_an_interruption(weights, asked, monkeypatch):
    write = stream.Stream.write

    def interrupted(self, piece):
        write(self, piece)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(stream.Stream, "write", interrupted)
    assert run(weights, "predict", "past.bvh", "--horizon", "40") == 130
    assert len(io.load("futures/future_00.bvh")) == 30
    assert written("futures") == {"future_00.bvh"}


def test_a_failure_in_between_says_where_the_finished_part_is(weights, asked, capsys):
    asked.update(stop=(0, 1), problem=MotionloomError("the disk is full"))
    assert run(weights, "predict", "past.bvh", "--horizon", "40", "--out", "a.bvh", "--count", "1") == 2
    assert capsys.readouterr().err == "motionloom: the disk is full (what was finished is in a.bvh, 11.00 s)\n"
    assert len(io.load("a.bvh")) == 330
    asked["stop"] = (0, -1)
    assert run(weights, "predict", "past.bvh", "--horizon", "40", "--count", "1") == 2
    assert written() == {"a.bvh"}


def test_bones_that_change_length_are_written_whole_or_not_at_all(weights, asked, capsys):
    clip = person(1.0, 30.0)
    moved = np.tile(SMPL22.offsets, (30, 1, 1)) * np.linspace(1, 1.1, 30)[:, None, None]
    io.save(replace(clip, translations=moved), "past.npz")
    assert run(weights, "predict", "past.npz", "--horizon", "40") == 2
    assert "motionloom export past.npz steady.bvh --skeleton smpl22" in capsys.readouterr().err
    assert written() == {"past.npz"}


def test_one_motion_with_moving_bones_and_one_without_go_together(weights, asked, capsys):
    """The still one gets its rest offsets; a moving one loses its movement only where that is asked."""
    clip = person(1.0, 30.0)
    moved = np.tile(SMPL22.offsets, (30, 1, 1)) * np.linspace(1, 1.1, 30)[:, None, None]
    io.save(clip, "still.npz")
    io.save(replace(clip, translations=moved), "moving.npz")
    assert run(weights, "switch", "moving.npz", "still.npz", "--out", "a.npz") == 0
    np.testing.assert_allclose(asked["target"].translations[7], SMPL22.offsets)
    asked.clear()
    assert run(weights, "switch", "still.npz", "moving.npz", "--out", "a.npz") == 2
    assert "bones that change length" in capsys.readouterr().err
    assert run(weights, "switch", "still.npz", "moving.npz", "--retarget", "--out", "a.npz") == 0
    assert asked["target"].translations is None


# Switching -------------------------------------------------------------------------------------------------------


def test_a_switch_is_one_file_in_the_pasts_manner(weights, asked, drawn, capsys):
    words = ["switch", "past.bvh", "kick.bvh", "--seconds", "0.5", "--facing", "kept"]
    assert run(weights, *words, "--out", "s.bvh", "--out", "s.png") == 0
    assert written() == {"s.bvh", "s.png"}
    file = read_bvh(Path("s.bvh"))
    assert (len(file.motion), file.unit, set(file.orders.values())) == (90, pytest.approx(0.01), {"XYZ"})
    assert (asked["seconds"], asked["facing"], len(asked["target"])) == (0.5, "kept", 45)
    past, several, _, caption = drawn[0]
    assert (len(past), len(several[0]), caption) == (30, 60, "past to kick")
    assert capsys.readouterr().out.splitlines() == ["wrote s.bvh", "wrote s.png"]
    assert run(weights, "switch", "past.bvh", "kick.bvh", "--count", "2") == 0
    assert written() == {"s.bvh", "s.png", "switch_0.bvh", "switch_1.bvh"}


def test_a_target_on_another_skeleton_is_retargeted_where_that_is_asked(weights, asked, capsys):
    assert run(weights, "switch", "past.bvh", "other.bvh") == 2
    said = capsys.readouterr().err
    assert "give --retarget" in said
    assert "motionloom export other.bvh same.bvh --skeleton past.bvh" in said
    assert main(["export", "other.bvh", "same.bvh", "--skeleton", "past.bvh"]) == 0
    assert run(weights, "switch", "past.bvh", "same.bvh") == 0
    assert run(weights, "switch", "past.bvh", "other.bvh", "--retarget") == 0
    assert asked["target"].skeleton == asked["past"].skeleton


# Mistakes --------------------------------------------------------------------------------------------------------

HOLD = ["--hold", "head", "--from", "kick.bvh"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["past.bvh", "--horizon", "0"], "--seconds must be above 0 and at most 86,400, a day; got 0"),
        (["past.bvh", "--seconds", "-1"], "got -1"),
        (["past.bvh", "--seconds", "nan"], "got nan"),
        (["past.bvh", "--seconds", "inf"], "got inf"),
        (["past.bvh", "--horizon", "86401"], "got 86401"),
        (["past.bvh", "--seconds", "0.001"], "less than a frame of past.bvh (0.0333 s)"),
        (["past.bvh", "--horizon", "86400"], "at most 2,500,000 fit"),
        (["past.bvh", "--horizon", "70", "--out", "a.glb", "--format", "gif", "--out", "f"], "write an .mp4"),
        (["past.bvh", "--count", "0"], "--count must be 1 to 1000"),
        (["past.bvh", "--count", "1001"], "got 1001"),
        (["past.bvh", "--seed", "-1"], "--seed 0 or more"),
        (["past.bvh", "--steps", "0"], "--steps must be 1 or more; got 0"),
        (["past.bvh", "--guidance", "nan"], "--guidance must be -100 to 100"),
        (["past.bvh", "--temperature", "2.1"], "--temperature must be 0 to 2, usually about 1; got 2.1"),
        (["past.bvh", "--temperature", "nan"], "--temperature must be 0 to 2"),
        (["past.bvh", "--end", "0.03"], "past.bvh has one frame here"),
        (["past.bvh", "--start", "9"], "cannot crop"),
        (["absent.bvh"], "absent.bvh"),
        (["nan.bvh"], "nan.bvh"),
        (["past.bvh", "--out", "past.bvh/futures"], "cannot write 'past.bvh/futures'"),
        (["past.bvh", "--out", "absent/futures"], "does not exist; make it first"),
        (["past.bvh", "--out", "absent/a.bvh"], "does not exist"),
        (["past.bvh", "--out", "taken"], "cannot write to taken: it is a file; name a folder"),
        (["past.bvh", "--out", "a.txt"], "a folder's name has no ending; got .txt"),
        (["past.bvh", "--out", "x" * 300], "cannot write"),
        (["past.bvh", "--out", "f", "--out", "./f"], "given twice"),
        (["past.bvh", "--hold", "head"], "say which one with --from MOTION"),
        (["past.bvh", "--mask", "mask.json"], "say which one with --from MOTION"),
        (["past.bvh", "--from", "kick.bvh"], "none is held; give --hold PART or --mask FILE"),
        (["past.bvh", "--hold", ",", "--from", "kick.bvh"], "no joint is named; there are root, left_leg, "),
        (["past.bvh", "--hold", "left_am", "--from", "kick.bvh"], "'left_am' (did you mean 'left_arm'?); there are"),
        (["past.bvh", "--mask", "bad.json", "--from", "kick.bvh"], "bad.json, line 2: no joint or group is called"),
        (["past.bvh", "--mask", "absent.json", "--from", "kick.bvh"], "absent.json"),
        (["past.bvh", *HOLD], "kick.bvh has 1.50 s from 0 s on, and parts are held for 2.00 s; give a longer motion"),
        (["past.bvh", *HOLD, "--seconds", "1", "--from-time", "1"], "has 0.50 s from 1 s on"),
        (["past.bvh", *HOLD, "--seconds", "1.5334"], "parts are held for 1.53 s"),  # a frame more than there is
        (["past.bvh", *HOLD, "--seconds", "1", "--from-time", "7"], "has 0.00 s from 7 s on"),
        (["past.bvh", "--mask", "late.json", "--from", "kick.bvh"], "nothing is held before 5 s"),
        (["past.bvh", *HOLD, "--hold", "lower_body,upper_body", "--seconds", "1"], "all joints are held all of the"),
        (["past.bvh", "--hold", "head", "--from", "other.bvh", "--seconds", "1"], "--skeleton past.bvh"),
        (["past.bvh", "--hold", "head", "--from", "absent.bvh"], "absent.bvh"),
        (["past.bvh", "--weights", "absent"], "no predictor 'absent'"),
        (["past.bvh", "--weights", "prior.safetensors"], "is a prior, not a predictor"),
        (["past.bvh", "--weights", "taken"], "not a whole safetensors file"),
        (["past.bvh", "--device", "abacus"], "'abacus' cannot be used"),
    ],
    ids=lambda value: " ".join(value)[:50] if isinstance(value, list) else "",
)
def test_mistakes_are_one_sentence_and_nothing_is_written(weights, asked, words, message, capsys):
    Path("taken").write_text("mine")
    Path("mask.json").write_text('{"hold": [{"joints": ["head"]}]}')
    Path("bad.json").write_text('{"hold": [{"joints":\n["tail"]}]}')
    Path("late.json").write_text('{"hold": [{"joints": ["head"], "from": 5}]}')
    text = Path("past.bvh").read_text().splitlines()
    Path("nan.bvh").write_text("\n".join([*text[:-1], "nan " * len(text[-1].split())]))
    if "prior.safetensors" in words:
        save_prior(tiny.prior(), "prior.safetensors")
    if "86400" in words:
        save_bvh(person(1.0, 60.0), "past.bvh", unit=0.01)
    before = written()
    assert main(["predict", *words, *([] if "--weights" in words else ["--weights", weights])]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.startswith("motionloom: ")
    assert said.count("\n") == 1
    assert (written(), "seconds" in asked) == (before, False)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--seconds", "0"], "--seconds must be above 0 and at most 30; got 0"),
        (["--seconds", "31"], "got 31"),
        (["--count", "0"], "--count"),
        (["--out", "folder"], "it is a folder"),
        (["--out", "new"], "must end in"),
        (["--end", "0.03"], "has one frame"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_mistakes_of_a_switch_are_told_too(weights, asked, words, message, capsys):
    Path("folder").mkdir()
    assert run(weights, "switch", "past.bvh", "kick.bvh", *words) == 2
    assert message in capsys.readouterr().err
    assert written() == {"folder"}
    assert "seconds" not in asked


def test_more_than_memory_holds_is_refused(weights, asked, monkeypatch, capsys):
    from motionloom import motion

    monkeypatch.setattr(motion, "MAX_POSES", 9_000)  # 90 frames of 22 joints are 1,980 each
    assert run(weights, "predict", "past.bvh", "--count", "5", "--out", "a.npz") == 2
    assert "5 motions of" in capsys.readouterr().err
    assert run(weights, "predict", "past.bvh", "--count", "2", "--out", "a.npz") == 0


def test_a_predictor_is_no_prior(weights, capsys):
    assert main(["generate", "walk", "--weights", weights]) == 2
    assert "does not describe a motionloom prior" in capsys.readouterr().err


def test_the_schema_is_printed_as_json(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["predict", "--schema"])
    assert ended.value.code == 0
    assert json.loads(capsys.readouterr().out)["title"] == "motionloom mask"


# With a network --------------------------------------------------------------------------------------------------


def test_a_tiny_network_predicts_on_the_users_own_skeleton(weights, capsys):
    """At the past's rate and length; the past comes back, and held joints are those of the other motion."""
    clip = person(1.0, 24.0)
    still = np.tile([1.0, 0, 0, 0], (24, 1, 1))
    turned = np.concatenate([still, clip.rotations, still], axis=1)  # a root on the floor, and a finger
    own = Motion(rig(), 24.0, clip.root * [1, 0, 1], turned)
    save_bvh(own, "own.bvh", unit=0.01)
    words = ["predict", "own.bvh", "--seconds", "0.5", "--count", "2", "--steps", "2", "--no-picture"]
    assert run(weights, *words, "--hold", "left_arm", "--from", "own.bvh") == 0
    given, made = io.load("own.bvh"), io.load("futures/future_01.bvh")
    assert (len(made), made.fps, made.skeleton) == (36, given.fps, given.skeleton)
    np.testing.assert_allclose(made.positions()[:24], given.positions(), atol=1e-5)
    elbow = given.skeleton.index("l_elbow")
    same = np.abs((made.rotations[24:, elbow] * given.rotations[:12, elbow]).sum(-1))
    np.testing.assert_allclose(same, 1, atol=1e-6)


def test_a_past_of_nobody_is_one_sentence(weights, capsys):
    stick = Skeleton(("a", "b", "c"), (-1, 0, 1), np.array([[0, 0, 0], [0, 1, 0], [0, 1, 0]]))
    save_bvh(Motion(stick, 30.0, np.zeros((20, 3)), np.tile([1.0, 0, 0, 0], (20, 3, 1))), "stick.bvh")
    assert run(weights, "predict", "stick.bvh") == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert written() == {"stick.bvh"}


def test_a_tiny_network_goes_on_and_on_and_switches(weights):
    assert run(weights, "predict", "past.bvh", "--horizon", "31", "--count", "1", "--steps", "1", "--out", "a.bvh") == 0
    assert len(io.load("a.bvh")) == 960
    assert run(weights, "switch", "past.bvh", "kick.bvh", "--steps", "1", "--out", "s.npz") == 0
    made, past, kick = io.load("s.npz"), io.load("past.bvh"), io.load("kick.bvh")
    assert len(made) == 30 + 30 + 45
    np.testing.assert_allclose(made.positions()[:30], past.positions(), atol=1e-6)
    for motion in (made, kick):
        assert motion.skeleton == past.skeleton
    np.testing.assert_allclose(np.abs((made.rotations[60:, 1:] * kick.rotations[:, 1:]).sum(-1)), 1, atol=1e-6)


def test_inf_is_the_default_end() -> None:
    """The contract with the tasks: a part named on the line is held for good."""
    assert HeldPart(("head",)).spans == ((0.0, inf),)
