"""`motionloom evaluate text` from the outside: a tiny prior, a judge who reads numbers, items made up."""

import json
from pathlib import Path

import pytest

from motionloom.cli import main
from motionloom.core.models.prior import save_prior
from motionloom_lab.suites import text_reference
from motionloom_lab.suites.protocol import Selection
from motionloom_train.data.clips import Clip, Note, write_clip
from tests.recorded import tiny
from tests_lab.suites.judged import Judge, features, item, place

FEW = ["--batch", "4", "--replications", "2", "--steps", "2,3", "--multimodality", "0"]


@pytest.fixture(autouse=True)
def _judge(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motionloom_lab.evaluator.evaluators.load_evaluator", lambda name: Judge(name=name))
    monkeypatch.setattr("motionloom_lab.suites.commands.memory_of", lambda asked, steps: 300.0)
    monkeypatch.setattr("motionloom_lab.report.plots.draw", lambda report, folder: [])


@pytest.fixture
def weights(tmp_path: Path) -> str:
    return str(save_prior(tiny.prior(), tmp_path / "tiny.safetensors"))


@pytest.fixture
def built(tmp_path: Path) -> str:
    (tmp_path / "set" / "clips").mkdir(parents=True)
    for k in range(6):
        notes = (Note(0, 40, "human", (f"person {k} walks",)),)
        moves = features(place(k), 44).astype("float32")
        write_clip(tmp_path / "set" / "clips", Clip(f"c{k}", "cmu", "free", "test", "plain", notes, moves))
    return str(tmp_path / "set")


def test_a_run_prints_a_table_writes_a_report_and_goes_on(
    weights: str, built: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    command = ["evaluate", "text", "--weights", weights, "--data", built, *FEW, "--out", str(tmp_path / "out")]
    assert main(command) == 0
    first = capsys.readouterr()
    assert "tiny, 3 steps" in first.out
    assert "replication 2 of 2" in first.err
    results = json.loads((tmp_path / "out" / "report.json").read_text())
    assert "--data SET" in results["command"]
    assert built not in results["command"]
    assert {row["name"] for row in results["rows"] if not row["measured_on"]} == {
        "real",
        "real, captions shuffled",
        "chance",
        "tiny, 2 steps",
        "tiny, 3 steps",
    }
    assert "Protocol" in (tmp_path / "out" / "report.md").read_text()
    monkeypatch.setattr("motionloom_lab.suites.text.sample_features", lambda *a, **k: pytest.fail("drawn twice"))
    assert main([*command, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == results
    assert main([*command, "--seed", "3"]) == 2
    assert "other settings" in capsys.readouterr().err


def test_the_same_seed_gives_the_same_numbers(weights: str, built: str, capsys: pytest.CaptureFixture[str]) -> None:
    tables = []
    for _ in range(2):
        assert main(["evaluate", "text", "--weights", weights, "--data", built, *FEW, "--json"]) == 0
        rows = json.loads(capsys.readouterr().out)["rows"]
        tables.append([(r["name"], r["values"].get("fid"), r["values"].get("mm_dist")) for r in rows])
    assert tables[0] == tables[1]


def test_without_data_the_shipped_reference_is_measured_against(
    weights: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    reference = text_reference.measure([item(k) for k in range(9)], Judge(), Selection())
    path = text_reference.save(reference, tmp_path / "shipped.safetensors")
    monkeypatch.setattr(text_reference, "shipped", lambda: path)
    assert main(["evaluate", "text", "--weights", weights, *FEW, "--json"]) == 0
    results = json.loads(capsys.readouterr().out)
    assert results["protocol"]["items"] == 9
    assert "--data" not in results["command"]
    assert main(["evaluate", "text", "--weights", weights, "--sources", "all", *FEW]) == 2
    assert "--data" in capsys.readouterr().err


def test_a_reference_is_made_of_a_set(built: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "r.safetensors"
    assert main(["evaluate", "text", "--make-reference", str(path), "--data", built]) == 0
    assert "6 items" in capsys.readouterr().out
    assert text_reference.load(path, Judge()).names[0] == "c0@0-2"


def test_quick_is_one_batch_and_says_so_in_its_command(
    weights: str, built: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["evaluate", "text", "--weights", weights, "--data", built, *FEW, "--quick", "--json"]) == 0
    results = json.loads(capsys.readouterr().out)
    assert results["protocol"]["items"] == 4
    assert results["command"].endswith("--quick")


@pytest.mark.parametrize(
    "words",
    [
        ["--steps", "many"],
        ["--steps", "0"],
        ["--steps", "5,5"],
        ["--steps", "99"],
        ["--batch", "some"],
        ["--batch", "32"],
        ["--count", "3"],
        ["--multimodality", "10"],
        ["--multimodality", "1x1"],
        ["--replications", "0"],
        ["--split", "everything"],
        ["--sources", "lafan"],
        ["--lengths", "guessed"],
        ["--cap-len", "published"],
        ["--solver", "magic"],
        ["--guidance", "nan"],
        ["--seed", "-1"],
        ["--data", "nowhere"],
        ["--weights", "nowhere"],
        ["--make-reference", "r.json"],
    ],
)
def test_mistakes_are_one_sentence_and_exit_code_2(
    words: list[str], weights: str, built: str, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        code = main(["evaluate", "text", "--weights", weights, "--data", built, *FEW, *words])
    except SystemExit as ended:
        code = ended.code
    captured = capsys.readouterr()
    assert code == 2
    assert captured.err.splitlines()[-1].startswith("motionloom")
    assert "Traceback" not in captured.err
    assert captured.out == ""
