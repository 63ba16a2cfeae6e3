"""Commands that draw, on a robot and from a robot's files; a tiny prior draws, so nothing depends on weights."""

import json
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import main
from motionloom.core.models.prior import save_prior
from motionloom.goals.goal_file import read_goal
from tests.live import people
from tests.robots import models
from tests.robots.people import marching

pytest.importorskip("mink")

from motionloom.robots.body import Robot, read_robot
from motionloom.robots.clip import put_on_robot
from motionloom.robots.figures import measure
from motionloom.robots.files import load_clip, save_clip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot, a clip of it, a path, and weights."""
    place = tmp_path_factory.mktemp("robot")
    (place / "tin.xml").write_text(models.humanoid())
    save_prior(people.prior(), place / "tiny.safetensors")
    robot = read_robot(place / "tin.xml")
    march = put_on_robot(marching(1.5), robot)
    save_clip(march, robot, place / "march.npz")
    save_clip(march, robot, place / "march.csv")
    (place / "path.json").write_text(json.dumps({"path": {"points": [[0, 0], [0, 1.2], [0.4, 1.6]]}}))
    return place


@pytest.fixture
def robot(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Robot:
    monkeypatch.chdir(folder)
    return read_robot("tin.xml")


DRAWN = ("--robot", "tin.xml", "--weights", "tiny.safetensors", "--steps", "2")


def test_a_path_is_in_the_robots_metres(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    """The robot ends where the path does, not 0.8 times as far, and it is told how fast it goes."""
    assert main(["control", "a person walks", "--goal", "path.json", "--seconds", "3", "--out", "p.npz", *DRAWN]) == 0
    said = capsys.readouterr()
    assert "it goes 1.7" in said.err
    clip = load_clip("p.npz", robot)
    figures = measure(clip, robot)
    assert figures.limits_broken == 0
    x, y = clip.qpos[-1, :2] - clip.qpos[0, :2]
    assert np.hypot(x - 1.6, y - 0.4) < 0.1


TIMELINES = {
    "path": """
path: {path: {points: [[0, 0], [0, 1.5]]}}
segments: [{text: a person walks, seconds: 2}, {text: a person walks, seconds: 1}]
""",
    "goal": """
segments:
  - {text: a person walks, seconds: 2, goal: {path: {points: [[0, 0], [0, 1.5]]}}}
  - {text: a person stands, seconds: 1, goal: {path: {points: [[0, 0], [0, 0]]}}}
""",
}
SCRIPTS = {
    "path": "seconds: 4.5\ncommands: [{at: 0, path: {points: [[0, 1.5], [1, 1.5]], speed: 0.5}}]\n",
    "steer": "seconds: 4\ncommands: [{at: 0, steer: {direction: 0, speed: 0.5}}, {at: 2.9, steer: {speed: 0}}]\n",
}


def way(path: str, robot: Robot) -> tuple[float, float]:
    """Metres ahead and to the left, from the first frame of a clip to its last."""
    poses = load_clip(path, robot).qpos
    ahead, left = poses[-1, :2] - poses[0, :2]
    return float(ahead), float(left)


@pytest.mark.parametrize("timeline", TIMELINES)
def test_a_timeline_is_in_the_robots_metres(timeline: str, robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a whole and of a segment: 1.5 m of the robot, not 1.2."""
    Path("timeline.yaml").write_text(TIMELINES[timeline])
    assert main(["compose", "timeline.yaml", "--out", f"{timeline}.npz", *DRAWN]) == 0
    assert "robot's metres" in capsys.readouterr().err
    ahead, left = way(f"{timeline}.npz", robot)
    assert ahead == pytest.approx(1.5, abs=0.08)
    assert abs(left) < 0.08


@pytest.mark.parametrize("script", SCRIPTS)
def test_a_live_script_is_in_the_robots_metres(script: str, robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    """Half a metre a second of the robot, which is more of the person."""
    Path("script.yaml").write_text(SCRIPTS[script])
    assert main(["live", "script.yaml", "--out", f"live_{script}.npz", *DRAWN]) == 0
    assert "robot's metres" in capsys.readouterr().err
    poses = load_clip(f"live_{script}.npz", robot).qpos
    speeds = np.linalg.norm(poses[100:130, :2] - poses[70:100, :2], axis=1) / 0.6
    assert np.median(speeds) == pytest.approx(0.5, abs=0.04)
    if script == "path":
        assert np.median(poses[-20:, 0]) - poses[0, 0] == pytest.approx(1.5, abs=0.12)  # behind the corner


def test_metres_in_words_are_the_robots(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    """And so is what is measured of them."""
    line = ["generate", "a person walks 1.5 meters forward", "--out", "words.npz", "--json", *DRAWN]
    assert main(line) == 0
    (amount,) = json.loads(capsys.readouterr().out)["motions"][0]["amounts"]
    assert (amount["read"], amount["kept"]) == ("1.5 m forward", True)
    assert amount["measured"] == pytest.approx(1.5, abs=0.1)
    assert way("words.npz", robot)[0] == pytest.approx(1.5, abs=0.1)


def test_a_motion_that_a_goal_file_names_is_a_persons(robot: Robot) -> None:
    """Its places are not scaled, and a drawing without a width is as large as a person walks in the time."""
    person = marching(1.0)
    io.save(person, Path("person.npz"))
    asked = {"follow": {"from": "person.npz", "joints": ["left_wrist"]}}
    goals = [read_goal(asked, frames=15, folder=Path(), metre=metre) for metre in (1.0, robot.metre)]
    assert goals[1].mask.any()
    np.testing.assert_allclose(goals[1].positions, goals[0].positions, atol=1e-9)
    Path("way.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0 L30 0 L30 40"/></svg>')
    drawn = [read_goal({"path": {"svg": "way.svg"}}, frames=60, folder=Path(), metre=m) for m in (1.0, robot.metre)]
    np.testing.assert_allclose(drawn[1].positions, drawn[0].positions, atol=1e-9)
    path = {"path": {"points": [[0, 0], [0, 2]]}}
    assert read_goal(path, frames=60, folder=Path(), metre=robot.metre).positions[-1, 0, 2] == pytest.approx(
        2 / robot.metre
    )


def test_an_edit_keeps_what_it_is_to_keep(robot: Robot) -> None:
    """Seconds that are not edited are the angles that were there; the file has as many frames."""
    line = ["edit", "march.npz", "a person waves", "--between", "0.6", "1.0", "--out", "edited.npz", *DRAWN]
    assert main(line) == 0
    before, after = load_clip("march.npz", robot), load_clip("edited.npz", robot)
    assert abs(len(after) - len(before)) <= 3
    assert measure(after, robot).limits_broken == 0
    early = slice(2, 15)
    assert np.median(np.abs(after.qpos[early, 7:] - before.qpos[early, 7:])) < 0.05


@pytest.mark.parametrize(
    ("line", "seconds"),
    [
        (["predict", "march.npz", "--count", "1", "--seconds", "0.5", "--out", "next.csv"], 2.0),
        (["switch", "march.npz", "march.csv", "--seconds", "0.5", "--out", "next.csv"], 3.5),
    ],
    ids=["predict", "switch"],
)
def test_what_comes_after_a_robots_clip_is_a_clip(line: list[str], seconds: float, robot: Robot) -> None:
    """It begins with the poses that were there, goes on for so long, and keeps every limit."""
    assert main([*line, "--robot", "tin.xml", "--force"]) == 0
    before, after = load_clip("march.npz", robot), load_clip("next.csv", robot)
    assert len(after) / 50 == pytest.approx(seconds, abs=0.2)
    figures = measure(after, robot)
    assert figures.limits_broken == 0
    assert figures.largest_step <= 0.3 + 1e-6
    assert np.median(np.abs(after.qpos[5:50, 7:] - before.qpos[5:50, 7:])) < 0.05


def test_joint_angles_go_with_a_robot(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    """Commands that read or write them without one say so before anything is drawn."""
    for line in (
        ["predict", "march.npz", "--out", "next.bvh"],
        ["predict", "march.bvh", "--out", "folder", "--format", "csv"],
        ["control", "a person walks", "--follow", "left_wrist", "--from", "march.csv"],
        ["control", "a person walks", "--goal", "path.json", "--max-speed", "3"],
    ):
        assert main(line) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1
        assert "robot" in said
