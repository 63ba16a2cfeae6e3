"""The run over all suites with made-up ones: what is run, kept, refused and told, and the page that is filled."""

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom.cli import main
from motionloom.core.errors import MotionloomError
from motionloom_lab.metrics.obedience import check
from motionloom_lab.metrics.realism import NUMBERS, average
from motionloom_lab.report import results
from motionloom_lab.report.report import Column, Report, Row, Value, encode, markdown, read
from motionloom_lab.suites import bodies, items, obey, physical
from motionloom_lab.suites.everything import QUICK, Outcome, run_all
from motionloom_lab.suites.harness import Run
from motionloom_lab.suites.items import RealClip
from motionloom_lab.suites.registry import SUITES, Job, Suite, Tools, chosen, command
from tests.kinematics.people import FPS, moved, standing, walking


def never(*_: object) -> Any:
    raise AssertionError("this suite does not need it")


STILL = np.zeros((1, 22, 3))
TOOLS = Tools(generator=never, prior=never, speed=never, memory=never)


class Counted:
    """A suite that counts its runs and stops when told to."""

    def __init__(self, name: str) -> None:
        self.name, self.runs, self.stops = name, 0, False

    def __call__(self, job: Job, settings: Mapping[str, Any]) -> Report:
        if self.stops:
            raise KeyboardInterrupt
        self.runs += 1
        column = Column("fid", "FID", "down", "")
        rows = (Row("ours", {"fid": Value(float(settings["n"]), 0.1, 5)}),)
        return Report(self.name, f"The {self.name}", command(self.name, job), {"n": settings["n"]}, (column,), rows)

    def suite(self, data: Any = "") -> Suite:
        return Suite(self.name, "something", self, {"n": 10}, {"n": 2}, data)


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    (tmp_path / "weights.safetensors").write_bytes(b"some weights")
    return tmp_path / "weights.safetensors"


@pytest.fixture
def job(weights: Path) -> Job:
    return Job(str(weights), TOOLS)


def test_a_killed_run_goes_on_with_the_next_suite(job: Job, tmp_path: Path) -> None:
    first, second = Counted("first"), Counted("second")
    second.stops = True
    with pytest.raises(KeyboardInterrupt):
        run_all(job, tmp_path / "out", [first.suite(), second.suite()])
    second.stops = False
    outcomes = run_all(job, tmp_path / "out", [first.suite(), second.suite()])
    assert (first.runs, second.runs) == (1, 1)
    assert [one.summary.split(":")[0] for one in outcomes] == ["kept", "measured"]
    assert [one.report and one.report.suite for one in outcomes] == ["first", "second"]


def test_a_kill_between_report_and_mark_is_measured_again(
    job: Job, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The old mark must not stand beside the new report: full, then quick again killed before its mark, then full."""
    one = Counted("one")
    run_all(job, tmp_path / "out", [one.suite()])

    def killed(path: Path, value: object) -> Path:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr("motionloom_lab.suites.everything.files.write_json", killed)
        with pytest.raises(KeyboardInterrupt):
            run_all(replace(job, quick=True), tmp_path / "out", [one.suite()], again=True)
    (outcome,) = run_all(job, tmp_path / "out", [one.suite()])
    assert outcome.summary == "measured"
    assert outcome.report
    assert outcome.report.protocol["n"] == 10


def test_a_suites_own_parts_are_found_again_and_never_those_of_other_settings(job: Job, tmp_path: Path) -> None:
    folders: list[Path] = []

    def run(job: Job, settings: Mapping[str, Any]) -> Report:
        folders.append(job.folder)
        return Counted("parts")(job, settings)

    suite = replace(Counted("parts").suite(), run=run)
    run_all(job, tmp_path / "out", [suite])
    (tmp_path / "out" / "parts" / "done.json").unlink()
    run_all(job, tmp_path / "out", [suite])
    Path(job.weights).write_bytes(b"other weights")
    run_all(job, tmp_path / "out", [suite])
    assert folders[0] == folders[1] != folders[2]


@pytest.mark.parametrize("change", ["weights", "settings", "data", "report", "mark", "again", "files"])
def test_whatever_changed_is_measured_again(job: Job, tmp_path: Path, change: str) -> None:
    (tmp_path / "set").mkdir()
    shipped = tmp_path / "evaluator"
    shipped.write_bytes(b"1")
    job, one, out = replace(job, data=tmp_path / "set"), Counted("one"), tmp_path / "out"
    suite = replace(one.suite("used"), files=lambda job: [shipped])
    run_all(job, out, [suite])
    run_all(job, out, [suite])
    assert one.runs == 1
    if change == "weights":
        Path(job.weights).write_bytes(b"other weights")
    if change == "settings":
        suite = replace(suite, full={"n": 11})
    if change == "data":
        (tmp_path / "set" / "clip").write_bytes(b"1")
    if change == "report":
        (out / "one" / "report.json").write_text("{}")
    if change == "mark":
        (out / "one" / "done.json").write_text("[1]")
    if change == "files":
        shipped.write_bytes(b"2")
    run_all(job, out, [suite], again=change == "again")
    assert one.runs == 2


def test_a_suite_without_its_data_is_skipped_and_a_failing_one_stops_no_other(job: Job, tmp_path: Path) -> None:
    def fails(job: Job, settings: Mapping[str, Any]) -> Report:
        raise MotionloomError("no motion")

    bad, good = replace(Counted("bad").suite(), run=fails), Counted("good")
    outcomes = run_all(job, tmp_path / "out", [Counted("hungry").suite("needed"), bad, good.suite()])
    assert [(one.summary.split(":")[0], one.failed) for one in outcomes] == [
        ("skipped", False),
        ("failed", True),
        ("measured", False),
    ]


def test_a_suite_whose_kind_of_data_is_not_there_is_skipped_and_asked_again(job: Job, tmp_path: Path) -> None:
    """Before it runs, or in it; once the data are there it is measured, and what is finished is not asked."""
    (tmp_path / "set").mkdir()
    job, out = replace(job, data=tmp_path / "set"), tmp_path / "out"
    pairs = replace(Counted("pairs").suite("needed"), needs=items.need_pairs)

    def none(job: Job, settings: Mapping[str, Any]) -> Report:
        raise items.NoData("there is no held-out pair")

    outcomes = run_all(job, out, [pairs, replace(Counted("later").suite("used"), run=none)])
    assert [(one.state, one.failed, one.report) for one in outcomes] == [("skipped", False, None)] * 2
    assert "no recordings of two people" in outcomes[0].summary
    assert outcomes[1].summary == "skipped: there is no held-out pair"
    (tmp_path / "set" / "x_a.bvh").write_text("")
    assert [one.state for one in run_all(job, out, [pairs])] == ["measured"]
    assert [one.state for one in run_all(job, out, [replace(pairs, needs=never)])] == ["kept"]


def test_what_says_that_a_folder_has_pairs(tmp_path: Path) -> None:
    """The layouts of docs/data.md; a built set is none of them."""
    for name, lines, has in [
        ("set", {"clips/02_01.safetensors": ""}, False),
        ("flat", {"x_a.bvh": ""}, True),
        ("deep", {"x/b.bvh": ""}, True),
        ("solo", {"x.bvh": "", "y/c.bvh": ""}, False),
        ("pack", {"manifest.csv": "path,partner\na,b\nb,a\n"}, True),
        ("alone", {"manifest.csv": "path,partner\na,\nb,\n", "x_a.bvh": ""}, False),
        ("older", {"manifest.csv": "path\na\n"}, False),
    ]:
        for place, text in lines.items():
            (tmp_path / name / place).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name / place).write_text(text)
        assert items.has_pairs(tmp_path / name) == has, name


def test_a_set_without_test_subjects_or_captions_lacks_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "clips").mkdir()
    with pytest.raises(items.NoData, match="futures"):
        items.need_recordings(tmp_path)
    (tmp_path / "clips" / "13_11.safetensors").write_text("")
    items.need_recordings(tmp_path)
    clips = [RealClip("a", "own", "train", ("walks",), STILL), RealClip("b", "own", "val", (), STILL)]
    monkeypatch.setattr("motionloom_lab.suites.items.real_clips", lambda folder: iter(clips))
    with pytest.raises(items.NoData, match="no held-out clip"):
        items.need_captions(tmp_path)
    clips.append(RealClip("c", "own", "test", ("walks",), STILL))
    items.need_captions(tmp_path)


def test_every_suite_that_reads_data_asks_what_it_needs(tmp_path: Path) -> None:
    assert {s.name: s.needs.__name__ for s in SUITES if s.data and s.name != "realism"} == {
        "text": "need_captions",
        "transitions": "need_captions",
        "control": "need_captions",
        "evaluator": "need_captions",
        "prediction": "need_recordings",
        "duet-completion": "need_pairs",
        "duet-text": "need_pairs",
        "duet-answers": "need_pairs",
        "duet-long": "need_pairs",
    }


def test_the_command_ends_well_where_suites_were_only_skipped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    outcomes: dict[str, Outcome] = {
        "skipped": Outcome(SUITES[0], None, "skipped", "there are no pairs"),
        "failed": Outcome(SUITES[0], None, "failed", "no motion"),
    }
    for state, code in (("skipped", 0), ("failed", 2)):
        monkeypatch.setattr("motionloom_lab.suites.everything.run_all", lambda *a, s=state, **k: [outcomes[s]])
        assert main(["evaluate", "all", "--quick", "--out", str(tmp_path)]) == code
        assert f"{SUITES[0].name}: {state}: " in capsys.readouterr().out


def test_a_quick_run_is_marked_and_never_replaces_a_full_one_unless_asked(job: Job, tmp_path: Path) -> None:
    one, out = Counted("one"), tmp_path / "out"
    quick = replace(job, quick=True)
    (first,) = run_all(quick, out, [one.suite()])
    assert first.report
    marks = first.report.protocol["files"]
    assert first.report.protocol == {"n": 2, "quick": True, "files": marks}
    assert re.fullmatch("[0-9a-f]{12}", marks["weights"])
    assert QUICK in markdown(first.report)
    run_all(job, out, [one.suite()], keep=tmp_path / "kept")
    assert read(tmp_path / "kept" / "one.json").protocol == {"n": 10, "files": marks}
    with pytest.raises(MotionloomError, match="full run"):
        run_all(quick, out, [one.suite()])
    with pytest.raises(MotionloomError, match=r"kept.*full run"):
        run_all(quick, tmp_path / "elsewhere", [one.suite()], keep=tmp_path / "kept")
    assert run_all(quick, out, [one.suite()], again=True)[0].summary == "measured"


def test_missing_weights_are_reported_before_anything_runs(job: Job, tmp_path: Path) -> None:
    one = Counted("one")
    with pytest.raises(MotionloomError, match="nowhere"):
        run_all(replace(job, weights="nowhere.safetensors"), tmp_path / "out", [one.suite()])
    assert one.runs == 0


def test_suites_have_different_names_and_both_kinds_of_settings() -> None:
    assert len({suite.name for suite in SUITES}) == len(SUITES)
    assert all(set(suite.full) == set(suite.quick) and suite.full != suite.quick for suite in SUITES)
    assert [s.name for s in chosen(["speed", "obedience"])] == ["obedience", "speed"]
    with pytest.raises(MotionloomError, match="no suite 'fly'"):
        chosen(["fly"])


def test_commands_name_no_place_on_anybodys_disk(weights: Path) -> None:
    job = Job(str(weights), TOOLS, data=Path("/home/me/set"), quick=True)
    assert command("text", job) == (
        "motionloom evaluate all --only text --weights weights.safetensors --data SET --quick"
    )


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("text", "motionloom_lab.suites.text.run"),
        ("evaluator", "motionloom_lab.evaluator.own.validate"),
        ("agreement", "motionloom_lab.evaluator.agreement.agreement"),
    ],
)
def test_suites_with_a_judge_ask_for_what_was_said(
    monkeypatch: pytest.MonkeyPatch, name: str, place: str, tmp_path: Path
) -> None:
    """The real function would take these arguments; its report comes back under the command of the whole run."""
    import importlib
    import inspect

    module, function = place.rsplit(".", 1)
    signature = inspect.signature(getattr(importlib.import_module(module), function))
    calls: dict[str, Any] = {}

    def fake(*args: Any, **named: Any) -> Report:
        calls.update(signature.bind(*args, **named).arguments)
        return replace(report_of(name), command=calls["run"].command if "run" in calls else "another")

    monkeypatch.setattr(place, fake)
    monkeypatch.setattr("motionloom_lab.evaluator.evaluators.load_evaluator", lambda said: f"judge {said}")
    tools = replace(TOOLS, prior=lambda: "the prior")  # type: ignore[arg-type, return-value]
    job = Job("default", tools, data=tmp_path, evaluator=str(tmp_path / "mine.tar"), quick=True)
    (tmp_path / "mine.tar").write_bytes(b"abc")
    (suite,) = chosen([name])
    table = suite.run(job, suite.settings(True))
    words = f"motionloom evaluate all --only {name} --weights default --data SET --evaluator mine.tar --quick"
    assert (table.suite, table.command) == (name, words)
    judge = calls["run"].evaluator if name == "text" else calls["evaluator"]
    assert judge == (job.evaluator if name == "text" else f"judge {job.evaluator}")
    assert suite.judged == (name != "evaluator")
    if name == "text":
        assert (calls["run"].weights, calls["run"].data, calls["protocol"].replications) == ("default", tmp_path, 2)


def test_a_judged_report_says_which_evaluator_file_it_was(job: Job, tmp_path: Path) -> None:
    (tmp_path / "mine.tar").write_bytes(b"abc")
    job = replace(job, evaluator=str(tmp_path / "mine.tar"))
    (outcome,) = run_all(job, tmp_path / "out", [replace(Counted("one").suite(), judged=True)])
    assert outcome.report
    assert outcome.report.protocol["evaluator file"] == "ba7816bf8f01"  # sha256 of abc, FIPS 180-2


# ---- obedience, realism and speed as reports ------------------------------------------------------------------------


def test_obedience_as_shares_of_seeds() -> None:
    """Of 4 seeds the odd ones stand still: half obey 'walk forward', the other half 'stand still'."""

    def half(prompts: Any, *, seconds: float, seed: int) -> tuple[list[np.ndarray], float]:
        return [standing(seconds) if (seed + k) % 2 else walking(1.2, seconds) for k in range(len(prompts))], FPS

    checks = [check("walk forward"), check("stand still")]
    results = obey.run(Run(), checks, generate=half, seeds=4, paraphrases=True)
    table = physical.obedience_report(results, checks, run=Run(command="c"), settings={"seeds": 4})
    rows = {row.name: row.values for row in table.rows}
    assert rows["a person walks forward"]["obeyed"] == Value(0.5, count=4)
    assert rows["a person walks forward"]["real"] == Value(111 / 113, count=113)
    assert rows["a person walks forward"]["reworded"] == Value(0.5, count=4 * len(checks[0].paraphrases))
    assert (rows["all prompts"]["obeyed"].mean, rows["all prompts"]["obeyed"].count) == (0.5, 8)
    other = sum(len(one.paraphrases) for one in checks)
    assert rows["all prompts"]["reworded"] == Value(0.5, count=4 * other)
    assert table.protocol["checks"] == obey.fingerprint(checks)
    assert "| a person walks forward | 0.50 (2/4) |" in markdown(table)


def test_realisms_means_are_those_of_the_metric_and_its_intervals_shrink_with_clips() -> None:
    clips = [walking(speed, 3.0) for speed in np.linspace(0.8, 1.6, 8)]
    values = physical.realism_value(clips, FPS)
    assert {name: value.mean for name, value in values.items()} == pytest.approx(average(clips, FPS))
    more = physical.realism_value(clips * 4, FPS)
    assert more["speed_median"].interval == pytest.approx(values["speed_median"].interval / 2, rel=0.2)
    assert np.isnan(physical.realism_value(clips[:1], FPS)["jerk"].interval)


def test_the_interval_of_a_plain_mean_is_the_textbooks() -> None:
    """Clips of equal length: the bootstrap must agree with 1.96 sigma / sqrt(n) within its own noise."""
    speeds = np.random.default_rng(3).uniform(0.6, 1.8, size=24)
    clips = [moved(standing(2.0), np.arange(40)[:, None] / FPS * np.array([0, 0, v])) for v in speeds]
    speed = physical.realism_value(clips, FPS)["speed_median"]
    assert speed.mean == pytest.approx(speeds.mean(), rel=0.01)
    assert speed.interval == pytest.approx(1.96 * speeds.std(ddof=1) / np.sqrt(24), rel=0.15)


def test_clips_of_other_lengths_that_move_alike_have_no_spread() -> None:
    """The weights of a draw are those of its own clips."""
    clips = [moved(standing(s), np.arange(round(s * FPS))[:, None] / FPS * np.array([0, 0, 1.0])) for s in (2, 3, 6)]
    assert physical.realism_value(clips, FPS)["speed_median"].interval == pytest.approx(0.0, abs=1e-6)


def test_realism_beside_real_clips_and_beside_shipped_numbers() -> None:
    clips = [walking(1.2, 3.0), walking(1.0, 3.0)]
    beside = physical.realism_report({"generated": clips}, FPS, clips, run=Run(), protocol={})
    assert [row.name for row in beside.rows] == ["real", "generated"]
    assert beside.rows[1].values["speed_distance"].mean == pytest.approx(0.0)
    orders, real, about = physical.realism_orders(None, 20)
    assert sum(len(order.prompts) for order in orders) == 20
    alone = physical.realism_report({"generated": clips}, FPS, real, run=Run(), protocol=about)
    assert [c.name for c in alone.columns][: len(NUMBERS)] == [n.name for n in NUMBERS]


def test_the_realism_report_holds_bodies_against_recorded_people() -> None:
    """Eight numbers of the body, the same as of `motionloom evaluate realism`."""
    clips, numbers = [walking(1.2, 3.0), standing(3.0)], dict.fromkeys((n.name for n in NUMBERS), 1.0)
    real, ours = physical.realism_report({"ours": clips}, FPS, numbers, run=Run(), protocol={}).rows
    held, reach = bodies.judge(clips, bodies.known()), bodies.known()
    assert ours.values["body_knees"].mean == held["numbers"]["knees"]["median"]
    assert ours.values["body_bones"].mean == held["numbers"]["bones"]["stretched"]
    assert real.values["body_knees"].mean == reach["knees"][2]
    assert sum(name.startswith("body_") for name in ours.values) == held["of"] == 8


def test_speed_has_its_targets_and_the_machine_in_the_protocol() -> None:
    entry = {"name": "generate, start to BVH", "value": 3.2, "unit": "s", "target": "< 8", "passes": True, "note": "n"}
    results = {"machine": {"device": "x86", "load": 2.0}, "quick": False, "entries": [entry]}
    table = physical.speed_report(results, run=Run(command="c"))
    assert table.protocol["machine"] == {"device": "x86"}  # load is no setting
    assert table.columns[0].better == "down"
    assert table.rows[0].values[table.columns[0].name].mean == 3.2
    assert any("busy" in note for note in table.notes)
    assert encode(table)


# ---- the page of results -------------------------------------------------------------------------------------------

PAGE = "# Results\n\nwords\n\n<!-- suite one -->\nNot measured yet.\n<!-- end -->\n\nmore words\n"


def report_of(suite: str = "one", number: float = 1.0, *, quick: bool = False) -> Report:
    rows = (Row("ours", {"fid": Value(number)}),)
    protocol = {"quick": True} if quick else {}
    return Report(suite, f"Title {suite}", "motionloom evaluate all", protocol, (Column("fid", "FID", "", ""),), rows)


def test_a_page_is_filled_at_its_marks_and_filling_twice_changes_nothing() -> None:
    once, _ = results.fill(PAGE, [report_of()])
    assert "| ours | 1.000 |" in once
    assert "motionloom evaluate all" in once
    assert "# Title one" not in once
    assert once.startswith("# Results\n\nwords\n")
    assert once.endswith("<!-- end -->\n\nmore words\n")
    assert results.fill(once, [report_of()])[0] == once
    assert "| ours | 2.000 |" in results.fill(once, [report_of(number=2.0)])[0]


def test_the_page_says_of_which_weight_files_a_suite_is() -> None:
    files = {"default": "0123456789ab", "duet": "ba9876543210"}
    once, _ = results.fill(PAGE, [replace(report_of(), protocol={"files": files})])
    assert "<!-- suite one; of default 0123456789ab, duet ba9876543210 -->" in once
    again, _ = results.fill(once, [replace(report_of(), protocol={"files": {"default": "ffffffffffff"}})])
    assert "<!-- suite one; of default ffffffffffff -->" in again
    assert "0123456789ab" not in again


def test_a_suite_without_a_place_gets_one_once() -> None:
    once, _ = results.fill(PAGE, [report_of("new")])
    assert "## Title new\n\n<!-- suite new -->" in once
    assert results.fill(once, [report_of("new")])[0] == once
    assert "Not measured yet." in once


def test_quick_numbers_never_replace_full_ones_on_the_page_unless_asked() -> None:
    quick, left = results.fill(PAGE, [report_of(number=7.0, quick=True)])
    assert ("7.000" in quick, left) == (True, [])
    full, _ = results.fill(quick, [report_of()])
    assert "7.000" not in full
    same, left = results.fill(full, [report_of(number=7.0, quick=True)])
    assert (same, left) == (full, ["one"])
    assert "7.000" in results.fill(full, [report_of(number=7.0, quick=True)], again=True)[0]


def test_a_note_cannot_end_its_place() -> None:
    tricky = replace(report_of(), notes=("<!-- end -->", "<!-- suite two -->"))
    once, _ = results.fill(PAGE, [tricky])
    assert results.fill(once, [tricky])[0] == once


def test_the_shipped_page_has_a_place_for_every_suite() -> None:
    text = (Path(__file__).parents[4] / "docs" / "results.md").read_text(encoding="utf-8")
    assert [match[2] for match in results.PLACE.finditer(text)] == [suite.name for suite in SUITES]


def test_outcomes_do_not_fail_unless_said() -> None:
    assert not Outcome(SUITES[0], None, "skipped").failed
    assert json.dumps(dict(SUITES[0].full))
