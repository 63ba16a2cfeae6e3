"""Skeletons and poses as MMCP has them, and as the library does.

MMCP gives each joint's rotation in its parent's frame, the rest rotation included, with quaternions ``(x, y, z, w)``;
here a skeleton at rest has no rotations at all. With W the world rotations at rest, of a joint and of its parent p:
``theirs = inverse(W_p) * ours * W`` and ``ours = W_p * theirs * inverse(W)``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.retarget import joint_map, retarget, to_smpl22
from motionloom.retarget.anatomy import read_body

Array = NDArray[np.float64]
MOST_JOINTS = 1000
_SAME = 1e-3
"""Metres up to which a skeleton counts as the uniform person's."""


@dataclass(frozen=True, eq=False)
class Rig:
    """A client's skeleton."""

    skeleton: Skeleton
    rest: Array
    """(joints, 4) world rotations at rest."""

    @property
    def uniform(self) -> bool:
        """Whether it is the uniform person itself."""
        same = self.skeleton.names == SMPL22.names and self.skeleton.parents == SMPL22.parents
        return same and bool(np.abs(self.skeleton.offsets - SMPL22.offsets).max() < _SAME)

    @property
    def size(self) -> float:
        """Length of its legs, in those of the uniform person."""
        return 1.0 if self.uniform else read_body(self.skeleton).leg / read_body(SMPL22).leg

    def joints(self) -> dict[str, str]:
        """The joint that is nearest to each of the 22, by the names of these."""
        if self.uniform:
            return {name: name for name in SMPL22.names}
        points = joint_map(self.skeleton).names()
        return {name: max(point, key=lambda joint: point[joint]) for name, point in points.items()}

    def motion(self, names: Sequence[str], turns: Array, root: Array, fps: float) -> Motion:
        """Poses (frames, joints, 4) as MMCP has them of some joints, the others at rest; root (frames, 3)."""
        rest = rot.multiply(rot.inverse(self._parents), self.rest)
        local = np.tile(rest, (len(turns), 1, 1))
        for number, name in enumerate(names):
            local[:, self.skeleton.index(name)] = rot.normalize(np.roll(turns[:, number], 1, axis=-1))
        own = rot.multiply(rot.multiply(self._parents[None], local), rot.inverse(self.rest)[None])
        return Motion(self.skeleton, fps, root, rot.normalize(own))

    def person(self, motion: Motion) -> Motion:
        """The uniform person who moves as somebody on this skeleton."""
        return motion if self.uniform else to_smpl22(motion)

    def from_person(self, motion: Motion) -> Motion:
        """The uniform person's motion on this skeleton."""
        return motion if self.uniform else retarget(motion, self.skeleton)

    def rotations_of(self, motion: Motion) -> Array:
        """(frames, joints, 4) rotations of a motion on this skeleton as MMCP has them."""
        turned = rot.multiply(rot.inverse(self._parents)[None], rot.multiply(motion.rotations, self.rest[None]))
        return np.roll(rot.normalize(turned), -1, axis=-1)

    def places_of(self, motion: Motion) -> Array | None:
        """(frames, joints, 3) places of joints in their parents' frames, the root's in the world; None: at rest."""
        if motion.translations is None:
            return None
        places = rot.rotate(
            np.broadcast_to(rot.inverse(self._parents), (*motion.translations.shape[:2], 4)), motion.translations
        )
        places[:, 0] = motion.root
        return places

    @property
    def _parents(self) -> Array:
        """(joints, 4) rest rotations of the joints' parents."""
        return np.array([self.rest[p] if p >= 0 else rot.IDENTITY for p in self.skeleton.parents])


def read_rig(joints: Sequence[Mapping[str, Any]]) -> Rig:
    """A skeleton of MMCP's (`motionmcp.schemas.Skeleton`, dumped); MotionloomError for one that is none."""
    if len(joints) > MOST_JOINTS:
        raise MotionloomError(f"the skeleton has {len(joints)} joints; at most {MOST_JOINTS} are taken")
    names = [joint["name"] for joint in joints]
    parents = [-1 if joint["parent"] is None else names.index(joint["parent"]) for joint in joints]
    if parents[0] != -1:
        raise MotionloomError("the first joint of the skeleton must be its root")
    turns = np.array([joint["rest_rotation"] for joint in joints], dtype=np.float64)
    places = np.array([joint["rest_translation"] for joint in joints], dtype=np.float64)
    if not (np.isfinite(turns).all() and np.isfinite(places).all() and np.abs(places).max() < 1e4):
        raise MotionloomError("the skeleton's rest pose must be finite numbers of metres and quaternions")
    if (np.linalg.norm(turns, axis=-1) < 1e-3).any():
        raise MotionloomError("the skeleton's rest rotations must be quaternions that are not zero")
    local = rot.normalize(np.roll(turns, 1, axis=-1))
    world, offsets = np.empty_like(local), places.copy()
    for joint, parent in enumerate(parents):
        world[joint] = local[joint] if parent < 0 else rot.multiply(world[parent], local[joint])
        if parent >= 0:
            offsets[joint] = rot.rotate(world[parent], places[joint])
    return Rig(Skeleton(tuple(names), tuple(parents), offsets, on_floor=True), world)


def canonical() -> list[dict[str, Any]]:
    """The uniform person as MMCP's joints."""
    return [
        {
            "name": name,
            "parent": None if parent < 0 else SMPL22.names[parent],
            "rest_translation": tuple(offset),
            "rest_rotation": (0.0, 0.0, 0.0, 1.0),
        }
        for name, parent, offset in zip(SMPL22.names, SMPL22.parents, SMPL22.offsets.tolist(), strict=True)
    ]
