"""control, as a stranger types it, on a tiny prior with random weights."""

import json
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import main
from motionloom.core.motion import Motion
from motionloom.core.rotations import IDENTITY
from motionloom.core.skeleton import SMPL22
from motionloom.tasks import control as task
from tests.cli.said import complaint

GOAL = {"path": {"points": [[1, 0], [1, 1.2]]}}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in a folder of its own with a goal, a clip and a drawing."""
    monkeypatch.chdir(tmp_path)
    Path("goal.json").write_text(json.dumps(GOAL))
    Path("line.svg").write_text('<svg><path d="M9 9V1"/></svg>')
    rotations = np.tile(IDENTITY, (30, 22, 1))
    io.save(Motion(SMPL22, 20.0, np.tile([2.0, SMPL22.offsets[0, 1], 0], (30, 1)), rotations), "clip.bvh")
    return tmp_path


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list:
    """What the command asks of the task, which here only stands there, 1 cm beside its goals."""
    calls = []

    def fake(prior, prompts, goal, *, seeds, sampling, fit, foot_lock, progress, adapters):
        names = ("count", "first", "seed", "guidance", "steps", "best_of")
        calls.append(
            {"prompt": prompts[0], "goal": goal, "fit": fit, "foot_lock": foot_lock, "adapters": adapters}
            | {name: getattr(sampling, name) for name in names}
        )
        progress(1, 1)
        motion = Motion(SMPL22, 20.0, np.tile([0.0, 0.9, 0], (len(goal), 1)), np.tile(IDENTITY, (len(goal), 22, 1)))
        return [task.Controlled(motion, motion, 0.01, 0.43, ("head at 1.20 s is 0.43 m away from its goal",))] * len(
            prompts
        )

    monkeypatch.setattr(task, "control_each", fake)
    return calls


def control(weights: str, *words: str) -> int:
    return main(["control", *words, "--weights", weights])


def test_options_reach_the_task(weights: str, calls: list, capsys: pytest.CaptureFixture[str]) -> None:
    words = [
        "a person walks",
        "--goal",
        "goal.json",
        "--seconds",
        "2",
        "--count",
        "2",
        "--seed",
        "5",
        "--guidance",
        "3",
    ]
    assert control(weights, *words, "--steps", "7", "--no-fit", "--no-foot-lock", "--out", "a.npz") == 0
    call = calls[0]
    goal = call.pop("goal")
    assert call == {
        "prompt": "a person walks",
        "count": 2,
        "first": 0,
        "seed": 5,
        "guidance": 3.0,
        "steps": 7,
        "best_of": 1,
        "fit": False,
        "foot_lock": False,
        "adapters": "none",
    }
    assert len(goal) == 40
    assert goal.positions[39, 0, ::2].tolist() == [1, 1.2]
    output = capsys.readouterr()
    assert output.out.splitlines()[0] == "wrote a_0.npz: 1.0 cm from its goals, at most 43.0 cm"
    assert output.err.count("head at 1.20 s is 0.43 m away from its goal") == 2
    assert len(io.load("a_1.npz")) == 40


def test_goals_a_drawing_and_a_clip_to_follow_go_together(weights: str, calls: list) -> None:
    words = ["walk", "--follow", "left_wrist", "--follow", "head", "--from", "clip.bvh"]
    assert control(weights, *words) == 0
    followed = calls[-1]["goal"]
    assert followed.joints == ("head", "left_wrist")
    assert len(followed) == 30  # as long as the clip
    assert followed.start.x == pytest.approx(2)
    head = json.dumps({"joints": [{"joint": "head", "points": [{"time": 1, "position": [None, 1.5, None]}]}]})
    Path("head.json").write_text(head)
    assert control(weights, "walk", "--goal", "head.json", "--path", "line.svg", "--width", "1") == 2
    assert control(weights, "walk", "--goal", "head.json", "--path", "line.svg", "--seconds", "3") == 0
    goal = calls[-1]["goal"]
    assert goal.joints == ("pelvis", "head")
    assert goal.positions[59, 0, 2] == pytest.approx(1.2 * 3)


def test_a_drawing_named_on_the_line_may_be_a_link(weights: str, calls: list, folder: Path) -> None:
    """Only files from strangers are kept in their folder."""
    (folder / "inner").mkdir()
    (folder / "inner" / "link.svg").symlink_to(folder / "line.svg")
    assert control(weights, "walk", "--path", "inner/link.svg", "--seconds", "3") == 0
    assert calls[-1]["goal"].positions[59, 0, 2] == pytest.approx(1.2 * 3)


def test_a_path_elsewhere_moves_the_start_of_somebody_who_follows(weights: str, calls: list) -> None:
    """The clip's person stands at x = 2, its hand 0.6 m further: in reach of a path at x = 2.3."""
    Path("goal.json").write_text(json.dumps({"path": {"points": [[2.3, 0]]}}))
    assert control(weights, "walk", "--goal", "goal.json", "--follow", "left_wrist", "--from", "clip.bvh") == 0
    assert calls[-1]["goal"].start.x == 2.3


def test_the_report_is_json_when_asked(weights: str, calls: list, capsys: pytest.CaptureFixture[str]) -> None:
    assert control(weights, "walk", "--goal", "goal.json", "--json", "--out", "a.npz", "--fps", "30") == 0
    about = json.loads(capsys.readouterr().out)
    assert [one.pop("happened")[0]["ends"] for one in about["motions"]] == ["standing"]
    assert about["motions"] == [
        {
            "prompt": "walk",
            "seed": 0,
            "error_cm": 1.0,
            "worst_cm": 43.0,
            "missed": ["head at 1.20 s is 0.43 m away from its goal"],
        }
    ]
    assert (about["files"], about["seconds"]) == (["a.npz"], 5.0)
    assert io.load("a.npz").fps == 30


def test_a_motion_is_made_from_end_to_end(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Even a prior of random weights is bent to the path."""
    assert control(weights, "walk", "--goal", "goal.json", "--seconds", "1", "--steps", "3", "--out", "a.npz") == 0
    motion = io.load("a.npz")
    assert motion.root[0, [0, 2]] == pytest.approx([1, 0], abs=0.05)
    assert "cm from its goals" in capsys.readouterr().out


@pytest.mark.parametrize(
    "words",
    [
        ["walk"],
        ["--goal", "goal.json"],
        ["  ", "--goal", "goal.json"],
        ["walk", "--goal", "absent.json"],
        ["walk", "--goal", "line.svg"],
        ["walk", "--path", "goal.json"],
        ["walk", "--path", "absent.svg"],
        ["walk", "--follow", "head"],
        ["walk", "--from", "clip.bvh"],
        ["walk", "--width", "3", "--goal", "goal.json"],
        ["walk", "--follow", "tail", "--from", "clip.bvh"],
        ["walk", "--follow", "head", "--from", "goal.json"],
        ["walk", "--goal", "goal.json", "--seconds", "61"],
        ["walk", "--goal", "goal.json", "--seconds", "0"],
        ["walk", "--goal", "goal.json", "--seconds", "nan"],
        ["walk", "--goal", "goal.json", "--count", "0"],
        ["walk", "--goal", "goal.json", "--seed", "-1"],
        ["walk", "--goal", "goal.json", "--out", "a.xyz"],
        ["walk", "--goal", "goal.json", "--adapters", "none", "--adapters", "x"],
        ["walk", "--goal", "goal.json", "--path", "line.svg"],
        ["walk", "--goal", "goal.json", "--follow", "hands", "--from", "clip.bvh", "--seconds", "5", "--fps", "0"],
    ],
    ids=lambda words: " ".join(words),
)
def test_mistakes_are_one_sentence_and_nothing_is_written(
    weights: str, calls: list, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """The path of the drawing contradicts that of the goal."""
    before = {path.name for path in Path().iterdir()}
    assert control(weights, *words) == 2
    complaint(capsys)
    assert {path.name for path in Path().iterdir()} == before
    assert not calls


def test_a_drawing_that_is_missing_is_named_with_its_option(
    weights: str, calls: list, capsys: pytest.CaptureFixture[str]
) -> None:
    assert control(weights, "walk", "--path", "absent.svg") == 2
    assert "--path: there is no file 'absent.svg'" in complaint(capsys)
