"""Commands that draw, on a robot and from a robot's files; a tiny prior draws, so nothing depends on weights."""

import json
from pathlib import Path

import numpy as np
import pytest

from motionloom.cli import main
from motionloom.weights.prior import save_prior
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
