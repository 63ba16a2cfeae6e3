"""Anatomical frames: what the bones' own coordinate axes mean on a given body.

Every SMPL joint has an *anatomical frame* whose first axis runs along the bone and whose second is the axis that
keeps the bone from twisting:

    joint                  first axis           second axis
    pelvis, spine, neck    up the spine         to the left
    head                   up                   to the left
    hip, knee              down the bone        to the left (the knee's hinge)
    ankle, toe             forward on the sole  to the left
    collar, arm, wrist     along the bone       forward (where the elbow bends to)

`Body.frames` holds them in the coordinates of the joint that turns the bone (`joint_from_anatomy`), so that
``world_from_anatomy = world_from_joint * joint_from_anatomy`` says the same about every body: two bodies strike
the same pose when these agree. In a sensible rest pose (T, A or arms down; upright) they can be read off it.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Poses, Skeleton
from motionloom.retarget.axes import (
    ARMS,
    CHEST,
    CHILD,
    COLLARS,
    FEET,
    HEAD,
    LEGS,
    SHOULDERS,
    SPINE,
    TOES,
    arms_hang,
    collar_frames,
    frame,
    hips_line,
    measure_frames,
    measure_sole,
    shoulder_line,
    stands_on_flat_feet,
    unit,
)
from motionloom.retarget.joint_map import JointMap, Override, joint_map

Array = NDArray[np.float64]

_STEPPING = np.radians(25)
"""Flat feet of one body differ by less in how far their bones point down."""
HUMAN_LEGS = (0.5, 1.3)
"""Metres of thigh and shin, from a child's to a giant's."""
BROADEST = 0.28
"""Human hip joints are at most so far apart, in lengths of the leg."""


@dataclass(frozen=True, eq=False)
class Body:
    """A skeleton read as a person."""

    skeleton: Skeleton
    points: Array
    """(22, joints): SMPL positions = points @ joint positions, and `tips` where a joint is missing."""
    drivers: tuple[int | None, ...]
    """Per SMPL joint the skeleton's joint that turns it."""
    rest: Array
    """(22, 3) metres: the SMPL joints in the skeleton's rest pose, whatever that pose is."""
    frames: Array
    """(22, 4) joint_from_anatomy."""
    upright: bool
    """Whether the rest pose is a standing person; the frames are read off it then."""
    shoulders: Array
    """(2, 3) metres from the joint of the chest to shoulders that rest, in the anatomical frame of the chest."""
    tips: Array
    """(22, 3) metres in the frame of the joint that turns it: where a foot without toes has them; 0 elsewhere."""
    measured: bool = False
    """Whether the frames were measured from poses; where they are neither, limbs have an arbitrary twist."""
    up: Array = field(default_factory=lambda: np.eye(3)[1])
    """(3,) up in rest pose; +Y where the rest pose is no standing person."""
    toe_height: float = 0.0
    """Metres from the ground up to the toe joint on a flat foot."""

    @property
    def on_floor(self) -> bool:
        """Whether the rest pose is a person who stands on the ground y = 0."""
        return self.skeleton.on_floor and self.upright and float(self.up[1]) > 0.9

    @property
    def known(self) -> bool:
        """Whether the frames say how a joint is turned against a standing person's, and not only where bones point."""
        return self.upright or self.measured

    @property
    def broad(self) -> float:
        """Metres by which each hip joint is further out than on any human body; 0 on those."""
        apart = float(np.linalg.norm(hips_line(self.rest)))
        return max(0.0, apart - BROADEST * self.leg) / 2

    @property
    def leg(self) -> float:
        """Metres of thigh and shin, mean of both sides."""
        return (self.bone(1) + self.bone(4) + (self.bone(2) + self.bone(5))) / 2

    @property
    def breadth(self) -> float:
        """Metres from shoulder to shoulder."""
        return max(float(np.linalg.norm(shoulder_line(self.rest))), 1e-6)

    @property
    def arm(self) -> float:
        """Metres of upper arm and forearm, mean of both sides."""
        return sum(self.bone(j) for j in (16, 17, 18, 19)) / 2

    def places(self, positions: Array, world: Array) -> Array:
        """(frames, 22, 3): the SMPL joints, of the joints' positions and world rotations (frames, joints, 3 and 4)."""
        places = np.einsum("sj,fjc->fsc", self.points, positions)
        for j in np.flatnonzero(np.abs(self.tips).max(axis=1)):
            driver = self.drivers[j]
            assert driver is not None
            places[:, j] += rot.rotate(world[:, driver], self.tips[j][None])
        return places

    def bone(self, joint: int) -> float:
        """Metres from an SMPL joint to the one its bone runs to."""
        child = CHILD[joint]
        if child is None:
            return 0.0
        return float(np.linalg.norm(self.rest[child] - self.rest[joint]))


_LAST: deque[tuple[Skeleton, Body]] = deque(maxlen=8)
"""Of skeletons to which many motions are retargeted, such as the uniform person's."""


def read_body(skeleton: Skeleton, override: Override | None = None, *, poses: Poses | None = None) -> Body:
    """Find the person in a skeleton; of the skeletons that were read last it is known.

    poses: what is measured where the rest pose is no standing person; else the skeleton's own `Skeleton.poses`.
    Errors as `joint_map`.
    """
    if override is not None or poses is not None:
        return _read_body(skeleton, override, poses)
    for known, body in tuple(_LAST):
        if known is skeleton:
            return body
    body = _read_body(skeleton, None, None)
    _LAST.append((skeleton, body))
    return body


def _read_body(skeleton: Skeleton, override: Override | None, poses: Poses | None) -> Body:
    poses = poses or skeleton.poses
    joints = joint_map(skeleton, override)
    points = joints.matrix(skeleton)
    rest = points @ skeleton.rest_positions()
    _check_legs(skeleton, joints, rest)
    tips = _missing_toes(rest)
    rest = rest + tips
    if override is None and _on_four_legs(rest):
        raise MotionloomError(
            "the skeleton is no person but an animal on four legs: at rest its spine lies along the ground and its "
            "arms reach it; name its joints in a joint map to read it as a person all the same"
        )
    axes, drivers = _rest_axes(rest), joints.drivers(skeleton)
    frames = _odd_frames(rest) if axes is None else _rest_frames(rest, axes)
    chest = _on_chest(skeleton, drivers, frames, rest)
    body = Body(skeleton, points, drivers, rest, frames, axes is not None, chest, tips)
    if axes is None:
        return body if poses is None else _measured(body, poses)
    # of the uniform person, whose legs differ by millimetres, it is measured, as when the weights were trained
    upright = skeleton.on_floor and axes[1][1] > 0.9 and skeleton != SMPL22
    toes = rest[list(TOES), 1]
    planted = float(toes.mean() if _lifted_foot(rest, axes) is None else toes.min())
    height = planted if upright else _toe_height(skeleton, joints, rest, axes[1])
    body = replace(body, up=axes[1], toe_height=height)
    return body if poses is None or skeleton.on_floor else _measured_feet(body, poses)


def _measured(body: Body, poses: Poses) -> Body:
    """The body with all frames measured from poses."""
    places, world, joints = _posed(body, poses)
    frames = measure_frames(places, world, body.drivers, body.frames)
    body = replace(body, frames=frames, measured=True)
    chest = body.drivers[CHEST]
    if chest is None:
        return body
    turned = rot.inverse(rot.multiply(world[:, chest], body.frames[CHEST]))
    local = rot.rotate(turned[:, None], places[:, SHOULDERS] - joints[:, chest, None])
    weights = arms_hang(places)[..., None]
    return replace(body, shoulders=(weights * local).sum(axis=0) / weights.sum(axis=0))


def _on_chest(skeleton: Skeleton, drivers: Sequence[int | None], frames: Array, rest: Array) -> Array:
    """(2, 3) metres from the joint of the chest to the shoulders of a rest pose; 0 where no joint turns a chest."""
    if (chest := drivers[CHEST]) is None:
        return np.zeros((2, 3))
    joint = skeleton.rest_positions()[chest]
    return np.asarray(rot.rotate(rot.inverse(frames[CHEST]), rest[list(SHOULDERS)] - joint), dtype=np.float64)


def _measured_feet(body: Body, poses: Poses) -> Body:
    """The body with the soles of those feet measured from poses that do not stand at rest, such as on the toes."""
    if body.up[1] < 0.9 or all(stands_on_flat_feet(body.rest, foot) for foot in FEET):
        return body
    places, world, _ = _posed(body, poses)
    frames = body.frames.copy()
    for foot, toe in zip(FEET, TOES):
        driver = body.drivers[foot]
        sole = measure_sole(places, world, driver, rest=body.rest, foot=foot)
        if sole is not None:
            frames[[foot, toe]] = sole
    return replace(body, frames=frames)


def _posed(body: Body, poses: Poses) -> tuple[Array, Array, Array]:
    """Places (poses, 22, 3) of the SMPL joints; orientations (poses, joints, 4) and places of the skeleton's."""
    motion = Motion(body.skeleton, 30.0, **vars(poses))
    world, positions = motion.world_rotations(), motion.positions()
    return body.places(positions, world), world, positions


def _on_four_legs(rest: Array) -> bool:
    """Whether arms hang down beside the legs from a spine that is level."""
    legs = unit((rest[[7, 8]] - rest[[1, 2]]).sum(axis=0))
    arms = unit((rest[[20, 21]] - rest[[16, 17]]).sum(axis=0))
    spine = unit(rest[12] - rest[0])
    return float(legs @ arms) > 0.8 and abs(float(legs @ spine)) < 0.5


def _missing_toes(rest: Array) -> Array:
    """(22, 3) from the ankle of a foot without toes to where they would be: ahead of it and a little lower."""
    tips = np.zeros((22, 3))
    up = _snap(rest[12] - rest[0])
    ahead = unit(np.cross(_snap(rest[1] - rest[2]), up))
    legs = np.linalg.norm(rest[[4, 5]] - rest[[1, 2]], axis=-1) + np.linalg.norm(rest[[7, 8]] - rest[[4, 5]], axis=-1)
    leg = float(legs.mean())
    for foot, toe in zip(FEET, TOES):
        if np.linalg.norm(rest[toe] - rest[foot]) < 1e-6:
            height = float(rest[foot, 1])  # half way to the ground where that is close
            fall = min(0.05 * leg, 0.5 * height) if 0 < height < 0.5 * leg else 0.05 * leg
            tips[toe] = 0.16 * leg * ahead - fall * up
    return tips


def _check_legs(skeleton: Skeleton, joints: JointMap, rest: Array) -> None:
    drivers = joints.drivers(skeleton)
    for j in LEGS:
        child = CHILD[j]
        assert child is not None
        if drivers[j] in (None, drivers[child], drivers[0]):
            raise MotionloomError(
                f"the joint map puts {SMPL22.names[j]} where no joint of its own bends the leg; name one joint for it"
            )
        if np.linalg.norm(rest[child] - rest[j]) < 1e-6:
            raise MotionloomError(f"the skeleton cannot be retargeted: the bone below {SMPL22.names[j]} has no length")


def _snap(v: Array) -> Array:
    """The coordinate axis next to a direction if it is within 30 degrees, else the direction."""
    v = unit(v)
    axis = np.zeros(3)
    axis[np.argmax(np.abs(v))] = np.sign(v[np.argmax(np.abs(v))])
    return axis if float(axis @ v) > np.cos(np.radians(30)) else v


def _rest_axes(rest: Array) -> tuple[Array, Array, Array] | None:
    """Left, up and forward in rest pose; None if it is no upright person."""
    left, up = _snap(rest[1] - rest[2]), _snap(rest[12] - rest[0])
    left = unit(left - float(left @ up) * up)
    thighs, shins = rest[[4, 5]] - rest[[1, 2]], rest[[7, 8]] - rest[[4, 5]]
    toes = rest[[10, 11]] - rest[[7, 8]]
    forward = np.cross(left, up)
    sane = (
        (unit(thighs) @ up < -0.3).all()
        and (unit(shins) @ up < -0.3).all()
        and (unit(toes) @ forward > -0.3).all()
        and float(unit(rest[16] - rest[17]) @ left) > 0.7
        and float(unit(rest[15] - rest[0]) @ up) > 0.8
    )
    return (left, up, forward) if sane else None


def _rest_frames(rest: Array, axes: tuple[Array, Array, Array]) -> Array:
    """Anatomical frames of a standing rest pose, where joint axes and world axes coincide."""
    left, up, forward = axes
    frames = np.tile(rot.IDENTITY, (22, 1))
    for j, child in enumerate(CHILD):
        bone = rest[child] - rest[j] if child is not None else up
        if np.linalg.norm(bone) < 1e-6:
            bone = up
        frames[j] = frame(bone, forward if j in ARMS else left)
    frames[[0, *SPINE, HEAD]] = frame(up, left)
    frames[list(COLLARS)] = collar_frames(frames[CHEST])
    lifted = _lifted_foot(rest, axes)
    for side, (foot, toe) in enumerate(zip(FEET, TOES)):
        heading = rest[toe] - rest[foot]
        if side == lifted:  # its sole slopes against its bone as the other's does
            heading = rot.rotate(rot.rotvec_to_quat(-_slopes(rest, axes)[1 - side] * left), heading)
        else:
            heading = heading - float(heading @ up) * up
            if float(heading @ forward) < 0.2 * np.linalg.norm(rest[toe] - rest[foot]):
                heading = forward  # an End Site straight below the ankle says nothing
        frames[foot] = frames[toe] = frame(heading, left)
    for elbow, wrist in ((18, 20), (19, 21)):
        frames[wrist] = frames[elbow]
    return frames


def _slopes(rest: Array, axes: tuple[Array, Array, Array]) -> tuple[float, float]:
    """Radians by which the bones from the ankles to the toes point down, left and right."""
    _, up, forward = axes
    bones = rest[list(TOES)] - rest[list(FEET)]
    left, right = (float(np.arctan2(-bone @ up, bone @ forward)) for bone in bones)
    return left, right


def _lifted_foot(rest: Array, axes: tuple[Array, Array, Array]) -> int | None:
    """0 for the left and 1 for the right foot where it is lifted at rest, as in a file that holds a step as its rest.

    Then the feet point down by other angles, and the higher ankle's is no flat foot.
    """
    slopes, heights = _slopes(rest, axes), rest[list(FEET)] @ axes[1]
    return None if abs(slopes[0] - slopes[1]) < _STEPPING else int(heights.argmax())


def _toe_height(skeleton: Skeleton, joints: JointMap, rest: Array, up: Array) -> float:
    """From the ground to the toe joint on a flat foot; the ground is the lowest tip of the foot."""
    heights = skeleton.rest_positions() @ up
    depths = []
    for foot, toe in zip(FEET, TOES):
        own = skeleton.below(*(skeleton.index(name) for name, _ in joints.points[foot]))
        depths.append(max(float(rest[toe] @ up) - float(heights[own].min()), 0.0))
    return min(float(np.mean(depths)), 0.06)


def _odd_frames(rest: Array) -> Array:
    """What the offsets alone show where neither the rest pose nor any other is known; the twist of limbs is arbitrary.

    Joints may be turned anyhow at rest, so that only what hangs on one joint says how that one is turned.
    """
    hips, shoulders = hips_line(rest), shoulder_line(rest)
    frames = np.tile(rot.IDENTITY, (22, 1))
    for j, child in enumerate(CHILD):
        bone = rest[child] - rest[j] if child is not None else np.zeros(3)
        if np.linalg.norm(bone) < 1e-6:
            frames[j] = frames[max(k for k, c in enumerate(CHILD) if c == j)]
            continue
        lines: dict[int, Array] = {3: hips, 6: shoulders, 9: shoulders, 12: shoulders}
        axis: Array = np.eye(3)[int(np.argmin(np.abs(bone)))]
        across = lines.get(j, axis)
        frames[j] = frame(bone, across)
    person = SMPL22.rest_positions()
    lean = rot.multiply(rot.inverse(_pelvis(person)), frame(np.eye(3)[1], np.eye(3)[0]))
    frames[0] = rot.multiply(_pelvis(rest), lean)
    return frames


def _pelvis(rest: Array) -> Array:
    """A frame of the hip line and the line from its middle to the spine, whatever the pose."""
    return frame(hips_line(rest), rest[3] - rest[[1, 2]].mean(axis=0))
