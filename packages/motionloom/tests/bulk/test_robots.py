"""Rows on a robot: joint angles in the batch's folder, figures in its records, recordings beside what is drawn."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom import io
from motionloom.bulk.batch import batch, check_options
from motionloom.bulk.maker import Options
from motionloom.bulk.metadata import read_batch
from motionloom.bulk.row import Sources, parse
from motionloom.cli import main
from motionloom.core.errors import MotionloomError
from tests.bulk.rows import options, write_jobs
from tests.robots import models
from tests.robots.people import marching

pytest.importorskip("mink")

from motionloom.robots.body import Robot, read_robot
from motionloom.robots.clip import put_on_robot
from motionloom.robots.figures import measure
from motionloom.robots.files import load_clip


@pytest.fixture
def robot(folder: Path) -> Robot:
    path = folder / "tin.xml"
    path.write_text(models.humanoid())
    return read_robot(path)


def key(row: dict[str, Any], **more: Any) -> str:
    return Sources(Path(), {}, **more).ask(parse(json.dumps(row).encode())).key


def records(out: Path) -> list[dict[str, Any]]:
    return [one.about | {"state": one.state, "id": one.id, "why": one.why} for one in read_batch(out)]


def test_rows_become_joint_angles_with_their_figures(robot: Robot, weights: str, folder: Path) -> None:
    """What is drawn and what was recorded are the same clips as by themselves, and are measured as by themselves."""
    io.save(marching(0.6), folder / "march.npz")
    rows = [
        {"prompt": "a person walks", "seconds": 1.0, "robot": "tin.xml", "id": "walk"},
        {"motion": "march.npz", "robot": "tin.xml", "max_speed": 2.0, "id": "march"},
        {"prompt": "a person walks", "seconds": 1.0},
    ]
    results = list(batch(write_jobs(folder / "jobs.jsonl", rows), "out", options=options(weights)))
    assert [one.state for one in results] == ["made"] * 3
    walk, march, plain = records(folder / "out")
    clip = put_on_robot(io.load("march.npz"), robot, max_speed=2.0)
    back = load_clip("out/shard-000000/march.npz", robot)
    assert np.allclose(back.qpos, clip.qpos, atol=1e-9)
    assert {name: march[name] for name in ("float_cm", "effector_cm", "slowed_seconds")} == {
        name: measure(clip, robot).as_dict()[name] for name in ("float_cm", "effector_cm", "slowed_seconds")
    }
    assert (march["frames"], march["fps"], march["text"]) == (len(clip), 50.0, "march.npz")
    assert march["top_speed"] <= 2.001
    assert walk["limits_broken"] == 0
    assert len(load_clip("out/shard-000000/walk.npz", robot)) == walk["frames"] == 48
    assert "robot" not in plain
    assert len(io.load(f"out/shard-000000/{plain['id']}.npz")) == 20


def test_what_a_row_does_not_say_the_job_says(robot: Robot, weights: str, folder: Path) -> None:
    """`--robot` is for every row but those with a skeleton; a filter asks for figures; a tar holds angles."""
    jobs = write_jobs(
        folder / "jobs.jsonl",
        [
            {"prompt": "a person walks", "seconds": 1.0, "id": "one"},
            {"prompt": "a person walks", "seconds": 1.0, "max_speed": 1.0, "id": "slow"},
            {"prompt": "a person walks", "seconds": 1.0, "skeleton": "smpl22", "id": "person"},
        ],
    )
    settings = options(weights, robot="tin.xml", format="webdataset", filter="top_speed > 1.1")
    list(batch(jobs, "out", options=settings))
    one, slow, person = records(folder / "out")
    assert one["state"] == "made"
    assert one["top_speed"] > 1.1
    assert slow["state"] == "dropped"
    assert slow["slowed_seconds"] > 0
    assert "robot" not in person
    assert [entry.id for entry in read_batch("out") if entry.motion] == ["person"]


def test_a_folder_of_recordings_needs_no_jobs(
    robot: Robot, weights: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is damaged has its sentence in the record; a second call makes nothing anew."""
    (folder / "motions" / "more").mkdir(parents=True)
    io.save(marching(0.5), folder / "motions" / "one.bvh")
    io.save(marching(0.5), folder / "motions" / "more" / "two, too.npz")
    (folder / "motions" / "three.bvh").write_text("no motion")
    line = ["batch", "--recordings", "motions", "--robot", "tin.xml", "--out", "out", "--format", "csv"]
    line += ["--weights", weights, "--workers", "1"]
    assert main(line) == 1
    assert "by their names" in capsys.readouterr().err
    entries = {one["id"]: one for one in records(folder / "out")}
    assert entries.keys() == {"more_two__too", "one", "three"}
    assert "BVH" in entries["three"]["why"]
    assert [entries[name]["limits_broken"] for name in ("one", "more_two__too")] == [0, 0]
    place = folder / "out" / "shard-000000" / "one.csv"
    assert len(load_clip(place, robot)) == len(place.read_text().splitlines()) - 1 == 24
    capsys.readouterr()
    assert main([*line, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["tried"] == 1
    assert main([*line, "--max-speed", "3"]) == 2
    assert "max_speed" in capsys.readouterr().err


def test_the_id_changes_with_the_robot_and_its_options(robot: Robot, folder: Path) -> None:
    """And is what it was without one."""
    (folder / "big.xml").write_text(models.humanoid(size=1.1))
    (folder / "map.json").write_text(json.dumps({"waist": "waist_yaw_joint", "left_knee": "left_knee_joint"}))
    row = {"prompt": "a person walks"}
    ways = [
        {},
        {"robot": "tin.xml"},
        {"robot": "big.xml"},
        {"robot": "tin.xml", "max_speed": 5},
        {"robot": "tin.xml", "avoid_collisions": True},
    ]
    assert len({key(row | way) for way in ways}) == 5
    assert key(row | {"robot": "tin.xml", "robot_map": "map.json"}) == key(row | {"robot": "tin.xml"})
    (folder / "copy.xml").write_text(models.humanoid())
    assert key(row | {"robot": "copy.xml"}) == key(row | {"robot": "tin.xml"})


@pytest.mark.parametrize(
    "row",
    [
        {"task": "compose", "timeline": "timeline.yaml"},
        {"task": "control", "prompt": "a person walks", "seconds": 3, "goal": {"path": {"points": [[0, 0], [0, 1.5]]}}},
        {"prompt": "a person walks 1.5 meters forward"},
    ],
    ids=["timeline", "goal", "words"],
)
def test_ways_are_in_the_robots_metres(row: dict[str, Any], robot: Robot, folder: Path) -> None:
    """One and a half of them, and not 0.8 times as many; without a robot they are a person's.

    With the weights that ship: the body of untrained ones shakes by more than that.
    """
    (folder / "timeline.yaml").write_text(
        "path: {path: {points: [[0, 0], [0, 1.5]]}}\nsegments: [{text: a person walks, seconds: 3}]\n"
    )
    rows = [{**row, "robot": "tin.xml", "id": "robot"}, {**row, "id": "person"}]
    results = list(batch(write_jobs(folder / "jobs.jsonl", rows), "out", options=Options(weights="default", steps=12)))
    assert [one.state for one in results] == ["made"] * 2
    poses = load_clip("out/shard-000000/robot.npz", robot).qpos
    assert np.hypot(*(poses[-1, :2] - poses[0, :2])) == pytest.approx(1.5, abs=0.1)
    root = io.load("out/shard-000000/person.npz").root
    assert np.hypot(*(root[-1] - root[0])[[0, 2]]) == pytest.approx(1.5, abs=0.1)


@pytest.mark.parametrize(
    ("row", "sentence"),
    [
        ({"prompt": "walks", "robot": "../tin.xml"}, "leads out"),
        ({"prompt": "walks", "robot": "none.xml"}, "no such file"),
        ({"prompt": "walks", "robot": "tin.xml", "skeleton": "smpl22"}, "leave one of them out"),
        ({"prompt": "walks", "max_speed": 3}, "go with a 'robot'"),
        ({"prompt": "walks", "robot": "tin.xml", "max_speed": 0}, "0.1 to 1,000"),
        ({"prompt": "walks", "robot": "tin.xml", "avoid_collisions": "yes"}, "true or false"),
        ({"motion": "tin.xml", "seconds": 3}, "draws nothing"),
        ({"motion": "tin.xml", "goal": {"path": {"points": [[0, 0], [0, 1]]}}}, "of the task export"),
        ({"task": "export", "prompt": "walks"}, "needs a motion"),
        ({"prompt": "walks", "robot": "dog.xml"}, "on 4 legs"),
    ],
    ids=str,
)
def test_rows_that_cannot_be_have_a_sentence(row: dict[str, Any], sentence: str, robot: Robot, folder: Path) -> None:
    (folder / "dog.xml").write_text(models.on_legs(4))
    with pytest.raises(MotionloomError, match=sentence) as caught:
        key(row)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"format": "bvh"}, "the format is bvh"),
        ({"hands": "fist"}, "characters"),
        ({"max_speed": 0.0}, "0.1 to 1000"),
        ({"robot": "none.xml"}, "none.xml"),
        ({"robot": None, "robot_map": "map.json"}, "--robot-map"),
    ],
    ids=str,
)
def test_jobs_that_cannot_be_are_refused_before_any_work(wrong: dict[str, Any], sentence: str, robot: Robot) -> None:
    settings: dict[str, Any] = {"robot": "tin.xml"}
    with pytest.raises((MotionloomError, OSError), match=sentence):
        check_options(Options(**settings | wrong))


def test_poses_are_not_joint_angles(weights: str, folder: Path) -> None:
    """A row without a robot fails where files hold joint angles, and says so."""
    jobs = write_jobs(folder / "jobs.csv", [])
    jobs.write_text("prompt,seconds,robot,avoid_collisions\na person walks,1,,\n")
    list(batch(jobs, "out", options=options(weights, format="csv")))
    (one,) = records(folder / "out")
    assert (one["state"], "name a robot" in one["why"]) == ("failed", True)


def test_a_table_says_yes_and_no(robot: Robot, folder: Path) -> None:
    from motionloom.bulk.jobs import Jobs

    (folder / "jobs.csv").write_text("prompt,robot,avoid_collisions\nwalks,tin.xml,yes\nwalks,tin.xml,false\n")
    assert [parse(row).avoid_collisions for row in Jobs.of("jobs.csv").read()] == [True, False]
