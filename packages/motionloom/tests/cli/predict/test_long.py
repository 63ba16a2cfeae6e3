"""Futures of any length, written while they are made."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.core.errors import MotionloomError
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.skeleton import SMPL22
from motionloom.io.bvh import read_bvh
from tests.cli.predict.clips import file_names, run
from tests.tasks.test_edit import person


def test_a_long_horizon_is_written_while_it_is_made(weights, call, overlays, capsys):
    """In the past's own manner too; pictures show its first seconds."""
    assert run(weights, "predict", "past.bvh", "--horizon", "40", "--count", "2", "--seed", "7") == 0
    assert file_names("futures") == {"future_00.bvh", "future_01.bvh", "overview.png", "overlay.mp4"}
    file = read_bvh(Path("futures/future_01.bvh"))
    assert (len(file.motion), file.unit, set(file.orders.values())) == (1230, pytest.approx(0.01), {"XYZ"})
    np.testing.assert_allclose(np.diff(file.motion.root[29:, 2]), 2 / 30, atol=1e-5)
    assert call["seed"] == 7
    past, several, _, caption = overlays[0]
    assert (len(past), [len(one) for one in several], caption) == (30, [300, 300], "past")
    np.testing.assert_allclose(several[1].root[0] - past.root[-1], [0, 0, 2 / 30], atol=1e-5)
    assert capsys.readouterr().out.splitlines()[:2] == [
        "wrote futures/future_00.bvh: 41.00 s",
        "wrote futures/future_01.bvh: 41.00 s",
    ]


def test_pictures_of_a_long_past_show_its_end(weights, call, overlays):
    save_bvh(person(12.0, 30.0), "past.bvh", unit=0.01)
    assert run(weights, "predict", "past.bvh", "--horizon", "31", "--count", "1") == 0
    past, several, *_ = overlays[0]
    assert (len(past), len(several[0])) == (60, 300)
    np.testing.assert_allclose(past.root[-1], io.load("past.bvh").root[-1], atol=1e-5)


@pytest.mark.parametrize("name", ["futures", "a.bvh", "a.npz"])
def test_an_interruption_leaves_what_was_finished(weights, call, overlays, name, capsys):
    call["stop"] = (1, 2)
    assert run(weights, "predict", "past.bvh", "--horizon", "40", "--count", "3", "--out", name, "--json") == 130
    files = [f"futures/future_0{i}.bvh" for i in (0, 1)] if name == "futures" else [f"a_{i}{name[1:]}" for i in (0, 1)]
    assert [len(io.load(file)) for file in files] == [1230, 630]
    assert file_names("futures" if name == "futures" else ".") == {Path(file).name for file in files}
    output = capsys.readouterr()
    sentence = f"{files[0]}, 41.00 s, {files[1]}, 21.00 s"
    assert output.err == f"motionloom: interrupted; what was finished is in {sentence} of 41.00 s\n"
    assert json.loads(output.out)["files"] == files


def test_a_real_ctrl_c_is_such_an_interruption(weights, call, ctrl_c):
    assert run(weights, "predict", "past.bvh", "--horizon", "40") == 130
    assert len(io.load("futures/future_00.bvh")) == 30
    assert file_names("futures") == {"future_00.bvh"}


def test_a_failure_in_between_says_where_the_finished_part_is(weights, call, capsys):
    call.update(stop=(0, 1), problem=MotionloomError("the disk is full"))
    assert run(weights, "predict", "past.bvh", "--horizon", "40", "--out", "a.bvh", "--count", "1") == 2
    assert capsys.readouterr().err == "motionloom: the disk is full (what was finished is in a.bvh, 11.00 s)\n"
    assert len(io.load("a.bvh")) == 330
    call["stop"] = (0, -1)
    assert run(weights, "predict", "past.bvh", "--horizon", "40", "--count", "1") == 2
    assert file_names() == {"a.bvh"}


def test_bones_that_change_length_are_written_whole_or_not_at_all(weights, call, capsys):
    clip = person(1.0, 30.0)
    moved = np.tile(SMPL22.offsets, (30, 1, 1)) * np.linspace(1, 1.1, 30)[:, None, None]
    io.save(replace(clip, translations=moved), "past.npz")
    assert run(weights, "predict", "past.npz", "--horizon", "40") == 2
    assert "motionloom export past.npz steady.bvh --skeleton smpl22" in capsys.readouterr().err
    assert file_names() == {"past.npz"}
