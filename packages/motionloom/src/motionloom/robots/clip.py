"""A robot's clip: poses over time, which parts of its soles are planted, and what was aimed at."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.body.feet import envelope
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.retarget.joint_map import Override
from motionloom.robots.body import Robot
from motionloom.robots.engine import load_mujoco
from motionloom.robots.joints import SIDES
from motionloom.robots.solve import solve
from motionloom.robots.targets import aim

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
FPS = 50.0
EFFECTORS = tuple(f"{side}_{part}" for part in ("wrist", "ankle") for side in SIDES)


@dataclass(frozen=True, eq=False)
class Clip:
    """Poses of a robot at a constant rate."""

    fps: float
    qpos: Array
    """(frames, 7 + hinges): root place (3), root quaternion (w, x, y, z), radians of the hinges in the model's
    order."""
    planted: Flags
    """(frames, 2, 2) whether heel and toes of the left and right foot are on the ground."""
    errors: Array | None = None
    """(frames, 4) metres from where `EFFECTORS` were to be; None where nobody knows."""
    aims: Array | None = None
    """(frames, 7) metres and quaternion (w, x, y, z) of where the pelvis's site was to be; None where nobody knows."""
    slowed: float = 0.0
    """Seconds that it is longer than its motion, so that hinges keep their speeds."""

    def __len__(self) -> int:
        return len(self.qpos)

    def frames(self, start: int, stop: int) -> "Clip":
        """Frames ``start`` to ``stop`` (half-open)."""
        some = slice(start, stop)
        errors = None if self.errors is None else self.errors[some]
        aims = None if self.aims is None else self.aims[some]
        return replace(self, qpos=self.qpos[some], planted=self.planted[some], errors=errors, aims=aims)


def put_on_robot(
    motion: Motion,
    robot: Robot,
    *,
    fps: float = FPS,
    max_speed: float | None = None,
    avoid_collisions: bool = False,
    source_map: Override | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Clip:
    """A person's motion as a robot does it.

    Args:
        motion: Of any humanoid skeleton.
        robot: See `read_robot`.
        fps: Frames per second of the clip.
        max_speed: Radians per second that no hinge exceeds; the clip is slowed down where one would. None: the speeds
            of the model's file, where it states any.
        avoid_collisions: Keep the robot's geoms apart, where that is possible.
        source_map: Which joints of the motion's skeleton are which.
        progress: Called with the frames that are done, and with all.

    Raises:
        MotionloomError: The motion is not a person's, or a setting cannot be.
    """
    check_settings(fps, max_speed)
    targets = aim(motion, robot, fps=fps, source_map=source_map)
    poses, reached = solve(robot, targets, avoid=avoid_collisions, watched=EFFECTORS, progress=progress)
    rows = [targets.joints.index(joint) for joint in EFFECTORS]
    errors = np.linalg.norm(reached - targets.places[:, rows], axis=-1)
    aims = np.concatenate([targets.place("pelvis"), targets.turn("pelvis")], axis=1)
    clip = Clip(fps, poses, targets.planted, errors, aims)
    return _paced(clip, robot.file.speeds(max_speed))


def check_settings(fps: float, max_speed: float | None) -> None:
    """Refuse a rate or a speed that cannot be."""
    if not 5 <= fps <= 1000:
        raise MotionloomError(f"a robot's clip has 5 to 1000 frames per second; got {fps:g}")
    if max_speed is not None and not 0.1 <= max_speed <= 1000:
        raise MotionloomError(f"--max-speed must be 0.1 to 1000 radians per second; got {max_speed:g}")


def _paced(clip: Clip, speeds: Array) -> Clip:
    """The clip slowed down where a hinge would be faster than ``speeds`` (hinges,) rad/s, smoothly."""
    if len(clip) < 2:
        return clip
    need = (np.abs(np.diff(clip.qpos[:, 7:], axis=0)) * clip.fps / speeds).max(axis=1)
    if need.max() <= 1:
        return clip
    slower = 1 + envelope((need * (1 + 1e-9) - 1).clip(0), round(0.1 * clip.fps))
    times = np.concatenate([[0.0], np.cumsum(slower)])
    count = int(np.floor(times[-1] + 1e-9)) + 1
    at = np.interp(np.arange(count), times, np.arange(len(clip)))
    return replace(sampled(clip, at), slowed=(count - len(clip)) / clip.fps)


def sampled(clip: Clip, at: Array, fps: float | None = None) -> Clip:
    """The clip at fractional frame numbers ``at``."""
    low = np.clip(np.floor(at).astype(int), 0, len(clip) - 1)
    high = np.minimum(low + 1, len(clip) - 1)
    share = (at - low)[:, None]

    def between(poses: Array) -> Array:
        result = poses[low] * (1 - share) + poses[high] * share
        result[:, 3:7] = rot.slerp(poses[low, 3:7], poses[high, 3:7], share[:, 0])
        return result

    nearest = np.where(share[:, 0] < 0.5, low, high)
    return Clip(
        clip.fps if fps is None else fps,
        between(clip.qpos),
        clip.planted[nearest],
        None if clip.errors is None else clip.errors[nearest],
        None if clip.aims is None else between(clip.aims),
        clip.slowed,
    )


def velocities(robot: Robot, clip: Clip) -> Array:
    """(frames, 6 + hinges) MuJoCo's ``qvel``: metres and radians per second, the root's turn in its own frame."""
    mujoco = load_mujoco()

    qvel = np.zeros((len(clip), robot.model.nv))
    for frame in range(len(clip)):
        before, after = max(frame - 1, 0), min(frame + 1, len(clip) - 1)
        if after > before:
            span = (after - before) / clip.fps
            mujoco.mj_differentiatePos(robot.model, qvel[frame], span, clip.qpos[before], clip.qpos[after])
    return qvel
