"""Rows whose motions go onto a robot: its joint angles are what is kept, and how good they are is measured."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.robots.body import Robot, read_robot, to_motion
from motionloom.robots.clip import FPS, put_on_robot
from motionloom.robots.figures import measure
from motionloom.robots.files import save_clip

FORMATS = ("npz", "csv", "webdataset")
"""Of the batch's formats those that hold joint angles; the second one holds nothing else."""
Save = Callable[[Path], Any]
"""Writes one robot's joint angles into a file."""


@dataclass(frozen=True, eq=False)
class OnRobot:
    """A robot, and how motions are put on it."""

    robot: Robot
    max_speed: float | None = None
    """Radians per second; None: what the model states."""
    avoid_collisions: bool = False

    @property
    def metre(self) -> float:
        """Of its own that one of the uniform person's becomes: goals are in the robot's metres."""
        return self.robot.metre

    def adapt(self, motion: Motion, fps: float | None) -> tuple[Motion, dict[str, Any], Save]:
        """What the robot does, as motion of its skeleton; its figures; and what writes its joint angles.

        motion: of any humanoid; fps: of the clip (None: 50). Raises `MotionloomError` where the motion is not a
        person's.
        """
        clip = put_on_robot(
            motion, self.robot, fps=fps or FPS, max_speed=self.max_speed, avoid_collisions=self.avoid_collisions
        )
        figures = measure(clip, self.robot, max_speed=self.max_speed)
        own = ("frames", "fps", "fastest")  # the record has the first two anyway
        measures = {name: value for name, value in figures.as_dict().items() if name not in own}
        moving = to_motion(self.robot, clip.qpos, clip.fps)
        return moving, {**measures, "faults": len(figures.faults())}, lambda path: save_clip(clip, self.robot, path)

    def determined(self) -> dict[str, Any]:
        """What of all this a clip depends on, as plain values."""
        robot, model = self.robot, self.robot.model
        arrays = (robot.file.lower, robot.file.upper, robot.file.speed, robot.home, *robot.soles.values())
        shape = (model.body_pos, model.body_quat, model.jnt_pos, model.jnt_axis, model.geom_pos, model.geom_size)
        return {
            "joints": robot.file.joint_names(),
            "parts": {part: [hinge.name for hinge in hinges] for part, hinges in robot.parts.hinges.items()},
            "numbers": [np.asarray(one).tolist() for one in (*arrays, *shape)],
            "max_speed": self.max_speed,
            "avoid_collisions": self.avoid_collisions,
        }


def check_format(kind: str, *, robot: bool) -> None:
    """Refuse joint angles of a robot in a format of poses, and poses in one of joint angles."""
    if robot and kind not in FORMATS:
        raise MotionloomError(f"joint angles of a robot go with --format {', '.join(FORMATS)}; the format is {kind}")
    if kind == "csv" and not robot:
        raise MotionloomError("--format csv is for joint angles; name a robot, or take npz")


def on_robot(path: Path, robot_map: Path | None = None) -> OnRobot:
    """Read a robot's model.

    Raises `MotionloomError` for what is no humanoid robot, and where the extra ``motionloom[robots]`` is not installed.
    """
    try:
        return OnRobot(read_robot(path, robot_map))
    except ModuleNotFoundError as error:
        raise MotionloomError(
            f"a robot needs {error.name}, which is not installed; pip install 'motionloom[robots]'"
        ) from None
