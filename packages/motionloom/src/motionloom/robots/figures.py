"""How good a robot's clip is, in figures: what its feet do, what its limits say, how near it comes to the motion."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.robots.body import Robot, to_motion, to_mujoco, turns_to_mujoco
from motionloom.robots.clip import Clip
from motionloom.robots.engine import load_mujoco
from motionloom.robots.feet import heel_and_toes
from motionloom.robots.joints import SIDES
from motionloom.robots.solve import pairs_apart

Array = NDArray[np.float64]
NEAR_LIMIT = 0.01
"""Radians from a limit at which a hinge counts as being there."""
_TOUCHING = 0.002
"""Metres by which geoms are in each other before that counts."""
ROOT_JUMPS = 1000.0
"""Centimetres per second of the root that no humanoid does."""
SHAKES, UNKNOWN_SHAKES = (12.0, 2.0), 30.0
"""Metres per second squared of the pelvis: this more than so many times what was aimed at shakes; where nobody knows
what was aimed at, this does. Walks of robots with all hinges have 2 to 6, of which the motion has half."""
HEADING_OFF, TILT_OFF = 20.0, 20.0
"""Degrees of the pelvis from the person's; robots with all hinges stay below 10."""
_LYING = 0.7
"""Of a pelvis that faces up or down by so much, heading says nothing."""
_LOW, _SLOW = 0.02, 0.3
"""Metres and metres per second: a part of a sole that is lower and slower is planted, where nobody says."""


@dataclass(frozen=True)
class Figures:
    """Of one clip. Feet are measured while they are planted, at the 95th percentile."""

    robot: str
    frames: int
    fps: float
    slowed_seconds: float
    float_cm: float
    """How far the lowest corner of a planted sole is above the ground."""
    slide_cm: float
    """How far what is planted of a sole moves along the ground in a frame."""
    sunk_cm: float
    """How deep the lowest corner of a sole ever is in the ground."""
    sole_roll: float
    """Radians by which a planted sole stands on one of its sides: in wide stances, where the ankle rolls no further."""
    planted_share: float
    """Share of frames with a foot on the ground."""
    limits_broken: int
    """Hinges out of their range, over all frames."""
    at_limit_share: float
    """Share of frames with a hinge at its limit."""
    largest_step: float
    """Radians that a hinge moves in a frame at most."""
    root_step_cm: float
    """How far the root moves in a frame at most, and by how many radians it turns."""
    root_turn: float
    root_acceleration: float
    """Metres per second squared of the pelvis, root mean square: shaking is far above the motion's."""
    aimed_acceleration: float | None
    """The same of where the pelvis was to be; None where only the angles are known."""
    heading_off: float | None
    """Degrees by which the pelvis faces another way than it was to, 95th percentile; None likewise."""
    tilt_off: float | None
    """Degrees by which it leans otherwise, likewise."""
    top_speed: float
    """Radians per second of the fastest hinge, and its name."""
    fastest: str
    speed_share: float | None
    """Top speed in shares of the hinge's own limit; None where neither the model states one nor was one given."""
    effector_cm: float | None
    """Median distance of hands and feet from where they were to be; None where only the angles are known."""
    outside_support_share: float
    """Share of frames on the ground whose centre of mass is not above the planted soles: such a pose cannot be held."""
    collision_frames: int | None
    """Frames in which the robot's geoms are in each other; None where the model has none that could."""

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return asdict(self)

    def faults(self) -> list[str]:
        """What is over the limits that `docs/robots.md` names, in words."""
        over = []
        if self.limits_broken:
            over.append(f"{self.limits_broken} angles are out of range")
        if self.float_cm > 1.0:
            over.append(f"planted soles float {self.float_cm:.1f} cm")
        if self.slide_cm > 0.3:
            over.append(f"planted soles slide {self.slide_cm:.2f} cm a frame")
        if self.sunk_cm > 1.0:
            over.append(f"soles are {self.sunk_cm:.1f} cm in the ground")
        if self.largest_step * self.fps > 15.001:
            over.append(f"{self.fastest} jumps {self.largest_step:.2f} rad in a frame")
        if self.root_step_cm * self.fps > ROOT_JUMPS or self.root_turn * self.fps > 15.001:
            over.append(f"the root jumps {self.root_step_cm:.1f} cm and {self.root_turn:.2f} rad in a frame")
        over += self._shaking()
        if self.speed_share is not None and self.speed_share > 1.001:
            over.append(f"{self.fastest} is {self.speed_share:.2f} times as fast as it can be")
        if self.effector_cm is not None and self.effector_cm > 6.0:
            over.append(f"hands and feet are {self.effector_cm:.1f} cm off")
        if self.collision_frames:
            over.append(f"the robot touches itself in {self.collision_frames} frames")
        return over

    def _shaking(self) -> list[str]:
        over, aimed = [], self.aimed_acceleration
        if self.root_acceleration > (UNKNOWN_SHAKES if aimed is None else SHAKES[0] + SHAKES[1] * aimed):
            instead = "" if aimed is None else f", where the motion has {aimed:.1f}"
            over.append(f"the pelvis shakes: its acceleration is {self.root_acceleration:.1f} m/s2{instead}")
        if self.heading_off is not None and self.heading_off > HEADING_OFF:
            over.append(f"the pelvis faces up to {self.heading_off:.0f} degrees away from the person's heading")
        if self.tilt_off is not None and self.tilt_off > TILT_OFF:
            over.append(f"the pelvis leans up to {self.tilt_off:.0f} degrees otherwise than the person's")
        return over


def measure(clip: Clip, robot: Robot, *, max_speed: float | None = None) -> Figures:
    """The figures of a clip. max_speed: radians per second that no hinge is to exceed, beside what the model states."""
    corners, masses, pelvis, touching = _follow(clip, robot)
    planted = clip.planted
    edges = heel_and_toes(corners)
    stays = planted[1:] & planted[:-1]
    moved = np.linalg.norm(np.diff(edges[..., :2], axis=0), axis=-1)[stays]
    on_ground = planted[..., 0] | planted[..., 1]
    heights = corners[..., 2].min(axis=2)
    across = corners[:, :, 1] - corners[:, :, 0]
    slopes = across[..., 2] / np.linalg.norm(across, axis=-1)
    angles = clip.qpos[:, 7:]
    lower, upper = robot.file.lower, robot.file.upper
    speeds = np.abs(np.diff(angles, axis=0)) * clip.fps
    speeds = speeds if len(speeds) else np.zeros((1, angles.shape[1]))
    top = speeds.max(axis=0)
    most = robot.file.speeds(max_speed)
    share = top / most
    fastest = int((share if np.isfinite(most).any() else top).argmax())
    root_step, root_turn = _root_steps(clip.qpos[:, :7])
    supported = on_ground[:, 0] | on_ground[:, 1]
    outside = [_outside(masses[f], corners[f][on_ground[f]].reshape(-1, 3)) for f in np.flatnonzero(supported)]
    return Figures(
        robot=robot.name,
        frames=len(clip),
        fps=clip.fps,
        slowed_seconds=round(clip.slowed, 3),
        float_cm=_high(100 * heights[on_ground]),
        slide_cm=_high(100 * moved),
        sunk_cm=round(100 * max(0.0, -float(heights.min())), 3),
        sole_roll=_high(np.arcsin(slopes.clip(-1, 1))[on_ground]),
        planted_share=round(float(supported.mean()), 3),
        limits_broken=int(((angles < lower - 1e-9) | (angles > upper + 1e-9)).sum()),
        at_limit_share=round(
            float(((angles < lower + NEAR_LIMIT) | (angles > upper - NEAR_LIMIT)).any(axis=1).mean()), 3
        ),
        largest_step=round(float(top.max()) / clip.fps, 4),
        root_step_cm=round(100 * root_step, 3),
        root_turn=round(root_turn, 4),
        root_acceleration=round(_acceleration(pelvis, clip.fps), 2),
        aimed_acceleration=None if clip.aims is None else round(_acceleration(clip.aims, clip.fps), 2),
        heading_off=None if clip.aims is None else _high(_headings_apart(pelvis, clip.aims)),
        tilt_off=None if clip.aims is None else _high(_tilts_apart(pelvis, clip.aims)),
        top_speed=round(float(top[fastest]), 3),
        fastest=robot.file.hinges[fastest].name,
        speed_share=round(float(share[fastest]), 4) if share[fastest] > 0 else None,
        effector_cm=None if clip.errors is None else round(100 * float(np.median(clip.errors)), 3),
        outside_support_share=round(float(np.mean(outside)), 3) if outside else 0.0,
        collision_frames=None if touching is None else int(touching.sum()),
    )


def _root_steps(root: Array) -> tuple[float, float]:
    """The most that root places and quaternions (frames, 7) move and turn in a frame: metres and radians."""
    moved = np.linalg.norm(np.diff(root[:, :3], axis=0), axis=1)
    turned = np.abs((root[1:, 3:] * root[:-1, 3:]).sum(axis=1)).clip(0, 1)
    return float(moved.max(initial=0.0)), float(2 * np.arccos(turned.min(initial=1.0)))


def _acceleration(root: Array, fps: float) -> float:
    """Metres per second squared of places (frames, 3 or more), root mean square."""
    steps = np.diff(root[:, :3], n=2, axis=0)
    return float(np.sqrt((steps**2).sum(axis=1).mean())) * fps**2 if len(steps) else 0.0


def _headings_apart(pelvis: Array, aims: Array) -> Array:
    """Degrees between where two of (frames, 7) face over the ground, in frames in which the second is not lying."""
    ways = [rot.rotate(poses[:, 3:7], np.array([1.0, 0.0, 0.0])) for poses in (pelvis, aims)]
    angles = [np.arctan2(way[:, 1], way[:, 0]) for way in ways]
    return np.degrees(np.angle(np.exp(1j * (angles[0] - angles[1]))))[np.abs(ways[1][:, 2]) < _LYING]


def _tilts_apart(pelvis: Array, aims: Array) -> Array:
    """Degrees between the upward axes of two of (frames, 7)."""
    ups = [rot.rotate(rot.inverse(poses[:, 3:7]), np.array([0.0, 0.0, 1.0])) for poses in (pelvis, aims)]
    return np.degrees(np.arccos((ups[0] * ups[1]).sum(axis=1).clip(-1, 1)))


def _high(values: Array) -> float:
    return round(float(np.percentile(np.abs(values), 95)), 3) if values.size else 0.0


def _follow(clip: Clip, robot: Robot) -> tuple[Array, Array, Array, NDArray[np.bool_] | None]:
    """Corners of the soles (frames, 2, 4, 3), centres of mass (frames, 3), places and turns of the pelvis's site
    (frames, 7), and frames in which the robot touches itself."""
    mujoco = load_mujoco()

    model = robot.model
    data = mujoco.MjData(robot.model)
    pairs = list(pairs_apart(robot))
    sites = [model.site(robot.site(f"{side}_ankle")).id for side in SIDES]
    corners, masses, pelvis = np.empty((len(clip), 2, 4, 3)), np.empty((len(clip), 3)), np.empty((len(clip), 7))
    hips = model.site(robot.site("pelvis")).id
    touching, nearest = np.zeros(len(clip), dtype=bool), np.zeros(6)
    root = int(model.jnt_bodyid[0])
    for frame, pose in enumerate(clip.qpos):
        data.qpos = pose
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        masses[frame] = data.subtree_com[root]
        pelvis[frame] = *data.site_xpos[hips], *rot.matrix_to_quat(data.site_xmat[hips].reshape(3, 3))
        for number, (side, site) in enumerate(zip(SIDES, sites)):
            corners[frame, number] = data.site_xpos[site] + robot.soles[side] @ data.site_xmat[site].reshape(3, 3).T
        touching[frame] = any(
            mujoco.mj_geomDistance(model, data, one, other, 0.0, nearest) < -_TOUCHING for one, other in pairs
        )
    return corners, masses, pelvis, touching if pairs else None


def _outside(point: Array, corners: Array) -> bool:
    """Whether a point is not above the convex hull of points on the ground."""
    around = corners[:, :2] - point[:2]
    angles = np.sort(np.arctan2(around[:, 1], around[:, 0]))
    gaps = np.diff(np.concatenate([angles, angles[:1] + 2 * np.pi]))
    return bool(gaps.max() > np.pi)


def planted_soles(robot: Robot, qpos: Array, fps: float) -> NDArray[np.bool_]:
    """(frames, 2, 2) which heels and toes are on the ground, by how low and slow they are: for angles out of a file."""
    motion = to_motion(robot, qpos, fps)
    places = to_mujoco(motion.positions())
    turns = turns_to_mujoco(motion.world_rotations())
    planted = np.zeros((len(qpos), 2, 2), dtype=bool)
    for number, side in enumerate(SIDES):
        j = robot.skeleton.index(f"{side}_ankle")
        corners = places[:, j, None] + rot.rotate(turns[:, j, None], robot.soles[side][None])
        edges = heel_and_toes(corners)
        speed = np.linalg.norm(np.gradient(edges, axis=0), axis=-1) * fps if len(qpos) > 1 else np.zeros((1, 2))
        planted[:, number] = (edges[..., 2] < _LOW) & (speed < _SLOW)
    return planted
