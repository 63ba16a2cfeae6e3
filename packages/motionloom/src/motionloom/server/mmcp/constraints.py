"""The constraints of an MMCP request as goals of the library: frames to seconds, one body to another."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion, ground_pose
from motionloom.core.skeleton import SMPL22
from motionloom.goals.goal import FPS, Goal, merged
from motionloom.goals.paths import root_path
from motionloom.server.mmcp.rigs import Rig

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Clock:
    """Frames of a request, and those at 20 per second that they are sampled as."""

    frames: int
    fps: float

    @property
    def sampled_frames(self) -> int:
        """Frames at 20 per second that reach from the request's first to its last."""
        return max(int(np.ceil((self.frames - 1) / self.fps * FPS - 1e-6)) + 1, 4)

    def frame(self, number: int) -> int:
        """The sampled frame nearest to one of the request's."""
        return min(round(number / self.fps * FPS), self.sampled_frames - 1)

    def resampled(self, motion: Motion) -> Motion:
        """A sampled motion at the request's frames."""
        return motion.at(np.arange(self.frames) / self.fps * FPS, self.fps)


@dataclass(frozen=True, eq=False)
class Keyframe:
    """A pose at a frame, of the uniform person."""

    frame: int
    places: Array
    """(22, 3) metres; in the world if it is ``placed``."""
    mask: NDArray[np.bool_]
    """(22,) joints that are constrained."""
    placed: bool


@dataclass(frozen=True, eq=False)
class Goals:
    """The constraints of a request."""

    goal: Goal
    """Paths, targets and poses with a place."""
    floating: tuple[Keyframe, ...]
    """Poses without a place: they are constrained to where the person is at that time."""
    ground: Array | None
    """(points, 3) x, z and height."""
    notes: tuple[dict[str, str], ...]


def read_constraints(constraints: Sequence[Any], rig: Rig, clock: Clock) -> Goals:
    """Goals of `motionmcp.schemas`; raises `MotionloomError` for what contradicts itself or cannot be reached."""
    size, nearest = rig.size, {joint: name for name, joint in rig.joints().items()}
    goal, floating, ground, notes = Goal.nothing(clock.sampled_frames), [], [], []
    for one in constraints:
        if one.type == "root_path":
            goal = merged(goal, _path(one, size, clock))
        elif one.type == "effector_target":
            goal = merged(goal, _target(one, nearest, size, clock))
            if one.rotations is not None:
                message = f"the rotations of {one.joint} are not asked, its places are"
                notes.append({"code": "rotation_ignored", "severity": "info", "message": message})
        elif one.type == "pose_keyframe":
            pose = _pose(one, rig, size, clock)
            if pose.placed:
                goal = merged(goal, as_goal(pose, clock.sampled_frames))
            else:
                floating.append(pose)
        else:
            ground += [(x / size, z / size, y / size) for x, z, y in one.points]
    return Goals(goal, tuple(floating), np.array(ground) if ground else None, tuple(notes))


def _path(one: Any, size: float, clock: Clock) -> Goal:
    frames, points = _unique([clock.frame(frame) for frame in one.frames], one.positions_xz)
    facing: Any = "along" if len(frames) > 1 else "free"
    if one.heading_radians is not None:
        _, turns = _unique([clock.frame(frame) for frame in one.frames], one.heading_radians)
        facing = np.degrees(np.unwrap(np.asarray(turns, dtype=np.float64))).tolist()
        facing = facing[0] if len(facing) == 1 else facing
    times = [frame / FPS for frame in frames]
    return root_path(np.asarray(points, dtype=np.float64) / size, times, frames=clock.sampled_frames, facing=facing)


def _unique(frames: Sequence[int], values: Sequence[Any]) -> tuple[list[int], list[Any]]:
    """One value for each sampled frame: the last of those that fall on it."""
    last = dict(zip(frames, values, strict=True))
    return sorted(last), [last[frame] for frame in sorted(last)]


def _target(one: Any, nearest: dict[str, str], size: float, clock: Clock) -> Goal:
    if one.joint not in nearest:
        raise MotionloomError(
            f"the joint {one.joint!r} is none of the 22 that can be asked to be somewhere; on this skeleton they are "
            f"{', '.join(sorted(nearest))}"
        )
    joint, goal = SMPL22.index(nearest[one.joint]), Goal.nothing(clock.sampled_frames)
    for frame, place in zip(one.frames, one.positions, strict=True):
        at = clock.frame(frame)
        goal.positions[at, joint], goal.mask[at, joint] = np.asarray(place, dtype=np.float64) / size, True
    if not np.isfinite(goal.positions).all():
        raise MotionloomError(f"the places of {one.joint} must be finite numbers")
    return goal


def _pose(one: Any, rig: Rig, size: float, clock: Clock) -> Keyframe:
    names = list(one.joint_rotations)
    turns = np.array([[one.joint_rotations[name] for name in names]], dtype=np.float64)
    if not np.isfinite(turns).all() or (np.linalg.norm(turns, axis=-1) < 1e-3).any():
        raise MotionloomError("the rotations of a pose must be quaternions that are not zero")
    placed = one.root_position is not None
    root = np.asarray(one.root_position if placed else rig.skeleton.offsets[0], dtype=np.float64)[None]
    person = rig.person(rig.motion(names, turns, root, FPS))
    places = person.positions()[0]
    if placed:  # the uniform person is where the client's root is, in its own size
        high = float(rig.joints()["pelvis"] == rig.skeleton.names[0])  # a root on the ground has no height of its own
        places = places + (root[0] / size - person.root[0]) * np.array([1.0, high, 1.0])
    known = np.ones(len(SMPL22), dtype=bool) if one.fill_mode == "rest" else _known(names, rig)
    return Keyframe(clock.frame(one.frame), places, known, placed)


def _known(names: Sequence[str], rig: Rig) -> NDArray[np.bool_]:
    """(22,) joints whose place follows from the rotations: all joints above them on this skeleton are in ``names``."""
    skeleton, joints = rig.skeleton, rig.joints()
    result = np.zeros(len(SMPL22), dtype=bool)
    for number, name in enumerate(SMPL22.names):
        joint = skeleton.parents[skeleton.index(joints[name])]
        while joint >= 0 and skeleton.names[joint] in names:
            joint = skeleton.parents[joint]
        result[number] = joint < 0
    return result


def as_goal(pose: Keyframe, frames: int) -> Goal:
    """A pose in the world as a goal of so many frames."""
    goal = Goal.nothing(frames)
    goal.positions[pose.frame] = pose.places
    goal.mask[pose.frame] = pose.mask[:, None]
    return goal


def standing_as(pose: Keyframe, person: Array) -> Keyframe:
    """A pose without a place, where and as a sampled person (22, 3) stands."""
    places = ground_pose(person).to_world(ground_pose(pose.places).from_world(pose.places))
    return replace(pose, places=places, placed=True)


def whole_path(goal: Goal) -> Goal:
    """The goal with a place for the pelvis in every frame: between and around those that it has, straight on."""
    frames = np.flatnonzero(goal.mask[:, 0, [0, 2]].all(axis=-1))
    positions, flags = goal.positions.copy(), goal.mask.copy()
    for axis in (0, 2):
        known = goal.positions[frames, 0, axis]
        positions[:, 0, axis] = np.interp(np.arange(len(goal)), frames, known)
        flags[:, 0, axis] = True
    return replace(goal, positions=positions, mask=flags)
