"""Armatures as the server reads them: a skeleton in metres, +Y up, that stands at the origin and faces +Z."""

import hashlib
from itertools import pairwise

import bpy
import numpy as np

from . import glb
from . import quaternions as quat
from .client import Problem

UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Turns the server's axes (+Y up, facing +Z) to Blender's (+Z up, facing -Y)."""
LEGS = (("left_hip", "left_knee", "left_ankle"), ("right_hip", "right_knee", "right_ankle"))
NEAR = 0.15
"""Lengths of the leg by which the pelvis is beside the object's origin and is still meant to be over it."""
ALIKE = np.radians(10)
"""Directions of bodies that are nearer to the object's own front are meant to be along it."""


class Body:
    """An armature's bones at rest, and where it stands.

    Made where Blender may be read. `settle` needs the server and may run in another thread.
    """

    def __init__(self, armature):
        """Raises `Problem` for an armature that is stretched or mirrored, or has no bones."""
        self.name, self.rigify = armature.name, is_rigify(armature)
        bones = armature.data.bones
        if self.rigify:
            kept = [bone.name for bone in bones if bone.use_deform and bone.name.startswith("DEF-")]
            above = {name: followed(bones[name], set(kept)) for name in kept}
        else:
            above = {bone.name: bone.parent.name if bone.parent else None for bone in bones}
        if not above:
            raise Problem(f"{armature.name} has no bones that could move: select an armature with a person's bones")
        self.names = ordered(above)
        self.parents = [self.names.index(above[name]) if above[name] else -1 for name in self.names]
        self.world = np.array(armature.matrix_world)
        sizes = np.linalg.norm(self.world[:3, :3], axis=0)
        if np.ptp(sizes) > 1e-3 * sizes.max() or np.linalg.det(self.world[:3, :3]) <= 0:
            shown = ", ".join(f"{size:.3g}" for size in sizes)
            raise Problem(
                f"{armature.name} is stretched or mirrored (scale {shown}): apply its "
                "scale first (Object, Apply, Scale)"
            )
        self.unit = bpy.context.scene.unit_settings.scale_length
        rest = self.world @ np.array([np.array(bones[name].matrix_local) for name in self.names])
        self.rest_turns, self.rest_places = quat.from_matrix(unscaled(rest)), rest[:, :3, 3]
        self.joints, self.id, self.scale = {}, "", 1.0
        self.turn, self.origin, self.stage = UPRIGHT, np.zeros(3), self

    # The server's world and Blender's

    def inside(self, points):
        """Points (..., 3) of Blender's world in the server's, in metres."""
        return (np.asarray(points) - self.origin) @ self.turn * self.unit

    def outside(self, points):
        """Points (..., 3) of the server's world in Blender's; two people share that of the first, the `stage`."""
        return np.asarray(points) @ self.stage.turn.T / self.unit + self.stage.origin

    def poses(self, moves):
        """(frames, joints, 4, 4) of Blender's world, in the order of the motion's joints."""
        at = [self.names.index(name) for name in moves.names]
        found = np.tile(np.eye(4), (*moves.turns.shape[:2], 1, 1))
        turns = quat.multiply(quat.from_matrix(self.stage.turn), moves.turns)
        turns = quat.multiply(quat.multiply(turns, quat.inverse(quat.from_matrix(self.turn))), self.rest_turns[at])
        found[..., :3, :3] = quat.to_matrix(turns)
        found[..., :3, 3] = self.outside(moves.places)
        return found

    def moves(self, poses, fps):
        """The motion of world matrices (frames, joints, 4, 4) in the order of `names`."""
        turns = quat.multiply(quat.from_matrix(unscaled(poses)), quat.inverse(self.rest_turns))
        own = quat.from_matrix(self.turn)
        turns = quat.multiply(quat.multiply(quat.inverse(own), quat.unroll(turns)), own)
        return glb.Moves(self.names, self.parents, fps, turns=turns, places=self.inside(poses[..., :3, 3]))

    # The server's knowledge

    def settle(self, client):
        """Send the skeleton to the server, learn which bone is which, and find where the person stands.

        Raises `Problem` with the server's sentence where it is no person.
        """
        self.joints = self._send(client)["joints"]
        left = sum(self._rest(f"left_{part}") - self._rest(f"right_{part}") for part in ("hip", "shoulder"))
        front = np.cross(left, [0.0, 0.0, 1.0])
        facing = np.arctan2(front[0], -front[1])
        own = np.arctan2(-self.world[0, 1], self.world[1, 1])
        if abs(np.angle(np.exp(1j * (facing - own)))) < ALIKE:
            facing = own
        cos, sin = np.cos(facing), np.sin(facing)
        self.turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ UPRIGHT
        self.origin = self._stand()
        self.id = self._send(client)["id"]
        person = client.json("GET", "/capabilities")
        offsets = dict(zip(person["joints"], np.array(person["offsets"])))
        usual = np.mean([sum(np.linalg.norm(offsets[joint]) for joint in leg[1:]) for leg in LEGS])
        self.scale = self._leg() * self.unit / usual

    def _stand(self):
        """(3,) the point of the ground that the person stands on."""
        pelvis, foot = self._rest("pelvis"), self.world[:3, 3]
        lowest = self.rest_places[:, 2].min()
        near = np.hypot(*(pelvis - foot)[:2]) < NEAR * self._leg()
        place = foot if near else pelvis
        level = foot[2] if abs(lowest - foot[2]) < NEAR * self._leg() else lowest
        return np.array([place[0], place[1], level])

    def _leg(self):
        """Of both sides in the middle, in Blender's units."""
        lengths = [
            sum(np.linalg.norm(self._rest(below) - self._rest(above)) for above, below in pairwise(leg)) for leg in LEGS
        ]
        return float(np.mean(lengths))

    def _rest(self, joint):
        """(3,) where a joint is at rest; the server's names, such as left_wrist."""
        return np.mean([self.rest_places[self.names.index(bone)] for bone in self.joints[joint]], axis=0)

    def bone(self, joint):
        """The last of the bones that turn a joint; None where the armature has none of its own."""
        return self.joints[joint][-1] if self.joints.get(joint) else None

    def _send(self, client):
        data = glb.pack(self.names, self.parents, self.inside(self.rest_places))
        key = (client.address, hashlib.sha256(data).hexdigest())
        if key not in SENT:
            try:
                SENT[key] = client.send("characters", "it.glb", data)
            except Problem as problem:
                said = str(problem).replace("it.glb", self.name).partition("; name the missing ones")
                raise Problem(said[0] + ("; give these bones such names" if said[1] else "")) from None
        return SENT[key]


SENT = {}
"""What a server answered to a skeleton, by its address and the bytes."""


def forget():
    """After a server was lost: nothing of what was sent is there any more."""
    SENT.clear()


def sampled(armature, body, frames):
    """(frames, joints, 4, 4) where the body's bones are in Blender's world; the scene's frame stays as it was."""
    scene = bpy.context.scene
    now, found = (scene.frame_current, scene.frame_subframe), []
    for frame in frames:
        scene.frame_set(int(frame))
        found.append(posed(armature, body))
    scene.frame_set(now[0], subframe=now[1])
    return np.array(found)


def posed(armature, body):
    """(joints, 4, 4) of the pose that is shown."""
    matrices = [np.array(armature.pose.bones[name].matrix) for name in body.names]
    return np.array(armature.matrix_world) @ np.array(matrices)


def is_rigify(armature):
    """Whether it is a rig that Rigify generated."""
    return {"DEF-spine", "torso"} <= set(armature.data.bones.keys())


def followed(bone, deforming):
    """The deform bone that a deform bone of Rigify hangs on: its own above it, or that of the nearest ORG- bone."""
    for above in bone.parent_recursive:
        name = above.name.replace("ORG-", "DEF-")
        if name in deforming and name != bone.name:
            return name
    return None


def ordered(above):
    """The names of bones with each behind the one it hangs on; above: the name of that, or None, by name."""
    found = []

    def add(name):
        if name is not None and name not in seen:
            seen.add(name)
            add(above[name])
            found.append(name)

    seen = set()
    for name in above:
        add(name)
    return found


def unscaled(matrices):
    """(..., 3, 3) the rotations in matrices (..., 4, 4) of bones."""
    linear = matrices[..., :3, :3]
    return linear / np.linalg.norm(linear, axis=-2, keepdims=True)
