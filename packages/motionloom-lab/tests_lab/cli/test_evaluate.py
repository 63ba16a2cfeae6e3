"""`motionloom evaluate` from the outside, with a made-up generator in place of weights."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom.cli import main
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom_lab.report.report import Column, Report, Row, Value, encode, read
from motionloom_lab.suites.registry import Suite, Tools, chosen
from motionloom_train.data.clips import Clip, Note, write_clip
from tests.kinematics.people import FPS, standing, walking
from tests_train.data import people


def walks_or_stands(prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[np.ndarray], float]:
    return [standing(seconds) if "still" in p else walking(1.2, seconds) for p in prompts], FPS


@pytest.fixture(autouse=True)
def _no_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motionloom_lab.suites.commands.generator_of", lambda asked: walks_or_stands)


@pytest.fixture
def built(tmp_path: Path) -> Path:
    for k, split in enumerate(("train", "val", "test")):
        features = humanml.encode(walking(1.2, 5.0), heading="corrected")
        note = Note(0, len(features), "human", ("a person walks forward",))
        write_clip(
            _folder(tmp_path / "set" / "clips"), Clip(f"w{k}", "made", "none", split, "plain", (note,), features)
        )
    return tmp_path / "set"


def _folder(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def test_obedience_prints_a_table_and_writes_a_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert main(["evaluate", "obedience", "--seeds", "2", "--out", str(out)]) == 0
    output = capsys.readouterr().out
    assert "a person walks forward" in output
    assert "2 of 20 prompts obeyed" in output
    assert "2 of 20 prompts obeyed" in (out / "report.md").read_text()
    assert json.loads((out / "obedience.json").read_text())["totals"]["prompts_obeyed"] == 2


def test_obedience_of_one_check_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "obedience", "--seeds", "3", "--only", "stand still", "--json", "--paraphrases"]) == 0
    (one,) = json.loads(capsys.readouterr().out)["checks"]
    assert (one["obeyed"], one["of"]) == (3, 3)
    assert len(one["attempts"]) == 9


def test_everyday_prompts_are_a_set_of_their_own_with_themes_and_a_sheet(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    only = ["--only", "walk and stop", "--only", "bow"]
    out, sheet = tmp_path / "out", tmp_path / "all.png"
    typed = ["evaluate", "obedience", "--set", "everyday", *only, "--seeds", "2", "--out", str(out)]
    assert main([*typed, "--sheet", str(sheet)]) == 0
    output = capsys.readouterr().out
    assert "0 of 2 prompts obeyed" in output
    assert "gaits, starts and stops" in output
    results = json.loads((out / "obedience.json").read_text())
    assert results["settings"]["first_seed"] == 100
    assert [c["seconds"] for c in results["checks"]] == [5.0, 4.0]
    assert sheet.stat().st_size < 200_000
    sheet.unlink()
    assert main([*typed, "--sheet", str(sheet)]) == 0  # everything is measured already, and drawn all the same
    assert sheet.is_file()


def test_checks_are_tried_with_ones_own_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = tmp_path / "words.toml"
    words.write_text('"bow" = "a waiter takes a deep bow"\n')
    typed = ["evaluate", "obedience", "--set", "everyday", "--seeds", "2", "--json", "--words", str(words)]
    assert main(typed) == 0
    (one,) = json.loads(capsys.readouterr().out)["checks"]
    assert (one["name"], one["prompt"]) == ("bow", "a waiter takes a deep bow")
    for wrong in ('"bows" = "a"', '"bow" = 3', "", "bow"):
        words.write_text(wrong)
        assert main(typed) == 2
        assert str(words) in capsys.readouterr().err


def test_checks_are_tried_on_real_clips(built: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert main(["evaluate", "checks", "--data", str(built), "--only", "bow", "--out", str(out), "--misses"]) == 0
    assert "0 of 1 checks are sound" in capsys.readouterr().out  # nobody bows there
    assert "no example" in (out / "checks.md").read_text()
    assert json.loads((out / "checks.json").read_text())["checks"]["bow"]["shown"] == [0, 0]
    again = ["evaluate", "checks", "--data", str(built), "--only", "bow", "--out", str(out)]
    assert main(again) == 0
    assert f"note: {out / 'checks.md'} was there and is written over" in capsys.readouterr().err
    assert main([*again, "--force"]) == 0
    assert "note:" not in capsys.readouterr().err


def test_realism_against_a_built_set(built: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "realism", "--data", str(built), "--out", str(tmp_path / "r")]) == 0
    assert "within 1.5 times of real" in capsys.readouterr().out
    numbers = json.loads((tmp_path / "r" / "realism.json").read_text())
    assert numbers["real_clips"] == numbers["generated_clips"] == 2  # val and test
    assert numbers["numbers"]["speed_median"]["passes"]


def test_realism_without_recordings_says_what_it_compares_with(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "realism", "--count", "20"]) == 0
    assert "--data" in capsys.readouterr().out


def test_bodies_are_compared_with_recordings_on_their_own_skeletons(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Percentiles of two people in a folder; walkers beside themselves are held as they are."""
    for name, person in (("walks", walking(1.2, 4.0)), ("stands", standing(4.0))):
        people.write_bvh(tmp_path / "own" / f"{name}.bvh", person)
    assert main(["evaluate", "reach", "--recordings", str(tmp_path / "own"), "--out", str(tmp_path / "b.json")]) == 0
    reach = json.loads((tmp_path / "b.json").read_text())["reach"]
    assert reach["pelvis"][0] == pytest.approx(reach["pelvis"][4], abs=0.5)  # nobody bends
    capsys.readouterr()
    line = ["evaluate", "realism", "--count", "20", "--recordings", str(tmp_path / "own"), "--json"]
    assert main(line) == 0
    body = json.loads(capsys.readouterr().out)["body"]
    assert body["numbers"]["whole"] == {"share": 1.0, "passes": True}
    assert body["numbers"]["pelvis"]["people"] == pytest.approx(reach["pelvis"])


def test_reference_of_a_built_set(built: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "reference", "--data", str(built), "--out", str(tmp_path / "r.json")]) == 0
    assert "2/2" in capsys.readouterr().out
    assert json.loads((tmp_path / "r.json").read_text())["clips"] == 3


@pytest.mark.parametrize(
    "words",
    [
        ["obedience", "--only", "fly"],
        ["obedience", "--set", "weekend"],
        ["obedience", "--sheet", "all.jpg"],
        ["checks", "--data", "nowhere"],
        ["checks", "--data", "nowhere", "--only", "walk forward"],
        ["obedience", "--seeds", "0"],
        ["obedience", "--seeds", "many"],
        ["realism", "--count", "-1"],
        ["realism", "--data", "nowhere"],
        ["realism", "--recordings", "nowhere"],
        ["reach"],
        ["reach", "--recordings", "nowhere"],
        ["reference"],
        ["reference", "--data", "nowhere"],
        ["all", "--only", "fly"],
        ["all", "--weights", "nowhere.safetensors"],
        ["all", "--results", "nowhere.md"],
        ["compare", "nowhere", "nowhere"],
        ["compare", "nowhere"],
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


def _fakes(options: Mapping[str, Any]) -> Tools:
    def speed(quick: bool) -> dict[str, Any]:
        entry = {"name": "help", "value": 0.1, "unit": "s", "target": "< 1", "passes": True, "note": ""}
        return {"machine": {"device": "x", "load": 0.0}, "quick": quick, "entries": [entry]}

    def never(*_: object) -> Any:
        raise AssertionError("not asked for")

    return Tools(lambda finished: walks_or_stands, prior=never, speed=speed, memory=never)


PHYSICAL = ["--only", "obedience", "--only", "realism", "--only", "speed"]


@pytest.fixture
def fakes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motionloom_lab.suites.commands.tools_of", _fakes)


@pytest.mark.usefixtures("fakes")
def test_all_writes_reports_fills_the_page_and_keeps_a_release(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page, out, release = tmp_path / "results.md", tmp_path / "out", tmp_path / "releases" / "1"
    page.write_text("# Results\n\n<!-- suite obedience -->\nnothing\n<!-- end -->\n")
    words = ["evaluate", "all", *PHYSICAL, "--quick", "--out", str(out), "--results", str(page), "--keep", str(release)]
    assert main(words) == 0
    assert "obedience: measured" in capsys.readouterr().out
    for suite in ("obedience", "realism", "speed"):
        assert read(out / suite).suite == suite
        assert read(release / f"{suite}.json").protocol["quick"] is True
        assert f"--only {suite} --weights default --quick" in page.read_text()
    filled = page.read_text()
    assert main(words) == 0
    assert "obedience: kept" in capsys.readouterr().out
    assert page.read_text() == filled
    assert main(["evaluate", "compare", str(release), str(out)]) == 0
    assert "0 worse and 0 better" in capsys.readouterr().out


@pytest.mark.usefixtures("fakes")
def test_a_suite_that_fails_ends_with_2_and_the_others_stand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(job: object, settings: object) -> Report:
        raise MotionloomError("no motion")

    bad = Suite("bad", "nothing", fails, {"n": 1}, {"n": 0})
    monkeypatch.setattr("motionloom_lab.suites.registry.chosen", lambda names: [bad, *chosen(["speed"])])
    assert main(["evaluate", "all", "--out", str(tmp_path)]) == 2
    assert read(tmp_path / "speed").suite == "speed"


def _reports(folder: Path, *means: float, interval: float = 0.1, batch: int = 32) -> list[str]:
    column = Column("fid", "FID", "down", "")
    paths = []
    for k, mean in enumerate(means):
        rows = (Row("ours", {"fid": Value(mean, interval, 10)}),)
        one = Report("text", "T", "", {"batch": batch * (k + 1) if batch < 0 else batch}, (column,), rows)
        (folder / str(k)).mkdir()
        (folder / str(k) / "report.json").write_text(json.dumps(encode(one)))
        paths.append(str(folder / str(k)))
    return paths


@pytest.mark.parametrize(("after", "code"), [(2.0, 1), (0.5, 0), (1.1, 0)])
def test_compare_exits_with_1_only_when_something_got_worse(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], after: float, code: int
) -> None:
    assert main(["evaluate", "compare", *_reports(tmp_path, 1.0, after)]) == code
    output = capsys.readouterr().out
    assert ("1 worse" in output) == (code == 1)
    assert ("ours" in output) == (after != 1.1)


def test_compare_as_json_lists_every_number(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evaluate", "compare", *_reports(tmp_path, 1.0, 1.1), "--every", "--json"]) == 0
    (one,) = json.loads(capsys.readouterr().out)
    assert (one["verdict"], one["before"]["mean"]) == ("same", 1.0)


def test_compare_of_other_protocols_is_2_and_anyway_compares(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = _reports(tmp_path, 1.0, 2.0, batch=-32)
    assert main(["evaluate", "compare", *paths]) == 2
    message = capsys.readouterr().err
    assert "batch -32 -> -64" in message
    assert message.count("\n") == 1
    assert main(["evaluate", "compare", *paths, "--anyway"]) == 1
