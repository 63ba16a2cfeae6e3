"""NPZ files of the generator Kimodo: places and world rotations of the SOMA skeleton's joints, without their names.

``posed_joints`` (T, J, 3) are metres, +Y up, and ``global_rot_mats`` (T, J, 3, 3) turn from the rest pose, a person in
a T who faces +Z. J is 77, or 30 in older files; 22 are the joints of SMPL. The files state no rate: it is `FPS`.
"""

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton

Array = NDArray[np.float64]

FPS = 30.0
_SPINE = "Hips Spine1 Spine2 Chest Neck1 Neck2 Head HeadEnd"
_FINGERS = {"Thumb": "1 2 3 End", "Index": "1 2 3 4 End", "Middle": "1 2 3 4 End", "Ring": "1 2 3 4 End"}
_FINGERS |= {"Pinky": "1 2 3 4 End"}
_LEFT_OUT = ("HeadEnd", "ToeEnd", "Index", "Ring", "Pinky", "Thumb1", "Thumb2", "Thumb3", "Middle1", "Middle2")
_LEFT_OUT += ("Middle3", "Middle4")
"""How the names of joints end, or what they hold, that the skeleton of 30 joints does not have."""


def _chain(start: str, names: str) -> list[tuple[str, str]]:
    """(joint, parent) of each of some names, one behind the other."""
    line = [start, *names.split()]
    return list(zip(line[1:], line, strict=False))


def _tree() -> dict[str, str]:
    """The parents of all 77 joints, in the order of the files."""
    tree = _chain("", _SPINE)
    tree += [(name, "Head") for name in ("Jaw", "LeftEye", "RightEye")]
    for side in ("Left", "Right"):
        tree += _chain("Chest", " ".join(f"{side}{part}" for part in ("Shoulder", "Arm", "ForeArm", "Hand")))
        for finger, parts in _FINGERS.items():
            tree += _chain(f"{side}Hand", " ".join(f"{side}Hand{finger}{part}" for part in parts.split()))
    for side in ("Left", "Right"):
        tree += _chain("Hips", " ".join(f"{side}{part}" for part in ("Leg", "Shin", "Foot", "ToeBase", "ToeEnd")))
    return dict(tree)


def _names_and_parents(count: int) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Raises `MotionloomError` for another number of joints."""
    if count == len(SMPL22):
        return SMPL22.names, SMPL22.parents
    if count not in (30, 77):
        robot = "; 34 are those of a robot" if count == 34 else ""
        raise MotionloomError(f"'posed_joints' of 22, 30 or 77 joints are read; these are {count}{robot}")
    tree = _tree()
    names = [name for name in tree if count == 77 or not any(part in name for part in _LEFT_OUT)]
    parents = []
    for name in names:
        above = tree[name]
        while above and above not in names:
            above = tree[above]
        parents.append(names.index(above) if above else -1)
    return tuple(names), tuple(parents)


def soma_motion(places: Array, turns: Array, fps: float) -> Motion:
    """The motion of such a file.

    Args:
        places: (frames, joints, 3) metres in the world.
        turns: (frames, joints, 3, 3) rotation matrices from the rest pose to the world.
        fps: Frames per second.

    Raises `MotionloomError` for another number of joints, no frames, and matrices that are no rotations.
    """
    names, parents = _names_and_parents(places.shape[1])
    if not len(places):
        raise MotionloomError("there are no frames")
    identity = turns @ np.swapaxes(turns, -1, -2)
    if np.abs(identity - np.eye(3)).max() > 1e-2 or np.linalg.det(turns).min() < 0:
        raise MotionloomError("'global_rot_mats' holds matrices that are no rotations")
    above = np.array(parents[1:])
    bones = np.einsum("tjba,tjb->tja", turns[:, above], places[:, 1:] - places[:, above])
    offsets = np.concatenate([np.zeros((1, 3)), np.median(bones, axis=0)])
    world = rot.matrix_to_quat(turns)
    local = world.copy()
    local[:, 1:] = rot.multiply(rot.inverse(world[:, above]), world[:, 1:])
    ends = frozenset(j for j, name in enumerate(names) if name.endswith("End"))
    groups = SMPL22.groups if names == SMPL22.names else {}
    return Motion(Skeleton(names, parents, offsets, ends, groups), fps, places[:, 0], rot.unroll(local))
