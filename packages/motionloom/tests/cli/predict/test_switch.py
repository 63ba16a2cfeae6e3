"""switch, as a stranger types it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import main
from motionloom.core.skeleton import SMPL22
from motionloom.io.bvh import read_bvh
from tests.cli.predict.clips import file_names, run
from tests.tasks.test_edit import person


def test_one_motion_with_moving_bones_and_one_without_go_together(weights, call, capsys):
    """The still one gets its rest offsets; a moving one loses its movement only where that is asked."""
    clip = person(1.0, 30.0)
    moved = np.tile(SMPL22.offsets, (30, 1, 1)) * np.linspace(1, 1.1, 30)[:, None, None]
    io.save(clip, "still.npz")
    io.save(replace(clip, translations=moved), "moving.npz")
    assert run(weights, "switch", "moving.npz", "still.npz", "--out", "a.npz") == 0
    np.testing.assert_allclose(call["target"].translations[7], SMPL22.offsets)
    call.clear()
    assert run(weights, "switch", "still.npz", "moving.npz", "--out", "a.npz") == 2
    assert "bones that change length" in capsys.readouterr().err
    assert run(weights, "switch", "still.npz", "moving.npz", "--retarget", "--out", "a.npz") == 0
    assert call["target"].translations is None


def test_a_switch_is_one_file_in_the_pasts_manner(weights, call, overlays, capsys):
    words = ["switch", "past.bvh", "kick.bvh", "--seconds", "0.5", "--facing", "kept"]
    assert run(weights, *words, "--out", "s.bvh", "--out", "s.png") == 0
    assert file_names() == {"s.bvh", "s.png"}
    file = read_bvh(Path("s.bvh"))
    assert (len(file.motion), file.unit, set(file.orders.values())) == (90, pytest.approx(0.01), {"XYZ"})
    assert (call["seconds"], call["facing"], len(call["target"])) == (0.5, "kept", 45)
    past, several, _, caption = overlays[0]
    assert (len(past), len(several[0]), caption) == (30, 60, "past to kick")
    assert capsys.readouterr().out.splitlines() == ["wrote s.bvh", "wrote s.png"]
    assert run(weights, "switch", "past.bvh", "kick.bvh", "--count", "2") == 0
    assert file_names() == {"s.bvh", "s.png", "switch_0.bvh", "switch_1.bvh"}


def test_a_target_on_another_skeleton_is_retargeted_where_that_is_asked(weights, call, capsys):
    assert run(weights, "switch", "past.bvh", "other.bvh") == 2
    errors = capsys.readouterr().err
    assert "give --retarget" in errors
    assert "motionloom export other.bvh same.bvh --skeleton past.bvh" in errors
    assert main(["export", "other.bvh", "same.bvh", "--skeleton", "past.bvh"]) == 0
    assert run(weights, "switch", "past.bvh", "same.bvh") == 0
    assert run(weights, "switch", "past.bvh", "other.bvh", "--retarget") == 0
    assert call["target"].skeleton == call["past"].skeleton


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--seconds", "0"], "--seconds must be above 0 and at most 30 seconds; got 0"),
        (["--seconds", "31"], "got 31"),
        (["--count", "0"], "--count"),
        (["--out", "folder"], "it is a folder"),
        (["--out", "new"], "must end in"),
        (["--end", "0.03"], "has one frame"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_mistakes_of_a_switch_are_reported_too(weights, call, words, message, capsys):
    Path("folder").mkdir()
    assert run(weights, "switch", "past.bvh", "kick.bvh", *words) == 2
    assert message in capsys.readouterr().err
    assert file_names() == {"folder"}
    assert "seconds" not in call
