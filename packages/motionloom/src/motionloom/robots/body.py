"""A robot read as a person: a `Skeleton` of its proportions, and how its bodies lie in that skeleton's joints.

The skeleton has the joints of a person, each where the axes of the robot's hinges meet; every frame of it is a site in
MuJoCo's model, so that poses of the skeleton are what the robot's inverse kinematics aims at, and poses of the robot
are motion of the skeleton.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.retarget.anatomy import read_body
from motionloom.robots.engine import load_mujoco, posed
from motionloom.robots.joints import LEG, SIDES, Parts, find_parts, limb_points
from motionloom.robots.model import Hinge, Model, check_limits, read_model

Array = NDArray[np.float64]
LEGS_M = (0.08, 1.6)
"""Metres of thigh and shin of a robot; outside of it a model is in another unit."""
_BENT = 0.25
"""Radians by which knees are bent in the pose that a robot prefers, where its file has none of its own."""
_STRAIGHT = 0.995
"""Share of its greatest length from which on a leg counts as straight: at 0.2 rad in the knee."""
_REACHES = 0.05
"""Share of the largest: singular values of a leg's Jacobian below it count as none."""
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
_KEYS = ("home", "stand", "standing", "default")


@dataclass(frozen=True, eq=False)
class Robot:
    """A humanoid robot to which motion can be retargeted."""

    file: Model
    parts: Parts
    model: Any
    """`mujoco.MjModel` with a site for each joint of the skeleton."""
    skeleton: Skeleton
    """+Y up, facing +Z, standing on y = 0: names are those of the uniform person's joints."""
    home: Array
    """(nq,) the pose that the robot prefers: it stands, knees bent, a little at least."""
    soles: dict[str, Array]
    """Side to (corners, 3) metres in the frame of the ankle's site, +Z up: heels first, then toes, at rest on one
    plane."""
    rolls: dict[str, tuple[float, float]]
    """Side to the radians, left side up, that a foot rolls from where it is level at rest; 0 and 0 without such a
    hinge: that foot rolls with its leg."""
    turns: dict[str, Array]
    """Side to the shares (3,), of roll, pitch and yaw in the frame of the ankle's site, in which the leg's hinges turn
    a foot that stays in its place: about 0 where a hinge is missing."""
    notes: tuple[str, ...]
    map: Path | None = None
    """Which joint is which, as a user said."""

    @property
    def name(self) -> str:
        """What the model calls itself."""
        return self.file.name

    @property
    def metre(self) -> float:
        """Metres of the robot's that one of the uniform person's becomes: the lengths of their legs."""
        return read_body(self.skeleton).leg / read_body(SMPL22).leg

    def remarks(self) -> tuple[str, ...]:
        """What a user should know: which hinges are which, and what the file lacks."""
        return (*self.notes, f"{self.name}: {self.parts.summary()} (--robot-map says otherwise)")

    def site(self, joint: str) -> str:
        """The name of a joint's site in the model."""
        return f"motionloom {joint}"

    def has(self, part: str) -> bool:
        """Whether the robot has hinges for a part."""
        return part in self.parts.hinges


def read_robot(path: Path | str, override: Path | None = None, *, meshes: bool = False) -> Robot:
    """Read a robot's model and find its body. ``override``: a map of joints (`find_parts`).

    Raises `MotionloomError` for what is no humanoid robot in metres, with limits, standing in its own pose.
    """
    file = read_model(path, meshes=meshes)
    parts = find_parts(file, override)
    check_limits(file, {hinge.joint for hinges in parts.hinges.values() for hinge in hinges})
    return replace(_Reading(file, parts).robot(), map=override)


def to_mujoco(points: np.ndarray) -> Array:
    """Points (..., 3) with +Y up, facing +Z, as MuJoCo has them: +Z up, facing +X."""
    return np.asarray(points, dtype=np.float64)[..., [2, 0, 1]]


def from_mujoco(points: np.ndarray) -> Array:
    """The inverse of `to_mujoco`."""
    return np.asarray(points, dtype=np.float64)[..., [1, 2, 0]]


def turns_to_mujoco(quaternions: np.ndarray) -> Array:
    """Quaternions (..., 4), (w, x, y, z), likewise."""
    return np.asarray(quaternions, dtype=np.float64)[..., [0, 3, 1, 2]]


def turns_from_mujoco(quaternions: np.ndarray) -> Array:
    """The inverse of `turns_to_mujoco`."""
    return np.asarray(quaternions, dtype=np.float64)[..., [0, 2, 3, 1]]


class _Reading:
    """Measures a robot in the pose in which a skeleton is read: facing +X, limbs as straight as they get."""

    def __init__(self, file: Model, parts: Parts) -> None:
        mujoco = load_mujoco()

        self.file, self.parts, self.data = file, parts, mujoco.MjData(file.model)
        self.first = {part: hinges[0] for part, hinges in parts.hinges.items()}
        self.tips = {side: self._tip(parts.hinges[f"{side}_elbow"][-1].body) for side in SIDES}
        self.last = {part: hinges[-1] for part, hinges in parts.hinges.items()}
        self.qpos = np.array(file.model.qpos0)
        self.qpos[7:] = np.clip(self.qpos[7:], file.lower, file.upper)
        self._pose()
        self._face_forward()
        for side in SIDES:
            self._straighten(side)

    def robot(self) -> Robot:
        places, bodies = self._places()
        soles, notes = self._soles(bodies, places)
        floor = min(float(corners[:, 2].min()) for corners in soles.values())
        places = {joint: place - [0, 0, floor] for joint, place in places.items()}
        soles = {side: corners - [0, 0, floor] for side, corners in soles.items()}
        self.qpos[2] -= floor
        self._pose()
        self._check_size(places)
        for side, corners in soles.items():
            front = corners[corners[:, 0] > corners[:, 0].mean()].mean(axis=0)
            ankle = places[f"{side}_ankle"]
            toe = ankle + 0.8 * (front - ankle)
            places[f"{side}_foot"] = np.array([toe[0], ankle[1], front[2]])
        soles = {side: soles[side] - places[f"{side}_ankle"] for side in SIDES}
        model, skeleton = self._with_sites(places, bodies), _skeleton(places, soles)
        notes = (*self.file.notes, *notes)
        home = self._home()
        turns = {side: self._turns(model, home, side) for side in SIDES}
        return Robot(self.file, self.parts, model, skeleton, home, soles, self._rolls(), turns, notes)

    def _pose(self) -> None:
        mujoco = load_mujoco()

        self.data.qpos = self.qpos
        mujoco.mj_kinematics(self.file.model, self.data)

    def _centre(self, part: str) -> Array:
        """(3,) metres: where the axes of a part's hinges come nearest to each other."""
        hinges = self.parts.hinges[part]
        anchors = np.array([self.data.xanchor[h.joint] for h in hinges])
        left, right = 1e-3 * len(hinges) * np.eye(3), 1e-3 * anchors.sum(axis=0)
        for hinge, anchor in zip(hinges, anchors):
            axis = self.data.xaxis[hinge.joint]
            across = np.eye(3) - np.outer(axis, axis)
            left, right = left + across, right + across @ anchor
        return np.linalg.solve(left, right)

    def _face_forward(self) -> None:
        """Turn the root so that the robot's left is +Y; refuse one that does not stand."""
        hips = {side: self._centre(f"{side}_hip") for side in SIDES}
        left = hips["left"] - hips["right"]
        down = np.mean([hips[side] - self._centre(f"{side}_ankle") for side in SIDES], axis=0)
        if np.linalg.norm(left[:2]) < 1e-3 or float(down[2]) < 0.7 * float(np.linalg.norm(down)):
            raise MotionloomError(
                f"{self.file.path}: the robot does not stand upright, +Z up, in the pose of its file; turn its root"
            )
        turn = rot.rotvec_to_quat(np.array([0.0, 0.0, np.pi / 2 - np.arctan2(left[1], left[0])]))
        self.qpos[3:7] = rot.normalize(rot.multiply(turn, self.qpos[3:7]))
        self.qpos[:2] = 0
        self._pose()

    def _straighten(self, side: str) -> None:
        """Set the elbow's hinges so that forearm and upper arm are in one line, as far as they go."""
        for hinge in self.parts.hinges[f"{side}_elbow"][::-1]:
            row = self.file.hinges.index(hinge)
            angles = np.linspace(self.file.lower[row], self.file.upper[row], 181)
            before, straight = self.qpos[7 + row], []
            for angle in angles:
                self.qpos[7 + row] = angle
                self._pose()
                elbow = self._centre(f"{side}_elbow")
                upper = elbow - self._centre(f"{side}_shoulder")
                fore = self._hand(side) - elbow
                straight.append(float(upper @ fore) / max(float(np.linalg.norm(upper) * np.linalg.norm(fore)), 1e-9))
            best = int(np.argmax(straight))
            near = int(np.argmin(np.abs(angles - before)))
            self.qpos[7 + row] = angles[best] if straight[best] > straight[near] + 1e-3 else before
        self._pose()

    def _hand(self, side: str) -> Array:
        """(3,) where the wrist is: where its axes meet, else the end of what is fixed to the forearm."""
        if f"{side}_wrist" in self.parts.hinges:
            return self._centre(f"{side}_wrist")
        body = self.parts.hinges[f"{side}_elbow"][-1].body
        return self.data.xpos[body] + rot.rotate(np.array(self.data.xquat[body]), self.tips[side])

    def _tip(self, body: int) -> Array:
        """(3,) in a body's frame: the farthest origin of the bodies fixed to it, else the farthest point of its own."""
        model, data = self.file.model, posed(self.file.model)
        fixed = data.xpos[model.body_weldid == body]
        points = fixed if len(fixed) > 1 else limb_points(self.file, body)
        away = points - data.xpos[body]
        return rot.rotate(rot.inverse(np.array(data.xquat[body])), away[int(np.linalg.norm(away, axis=-1).argmax())])

    def _places(self) -> tuple[dict[str, Array], dict[str, int]]:
        """Where the skeleton's joints are, and which body each one turns."""
        has = self.parts.hinges
        pelvis = self._shared([self.first[f"{side}_hip"] for side in SIDES])
        torso = self._shared([self.first[f"{side}_shoulder"] for side in SIDES])
        places, bodies = {}, {"pelvis": pelvis}
        for side in SIDES:
            for part in (f"{side}_{name}" for name in (*LEG, "shoulder", "elbow")):
                places[part], bodies[part] = self._centre(part), self.last[part].body
            places[f"{side}_wrist"] = self._hand(side)
            bodies[f"{side}_wrist"] = self.last.get(f"{side}_wrist", self.last[f"{side}_elbow"]).body
        hips = (places["left_hip"] + places["right_hip"]) / 2
        shoulders = (places["left_shoulder"] + places["right_shoulder"]) / 2
        trunk = shoulders - hips
        places["pelvis"] = hips + 0.12 * trunk
        if "waist" in has:
            waist = self._centre("waist")
            share = np.clip(float((waist - hips) @ trunk) / float(trunk @ trunk), 0.15, 0.6)
            places["spine1"] = np.array([waist[0], hips[1], (hips + share * trunk)[2]])
            bodies["spine1"] = torso
        places["neck"] = shoulders + 0.15 * trunk
        places["head"] = shoulders + 0.35 * trunk
        bodies["neck"] = bodies["head"] = self.last["neck"].body if "neck" in has else torso
        if "neck" in has:
            places["neck"] = self._centre("neck")
            places["head"] = places["neck"] + 0.2 * trunk
        return places, bodies

    def _shared(self, hinges: list[Hinge]) -> int:
        """The lowest body that all of these hang on."""
        lines = [self.file.above(hinge.parent) for hinge in hinges]
        return next(body for body in lines[0] if all(body in line for line in lines))

    def _soles(self, bodies: dict[str, int], places: dict[str, Array]) -> tuple[dict[str, Array], list[str]]:
        """Side to (4, 3) metres in the world: corners of the sole, heels first."""
        soles, notes = {}, []
        leg = float(np.linalg.norm(places["left_hip"] - places["left_ankle"]))
        for side in SIDES:
            ankle = places[f"{side}_ankle"]
            points = self._foot_points(bodies[f"{side}_ankle"])
            low = points[points[:, 2] < points[:, 2].min() + 0.02 * leg] if len(points) else points
            if len(low) < 3 or np.ptp(low[:, 0]) < 0.05 * leg:
                low = ankle + leg * np.array([[-0.08, -0.05, -0.07], [0.2, 0.05, -0.07]])
                notes = [f"{self.file.path} has no geoms under its ankles; soles are taken to be as on other robots"]
            (back, right) = low[:, :2].min(axis=0)
            (front, left) = low[:, :2].max(axis=0)
            ground = float(low[:, 2].min())
            soles[side] = np.array([[x, y, ground] for x in (back, front) for y in (right, left)])
        return soles, notes

    def _foot_points(self, body: int) -> Array:
        """(points, 3) metres in the world: corners of the geoms of a foot."""
        mujoco = load_mujoco()

        model, data, points = self.file.model, self.data, []
        for geom in range(model.ngeom):
            if int(model.body_weldid[model.geom_bodyid[geom]]) != body:
                continue
            size, kind = model.geom_size[geom], model.geom_type[geom]
            turn, place = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
            if kind == mujoco.mjtGeom.mjGEOM_MESH:
                mesh = int(model.geom_dataid[geom])
                start = int(model.mesh_vertadr[mesh])
                local = model.mesh_vert[start : start + int(model.mesh_vertnum[mesh])]
                points.append(place + local @ turn.T)
                continue
            if kind == mujoco.mjtGeom.mjGEOM_BOX:
                points.append(place + (_CORNERS * size[:3]) @ turn.T)
                continue
            half = np.array([0, 0, size[1] if kind != mujoco.mjtGeom.mjGEOM_SPHERE else 0.0])
            ends = np.array([half, -half]) @ turn.T + place
            points.append(ends - [0, 0, float(size[0])])
        return np.concatenate(points) if points else np.zeros((0, 3))

    def _rolls(self) -> dict[str, tuple[float, float]]:
        rolls: dict[str, tuple[float, float]] = dict.fromkeys(SIDES, (0.0, 0.0))
        for side in SIDES:
            for hinge in self.parts.hinges[f"{side}_ankle"]:
                ahead = float(self.data.xaxis[hinge.joint][0])
                row = self.file.hinges.index(hinge)
                if abs(ahead) > 0.7:
                    limits = np.array([self.file.lower[row], self.file.upper[row]])
                    ends = np.sign(ahead) * (limits - self.qpos[7 + row])
                    rolls[side] = (min(float(ends.min()), 0.0), max(float(ends.max()), 0.0))
        return rolls

    def _turns(self, model: Any, home: Array, side: str) -> Array:
        """(3,) how far a foot is turned about its axes by hinges that leave it in its place."""
        mujoco = load_mujoco()

        data, jacobian = posed(model, home), np.empty((6, model.nv))
        mujoco.mj_comPos(model, data)
        mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], model.site(f"motionloom {side}_ankle").id)
        for one in self.file.couplings:
            follower = jacobian[:, 6 + one.hinge].copy()
            jacobian[:, 6 + one.hinge] = 0
            jacobian[:, 6 + one.leader] += one.slope(home[7:]) * follower
        leg = [int(model.jnt_dofadr[h.joint]) for part in LEG for h in self.parts.hinges[f"{side}_{part}"]]
        place, turn = jacobian[:3, leg], jacobian[3:, leg]
        _, sizes, ways = np.linalg.svd(place)
        free = ways[int((sizes > _REACHES * sizes[0]).sum()) :].T
        axes, sizes, _ = np.linalg.svd(turn @ free, full_matrices=False)
        about = data.site(f"motionloom {side}_ankle").xmat.reshape(3, 3).T @ axes[:, sizes > _REACHES]
        return (about**2).sum(axis=1)

    def _check_size(self, places: dict[str, Array]) -> None:
        leg = sum(
            float(np.linalg.norm(places[f"left_{a}"] - places[f"left_{b}"]))
            for a, b in (("hip", "knee"), ("knee", "ankle"))
        )
        if not LEGS_M[0] < leg < LEGS_M[1]:
            raise MotionloomError(
                f"the legs of the robot in {self.file.path} would be {leg:.3g} m long; a robot's model is in metres, "
                "so scale it (1 inch is 0.0254 m)"
            )

    def _with_sites(self, places: dict[str, Array], bodies: dict[str, int]) -> Any:
        """The model with a site for each joint of the skeleton, turned as the world is at rest."""
        own = {body.id: body for body in self.file.spec.bodies}
        for joint, body in bodies.items():
            turn = rot.inverse(np.array(self.data.xquat[body]))
            place = rot.rotate(turn, places[joint] - self.data.xpos[body])
            own[body].add_site(name=f"motionloom {joint}", pos=place, quat=turn)
        return self.file.spec.compile()

    def _home(self) -> Array:
        """The file's standing pose, else this one, with legs that are straight in it bent a little."""
        model, home = self.file.model, self.qpos.copy()
        home[7:] = model.qpos0[7:]
        keys = [key for key in range(model.nkey) if model.key(key).name.lower() in _KEYS]
        if keys:
            home[7:] = np.clip(model.key_qpos[keys[0]][7:], self.file.lower, self.file.upper)
            home[:3] = model.key_qpos[keys[0]][:3]
        for side in SIDES:
            if keys and not self._is_straight(home, side):
                continue
            for part, share in (("hip", -0.5), ("knee", 1.0), ("ankle", -0.5)):
                hinge = max(self.parts.hinges[f"{side}_{part}"], key=lambda h: abs(float(self.data.xaxis[h.joint][1])))
                row = self.file.hinges.index(hinge)
                sign = float(np.sign(self.data.xaxis[hinge.joint][1])) or 1.0
                home[7 + row] += sign * share * _BENT
        home[7:] = self.file.coupled(np.clip(home[7:], self.file.lower, self.file.upper))
        return home

    def _is_straight(self, home: Array, side: str) -> bool:
        """Whether hip and ankle are nearly as far apart in a pose as the knee lets them be."""
        joints = [self.parts.hinges[f"{side}_{part}"][-1].joint for part in LEG]
        knee, pose = self.file.hinges.index(self.parts.hinges[f"{side}_knee"][-1]), home.copy()
        apart = []
        for angle in [home[7 + knee], *np.linspace(self.file.lower[knee], self.file.upper[knee], 91)]:
            pose[7 + knee] = angle
            anchors = posed(self.file.model, pose).xanchor[joints]
            apart.append(float(np.linalg.norm(anchors[2] - anchors[0])))
        return apart[0] > _STRAIGHT * max(apart)


def _skeleton(places: dict[str, Array], soles: dict[str, Array]) -> Skeleton:
    """The skeleton of joints at these places in MuJoCo's world; soles in the frames of the ankles."""
    names = [joint for joint in SMPL22.names if joint in places]
    parents, offsets = [-1], [places["pelvis"]]
    for joint in names[1:]:
        line = [SMPL22.names[j] for j in SMPL22.ancestors(SMPL22.index(joint))]
        above = next(other for other in line[1:] if other in places)
        parents.append(names.index(above))
        offsets.append(places[joint] - places[above])
    return Skeleton(
        tuple(names),
        tuple(parents),
        from_mujoco(np.array(offsets)),
        ends=frozenset(names.index(f"{side}_foot") for side in SIDES),
        humanoid={name: name for name in names},
        on_floor=True,
        soles={names.index(f"{side}_ankle"): from_mujoco(corners) for side, corners in soles.items()},
    )


def to_motion(robot: Robot, qpos: np.ndarray, fps: float) -> Motion:
    """A robot's poses as motion of its skeleton, every joint exactly where the robot has it.

    qpos: (frames, nq) as MuJoCo has them. Bones whose hinges do not meet in one point change length a little.
    """
    mujoco = load_mujoco()

    data, skeleton = mujoco.MjData(robot.model), robot.skeleton
    turning = [name for j, name in enumerate(skeleton.names) if j not in skeleton.ends]
    sites = [robot.model.site(robot.site(name)).id for name in turning]
    rows = [skeleton.names.index(name) for name in turning]
    places = np.zeros((len(qpos), len(skeleton), 3))
    world = np.tile(rot.IDENTITY, (len(qpos), len(skeleton), 1))
    for frame, pose in enumerate(qpos):
        data.qpos = pose
        mujoco.mj_kinematics(robot.model, data)
        places[frame, rows] = from_mujoco(data.site_xpos[sites])
        world[frame, rows] = turns_from_mujoco(rot.matrix_to_quat(data.site_xmat[sites].reshape(-1, 3, 3)))
    local = world.copy()
    moved = np.zeros_like(places)
    parents = list(skeleton.parents[1:])
    ends = list(skeleton.ends)
    back = rot.inverse(world[:, parents])
    local[:, 1:], local[:, ends] = rot.multiply(back, world[:, 1:]), rot.IDENTITY
    moved[:, 1:] = rot.rotate(back, places[:, 1:] - places[:, parents])
    moved[:, ends] = skeleton.offsets[ends]
    return Motion(skeleton, fps, places[:, 0], rot.unroll(rot.normalize(local)), moved)
