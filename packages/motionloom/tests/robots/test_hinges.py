"""Robots that lack hinges of a person: pelvis and trunk stay calm, and what cannot be done is told."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from tests.robots import models
from tests.robots.people import marching, stepping_aside

pytest.importorskip("mink")

from motionloom.robots.body import Robot, read_robot, to_motion
from motionloom.robots.clip import put_on_robot
from motionloom.robots.figures import measure
from motionloom.robots.follow import Follower

LACKS = {"ankle roll": (5,), "hip yaw": (2,), "hip roll": (1,), "waist": (6,), "upper arm": (9,), "several": (5, 6, 9)}
"""Numbers of the hinges that are missing."""


def without(folder: Path, numbers: tuple[int, ...]) -> Robot:
    names = ["" if number in numbers else name for number, name in enumerate(models.UNITREE)]
    path = folder / "tin.xml"
    path.write_text(models.humanoid(names))
    return read_robot(path)


def turning() -> Motion:
    """A person who marches, sways, walks ahead and turns by a right angle."""
    motion = marching(2.0)
    seconds = np.arange(len(motion)) / motion.fps
    root, turns = motion.root.copy(), motion.rotations.copy()
    root[:, 0] += 0.08 * np.sin(2 * np.pi * seconds)
    root[:, 2] += 0.4 * seconds
    turned = rot.rotvec_to_quat(np.pi / 4 * seconds[:, None] * np.array([0.0, 1.0, 0.0]))
    turns[:, SMPL22.index("pelvis")] = rot.multiply(turned, turns[:, SMPL22.index("pelvis")])
    return replace(motion, root=root, rotations=turns)


def acceleration(poses: np.ndarray, fps: float) -> float:
    """Root mean square, m/s2, of the root of poses (frames, nq)."""
    return float(np.sqrt((np.diff(poses[:, :3], n=2, axis=0) ** 2).sum(axis=1).mean())) * fps**2


MOTIONS = {"march": marching(), "turn": turning(), "aside": stepping_aside(0.5)}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return without(tmp_path_factory.mktemp("whole"), ())


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("lacking", LACKS)
def test_the_pelvis_is_calm_without_a_hinge(lacking: str, name: str, whole: Robot, tmp_path: Path) -> None:
    """Accelerated at most twice as much as with all hinges, and upright and turned as the person's is."""
    robot, motion = without(tmp_path, LACKS[lacking]), MOTIONS[name]
    clip, usual = put_on_robot(motion, robot), put_on_robot(motion, whole)
    assert acceleration(clip.qpos, clip.fps) < 2 * acceleration(usual.qpos, usual.fps)
    figures = measure(clip, robot)
    assert figures.heading_off is not None
    assert figures.heading_off < 3
    assert figures.tilt_off is not None
    assert figures.tilt_off < 6
    assert figures.float_cm < 0.2


@pytest.mark.parametrize("lacking", ["ankle roll", "hip yaw"])
def test_live_the_pelvis_is_calm_without_a_hinge(lacking: str, whole: Robot, tmp_path: Path) -> None:
    def follow(robot: Robot) -> float:
        follower = Follower(robot, 50)
        clip = put_on_robot(marching(), robot)
        motion = to_motion(robot, clip.qpos, clip.fps)
        poses = [follower.pose(motion.frames(frame, frame + 1)) for frame in range(len(motion))]
        return acceleration(np.array(poses), 50)

    assert follow(without(tmp_path, LACKS[lacking])) < 2 * follow(whole)


def test_feet_without_a_roll_stand_flat_under_the_hips(tmp_path: Path) -> None:
    """A person whose stance is narrower than the robot's hips: the soles lie flat all the same."""
    robot = without(tmp_path, (5,))
    clip = put_on_robot(marching(), robot)
    assert measure(clip, robot).sole_roll < 0.03


def test_a_foot_that_cannot_be_levelled_is_told(tmp_path: Path) -> None:
    """An ankle that only rolls: heel and toes come up with the shin, which no pelvis makes good."""
    robot = without(tmp_path, (4,))
    assert any("the pelvis shakes" in fault for fault in measure(put_on_robot(marching(), robot), robot).faults())
