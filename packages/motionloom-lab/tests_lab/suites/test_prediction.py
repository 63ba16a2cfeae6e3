"""The prediction suite on people who wave, whose futures are known, and on predictors that know nothing."""

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.models.predictor import save_predictor
from motionloom.tasks.completion import futures
from motionloom_lab.metrics import prediction as metrics
from motionloom_lab.papers.benchmark_layouts import HUMANEVA_LAYOUT
from motionloom_lab.report import report
from motionloom_lab.report.report import REAL, SAME
from motionloom_lab.suites import prediction
from motionloom_lab.suites import prediction_trial as trials
from motionloom_lab.suites.harness import Run
from motionloom_lab.suites.prediction import PredictionSettings
from tests_lab.suites.predicted import AHEAD, FPS, SEEN, predictor, protocol

FEW = PredictionSettings(samples=3, steps=2, published_steps=3)


@pytest.fixture(scope="module")
def trial() -> trials.PredictionTrial:
    return trials.prepare(protocol())


def clairvoyant(trial: trials.PredictionTrial):
    """A way that knows what comes, by the first frame of the past."""
    known = {trial.pasts(k, k + 1)[0].tobytes(): trial.future(k) for k in range(len(trial.windows))}
    return lambda past: np.stack([known[one.tobytes()][None].repeat(2, 0) for one in past])


def test_who_knows_the_future_is_right_and_draws_it_every_time(trial: trials.PredictionTrial) -> None:
    scores = trials.score(trial, clairvoyant(trial), samples=2)
    assert max(scores[name] for name in ("apd", "ade", "fde", "root_ade", "root_fde", "mae", "stretch")) < 1e-5
    real = trials.score(trial, None)
    assert {n: scores[n] for n in ("jerk", "cmd", "seam_velocity", "jitter")} == pytest.approx(
        {n: real[n] for n in ("jerk", "cmd", "seam_velocity", "jitter")}
    )
    assert not {"ade", "fde", "root_ade", "seconds"} & real.keys()


def test_baselines_are_the_last_pose_and_the_last_step_gone_on(trial: trials.PredictionTrial) -> None:
    """ADE and FDE written out; the root glides evenly, so that of constant velocity is exact."""
    zero = trials.score(trial, prediction.by_rule(metrics.zero_velocity, AHEAD))
    constant = trials.score(trial, prediction.by_rule(metrics.constant_velocity, AHEAD))
    ades, ends, roots = [], [], []
    for recording, start in trial.windows:
        p = recording.positions[start : start + SEEN + AHEAD].astype(np.float64)
        pose = (p[:, 1:] - p[:, :1]).reshape(len(p), -1)
        off = np.linalg.norm(pose[SEEN:] - pose[SEEN - 1], axis=1)
        ades.append(off.mean())
        ends.append(off[-1])
        roots.append(np.linalg.norm(p[SEEN:, 0] - p[SEEN - 1, 0], axis=1).mean())
    assert (zero["ade"], zero["fde"], zero["root_ade"]) == pytest.approx((np.mean(ades), np.mean(ends), np.mean(roots)))
    assert zero["apd"] == 0
    assert constant["root_fde"] < 1e-4
    assert constant["jerk"] < 1e-6


def test_futures_of_similar_pasts_are_counted_among_all_windows_whichever_are_measured(
    trial: trials.PredictionTrial,
) -> None:
    few = trials.prepare(protocol(), count=3)
    places = [0, 6, 11]  # evenly of twelve
    names = [(r.name, start) for r, start in few.windows]
    assert names == [(trial.windows[k][0].name, trial.windows[k][1]) for k in places]
    for k, near in zip(places, few.alike, strict=True):
        assert np.array_equal(near, trial.alike[k])
        last = np.stack([r.positions[s + SEEN - 1] for r, s in few.every])
        last = (last[:, 1:] - last[:, :1]).reshape(len(few.every), -1).astype(np.float64)
        assert near.tolist() == np.flatnonzero(np.linalg.norm(last - last[k], axis=1) < 0.5).tolist()
    truth = trials.from_root(few.future(0))
    assert any(np.allclose(one, truth) for one in few.futures(0))


def test_how_many_windows_go_at_a_time_changes_nothing(trial: trials.PredictionTrial) -> None:
    tiny = predictor()
    for way in (
        partial(futures, tiny, count=3, seed=0, steps=2),
        prediction.as_published(tiny, 0, samples=3, steps=3),
    ):
        one, all_ = (trials.score(trial, way, samples=3, chunk=chunk) for chunk in (1, 100))
        one.pop("seconds"), all_.pop("seconds")
        assert one == pytest.approx(all_, rel=1e-4)


def test_windows_of_a_single_future_are_skipped_when_asked() -> None:
    """One person whose speed is like nobody's; with a small threshold every window is alone."""
    alone = replace(protocol(), threshold=1e-3)
    assert trials.prepare(alone).several == 0
    with pytest.raises(MotionloomError, match="more than one future"):
        trials.prepare(alone, singles="skip")
    way = prediction.by_rule(metrics.zero_velocity, AHEAD)
    scores = trials.score(trials.prepare(alone, singles="skip_multimodal"), way)
    assert "ade" in scores
    assert "mmade" not in scores
    counted = trials.score(trials.prepare(alone), way)
    assert counted["mmade"] == pytest.approx(counted["ade"])


def test_the_table_has_every_row_and_everything_that_must_be_said(
    trial: trials.PredictionTrial, tmp_path: Path
) -> None:
    lines: list[str] = []
    how = replace(FEW, replications=2)
    table = prediction.measure(predictor(), trial, how, run=Run("predictor", folder=tmp_path, progress=lines.append))
    here = [row for row in table.rows if not row.measured_on]
    assert [row.name for row in here] == [
        REAL,
        prediction.ZERO,
        prediction.CONSTANT,
        "predictor, 2 steps",
        "predictor, 3 steps",
        "predictor, published sampler, 3 steps",
    ]
    assert here[3].values["ade"].count == 2
    assert here[1].values["ade"].count == 1
    for key in (
        "data",
        "split",
        "windows measured",
        "windows with more than one future",
        "frames per second",
        "representation",
        "statistics",
        "windows with one future",
        "samples",
        "sampler",
        "steps",
        "guidance",
        "seed",
        "replications",
    ):
        assert key in table.protocol
    assert report.decode(json.loads(json.dumps(report.encode(table))))
    again = prediction.measure(
        predictor(), trial, how, run=Run("predictor", folder=tmp_path, progress=lambda line: pytest.fail(line))
    )
    assert again == table
    with pytest.raises(MotionloomError, match="other settings"):
        prediction.measure(predictor(), trial, FEW, run=Run("predictor", folder=tmp_path))


def test_ours_keeps_bones_and_the_published_sampler_does_not(trial: trials.PredictionTrial) -> None:
    table = prediction.measure(predictor(), trial, FEW, ("ours", "published"), with_published=False)
    ours, published = (row.values["jitter"].mean for row in table.rows)
    assert ours < published


def test_published_rows_are_marked_as_of_other_data_unless_all_of_it_is_here(trial: trials.PredictionTrial) -> None:
    kinds = ("zero",)
    own = prediction.measure(predictor(), trial, FEW, kinds)
    others = [row for row in own.rows if row.measured_on]
    assert {"Human3.6M", "HumanEva-I", "AMASS", "CMU"} <= {
        row.measured_on.split(",")[0].split(" ")[0] for row in others
    }
    assert not any(row.measured_on.startswith(SAME) for row in others)
    assert report.markdown(own).count("other data, so not to be compared") == len({r.measured_on for r in others})
    names = {(row.name, row.measured_on[:9]): row.values for row in others}
    assert names["HumanMAC", "Human3.6M"]["ade"].mean == 0.369
    same = replace(trial, protocol=replace(trial.protocol, name="humaneva"))
    marked = prediction.measure(predictor(), same, replace(FEW, samples=50), kinds)
    assert {r.measured_on[len(SAME) :][:10] for r in marked.rows if r.measured_on.startswith(SAME)} == {"HumanEva-I"}
    assert f"Published, measured on {SAME}HumanEva-I" in report.markdown(marked)
    few = replace(same, windows=same.windows[:2], alike=same.alike[:2])
    assert not [
        row
        for row in prediction.measure(predictor(), few, replace(FEW, samples=50), kinds).rows
        if row.measured_on.startswith(SAME)
    ]
    assert len(prediction.measure(predictor(), trial, FEW, kinds, with_published=False).rows) == 1


def test_on_a_terminal_every_block_is_a_table_of_its_own(trial: trials.PredictionTrial) -> None:
    page = report.by_place(prediction.measure(predictor(), trial, FEW, ("real", "zero")))
    first, *others = page.split("Published, measured on ")
    assert "zero velocity" in first
    assert "HumanMAC" not in first
    assert len(others) == 8
    assert all("APD" in block or "stretch" in block for block in others)


def test_a_layout_without_the_roots_way_has_no_figures_of_it(trial: trials.PredictionTrial) -> None:
    tiny = predictor()
    blind = replace(tiny, layout=replace(tiny.layout, root=False))
    rows = prediction._ways(blind, trial, FEW, ("zero", "ours"), label="blind")
    assert len(rows) == 2
    still = prediction.by_rule(metrics.zero_velocity, AHEAD)
    assert "root_ade" not in trials.score(trial, still, root=False)


@pytest.mark.parametrize(
    "values",
    [{"samples": 0}, {"steps": 0}, {"published_steps": 5000}, {"guidance": float("nan")}, {"singles": "some"}],
    ids=lambda v: next(iter(v)),
)
def test_settings_that_cannot_be_are_refused(values: dict) -> None:
    with pytest.raises(MotionloomError):
        PredictionSettings(**values)


def test_weights_of_other_windows_are_refused() -> None:
    with pytest.raises(MotionloomError, match="22 joints at 30 fps, 10 of 30 frames seen"):
        trials.check_fit(predictor(ahead=20), protocol())
    assert trials.check_fit(predictor(), protocol()) is None


def humaneva(path: Path, frames: int = 140) -> Path:
    """The file of the benchmark with people who wave, +Z up."""
    rng = np.random.default_rng(0)
    bones, t = rng.normal(0, 0.2, (15, 3)), np.arange(frames)[:, None, None] / 60
    swing = 0.05 * np.sin(2 * np.pi * t + np.arange(15)[:, None])
    places = (bones + swing + np.array([0.5, 0, 0]) * t + [0, 0, 1]).astype(np.float32)
    table = {
        f"{part}/S1": {f"Walking 1 chunk{k}": places + 0.01 * k for k in range(2)} for part in ("Train", "Validate")
    }
    np.savez(path / "data_3d_humaneva15.npz", positions_3d=np.array(table, dtype=object))
    return path / "data_3d_humaneva15.npz"


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Recordings, and weights for them."""
    folder = tmp_path_factory.mktemp("humaneva")
    tiny = predictor(layout=HUMANEVA_LAYOUT, seen=15, ahead=60, fps=60.0)
    return humaneva(folder), save_predictor(tiny, folder / "tiny.safetensors")


def test_the_command_measures_and_writes(files: tuple[Path, Path], tmp_path: Path, capsys) -> None:
    from motionloom.cli import main

    data, weights = files
    words = [
        "evaluate",
        "prediction",
        "--data",
        str(data),
        "--weights",
        str(weights),
        "--out",
        str(tmp_path / "out"),
        "--quick",
        "--windows",
        "3",
        "--steps",
        "2",
        "--published-steps",
        "3",
        "--singles",
        "skip-multimodal",
        "--rows-without-published",
    ]
    assert main(words) == 0
    output = capsys.readouterr().out
    assert "tiny, published sampler, 3 steps" in output
    assert "HumanMAC" not in output
    copy = report.read(tmp_path / "out")
    assert (copy.protocol["data"], copy.protocol["samples"], copy.protocol["windows measured"]) == ("humaneva", 6, 3)
    assert copy.protocol["windows with one future"] == "skip multimodal"
    assert "--windows 3" in copy.command
    assert "--singles skip-multimodal" in copy.command
    assert (tmp_path / "out" / "report.md").is_file()
    assert (tmp_path / "out" / "report.png").is_file()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--data", "nowhere"], "there is no nowhere"),
        (["--data", "DATA", "--weights", "none.safetensors"], "no predictor"),
        (["--data", "DATA", "--samples", "0"], "samples must be"),
        (["--data", "DATA", "--windows", "0"], "at least one window"),
        (["--data", "DATA", "--steps", "1000"], "steps cannot be taken"),
        (["--data", "DATA", "--threads", "0"], "threads"),
        (["--data", "DATA", "--protocol", "h36m"], "subjects"),
    ],
    ids=["no data", "no weights", "samples", "windows", "steps", "threads", "protocol"],
)
def test_bad_input_ends_with_a_sentence(
    words: list[str], said: str, files: tuple[Path, Path], tmp_path: Path, capsys
) -> None:
    from motionloom.cli import main

    words = [str(files[0]) if word == "DATA" else word for word in words]
    words += [] if "--weights" in words else ["--weights", str(files[1])]
    assert main(["evaluate", "prediction", *words, "--out", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out" / "report.json").exists()


def test_a_built_sets_held_out_clips_are_a_test_part_too(tmp_path: Path) -> None:
    from motionloom.core.features import humanml
    from motionloom_train.data.clips import Clip, write_clip
    from tests.kinematics.people import FPS as SLOW
    from tests.kinematics.people import walking

    features = humanml.positions_to_features(walking(1.0, 6.0), SLOW).astype(np.float32)
    (tmp_path / "clips").mkdir()
    for name, way in (("02_01", "plain"), ("02_01_looped", "looped"), ("01_01", "plain")):
        write_clip(tmp_path / "clips", Clip(name, "cmu", "free", "train", way, (), features))
    data = trials.read_test(tmp_path)
    assert [(r.name, r.split) for r in data.recordings] == [("02_01", "test")]
    (recording,) = data.recordings
    assert len(recording.positions) == pytest.approx(len(features) * 1.5, abs=2)
    speed = np.linalg.norm(np.diff(recording.positions[:, 0], axis=0), axis=1).mean() * data.fps
    assert speed == pytest.approx(1.0, rel=0.1)
    assert data.fps == FPS
