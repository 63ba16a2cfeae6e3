"""What predict writes: its files, their formats, and nothing where it cannot finish."""

import json
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import futures
from motionloom.cli import predict as command
from motionloom.core.errors import MotionloomError
from motionloom.io.bvh import read_bvh
from tests.cli.predict.clips import file_names, run


def test_a_folder_holds_one_file_per_future_a_picture_and_a_film(weights, call, overlays, capsys):
    """All in the past's own manner, and drawn from where the past ends."""
    assert run(weights, "predict", "past.bvh", "--seconds", "2", "--count", "3", "--out", "futures/") == 0
    names = ["future_00.bvh", "future_01.bvh", "future_02.bvh", "overview.png", "overlay.mp4"]
    assert file_names("futures") == set(names)
    assert file_names() == {"futures"}
    output = capsys.readouterr()
    assert output.out.splitlines() == [f"wrote futures/{name}" for name in names]
    assert output.err == "note: of the 1.00 s of the past the predictor sees the last 0.50\n"
    own, file = read_bvh(Path("past.bvh")), read_bvh(Path("futures/future_01.bvh"))
    assert (file.unit, dict(file.orders)) == (own.unit, dict(own.orders))
    assert (file.motion.fps, file.motion.skeleton, len(file.motion)) == (own.motion.fps, own.motion.skeleton, 90)
    np.testing.assert_allclose(file.motion.positions()[:30], own.motion.positions(), atol=1e-6)
    np.testing.assert_allclose(file.motion.root[-1] - own.motion.root[-1], [0, 0, 4], atol=1e-5)
    past, several, _, caption = overlays[0]
    assert (len(past), [len(one) for one in several], caption) == (30, [60] * 3, "past")
    np.testing.assert_allclose(several[2].root[0] - past.root[-1], [0, 0, 3 / 30], atol=1e-5)
    assert [name for *_, name, _ in overlays] == names[3:]


def test_without_ffmpeg_the_folders_film_is_a_gif_and_an_mp4_is_refused_at_once(
    weights, call, overlays, capsys, monkeypatch
):
    """As after `pip install .` on a machine that has no ffmpeg of its own."""

    def none() -> str:
        raise MotionloomError("there is no ffmpeg")

    monkeypatch.setattr("motionloom.viz.film.find_ffmpeg", none)
    assert run(weights, "predict", "past.bvh", "--count", "2") == 0
    assert file_names("futures") == {"future_00.bvh", "future_01.bvh", "overview.png", "overlay.gif"}
    call.clear()
    assert run(weights, "predict", "past.bvh", "--out", "other", "--format", "mp4") == 2
    assert "there is no ffmpeg" in capsys.readouterr().err
    assert "seconds" not in call


def test_lines_ask_what_the_tasks_take(weights, call):
    words = ["predict", "past.bvh", "--horizon", "3", "--out", "a.npz", "--seed", "5", "--guidance", "1.5"]
    walk = ["--steps", "4", "--temperature", "0"]
    assert run(weights, *words, *walk, "--no-root", "--no-foot-lock", "--count", "2") == 0
    keys = ("seconds", "count", "seed", "walk", "guidance", "root", "foot_lock", "hold")
    assert [call[key] for key in keys] == [3, 2, 5, {"steps": 4, "temperature": 0}, 1.5, False, False, None]
    assert run(weights, "predict", "past.bvh", "--no-picture") == 0
    assert [call[key] for key in keys] == [2, 10, 0, {"steps": 5, "temperature": 1.1}, 1, True, True, None]
    assert run(weights, "predict", "past.bvh", "--horizon", "40", "--out", "a.bvh", "--temperature", "0.5") == 0
    assert call["walk"]["temperature"] == 0.5
    assert run(weights, "switch", "past.bvh", "past.bvh", "--out", "a.bvh", "--temperature", "2") == 0
    assert call["walk"]["temperature"] == 2
    assert file_names("futures") == {f"future_{i:02d}.bvh" for i in range(10)}


def test_formats_are_chosen_by_name_or_by_the_files_ending(weights, call, overlays, capsys):
    assert run(weights, "predict", "past.bvh", "--count", "2", "--format", "npz", "--format", "glb", "--json") == 0
    names = {"future_00.npz", "future_01.npz", "future_00.glb", "future_01.glb", "overview.png", "overlay.mp4"}
    assert file_names("futures") == names
    about = json.loads(capsys.readouterr().out)
    assert {Path(file).name for file in about["files"]} == names
    assert (about["seconds"], about["count"], about["seed"]) == (2, 2, 0)
    assert run(weights, "predict", "past.bvh", "--count", "2", "--out", "a.glb", "--out", "all.mp4") == 0
    assert file_names() == {"futures", "a_0.glb", "a_1.glb", "all.mp4"}
    assert len(io.load("a_1.glb")) == 90


def test_a_thousand_futures_are_reported_in_few_lines(weights, call, capsys, monkeypatch):
    monkeypatch.setattr(futures, "write_futures", lambda *a, **k: [])
    monkeypatch.setattr(command, "write_futures", lambda outputs, *a, **k: outputs[0].files)
    assert run(weights, "predict", "past.bvh", "--count", "1000", "--no-picture", "--out", "f") == 0
    lines = capsys.readouterr().out.splitlines()
    assert (lines[0], lines[-1]) == ("wrote f/future_000.bvh", "... and 960 more; --json lists all")


def test_a_folder_that_is_there_keeps_what_else_is_in_it(weights, call):
    Path("futures").mkdir()
    Path("futures/notes.txt").write_text("mine")
    Path("futures/future_00.bvh").write_text("old")
    assert run(weights, "predict", "past.bvh", "--count", "1", "--no-picture") == 0
    assert file_names("futures") == {"notes.txt", "future_00.bvh"}
    assert len(io.load("futures/future_00.bvh")) == 90


def test_a_part_of_a_file_can_be_the_past(weights, call):
    assert run(weights, "predict", "past.bvh", "--start", "0.2", "--end", "0.7", "--out", "a.npz", "--count", "1") == 0
    assert len(call["past"]) == 15


@pytest.mark.parametrize("problem", [KeyboardInterrupt, MotionloomError("the disk is full")])
@pytest.mark.parametrize("out", ["futures", "old", "a.npz"])
def test_what_cannot_be_finished_leaves_nothing(weights, call, monkeypatch, problem, out):
    """Neither a new folder nor a file in an old one, also where only the last picture fails."""
    from motionloom.viz import overlay

    def fails(*_, **__):
        raise problem

    Path("old").mkdir()
    monkeypatch.setattr(overlay, "draw_futures", fails)
    outs = ["--out", out] + (["--out", "all.png"] if out == "a.npz" else [])
    assert run(weights, "predict", "past.bvh", "--count", "2", *outs) == (130 if problem is KeyboardInterrupt else 2)
    assert file_names() == {"old"}
    assert file_names("old") == set()


def test_more_than_memory_holds_is_refused(weights, call, monkeypatch, capsys):
    monkeypatch.setattr("motionloom.cli.predict.MAX_POSES", 9_000)  # 90 frames of 22 joints are 1,980 each
    assert run(weights, "predict", "past.bvh", "--count", "5", "--out", "a.npz") == 2
    assert "5 motions of" in capsys.readouterr().err
    assert run(weights, "predict", "past.bvh", "--count", "2", "--out", "a.npz") == 0
