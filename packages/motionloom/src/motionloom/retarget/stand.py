"""Where a character stands and which way it faces, and motions that start there.

A retargeted motion keeps the world of its source. A character of a game or a scene stands somewhere in its own: a VRM 0
avatar faces -Z, another one was placed in a room, and their own clips leave them there.
"""

from dataclasses import replace

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.ground import GroundPose
from motionloom.core.motion import Motion, ground_pose
from motionloom.core.skeleton import Skeleton
from motionloom.retarget.anatomy import Body, read_body

HERE = GroundPose()
"""At the origin, facing +Z: where most characters stand."""
_NEAR = 0.15
"""Lengths of the leg by which a pelvis is beside the place its body stands on."""
_ALIKE = np.radians(10)
"""Directions of bodies at rest that are nearer to an axis are meant to be along it."""
_SWAY = np.radians(20)
"""Likewise those of somebody who moves: hips and shoulders turn with every step."""


def stand(body: Body) -> GroundPose:
    """Where a body stands at rest and faces; `HERE` where its rest pose is nobody who stands."""
    if not body.upright or body.up[1] < 0.9:
        return HERE
    pose = ground_pose(body.rest)
    near = np.hypot(pose.x, pose.z) < _NEAR * body.leg
    facing = _along(pose.facing, _ALIKE)
    return GroundPose(0.0 if near else pose.x, 0.0 if near else pose.z, facing)


def _along(facing: float, near: float) -> float:
    """The axis that a direction is ``near`` to, else the direction; above -pi, at most pi."""
    quarter = round(facing / (np.pi / 2)) * np.pi / 2
    facing = quarter if abs(facing - quarter) < near else facing
    return float(np.pi - (np.pi - facing) % (2 * np.pi))


def begin(motion: Motion, body: Body) -> GroundPose:
    """Where the person of a motion on the body's skeleton is in the first frame, and faces."""
    first = motion.frames(0, 1)
    pose = ground_pose(body.places(first.positions(), first.world_rotations())[0])
    return replace(pose, facing=_along(pose.facing, _SWAY))


def started(motion: Motion, body: Body, place: GroundPose) -> Motion:
    """The motion, as `retarget` makes it, moved over the ground so that it begins at ``place``."""
    return moved(motion, body, world_of(begin(motion, body), place))


def world_of(first: GroundPose, goal: GroundPose) -> GroundPose:
    """Where the world is in which somebody at ``first`` is at ``goal``."""
    back = first.inverse()
    x, _, z = goal.to_world(np.array([back.x, 0.0, back.z]))
    return GroundPose(float(x), float(z), goal.facing + back.facing)


def moved(motion: Motion, body: Body, world: GroundPose) -> Motion:
    """The motion with its world at ``world``; joints above the pelvis go along and do not turn, as in `retarget`."""
    pelvis = body.drivers[0] or 0
    places, rotations = motion.positions()[:, pelvis], motion.rotations.copy()
    turn = rot.rotvec_to_quat(np.array([0.0, world.facing, 0.0]))
    rotations[:, pelvis] = rot.multiply(turn, rotations[:, pelvis])
    return replace(motion, root=motion.root + world.to_world(places) - places, rotations=rotations)


def shares_world(motion: Motion, skeleton: Skeleton) -> bool:
    """Whether a motion's own skeleton stands where another does, and so moves in that one's world already."""
    if motion.skeleton == skeleton:
        return True
    own, other = read_body(motion.skeleton), read_body(skeleton)
    apart = stand(own).seen_from(stand(other))
    return bool(np.hypot(apart.x, apart.z) < _NEAR * other.leg and np.cos(apart.facing) > np.cos(_ALIKE))
