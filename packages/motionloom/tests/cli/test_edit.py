"""edit, as a stranger types it, on a tiny prior with random weights."""

import json
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import main, parser
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.io.bvh import read_bvh
from tests.cli.said import complaint
from tests.io.motions import largest_distance
from tests.tasks.test_edit import person


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs beside a clip in centimetres with angles in another order."""
    monkeypatch.chdir(tmp_path)
    save_bvh(person(2.0, 30.0), "clip.bvh", order="XYZ", unit=0.01)
    return tmp_path


def edit(weights: str, *words: str) -> int:
    return main(["edit", "clip.bvh", *words, "--weights", weights, "--steps", "1"])


def file_names() -> set[str]:
    return {path.name for path in Path().iterdir()} - {"clip.bvh"}


def test_the_issues_line_is_understood() -> None:
    """A text behind options, one before them, and none."""
    behind = parser().parse_args(["edit", "clip.bvh", "--keep", "lower_body", "waves with both hands"])
    assert (behind.text, behind.keep) == ("waves with both hands", ("lower_body",))
    assert parser().parse_args(["edit", "clip.bvh", "waves", "--loop"]).text == "waves"
    assert parser().parse_args(["edit", "clip.bvh", "--loop"]).text is None


def test_several_files_hold_the_same_edit_in_the_clips_own_manner(weights: str) -> None:
    """Rate, unit and order of rotations are the clip's; frames outside of the stretch are too."""
    assert edit(weights, "turns", "--between", "0.5", "1.2", "--out", "a.bvh", "--out", "a.npz") == 0
    assert file_names() == {"a.bvh", "a.npz"}
    a, b, clip = io.load("a.bvh"), io.load("a.npz"), io.load("clip.bvh")
    assert (len(a), a.fps) == (60, pytest.approx(30, abs=1e-3))
    assert largest_distance(a, b) < 1e-3
    np.testing.assert_allclose(a.positions()[:15], clip.positions()[:15], atol=1e-5)
    file, own = read_bvh(Path("a.bvh")), read_bvh(Path("clip.bvh"))
    assert (file.unit, dict(file.orders)) == (own.unit, dict(own.orders))


def test_versions_are_numbered_and_told_as_json(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert edit(weights, "--loop", "--blend", "0.5", "--count", "2", "--seed", "7", "--out", "m.npz", "--json") == 0
    about = json.loads(capsys.readouterr().out)
    assert about["seeds"] == [7, 8]
    assert set(about["files"]) == file_names() == {"m_0.npz", "m_1.npz"}


def test_rate_and_skeleton_of_the_files_can_be_chosen(weights: str) -> None:
    assert (
        edit(
            weights, "sits", "--extend", "0.5", "--fps", "60", "--skeleton", "smpl", "--out", "m.npz", "--no-foot-lock"
        )
        == 0
    )
    motion = io.load("m.npz")
    assert (motion.fps, motion.skeleton.names[0]) == (60, "pelvis")


def test_a_part_of_the_clip_can_be_edited_alone(weights: str) -> None:
    assert edit(weights, "turns", "--start", "0.5", "--end", "1.5", "--keep", "root,head", "--out", "m.npz") == 0
    assert len(io.load("m.npz")) == 30


@pytest.mark.parametrize(
    "words",
    [
        [],
        [""],
        ["walk", "--keep", "tail"],
        ["walk", "--between", "1", "9"],
        ["walk", "--between", "1", "nan"],
        ["walk", "--between", "0.2", "1", "--between", "0.8", "1.5"],
        ["walk", "--strength", "2"],
        ["--loop", "--blend", "5"],
        ["--extend", "-1"],
        ["walk", "--out", "a.xyz"],
        ["walk", "--out", "absent/a.bvh"],
        ["walk", "--out", "a.bvh", "--out", "a.bvh"],
        ["walk", "--count", "0"],
        ["walk", "--seed", "-1"],
        ["walk", "--fps", "0"],
        ["walk", "--device", "toaster"],
        ["walk", "--asf", "other.asf"],
        ["walk", "--start", "3"],
        ["walk " * 10_000],
    ],
    ids=lambda words: " ".join(words)[:30],
)
def test_mistakes_are_one_sentence_and_nothing_is_written(
    weights: str, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert edit(weights, *words) == 2
    complaint(capsys)
    assert not file_names()


@pytest.mark.parametrize("clip", ["absent.bvh", "clip.xyz", "."])
def test_a_clip_that_cannot_be_read_is_reported(weights: str, clip: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["edit", clip, "walk", "--weights", weights]) == 2
    complaint(capsys)
    assert not file_names()


@pytest.mark.parametrize("words", [["walk on", "turn"], ["walk", "--bogus"], ["--between", "1"]])
def test_what_the_parser_does_not_know_points_to_the_help(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["edit", "clip.bvh", *words])
    assert ended.value.code == 2
    assert "motionloom edit --help" in capsys.readouterr().err
