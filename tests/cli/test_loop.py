"""`--loop` of the commands that draw: the motion's first frame can follow its last one."""

from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import main
from motionloom.io.bvh_writer import save_bvh
from tests.cli.said import complaint
from tests.tasks.test_edit import person

TINY = ("--steps", "2", "--no-foot-lock", "--seed", "3")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    save_bvh(person(2.0, 20.0), "walk.bvh")
    return tmp_path


@pytest.mark.parametrize(
    "words",
    [
        ("generate", "a person walks", "--seconds", "3"),
        ("compose", "a person walks", "a person turns", "--seconds", "2"),
        ("control", "a person walks", "--follow", "left_wrist", "--from", "walk.bvh"),
    ],
)
def test_a_looped_motion_ends_where_it_begins_and_is_else_the_same(weights: str, words: tuple[str, ...]) -> None:
    """The last half second is drawn anew, towards the first frame: random weights are far from it without."""
    line = [*words, "--weights", weights, *TINY]
    assert main([*line, "--out", "plain.npz"]) == 0
    assert main([*line, "--out", "loop.npz", "--loop", "--blend", "0.5"]) == 0
    plain, loop = io.load("plain.npz"), io.load("loop.npz")
    assert len(loop) == len(plain)
    np.testing.assert_array_equal(loop.rotations[:-10], plain.rotations[:-10])

    def apart(a: np.ndarray, b: np.ndarray) -> float:
        return float(2 * np.arccos(np.clip(np.abs((a * b).sum(-1)), 0, 1)).max())

    seam, open_seam = (apart(motion.rotations[-1, 1:], motion.rotations[0, 1:]) for motion in (loop, plain))
    assert seam < 0.5 * open_seam


def test_a_loop_that_does_not_fit_is_refused_before_anything_is_drawn(
    weights: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for words in (["generate", "a person walks"], ["compose", "a person walks"]):
        line = [*words, "--seconds", "1", "--weights", weights, *TINY, "--loop", "--out", "out.bvh"]
        assert main(line) == 2
        assert "a loop of a clip of" in complaint(capsys)
    assert not Path("out.bvh").exists()
