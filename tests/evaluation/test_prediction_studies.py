"""The studies of prediction with networks that know nothing: what is trained, kept, measured and written."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom.errors import MotionloomError
from motionloom.evaluation import prediction_behaviour as behaviour
from motionloom.evaluation import prediction_studies as studies
from motionloom.evaluation import prediction_trial as trials
from motionloom.evaluation import report
from motionloom.evaluation.report import REAL
from motionloom.predictor import save_predictor
from tests.evaluation.predicted import AHEAD, SEEN, predictor, protocol
from tests.evaluation.test_prediction import humaneva

SMALL = studies.Budget(2, 2, 4, seconds=1.0, walks=(2, 4))


def lab(keep: Path, say=lambda line: None) -> studies.Lab:
    return studies.Lab(protocol(), SMALL, predictor, keep, progress=say)


@pytest.fixture(scope="module")
def keep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("networks")


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Networks of 16 numbers, windows for statistics as few."""
    monkeypatch.setattr(studies, "BASE", {"kept": 5, "layers": 2, "width": 16, "heads": 2, "dropout": 0.0})
    monkeypatch.setattr(studies, "STUDIED", {
        "coefficients": ("kept", (3, 5, 45)), "layers": ("layers", (2, 4)),
        "schedules": ("schedule", ("cosine", "sqrt")),
        "noising": ("levels", (100, 1000)), "dct": ("dct", (True, False)),
    })  # fmt: skip
    monkeypatch.setattr("motionloom.train.predictor.STATISTICS", 64)


@pytest.mark.parametrize(
    ("name", "rows"),
    [
        ("coefficients", ["real", "kept 3", "kept 5"]),
        ("layers", ["real", "layers 2", "layers 4"]),
        ("schedules", ["real", "schedule cosine", "schedule sqrt"]),
        ("noising", ["real", *(f"{n} levels, {k} steps" for n in (100, 1000) for k in (10, 50))]),
        ("dct", ["real", "dct True", "dct False"]),
    ],
    ids=lambda v: v if isinstance(v, str) else "",
)
def test_what_is_changed_is_a_row_each(name: str, rows: list[str], small: None, keep: Path) -> None:
    found = studies.study(name, lab(keep))
    assert [row.name for row in found.rows] == rows
    sizes = [row.values["parameters"].mean for row in found.rows[1:]]
    if name in ("coefficients", "layers"):
        assert sizes == sorted(set(sizes))
    assert all(np.isfinite(row.values["jerk"].mean) for row in found.rows)
    assert found.protocol["training"].startswith("4 steps")


def test_networks_differ_in_what_is_said_and_finished_ones_are_found_again(small: None, keep: Path) -> None:
    plain = studies.network(lab(keep), "dct", False)
    assert plain.basis.kept == SEEN + AHEAD
    assert studies.network(lab(keep), "schedule", "sqrt").schedule.name == "sqrt"
    assert studies.network(lab(keep), "levels", 100).schedule.steps == 100
    one = studies.network(lab(keep), "kept", 3)
    again = studies.network(lab(keep, say=pytest.fail), "kept", 3)
    assert again.basis.kept == 3
    assert np.array_equal(one.net.out.weight.numpy(), again.net.out.weight.numpy())
    other = replace(lab(keep), budget=replace(SMALL, seed=1))
    with pytest.raises(MotionloomError, match="--keep"):
        studies.network(other, "kept", 3)


def test_a_stopped_network_goes_on(small: None, tmp_path: Path) -> None:
    class Stopped(Exception):
        pass

    def stop(line: str) -> None:
        if "parameters" in line:
            raise Stopped

    with pytest.raises(Stopped):
        studies.network(lab(tmp_path, say=stop), "kept", 3)
    assert studies.network(lab(tmp_path), "kept", 3).card.notes["steps"] == 4


def test_steps_are_told_beside_the_most_steps_of_their_kind(keep: Path, tmp_path: Path) -> None:
    found = studies.study("steps", lab(keep))
    assert len(found.rows) == 1 + 2 * 3 * len(SMALL.walks)
    by_name = {row.name: row.values for row in found.rows}
    few, many = (by_name[f"dpm2m, index, {n} steps"] for n in (2, 4))
    assert many["ade_ratio"].mean == 1
    assert few["ade_ratio"].mean == pytest.approx(few["ade"].mean / many["ade"].mean)
    studies.write(found, "steps", tmp_path)
    assert (tmp_path / "steps.png").stat().st_size > 10_000
    assert "| dpm2m, index, 2 steps |" in (tmp_path / "steps.md").read_text()
    assert report.read(tmp_path / "steps.json").suite == "study-steps"


def test_a_long_future_begins_as_a_short_one_and_goes_on_from_its_end() -> None:
    trial = trials.prepare(protocol(), count=2)
    tiny = predictor()
    short = behaviour.long_futures(tiny, trial, samples=2, seed=0, seconds=AHEAD / 30)
    long = behaviour.long_futures(tiny, trial, samples=2, seed=0, seconds=3 * AHEAD / 30)
    assert long.shape == (2, 2, 3 * AHEAD, 22, 3)
    assert np.allclose(long[:, :, :AHEAD], short)
    steps = np.linalg.norm(np.diff(long[:, :, :, 0], axis=2), axis=-1)
    assert steps[:, :, AHEAD - 1].max() < 5 * steps.max(initial=0.01)


def test_a_horizon_is_told_second_by_second_beside_real_motion(keep: Path) -> None:
    found = studies.study("horizon", replace(lab(keep), budget=replace(SMALL, seconds=2.0)))
    assert [row.name for row in found.rows] == [REAL, "second 1", "second 2"]
    real = found.rows[0].values
    trial = trials.prepare(protocol(), count=2)
    moved = np.stack([trial.future(k) for k in range(2)])
    body = moved[:, :, 1:] - moved[:, :, :1]
    assert real["speed"].mean == pytest.approx(np.linalg.norm(body[:, 1:] - body[:, :-1], axis=-1).mean() * 30)
    assert real["root_speed"].mean == pytest.approx(np.diff(moved[:, :, 0, 2], axis=1).mean() * 30, rel=1e-4)
    assert real["height"].mean == pytest.approx(0.9)


def test_a_pose_in_its_own_facing_is_the_same_wherever_it_stands_and_faces() -> None:
    pose = protocol().recordings[0].positions[7].astype(np.float64)
    turn = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    both = behaviour.own_poses(np.stack([pose, pose @ turn.T + [3, 0, 2]]), protocol().layout)
    assert np.allclose(both[0], both[1], atol=1e-6)
    assert behaviour._nearest(both[:1], both[1:] + 0.3)[0] == pytest.approx(0.3 * 3**0.5)


@pytest.mark.parametrize("group", ["left_arm", "lower_body"])
def test_what_is_held_comes_out_as_given(group: str) -> None:
    """The window's places to float32, the motion's rotations exactly; what is free stays what the network says."""
    trial = trials.prepare(protocol(), count=1)
    found = behaviour.held_numbers(predictor(), trial, group, samples=2, seed=0)
    assert found["held"] < 1e-5
    assert found["rotations"] < 1e-12
    assert found["free"] > 0 < found["given"]


def test_a_switch_arrives_at_the_target_itself() -> None:
    columns, rows, about = behaviour.arrive(
        predictor(), protocol(), windows=2, samples=1, seed=0, seconds=0, say=lambda line: None
    )
    assert [row.name for row in rows] == [REAL, "cut", "0.5 s", "1 s", "2 s"]
    assert all(row.values["target"].mean < 1e-6 for row in rows[2:])
    assert {c.name for c in columns} >= set(rows[2].values)
    assert about["pairs"] == 2


def test_weights_of_another_skeleton_have_no_parts_to_hold() -> None:
    blind = predictor(layout=replace(protocol().layout, root=False))
    with pytest.raises(MotionloomError, match="22 joints"):
        behaviour.hold(blind, protocol(), windows=1, samples=1, seed=0, seconds=1, say=lambda line: None)


def test_the_command_does_a_study(tmp_path: Path, capsys) -> None:
    from motionloom.cli import main
    from motionloom.features.benchmark_layouts import HUMANEVA_LAYOUT

    weights = save_predictor(
        predictor(layout=HUMANEVA_LAYOUT, seen=15, ahead=60, fps=60.0), tmp_path / "tiny.safetensors"
    )
    words = ["evaluate", "study", "horizon", "--data", str(humaneva(tmp_path)), "--weights", str(weights), "--quick",
             "--threads", "1", "--windows", "2"]  # fmt: skip
    assert main([*words, "--out", str(tmp_path / "out")]) == 0
    assert "second 4" in capsys.readouterr().out
    said = (tmp_path / "out" / "horizon.md").read_text()
    assert (
        "motionloom evaluate study horizon --data DIR --weights tiny.safetensors --windows 2 --out FOLDER --quick"
        in said
    )
    assert (tmp_path / "out" / "horizon.png").is_file()
    assert main([*words, "--samples", "0", "--out", str(tmp_path / "bad")]) == 2
    assert "samples must be" in capsys.readouterr().err
    assert not (tmp_path / "bad").exists()


def test_the_command_lists_what_there_is() -> None:
    from motionloom.cli import evaluate_prediction
    from motionloom.evaluation.prediction import KINDS

    assert tuple(studies.TITLES) == evaluate_prediction.STUDIES
    assert evaluate_prediction.ROWS == KINDS
