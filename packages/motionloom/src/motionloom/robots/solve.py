"""Joint angles that come nearest to what is aimed at, under the robot's limits: `mink`'s tasks, frame after frame.

Each frame starts from the one before. The quadratic program holds every hinge within its range and within the step
that its speed allows; planted feet outweigh all else; then come feet in the air, pelvis and trunk, hands, elbows.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.robots.body import Robot
from motionloom.robots.engine import load_mujoco, posed
from motionloom.robots.joints import SIDES
from motionloom.robots.targets import Targets

Array = NDArray[np.float64]
STEP = 15.0
"""Radians per second that no hinge exceeds from frame to frame: 0.3 rad at 50 frames per second."""
_CATCHES_UP = np.array([2.0, 4.0])
"""Metres and radians per second by which the root moves and turns faster at most than its targets: where a leg is
too slow for its foot, the foot is late and the body does not jump to it."""
ROUNDS, AVOIDING_ROUNDS, FIRST_ROUNDS = 2, 4, 40
"""How often a frame's program is linearised anew; the first frame starts from the robot's own pose."""
_SHORT = 0.08
"""Radians that a hinge goes in one round where parts are kept apart: further, and distances are no longer linear."""
_NEAR, _APART, _AWAY = 0.15, 0.01, 0.003
"""Metres: from which distance on parts are kept apart, how far, and by how much in a round at least if nearer."""
_DAMPING = 0.02
_NEAR_GROUND, _SINKING = 0.5, 0.0005
"""Metres: ankles above are not looked at, and soles may be so deep."""
_MARGIN = 1e-4
"""Radians inside of its range that a hinge stays, so that no rounding of a file breaks a limit."""


@dataclass(frozen=True)
class Weight:
    """What an error of a metre and of a radian costs."""

    place: float
    turn: float


PLANTED, SWINGING = Weight(300.0, 20.0), Weight(15.0, 2.0)
PELVIS, TRUNK, HEAD = Weight(3.0, 1.0), Weight(0.0, 1.5), Weight(0.0, 0.5)
HAND, ELBOW = Weight(5.0, 0.1), Weight(2.0, 0.0)
LACKING = 0.1
"""What a radian of a foot's turn costs for which its leg has no hinge."""
POSTURE, CALM = 0.02, 0.3
"""What a radian away from the robot's preferred pose costs, and one from the frame before: where a limb's twist hardly
shows, as on a straight arm, it stays."""
COUPLED = 100.0
"""What a radian costs by which a hinge is not where another one moves it."""
_SETTLED = 1e-4


class Solver:
    """Follows targets frame by frame; what it has solved last is where it goes on."""

    def __init__(self, robot: Robot, fps: float, *, speed: Array | None = None, avoid: bool = False) -> None:
        """speed: (hinges,) radians per second that are kept, at most `STEP`; avoid: keep the robot's parts apart."""
        import mink

        self.robot, self.fps = robot, fps
        self.configuration = mink.Configuration(robot.model, q=robot.home)
        self.tasks = _tasks(robot)
        hinges = np.arange(robot.model.nv) >= 6  # the root is free
        self.posture, self.calm = (mink.PostureTask(robot.model, cost=c * hinges) for c in (POSTURE, CALM))
        self.posture.set_target(robot.home)
        self.coupled = [_couplings(robot)] if robot.file.couplings else []
        lower, upper = robot.file.lower + _MARGIN, robot.file.upper - _MARGIN
        step = np.minimum(STEP if speed is None else speed, STEP) / fps
        self.limit = _box(robot, lower, upper, step, most=_SHORT if avoid else np.inf)
        self.limits = [self.limit, _ground(robot), *([_apart(robot)] if avoid else [])]
        self.rounds = AVOIDING_ROUNDS if avoid else ROUNDS
        self.begun = False
        self.goal = np.zeros(7)
        """Where the pelvis was to be, and how turned, in the frame before."""

    def frame(self, targets: Targets, number: int) -> Array:
        """(nq,) the robot's pose at a frame of the targets."""
        import mink

        for joint, task in self.tasks.items():
            place, turn = targets.place(joint)[number], targets.turn(joint)[number]
            task.set_target(mink.SE3(np.concatenate([turn, place])))
        for number_of, side in enumerate(SIDES):
            weight = PLANTED if targets.planted[number, number_of].any() else SWINGING
            self.tasks[f"{side}_ankle"].set_position_cost(weight.place)
            self.tasks[f"{side}_ankle"].set_orientation_cost(_turning(weight.turn, self.robot.turns[side]))
        if not self.begun:
            self._place_root(targets, number)
        self.limit.before = self.configuration.q.copy() if self.begun else None
        goal = np.concatenate([targets.place("pelvis")[number], targets.turn("pelvis")[number]])
        steps = _between(self.goal, goal)
        self.limit.reach = np.abs(steps) + np.repeat(_CATCHES_UP, 3) / self.fps
        self.goal = goal
        if self.begun:
            self.calm.set_target(self.configuration.q)
        for _ in range(self.rounds if self.begun else FIRST_ROUNDS):
            if self._round() < _SETTLED:
                break
        self.begun = True
        return self.configuration.q.copy()

    def _round(self) -> float:
        """One step; gives how far it went, in radians and metres."""
        import mink

        calm = [self.calm] if self.begun else []
        tasks = [*self.tasks.values(), self.posture, *self.coupled, *calm]
        try:
            velocity = mink.solve_ik(self.configuration, tasks, 1.0, "daqp", _DAMPING, limits=self.limits)
        except mink.NoSolutionFound:  # parts that cannot be kept apart within limits
            velocity = mink.solve_ik(self.configuration, tasks, 1.0, "daqp", _DAMPING, limits=self.limits[:2])
        pose = self.configuration.integrate(velocity, 1.0)
        pose[7:] = np.clip(self.robot.file.coupled(pose[7:]), *self.limit.bounds())
        self.configuration.update(pose)
        return float(np.abs(velocity).max())

    def _place_root(self, targets: Targets, number: int) -> None:
        """Begin beside the first target, so that what is far away is not walked to."""
        start = self.robot.home.copy()
        ahead = targets.turn("pelvis")[number]
        start[:2] = targets.place("pelvis")[number][:2]
        heading = 2 * np.arctan2(ahead[3], ahead[0])
        half = np.array([np.cos(heading / 2), 0.0, 0.0, np.sin(heading / 2)])
        start[3:7] = rot.multiply(half, start[3:7])
        self.configuration.update(start)


def solve(
    robot: Robot,
    targets: Targets,
    *,
    avoid: bool = False,
    watched: Sequence[str] = (),
    progress: Callable[[int, int], None] | None = None,
) -> tuple[Array, Array]:
    """(frames, nq) poses of the robot, and where (frames, joints, 3) the ``watched`` joints are in them; the same
    targets give the same numbers, bit for bit."""
    sites = [robot.model.site(robot.site(joint)).id for joint in watched]
    reached = np.empty((len(targets), len(sites), 3))
    solver = Solver(robot, targets.fps, avoid=avoid)
    poses = np.empty((len(targets), robot.model.nq))
    for number in range(len(targets)):
        poses[number] = solver.frame(targets, number)
        reached[number] = solver.configuration.data.site_xpos[sites]
        if progress is not None:
            progress(number + 1, len(targets))
    return poses, reached


def _between(before: Array, after: Array) -> Array:
    """(6,) metres, and radians in the frame of the first, from one place and turn (7,) to another."""
    turned = rot.multiply(rot.inverse(before[3:7]), after[3:7]) if before[3:7].any() else rot.IDENTITY
    return np.concatenate([after[:3] - before[:3], rot.quat_to_rotvec(turned * np.sign(turned[0] or 1.0))])


def _turning(cost: float, shares: Array) -> Array:
    """(3,) cost of a foot's roll, pitch and yaw: little for a turn for which the leg has no hinge, because body and
    other leg would shake for it."""
    return np.where(shares > 0.5, cost, min(cost, LACKING))


def _tasks(robot: Robot) -> dict[str, Any]:
    """mink's task for each joint that is aimed at."""
    import mink

    weights = {"pelvis": PELVIS}
    if robot.has("waist"):
        weights["spine1"] = TRUNK
    if robot.has("neck"):
        weights["neck"] = HEAD
    for side in SIDES:
        turn = HAND.turn if robot.has(f"{side}_wrist") else 0.0
        weights |= {f"{side}_ankle": SWINGING, f"{side}_elbow": ELBOW, f"{side}_wrist": Weight(HAND.place, turn)}
    return {
        joint: mink.FrameTask(
            robot.site(joint), "site", position_cost=weight.place, orientation_cost=weight.turn, lm_damping=1e-3
        )
        for joint, weight in weights.items()
    }


def _box(robot: Robot, lower: Array, upper: Array, step: Array | float, *, most: float) -> Any:
    """mink's limit of the hinges' places and of their and the root's steps since the frame before, in one."""
    import mink

    class Box(mink.Limit):
        before: Array | None = None
        reach = np.zeros(6)
        matrix = np.vstack([np.eye(robot.model.nv), -np.eye(robot.model.nv)])

        def bounds(self) -> tuple[Array, Array]:
            """Of the hinges' places in this frame."""
            if self.before is None:
                return lower, upper
            return np.maximum(lower, self.before[7:] - step), np.minimum(upper, self.before[7:] + step)

        def compute_qp_inequalities(self, configuration: Any, dt: float) -> Any:
            low, high = self.bounds()
            now, root = configuration.q[7:], np.full(6, np.inf)
            gone = np.zeros(6)
            if self.before is not None:
                root, gone = self.reach, _between(self.before[:7], configuration.q[:7])
            room = np.concatenate([root - gone, high - now, root + gone, now - low]).clip(0)
            hinges = np.tile(np.arange(len(now) + 6) >= 6, 2)
            room[hinges] = room[hinges].clip(0, most)
            known = np.isfinite(room)
            return mink.Constraint(self.matrix[known], room[known])

    return Box()


def _couplings(robot: Robot) -> Any:
    """mink's task of hinges that others move."""
    import mink

    couplings, columns = robot.file.couplings, robot.model.nv

    class Couplings(mink.Task):
        def compute_error(self, configuration: Any) -> Array:
            angles = configuration.q[7:]
            return np.array([angles[one.hinge] - one.angle(angles) for one in couplings])

        def compute_jacobian(self, configuration: Any) -> Array:
            jacobian = np.zeros((len(couplings), columns))
            for row, one in zip(jacobian, couplings):
                row[6 + one.leader] = -one.slope(configuration.q[7:])
                row[6 + one.hinge] += 1.0
            return jacobian

    return Couplings(cost=np.full(len(couplings), COUPLED))


def _ground(robot: Robot) -> Any:
    """mink's limit of soles that are not to go into the ground."""
    import mink

    mujoco = load_mujoco()

    sites = [robot.model.site(robot.site(f"{side}_ankle")).id for side in SIDES]
    bodies = [int(robot.model.site_bodyid[site]) for site in sites]

    class Ground(mink.Limit):
        jacobian = np.empty((3, robot.model.nv))

        def compute_qp_inequalities(self, configuration: Any, dt: float) -> Any:
            rows, room = [], []
            data = configuration.data
            for site, body, side in zip(sites, bodies, SIDES):
                turn, place = data.site_xmat[site].reshape(3, 3), data.site_xpos[site]
                if place[2] > _NEAR_GROUND:
                    continue
                for corner in place + robot.soles[side] @ turn.T:
                    mujoco.mj_jac(robot.model, data, self.jacobian, None, corner, body)
                    rows.append(-self.jacobian[2])
                    room.append(corner[2] + _SINKING)
            if rows:
                return mink.Constraint(np.array(rows), np.array(room))
            return mink.Constraint()

    return Ground()


def pairs_apart(robot: Robot) -> Iterator[tuple[int, int]]:
    """Pairs of geoms of the robot that may touch and do not where it stands."""
    mujoco = load_mujoco()

    model, data = robot.model, posed(robot.model, robot.home)
    own = [
        g for g in range(model.ngeom) if model.geom_bodyid[g] and (model.geom_contype[g] or model.geom_conaffinity[g])
    ]
    nearest = np.zeros(6)
    for i, one in enumerate(own):
        for other in own[i + 1 :]:
            welds = [int(model.body_weldid[model.geom_bodyid[g]]) for g in (one, other)]
            above = [int(model.body_weldid[model.body_parentid[b]]) for b in welds]
            meet = model.geom_contype[one] & model.geom_conaffinity[other] | (
                model.geom_contype[other] & model.geom_conaffinity[one]
            )
            if not meet or welds[0] == welds[1] or welds[0] in above[1:] or welds[1] in above[:1]:
                continue
            if mujoco.mj_geomDistance(model, data, one, other, 0.05, nearest) > 0.005:
                yield one, other


def _apart(robot: Robot) -> Any:
    import mink

    return mink.CollisionAvoidanceLimit(
        robot.model,
        geom_pairs=[([one], [other]) for one, other in pairs_apart(robot)],
        minimum_distance_from_collisions=_APART,
        collision_detection_distance=_NEAR,
        bound_relaxation=-_AWAY,
    )
