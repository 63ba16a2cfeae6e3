"""A robot that follows poses as they come, of somebody live: nothing is known of what is next, nothing is taken back.

What `targets` and `feet` do for a whole clip is done here with what was: a foot is planted when it is low and slow, its
sole levels and stays, and the correction fades when it leaves. Speeds are kept by lagging behind.
"""

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.blending import smoothstep
from motionloom.core.motion import Motion
from motionloom.robots.body import Robot, to_mujoco, turns_to_mujoco
from motionloom.robots.clip import check_settings
from motionloom.robots.feet import EASE, ROLLING, angles, heel_and_toes, lowest, orient
from motionloom.robots.joints import SIDES
from motionloom.robots.solve import Solver
from motionloom.robots.targets import Targets, lack, lowered, rolled

Array = NDArray[np.float64]
_BEGINS, _ENDS = (0.03, 0.4), (0.05, 0.8)
"""Metres and metres per second: heel or toes that are lower and slower come to stand, and go on standing."""
_STRAYS = (0.1, 0.5)
"""Metres and radians from a planted foot to its goal, from which on it lets go."""
_DOWN = 0.6
"""Metres per second at which the pelvis comes down, and goes up, so that legs reach."""
_PLANTED = 0.004
"""Metres: a sole that is lower counts as planted."""


class Follower:
    """One robot and what it did last."""

    def __init__(
        self, robot: Robot, fps: float, *, max_speed: float | None = None, avoid_collisions: bool = False
    ) -> None:
        """fps: rate of the poses. max_speed: radians per second that no hinge exceeds (None: as the model states).

        Raises `MotionloomError` for a rate or a speed that cannot be.
        """
        check_settings(fps, max_speed)
        self.robot, self.fps = robot, fps
        self._solver = Solver(robot, fps, speed=robot.file.speeds(max_speed), avoid=avoid_collisions)
        self._feet = [_Foot(robot.soles[side], fps) for side in SIDES]
        self._down = 0.0
        self.planted = np.zeros((2, 2), dtype=bool)
        """(2, 2) whether heel and toes of the left and right foot are held to the ground, in the last pose."""

    def pose(self, motion: Motion) -> Array:
        """(7 + hinges,) the robot's pose, as `Clip.qpos` has it, for the first frame of a motion of its skeleton."""
        robot = self.robot
        places = to_mujoco(motion.positions()[:1])
        turns = turns_to_mujoco(motion.world_rotations()[:1])
        for number, (side, foot) in enumerate(zip(SIDES, self._feet, strict=True)):
            j = robot.skeleton.index(f"{side}_ankle")
            places[0, j], turns[0, j], self.planted[number] = foot.step(places[0, j], turns[0, j])
        targets = Targets(self.fps, robot.skeleton.names, places, turns, self.planted[None])
        need, most = float(lack(targets, robot)[0]), _DOWN / self.fps
        self._down = float(np.clip(need, self._down - most, self._down + most))
        return self._solver.frame(rolled(lowered(targets, np.array([self._down])), robot), 0)


class _Foot:
    """Where one foot goes: its goal, or its stance, and what is left of the way from one to the other."""

    def __init__(self, sole: Array, fps: float) -> None:
        self.sole, self.fps = sole, fps
        self.edges = heel_and_toes(sole)
        self.before: Array | None = None
        """(2, 3) where heel and toes were to be in the frame before."""
        self.stance: tuple[float, Array] | None = None
        """Heading, and the ankle's place, where the foot stands flat."""
        self.left, self.turn_left, self.since = np.zeros(3), np.zeros(3), 0

    def step(self, place: Array, turn: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Place (3,) and turn (4,) of the ankle in a frame, and which of heel and toes are planted."""
        on_ground, goal = self._is_on_ground(place, turn), (place, turn)
        if on_ground != (self.stance is not None):
            now = self._faded(*self._sole_pose(*goal))
            self.stance = self._stance_of(*now) if on_ground else None
            to = self._sole_pose(*goal)
            self.left = now[0] - to[0]
            self.turn_left = rot.quat_to_rotvec(rot.multiply(rot.inverse(to[1]), now[1]))
            self.since = 0
        place, turn = self._faded(*self._sole_pose(*goal))
        self.since += 1
        place = place + np.array([0.0, 0.0, max(0.0, -self._low(place, turn))])
        pitch = float(angles(turn[None])[1][0])
        on = self.stance is not None and self._low(place, turn) < _PLANTED
        return place, turn, np.array([pitch <= 1e-3, pitch >= -1e-3]) & on

    def _low(self, place: Array, turn: Array) -> float:
        return float(lowest(place[None], turn[None], self.sole)[0])

    def _is_on_ground(self, place: Array, turn: Array) -> bool:
        edges = place + rot.rotate(turn[None], self.edges)
        moved = np.zeros(2) if self.before is None else np.linalg.norm(edges - self.before, axis=-1) * self.fps
        self.before = edges
        height, speed = _BEGINS if self.stance is None else _ENDS
        if self.stance is not None:
            away = float(np.linalg.norm((self._held(turn)[0] - place)[:2]))
            turned = float(angles(turn[None])[0][0]) - self.stance[0]
            if away > _STRAYS[0] or abs(np.angle(np.exp(1j * turned))) > _STRAYS[1]:
                return False
        return bool(((edges[:, 2] < height) & (moved < speed)).any())

    def _sole_pose(self, place: Array, turn: Array) -> tuple[Array, Array]:
        return (place, turn) if self.stance is None else self._held(turn)

    def _held(self, turn: Array) -> tuple[Array, Array]:
        """The ankle of a foot that stands and rolls over its heel or its toes as far as its goal does."""
        assert self.stance is not None
        heading, ankle = self.stance
        pitch = _rolled(turn)
        pivot = self.edges[0 if pitch < 0 else 1]
        turned = orient(heading, np.array([pitch]))[0]
        flat = orient(heading, np.zeros(1))[0]
        return ankle + rot.rotate(flat, pivot) - rot.rotate(turned, pivot), turned

    def _stance_of(self, place: Array, turn: Array) -> tuple[float, Array]:
        """The stance that leaves heel or toes of a foot over the place where they are."""
        heading = float(angles(turn[None])[0][0])
        pivot = self.edges[0 if _rolled(turn) < 0 else 1]
        flat = orient(heading, np.zeros(1))[0]
        ankle = place + rot.rotate(turn, pivot) - rot.rotate(flat, pivot)
        ankle[2] = -float(self.sole[:, 2].min())
        return heading, ankle

    def _faded(self, place: Array, turn: Array) -> tuple[Array, Array]:
        """With what is left of the way from what it did before."""
        left = 1.0 - float(smoothstep(np.array(self.since / (EASE * self.fps))))
        return place + left * self.left, rot.multiply(turn, rot.rotvec_to_quat(left * self.turn_left))


def _rolled(turn: Array) -> float:
    """Radians, toes down, by which a foot that stands rolls; small ones are flat."""
    pitch = float(angles(turn[None])[1][0])
    return float(np.sign(pitch)) * max(0.0, abs(pitch) - ROLLING)
