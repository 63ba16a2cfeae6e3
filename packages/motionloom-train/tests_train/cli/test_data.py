"""data build, as a stranger types it."""

import json
from pathlib import Path

import pytest

from motionloom.cli import main
from tests_train.data import people


def test_a_folder_of_bvh_files_becomes_a_set(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    people.write_bvh(tmp_path / "mine" / "stroll.bvh", people.walker(seconds=2.5))
    assert main(["data", "build", str(tmp_path / "mine"), "--out", str(tmp_path / "set"), "--workers", "1"]) == 0
    assert "1 takes to do" in capsys.readouterr().out
    about = json.loads((tmp_path / "set" / "set.json").read_text())
    assert about["clips"]["own/train/plain"] == 2
    assert about["dropped"] == {}


@pytest.mark.parametrize(
    "words", [["absent", "--out", "set"], [".", "--out", "set"], [".", "--out", "set", "--workers", "0"]], ids=" ".join
)
def test_mistakes_are_one_sentence(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["data", "build", *words]) == 2
    assert capsys.readouterr().err.strip().count("\n") == 0
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("content", "message"),
    [(None, "motionloom: there is no caption file said.jsonl"), (b"\xff" * 5000, "line 1 is not JSON")],
)
def test_captions_that_are_none_are_reported_in_one_short_sentence(content, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "walk.bvh").write_text("HIERARCHY")
    if content:
        (tmp_path / "said.jsonl").write_bytes(content)
    assert main(["data", "build", ".", "--out", "set", "--captions", "said.jsonl"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("motionloom: ")
    assert message in said
    assert len(said) < 300


def test_an_unknown_option_points_to_the_help_of_its_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["data", "build", "here", "--out", "there", "--bogus"])
    assert capsys.readouterr().err.endswith("see motionloom data build --help\n")
