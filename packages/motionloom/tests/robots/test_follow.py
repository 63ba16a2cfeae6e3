"""A robot that follows poses as they come: limits, steps and feet, and the same over a live connection."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom import io
from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.live import messages
from motionloom.live.sessions import Sessions
from motionloom.retarget import retarget
from tests.live import people
from tests.live.people import QUICK
from tests.live.test_socket import Client, talk
from tests.robots import models
from tests.robots.people import marching, stepping_aside
from tests.shared import shared

pytest.importorskip("mink")

from motionloom.robots.body import Robot, read_robot
from motionloom.robots.clip import Clip
from motionloom.robots.figures import Figures, measure
from motionloom.robots.follow import Follower


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    path = tmp_path_factory.mktemp("robot") / "tin.xml"
    path.write_text(models.humanoid())
    return read_robot(path)


def followed(motion: Motion, robot: Robot, **how: Any) -> Clip:
    """A person's motion, frame by frame."""
    asked, follower = retarget(motion, robot.skeleton).resample(50), Follower(robot, 50.0, **how)
    poses, planted = [], []
    for number in range(len(asked)):
        poses.append(follower.pose(asked.frames(number, number + 1)))
        planted.append(follower.planted.copy())
    return Clip(50.0, np.array(poses), np.array(planted))


def check(figures: Figures) -> None:
    assert figures.limits_broken == 0
    assert figures.largest_step <= 0.3 + 1e-9
    assert figures.float_cm <= 1.0
    assert figures.slide_cm <= 0.3
    assert figures.sunk_cm <= 0.5


def test_a_march_is_followed_within_every_limit(robot: Robot) -> None:
    """Feet are planted and lifted in turn, the root moves as the person's does, and twice the same is the same."""
    clip = followed(marching(), robot)
    check(measure(clip, robot))
    assert clip.planted[38, 0].all()
    assert not clip.planted[38, 1].any()
    assert clip.planted[13, 1].all()
    assert not clip.planted[13, 0].any()
    assert np.abs(np.diff(clip.qpos[:, :3], axis=0)).max() < 0.03
    assert np.array_equal(followed(marching(), robot).qpos, clip.qpos)


def test_wide_steps_to_the_side_are_followed(robot: Robot) -> None:
    """Soles stand on their edges where ankles roll no further, as in clips."""
    figures = measure(followed(stepping_aside(1.3), robot), robot)
    check(figures)
    assert figures.sole_roll > 0.1


def test_what_jumps_is_followed_in_steps(robot: Robot) -> None:
    """An arm and a body that are elsewhere from one frame to the next: hinges and root take their time."""
    motion = marching()
    turns, root = motion.rotations.copy(), motion.root.copy()
    turns[20:, SMPL22.index("left_elbow")] = rot.rotvec_to_quat(np.array([0.0, -2.0, 0.0]))
    root[30:, 2] += 1.0
    clip = followed(replace(motion, rotations=turns, root=root), robot, max_speed=6.0)
    assert np.abs(np.diff(clip.qpos[:, 7:], axis=0)).max() <= 6.0 / 50 + 1e-9
    asked = np.abs(np.diff(retarget(replace(motion, root=root), robot.skeleton).resample(50).root[:, 2])).max()
    assert np.abs(np.diff(clip.qpos[:, 0])).max() <= asked + 2.0 / 50 + 0.01
    assert ((clip.qpos[:, 7:] >= robot.file.lower) & (clip.qpos[:, 7:] <= robot.file.upper)).all()


def test_a_walk_is_followed_by_a_published_robot() -> None:
    """As a clip that is known whole: soles stand and joints stay within their limits."""
    robot = read_robot(shared("robots/unitree_g1/g1_29dof_without_meshes.xml"))
    check(measure(followed(io.load(shared("data/cmu/bvh/07_04.bvh")).frames(0, 60), robot), robot))


@pytest.mark.parametrize("how", [{"max_speed": 0.0}, {"max_speed": float("nan")}], ids=str)
def test_a_speed_that_cannot_be_is_refused(how: dict[str, Any], robot: Robot) -> None:
    with pytest.raises(MotionloomError, match="radians per second"):
        Follower(robot, 50.0, **how)


@pytest.fixture
def sessions(robot: Robot) -> Iterator[Sessions]:
    made = people.prior()
    found = Sessions(lambda: made, most=2, settings=QUICK, robots={"tin": robot})
    yield found
    found.close()


def test_joint_angles_come_over_the_connection(sessions: Sessions, robot: Robot) -> None:
    """At 50 Hz, in the order that the welcome names, within the robot's limits, and on across a lost connection."""
    found: list[dict[str, Any]] = []
    key = ""

    async def lead(client: Client) -> None:
        nonlocal key
        client.say(type="hello", seed=3, robot="tin", max_speed=5)
        hello = await client.next("welcome")
        key = hello["session"]
        assert hello["fps"] == 50.0
        assert hello["robot"] == "tin"
        assert hello["joint_names"] == list(robot.file.joint_names())
        assert hello["joints"] == list(robot.skeleton.names)
        client.say(type="say", text="a person walks forward")
        found.extend(await client.frames(60))

    async def again(client: Client) -> None:
        client.say(type="hello", session=key)
        assert (await client.next("welcome"))["joint_names"] == list(robot.file.joint_names())
        found.extend(await client.frames(20))

    talk(sessions, lead)
    talk(sessions, again)
    assert [frame["frame"] for frame in found[:60]] == list(range(60))
    angles = np.array([frame["qpos"] for frame in found])
    assert angles.shape == (80, 7 + len(robot.file.hinges))
    assert (angles[:, 7:] >= robot.file.lower - 1e-6).all()
    assert (angles[:, 7:] <= robot.file.upper + 1e-6).all()
    np.testing.assert_allclose(np.linalg.norm(angles[:, 3:7], axis=1), 1, atol=1e-5)
    steps = np.diff([frame["frame"] for frame in found])
    assert (np.abs(np.diff(angles[:, 7:], axis=0)).max(axis=1) <= 0.1 * steps + 1e-5).all()
    assert np.abs(angles[:, 2]).max() < 1.0
    asked = np.array([frame["root"] for frame in found])[:, [2, 0]]
    assert np.linalg.norm(angles[:, :2] - asked, axis=1).max() < 0.3


def test_steering_is_in_the_robots_metres(sessions: Sessions, robot: Robot) -> None:
    """A path and a pace are the robot's, and are recorded as they were said; what nobody of that size does is told."""
    path = {"points": [[0.0, 3.0]], "speed": 0.45}
    found: list[dict[str, Any]] = []
    recorded: dict[str, Any] = {}

    async def lead(client: Client) -> None:
        client.say(type="hello", seed=3, robot="tin")
        await client.next("welcome")
        client.say(type="steer", speed=11.5)
        assert f"{1 / robot.metre:.2f} times as large" in (await client.next("error"))["message"]
        client.say(type="path", **path)
        found.extend(await client.frames(150))
        client.say(type="record")
        recorded.update(await client.next("recorded"))

    talk(sessions, lead)
    (command,) = recorded["commands"]
    assert {name: command[name] for name in path} == path
    poses = np.array([frame["qpos"] for frame in found])
    speeds = np.linalg.norm(poses[75:125, :2] - poses[50:100, :2], axis=1) / 0.5
    assert np.median(speeds) == pytest.approx(0.45, abs=0.09)  # half as much or twice would be a person's metres


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ({"robot": "g1"}, "it has tin"),
        ({"robot": "../tin.xml"}, "it has tin"),
        ({"robot": 3}, "must be text"),
        ({"robot": "tin", "skeleton": "mixamo"}, "own skeleton"),
        ({"robot": "tin", "max_speed": 0}, "0.1 to 1,000"),
        ({"robot": "tin", "fps": 2}, "5 to 1000"),
        ({"max_speed": 3}, "go with a 'robot'"),
    ],
    ids=str,
)
def test_a_hello_that_cannot_be_has_a_sentence(said: dict[str, Any], told: str, sessions: Sessions) -> None:
    with pytest.raises(MotionloomError, match=told) as caught:
        sessions.begin(messages.hello({"type": "hello", **said}))
    assert "\n" not in str(caught.value)
    assert len(sessions) == 0


def test_a_server_reads_its_robots_before_it_starts(robot: Robot, tmp_path: Path) -> None:
    pytest.importorskip("uvicorn")
    from motionloom.server.serving import read_robots

    assert read_robots([robot.file.path])["tin"].file.joint_names() == robot.file.joint_names()
    (tmp_path / "tin.xml").write_text(models.humanoid())
    with pytest.raises(MotionloomError, match="two robots are called tin"):
        read_robots([robot.file.path, tmp_path / "tin.xml"])
    (tmp_path / "dog.xml").write_text(models.on_legs(4))
    with pytest.raises(MotionloomError, match="on 4 legs"):
        read_robots([tmp_path / "dog.xml"])
