"""The studies of prediction with networks that know nothing: what is trained, kept, measured and written."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.models.container import weights_digest
from motionloom.core.models.predictor import save_predictor
from motionloom_lab.report import report
from motionloom_lab.report.report import REAL
from motionloom_lab.suites import prediction_behaviour as behaviour
from motionloom_lab.suites import prediction_studies as studies
from motionloom_lab.suites import prediction_trial as trials
from tests_lab.suites.predicted import AHEAD, SEEN, predictor, protocol
from tests_lab.suites.test_prediction import humaneva

SMALL = behaviour.Budget(2, 2, 4, seconds=1.0, walks=(2, 4))


def lab(keep: Path, say=lambda line: None) -> behaviour.Lab:
    return behaviour.Lab(protocol(), SMALL, keep, say=say)


@pytest.fixture(scope="module")
def keep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("networks")


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Networks of 16 numbers, windows for statistics as few."""
    monkeypatch.setattr(studies, "BASE", {"kept": 5, "layers": 2, "width": 16, "heads": 2, "dropout": 0.0})
    monkeypatch.setattr(
        studies,
        "STUDIED",
        {
            "coefficients": ("kept", (3, 5, 45)),
            "layers": ("layers", (2, 4)),
            "schedules": ("schedule", ("cosine", "sqrt")),
            "noising": ("levels", (100, 1000)),
            "dct": ("dct", (True, False)),
        },
    )
    monkeypatch.setattr("motionloom_train.predictor.STATISTICS", 64)


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
    table = studies.study(name, lab(keep))
    assert [row.name for row in table.rows] == rows
    sizes = [row.values["parameters"].mean for row in table.rows[1:]]
    if name in ("coefficients", "layers"):
        assert sizes == sorted(set(sizes))
    assert all(np.isfinite(row.values["jerk"].mean) for row in table.rows)
    assert table.protocol["training"].startswith("4 steps")


def test_networks_differ_in_what_is_said_and_finished_ones_are_found_again(small: None, keep: Path) -> None:
    plain = studies.network(lab(keep), "dct", False)
    assert plain.basis.kept == SEEN + AHEAD
    assert studies.network(lab(keep), "schedule", "sqrt").schedule.name == "sqrt"
    assert studies.network(lab(keep), "levels", 100).schedule.steps == 100
    one = studies.network(lab(keep), "kept", 3)
    again = studies.network(lab(keep, say=pytest.fail), "kept", 3)
    assert again.basis.kept == 3
    assert np.array_equal(one.net.weights["net.out.weight"], again.net.weights["net.out.weight"])
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


def test_steps_are_compared_with_the_most_steps_of_their_kind(keep: Path, tmp_path: Path) -> None:
    table = studies.study("steps", lab(keep), predictor())
    assert len(table.rows) == 1 + 2 * 3 * len(SMALL.walks)
    by_name = {row.name: row.values for row in table.rows}
    few, many = (by_name[f"dpm2m, index, {n} steps"] for n in (2, 4))
    assert many["ade_ratio"].mean == 1
    assert few["ade_ratio"].mean == pytest.approx(few["ade"].mean / many["ade"].mean)
    studies.write(table, "steps", tmp_path)
    assert (tmp_path / "steps.png").stat().st_size > 10_000
    assert "| dpm2m, index, 2 steps |" in (tmp_path / "steps.md").read_text()
    assert report.read(tmp_path / "steps.json").suite == "study-steps"


def test_a_long_future_begins_as_a_short_one_and_goes_on_from_its_end() -> None:
    trial = trials.prepare(protocol(), count=2)
    tiny = predictor()
    short = behaviour.long_futures(tiny, trial, behaviour.Budget(2, 2, seconds=AHEAD / 30))
    long = behaviour.long_futures(tiny, trial, behaviour.Budget(2, 2, seconds=3 * AHEAD / 30))
    assert long.shape == (2, 2, 3 * AHEAD, 22, 3)
    assert np.allclose(long[:, :, :AHEAD], short)
    steps = np.linalg.norm(np.diff(long[:, :, :, 0], axis=2), axis=-1)
    assert steps[:, :, AHEAD - 1].max() < 5 * steps.max(initial=0.01)


def test_a_horizon_is_measured_second_by_second_beside_real_motion(keep: Path) -> None:
    table = studies.study("horizon", replace(lab(keep), budget=replace(SMALL, seconds=2.0)), predictor())
    assert [row.name for row in table.rows] == [REAL, "second 1", "second 2"]
    real = table.rows[0].values
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


def gliding(frames: int = 30) -> np.ndarray:
    """(frames, 22, 3) at 30 fps: a still body 0.9 m up whose root goes t³ metres along +X."""
    places = np.repeat(protocol().recordings[0].positions[:1].astype(np.float64), frames, axis=0)
    places[:, :, 0] += (np.arange(frames)[:, None] / 30) ** 3
    return places


def test_how_lively_motion_is_in_closed_form() -> None:
    """A joint that goes t³ metres from the root has the jerk 6 m/s³; that of the root does not count."""
    places, known = gliding(), behaviour._known_poses(protocol())
    end = (29 / 30) ** 3
    numbers = behaviour._lively(places[None], protocol(), known)
    assert (numbers["speed"], numbers["jerk"]) == pytest.approx((0, 0), abs=1e-6)
    assert (numbers["root_speed"], numbers["height"]) == pytest.approx((end / (29 / 30), places[0, 0, 1]))
    assert numbers["height"] == pytest.approx(0.9)
    places[:, 20, 1] += (np.arange(30) / 30) ** 3
    numbers = behaviour._lively(places[None], protocol(), known)
    assert (numbers["speed"], numbers["jerk"]) == pytest.approx((end / (29 / 30) / 21, 6 / 21), rel=1e-6)


def test_the_spread_of_futures_is_metres_per_joint_between_two() -> None:
    """Three futures, a head 0, 0.3 and 0.6 m up: 0.3, 0.6 and 0.3 m apart."""
    futures = np.stack([gliding() for _ in range(3)])[None]
    futures[0, :, :, 15, 1] += np.array([0.0, 0.3, 0.6])[:, None]
    assert behaviour._spread(futures, protocol().layout) == pytest.approx(0.4 / 21**0.5)


def test_poses_are_compared_with_those_that_were_trained_on() -> None:
    own, known = protocol(), behaviour._known_poses(protocol())
    for split, near in (("train", True), ("test", False)):
        poses = np.concatenate([r.positions for r in own.split(split)]).astype(np.float64)
        away = behaviour._nearest(behaviour.own_poses(poses, own.layout), known)
        assert bool(away.max() < 1e-5) == near


def test_every_second_of_a_long_future_is_measured_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first second stands, the second goes 1 m/s; the two real windows are of different people."""
    walks = np.stack([gliding(60), gliding(60)])
    walks[:, :, :, 0] = walks[:, :1, :, 0] + np.maximum(np.arange(60) - 30, 0)[:, None] / 30
    monkeypatch.setattr(behaviour, "long_futures", lambda *args, **given: np.stack([walks, walks]))
    _, rows, about = behaviour.horizon(replace(lab(tmp_path), budget=behaviour.Budget(2, 2, seconds=2)), predictor())
    assert [row.values["root_speed"].mean for row in rows[1:]] == pytest.approx([0, 1])
    assert [row.values["spread"].mean for row in rows[1:]] == pytest.approx([0, 0], abs=1e-6)
    assert rows[0].values["spread"].mean > 0.01
    assert about["training poses"] == 180


def test_what_comes_of_holding_a_group_is_told_of_the_other_joints(monkeypatch: pytest.MonkeyPatch) -> None:
    """Free joints are 10 cm off, with the group given 2 cm; second futures 1 or 4 mm more; what is held 1 mm off."""
    trial, held = trials.prepare(protocol(), count=2), [13, 16, 18, 20]
    calls: list[np.ndarray] = []

    def futures(predictor, past, *, seeds, known=None, exact):
        number = next(k for k in range(2) if np.array_equal(trial.pasts(k, k + 1)[0], past[0]))
        places, free = trial.future(number)[None].repeat(2, 0), [j for j in range(1, 22) if j not in held]
        places[:, :, free, 1] += 0.1 if known is None else 0.02
        places[1, :, free, 1] += 0.001 if known is None else 0.004
        if known is not None:
            calls.append(known.mask)
            places[number, 3, held[1], 2] += 0.001 * number
        return places

    turns = iter([0.25, 0.125])
    monkeypatch.setattr(behaviour, "next_frames", futures)
    monkeypatch.setattr(behaviour, "held_rotations", lambda *args, **given: next(turns))
    numbers = behaviour.held_numbers(predictor(), trial, "left_arm", samples=2, seed=0)
    assert sorted(behaviour.SMPL22.groups["left_arm"]) == held
    assert all(np.array_equal(np.flatnonzero(mask.all(axis=0)), held) and mask.sum() == 4 * AHEAD for mask in calls)
    wide = 17**0.5  # of 17 joints, each as far off
    expected = {
        "free": 0.1 * wide,
        "given": 0.02 * wide,
        "apd_free": 0.001 * wide * AHEAD**0.5,
        "apd_given": 0.004 * wide * AHEAD**0.5,
        "held": 0.001,
        "rotations": 0.25,
    }
    assert numbers == pytest.approx(expected, rel=1e-6)


def test_jumps_and_speed_of_a_way_in_between_in_closed_form() -> None:
    """A hand at 1 m/s, from frame 10 on at 2, from frame 20 on at 5: jumps of 1 and 3 m/s, of one joint of 21."""
    places = np.repeat(gliding(1), 40, axis=0)
    places[:, 20, 1] += np.cumsum(np.repeat([1.0, 2.0, 5.0], [10, 10, 20])) / 30
    numbers = behaviour._ends(places, 10, 20, 30.0)
    expected = {
        "start_velocity": 1 / 21,
        "start_acceleration": 30 / 21,
        "end_velocity": 3 / 21,
        "end_acceleration": 90 / 21,
        "speed": (10 * 2 + 5) / 11 / 21,
    }
    assert numbers == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("group", ["left_arm", "lower_body"])
def test_what_is_held_comes_out_as_given(group: str) -> None:
    """The window's places to float32, the motion's rotations exactly; what is free stays what the network says."""
    trial = trials.prepare(protocol(), count=1)
    numbers = behaviour.held_numbers(predictor(), trial, group, samples=2, seed=0)
    assert numbers["held"] < 1e-5
    assert numbers["rotations"] < 1e-12
    assert numbers["free"] > 0 < numbers["given"]


def test_a_switch_arrives_at_the_target_itself(tmp_path: Path) -> None:
    columns, rows, about = behaviour.arrive(replace(lab(tmp_path), budget=behaviour.Budget(2, 1)), predictor())
    assert [row.name for row in rows] == [REAL, "cut", "0.5 s", "1 s", "2 s"]
    assert all(row.values["target"].mean < 1e-6 for row in rows[2:])
    assert {c.name for c in columns} >= set(rows[2].values)
    assert about["pairs"] == 2


def test_the_command_does_a_study(tmp_path: Path, capsys) -> None:
    from motionloom.cli import main
    from motionloom_lab.papers.benchmark_layouts import HUMANEVA_LAYOUT

    weights = save_predictor(
        predictor(layout=HUMANEVA_LAYOUT, seen=15, ahead=60, fps=60.0), tmp_path / "tiny.safetensors"
    )
    words = [
        "evaluate",
        "study",
        "horizon",
        "--data",
        str(humaneva(tmp_path)),
        "--weights",
        str(weights),
        "--quick",
        "--threads",
        "1",
        "--windows",
        "2",
    ]
    assert main([*words, "--out", str(tmp_path / "out")]) == 0
    assert "second 4" in capsys.readouterr().out
    page = (tmp_path / "out" / "horizon.md").read_text()
    assert (
        "motionloom evaluate study horizon --weights tiny.safetensors --data DIR --windows 2 --out FOLDER --quick"
        in page
    )
    filler = runpy.run_path(str(Path(__file__).parents[4] / "tools" / "fill_readme.py"))
    (place,) = filler["PLACE"].finditer(page)
    assert place[4] == f"tiny {weights_digest(weights)[:12]}"
    assert page.startswith(f"# {studies.TITLES['horizon']}\n\n<!-- figures; of ")
    assert page.endswith("![A long horizon: window after window](horizon.png)\n<!-- end -->\n")
    assert (tmp_path / "out" / "horizon.png").is_file()
    assert main([*words, "--samples", "0", "--out", str(tmp_path / "bad")]) == 2
    assert "samples must be" in capsys.readouterr().err
    assert not (tmp_path / "bad").exists()


def test_the_command_lists_what_there_is() -> None:
    from motionloom_lab.suites.options import commands
    from motionloom_lab.suites.prediction import KINDS

    choices = {(name, o.name): o.choices for name, command in commands().items() for o in command.options}
    assert tuple(studies.TITLES) == choices["study", "name"]
    assert choices["prediction", "row"] == KINDS
