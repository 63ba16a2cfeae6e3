"""What a robot's inverse kinematics aims at: a motion on its skeleton, feet planted, knees never snapped.

The retargeting of characters (`motionloom.retarget`) does the sizes: the way over the ground and the stance by the
length of the legs, arms by their directions and the robot's lengths.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.body.feet import envelope, planted_feet
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.retarget import retarget, to_smpl22
from motionloom.retarget.joint_map import Override
from motionloom.robots.body import Robot, to_mujoco, turns_to_mujoco
from motionloom.robots.feet import plant
from motionloom.robots.joints import SIDES

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
STRAIGHTEST = 0.985
"""Share of a leg's length that hip and ankle are apart at most: nearer to 1 knees snap."""
_ROLL_LEFT = 0.02
"""Radians of an ankle's roll that are left for what the solver makes of it."""
_ASIDE = 0.2
"""Share of a leg's length by which a foot is moved to the side at most."""
_LOWEST = 0.25
"""Share of a leg's length by which the pelvis goes down at most so that both feet reach."""


@dataclass(frozen=True, eq=False)
class Targets:
    """Poses of the robot's skeleton in MuJoCo's world."""

    fps: float
    joints: tuple[str, ...]
    places: Array
    """(frames, joints, 3) metres."""
    turns: Array
    """(frames, joints, 4) world orientations."""
    planted: Flags
    """(frames, 2, 2) whether heel and toes of the left and right foot are held to the ground."""

    def __len__(self) -> int:
        return len(self.places)

    def place(self, joint: str) -> Array:
        """(frames, 3) metres."""
        return self.places[:, self.joints.index(joint)]

    def turn(self, joint: str) -> Array:
        """(frames, 4)."""
        return self.turns[:, self.joints.index(joint)]


def aim(motion: Motion, robot: Robot, *, fps: float, source_map: Override | None = None) -> Targets:
    """What the robot is to do, frame by frame at ``fps``.

    Raises `MotionloomError` where the motion is not that of a person.
    """
    person = motion if motion.skeleton == SMPL22 else to_smpl22(motion, source_map)
    planted = planted_feet(person.resample(fps).positions(), fps)
    if motion.skeleton != robot.skeleton:
        motion = retarget(motion, robot.skeleton, source_map=source_map)
    motion = motion.resample(fps)
    joints = robot.skeleton.names
    targets = Targets(
        fps,
        joints,
        to_mujoco(motion.positions()),
        turns_to_mujoco(motion.world_rotations()),
        planted.reshape(len(planted), 2, 2),
    )
    targets = _stepping(_under_hips(targets, robot), robot)
    down = envelope(lack(targets, robot), round(0.1 * fps))  # so that no leg is stretched out
    return rolled(lowered(targets, down), robot)


def _under_hips(targets: Targets, robot: Robot) -> Targets:
    """With feet that cannot roll moved to the side, for the whole clip, so that their legs stand upright mostly and
    their soles are flat."""
    places = targets.places.copy()
    for number, side in enumerate(SIDES):
        standing = targets.planted[:, number].any(axis=1)
        if robot.rolls[side] != (0.0, 0.0) or not standing.any():
            continue
        j = targets.joints.index(f"{side}_ankle")
        left = rot.rotate(targets.turns[:, j], np.array([0.0, 1.0, 0.0])) * [1.0, 1.0, 0.0]
        left /= np.linalg.norm(left, axis=1, keepdims=True).clip(1e-6)
        aside = ((targets.place(f"{side}_hip") - places[:, j]) * left).sum(axis=1) - _beside(robot.skeleton, side)
        most = _ASIDE * _leg(robot.skeleton, side)
        places[:, j] += float(np.clip(np.median(aside[standing]), -most, most)) * left
    return replace(targets, places=places)


def _stepping(targets: Targets, robot: Robot) -> Targets:
    """With feet that stand where they are planted."""
    places = targets.places.copy()
    turns = targets.turns.copy()
    held = targets.planted.copy()
    for number, side in enumerate(SIDES):
        ankle = targets.joints.index(f"{side}_ankle")
        places[:, ankle], turns[:, ankle], held[:, number] = plant(
            places[:, ankle], turns[:, ankle], targets.planted[:, number], robot.soles[side], targets.fps
        )
    return replace(targets, places=places, turns=turns, planted=held)


def lack(targets: Targets, robot: Robot) -> Array:
    """(frames,) metres by which the pelvis is too high for legs that reach, up to a quarter of their length."""
    skeleton, need = robot.skeleton, np.zeros(len(targets))
    pelvis, around = targets.place("pelvis"), targets.turn("pelvis")
    leg = 1.0
    for side in SIDES:
        leg = _leg(skeleton, side)
        offset = to_mujoco(skeleton.offsets[skeleton.index(f"{side}_hip")])
        hip = pelvis + rot.rotate(around, np.broadcast_to(offset, pelvis.shape))
        line = targets.place(f"{side}_ankle") - hip
        reach = (STRAIGHTEST * leg) ** 2 + _beside(skeleton, side) ** 2
        most = reach - (line[:, :2] ** 2).sum(axis=-1)
        need = np.maximum(need, -line[:, 2] - np.sqrt(most.clip(0)))
    return need.clip(0, _LOWEST * leg)


def _leg(skeleton: Skeleton, side: str) -> float:
    """Metres of thigh and shin in the leg's plane."""
    bones = [skeleton.offsets[skeleton.index(f"{side}_{part}")][1:] for part in ("knee", "ankle")]
    return sum(float(np.linalg.norm(bone)) for bone in bones)


def rolled(targets: Targets, robot: Robot) -> Targets:
    """With soles on their inner edge where a leg stands out to the side further than its ankle rolls."""
    places, turns = targets.places.copy(), targets.turns.copy()
    for side in SIDES:
        low, high = robot.rolls[side]
        j, sole = targets.joints.index(f"{side}_ankle"), robot.soles[side]
        up = rot.rotate(rot.inverse(turns[:, j]), targets.place(f"{side}_hip") - places[:, j])
        beside = _beside(robot.skeleton, side) / np.linalg.norm(up[:, 1:], axis=1)
        lean = np.arctan2(up[:, 1], up[:, 2]) - np.arcsin(beside.clip(-1, 1))  # what the ankle has to roll
        upright = up[:, 2] / np.linalg.norm(up, axis=1)  # of a foot that swings behind, lean says nothing
        over = (lean - lean.clip(min(low + _ROLL_LEFT, 0.0), max(high - _ROLL_LEFT, 0.0))) * (
            (upright - 0.5) / 0.25
        ).clip(0, 1)
        turned = rot.multiply(turns[:, j], rot.rotvec_to_quat(-over[:, None] * np.array([1.0, 0.0, 0.0])))
        edge = np.where(over[:, None] < 0, sole[sole[:, 1].argmin()], sole[sole[:, 1].argmax()]) * [0.0, 1.0, 1.0]
        places[:, j] += rot.rotate(turns[:, j], edge) - rot.rotate(turned, edge)
        turns[:, j] = turned
    return replace(targets, places=places, turns=turns)


def _beside(skeleton: Skeleton, side: str) -> float:
    """Metres to the left of a leg's plane, in which knee and ankle bend, where the axes of the hip meet."""
    return -float(sum(skeleton.offsets[skeleton.index(f"{side}_{part}")][0] for part in ("knee", "ankle")))


def lowered(targets: Targets, down: Array) -> Targets:
    """With all but the legs lower by ``down`` (frames,) metres."""
    places = targets.places.copy()
    legs = [j for j, name in enumerate(targets.joints) if name.endswith(("ankle", "foot", "knee"))]
    upper = [j for j in range(len(targets.joints)) if j not in legs]
    places[:, upper] -= down[:, None, None] * np.array([0.0, 0.0, 1.0])
    return replace(targets, places=places)
