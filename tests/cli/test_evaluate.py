"""`motionloom evaluate` from the outside, with a made-up generator in place of weights."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from motionloom.cli import main
from motionloom.data.build import Clip, Note, write_clip
from motionloom.features import humanml
from tests.metrics.people import FPS, standing, walking


def walks_or_stands(prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[np.ndarray], float]:
    return [standing(seconds) if "still" in p else walking(1.2, seconds) for p in prompts], FPS


@pytest.fixture(autouse=True)
def _no_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motionloom.cli.evaluate._generator", lambda arguments: walks_or_stands)


@pytest.fixture
def built(tmp_path: Path) -> Path:
    for k, split in enumerate(("train", "val", "test")):
        features = humanml.encode(walking(1.2, 5.0), heading="corrected")
        note = Note(0, len(features), "human", ("a person walks forward",))
        write_clip(_made(tmp_path / "set" / "clips"), Clip(f"w{k}", "made", "none", split, "plain", (note,), features))
    return tmp_path / "set"


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def test_obedience_prints_a_table_and_writes_a_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert main(["evaluate", "obedience", "--seeds", "2", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "a person walks forward" in said
    assert "2 of 20 prompts obeyed" in said
    assert "2 of 20 prompts obeyed" in (out / "report.md").read_text()
    assert json.loads((out / "obedience.json").read_text())["totals"]["prompts_obeyed"] == 2


def test_obedience_of_one_check_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "obedience", "--seeds", "3", "--only", "stand still", "--json", "--paraphrases"]) == 0
    (one,) = json.loads(capsys.readouterr().out)["checks"]
    assert (one["obeyed"], one["of"]) == (3, 3)
    assert len(one["attempts"]) == 9


def test_realism_against_a_built_set(built: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "realism", "--data", str(built), "--out", str(tmp_path / "r")]) == 0
    assert "within 1.5 times of real" in capsys.readouterr().out
    found = json.loads((tmp_path / "r" / "realism.json").read_text())
    assert found["real_clips"] == found["generated_clips"] == 2  # val and test
    assert found["numbers"]["speed_median"]["passes"]


def test_realism_without_recordings_says_what_it_compares_with(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "realism", "--count", "20"]) == 0
    assert "--data" in capsys.readouterr().out


def test_reference_of_a_built_set(built: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "reference", "--data", str(built), "--out", str(tmp_path / "r.json")]) == 0
    assert "2/2" in capsys.readouterr().out
    assert json.loads((tmp_path / "r.json").read_text())["clips"] == 3


@pytest.mark.parametrize(
    "words",
    [
        ["obedience", "--only", "fly"],
        ["obedience", "--seeds", "0"],
        ["obedience", "--seeds", "many"],
        ["realism", "--count", "-1"],
        ["realism", "--data", "nowhere"],
        ["reference"],
        ["reference", "--data", "nowhere"],
    ],
)
def test_mistakes_are_one_sentence_and_exit_code_2(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    try:
        code = main(["evaluate", *words])
    except SystemExit as ended:
        code = ended.code
    captured = capsys.readouterr()
    assert code == 2
    assert captured.err.count("\n") == 1
    assert captured.out == ""
