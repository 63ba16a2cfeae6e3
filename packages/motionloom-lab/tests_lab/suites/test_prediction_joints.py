"""Prediction by networks of 17 joints at 50 fps: zero-shot on people of 22 joints, retargeted files, studies."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom.cli import main
from motionloom.core.errors import MotionloomError
from motionloom.core.models.predictor import Predictor, save_predictor
from motionloom_lab.papers.benchmark_layouts import H36M_LAYOUT
from motionloom_lab.papers.benchmarks import find_protocol
from motionloom_lab.suites import prediction_behaviour as behaviour
from motionloom_lab.suites import prediction_studies as studies
from motionloom_lab.suites import prediction_trial as trials
from tests_lab.suites.predicted import predictor, protocol

SMALL = behaviour.Budget(2, 2, 2, seconds=1.0)


def of_h36m() -> Predictor:
    """What Human3.6M networks see: 16 joints from the root, 25 of 125 frames at 50 fps."""
    return predictor(layout=H36M_LAYOUT, seen=25, ahead=100, fps=50.0)


def retargeted(folder: Path, *, clips: int = 3, extra: int = 1) -> Path:
    """The published array: clips of 125 frames with axes of length 1 between, +Z up."""
    rng = np.random.default_rng(0)
    array = 0.3 * rng.standard_normal((clips, 125, *[1] * extra, 17, 3))
    np.save(folder / "amass_retargeted.npy", array)
    return folder / "amass_retargeted.npy"


def test_people_of_22_joints_become_those_of_the_network_at_its_rate() -> None:
    found = trials.fitted(of_h36m(), protocol(frames=120))
    assert (found.layout, found.fps, found.observed, found.future) == (H36M_LAYOUT, 50.0, 25, 100)
    one, real = found.split("test")[0], protocol(frames=120).split("test")[0]
    assert one.positions.shape == (1 + int(119 / 30 * 50), 17, 3)
    names = H36M_LAYOUT.names
    for name, joint in (("hip", 0), ("left_knee", 4), ("right_wrist", 21), ("head", 15)):
        ends = one.positions[[0, 5 * 33], names.index(name)]
        np.testing.assert_allclose(ends, real.positions[[0, 3 * 33], joint], atol=1e-5)


def test_data_of_the_networks_joints_stay_and_other_data_are_refused() -> None:
    people = protocol()
    assert trials.fitted(predictor(), people) is people
    with pytest.raises(MotionloomError, match="17 joints at 50 fps"):
        trials.fitted(predictor(), replace(people, layout=H36M_LAYOUT, fps=50.0))


@pytest.mark.parametrize("extra", [0, 1, 2])
def test_a_retargeted_array_is_a_window_a_clip_in_the_files_axes(tmp_path: Path, extra: int) -> None:
    path = retargeted(tmp_path, extra=extra)
    for place in (path, tmp_path):
        read = find_protocol(place, splits=("test",))
        assert [start for _, start in read.windows("test")] == [0, 0, 0]
    first = np.load(path).reshape(3, 125, 17, 3)[0]
    features = H36M_LAYOUT.encode(read.recordings[0].positions, H36M_LAYOUT.place(read.recordings[0].positions[24]))
    np.testing.assert_allclose(features.reshape(125, 16, 3), first[:, 1:] - first[:, :1], atol=1e-5)
    trials.check_fit(of_h36m(), read)


@pytest.mark.parametrize(
    "array",
    [np.zeros((2, 125, 22, 3)), np.zeros((2, 60, 17, 3)), np.zeros((2, 125, 17)), np.full((1, 125, 17, 3), np.nan)],
    ids=["joints", "short", "flat", "nan"],
)
def test_an_array_of_another_form_is_refused(tmp_path: Path, array: np.ndarray) -> None:
    np.save(tmp_path / "amass_retargeted.npy", array)
    with pytest.raises(MotionloomError, match=r"amass_retargeted\.npy"):
        find_protocol(tmp_path, splits=("test",))


@pytest.mark.parametrize("name", ["hold", "switch"])
def test_parts_are_held_and_targets_reached_on_17_joints(name: str, tmp_path: Path) -> None:
    data = trials.fitted(of_h36m(), protocol(frames=150))
    table = studies.study(name, behaviour.Lab(data, SMALL, tmp_path), of_h36m())
    if name == "hold":
        assert [row.name for row in table.rows] == list(behaviour.GROUPS)
        assert all(row.values["held"].mean < 1e-5 for row in table.rows)
    else:
        rows = [row for row in table.rows if "target" in row.values]
        assert len(rows) == len(behaviour.TRANSITIONS)
        assert all(row.values["target"].mean < 1e-6 for row in rows)


@pytest.mark.parametrize(
    ("name", "words", "values"),
    [("coefficients", ["5", "10", "5"], (5, 10)), ("schedules", ["Cosine"], ("cosine",)), ("dct", ["false"], (False,))],
)
def test_values_are_read_as_what_the_setting_is(name: str, words: list[str], values: tuple) -> None:
    assert studies.values_of(name, words) == values


@pytest.mark.parametrize(
    ("name", "word", "message"),
    [
        ("layers", "many", "whole numbers"),
        ("schedules", "steep", "cosine"),
        ("layers", "0", "1 to 8192"),
        ("hold", "3", "leave --values out"),
    ],
)
def test_values_that_cannot_be_are_refused(name: str, word: str, message: str) -> None:
    with pytest.raises(MotionloomError, match=message):
        studies.values_of(name, [word])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "values", "rows"),
    [
        ("coefficients", ["3", "5"], ["kept 3", "kept 5"]),
        ("noising", ["20"], ["20 levels, 2 steps"]),
    ],
)
def test_published_networks_of_a_papers_values_are_a_command(tmp_path, name, values, rows) -> None:
    clip = np.random.default_rng(0).standard_normal((150, 32, 3)).astype(np.float32)
    table = {subject: {"Walking": clip} for subject in ("S1", "S5", "S9")}
    path = tmp_path / "data_3d_h36m.npz"
    np.savez(path, positions_3d=np.array(table, dtype=object))
    sizes = ["--width", "16", "--layers", "2", "--heads", "2", "--kept", "4", "--variant", "published"]
    few = ["--windows", "1", "--samples", "2", "--train-steps", "2"]
    words = ["evaluate", "study", name, "--data", str(path), "--values", *values, *sizes, *few]
    assert main([*words, "--out", str(tmp_path / "out")]) == 0
    report = json.loads((tmp_path / "out" / f"{name}.json").read_text())
    assert [row["name"] for row in report["rows"]][1:] == rows


@pytest.mark.slow
def test_zero_shot_figures_are_a_command(tmp_path: Path) -> None:
    weights = save_predictor(of_h36m(), tmp_path / "h36m.safetensors")
    retargeted(tmp_path)
    few = ["--samples", "2", "--windows", "2", "--steps", "2", "--published-steps", "2"]
    words = ["evaluate", "prediction", "--weights", str(weights), "--protocol", "amass", *few]
    assert main([*words, "--data", str(tmp_path), "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "report.json").is_file()
