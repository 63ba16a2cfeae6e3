"""Writing motions as NumPy archives, never with pickle; `motionloom.io.npz` reads them.

Layout (version 1), for a motion of T frames and J joints:

==============  ==================  ===========================================================================
``version``     int                 1
``names``       (J,) text           joint names
``parents``     (J,) int            number of each joint's parent; -1 for joint 0
``offsets``     (J, 3) float        metres, each joint in its parent's frame at rest
``ends``        (E,) int            joints that are mere bone tips
``fps``         float               frames per second
``root``        (T, 3) float        metres, joint 0 in the world
``rotations``   (T, J, 4) float     quaternions (w, x, y, z), each joint in its parent's frame
``translations``  (T, J, 3) float   only where bones change length: metres in the parent's frame
``positions``   (T, J, 3) float32   metres in the world; for your convenience, not read back
``on_floor``    bool                whether the rest pose stands on y = 0
``humanoid``    (H, 2) text         SMPL joint and the joint that plays it, where the file of the body named them
``sole_joints`` (S,) int            joints of the feet, one for each corner of the mesh below them
``sole_points`` (S, 3) float        metres in the frames of these joints
``pose_root``, ``pose_rotations``, ``pose_translations``: some poses of the file that the skeleton is from
==============  ==================  ===========================================================================

Those from ``translations`` on may be missing.
"""

from pathlib import Path

import numpy as np

from motionloom.core.files.atomic import atomic_path
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Skeleton

VERSION = 1


def save_npz(motion: Motion, path: Path | str, *, packed: bool = True) -> Path:
    """Write a motion in the layout above and give the path back.

    packed: a tenth smaller, and most of the time that writing takes.
    """
    skeleton = motion.skeleton
    moved = {} if motion.translations is None else {"translations": motion.translations}
    arrays = {
        "version": np.array(VERSION),
        "names": np.array(skeleton.names),
        "parents": np.array(skeleton.parents, dtype=np.int64),
        "offsets": skeleton.offsets,
        "ends": np.array(sorted(skeleton.ends), dtype=np.int64),
        "fps": np.array(float(motion.fps)),
        "root": motion.root,
        "rotations": motion.rotations,
        "positions": motion.positions().astype(np.float32),
        **moved,
        **_body_arrays(skeleton),
    }
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        (np.savez_compressed if packed else np.savez)(file, **arrays)
    return Path(path)


def _body_arrays(skeleton: Skeleton) -> dict[str, np.ndarray]:
    """What the file of a body says of it beside its bones."""
    arrays = {"on_floor": np.array(skeleton.on_floor)}
    if skeleton.humanoid:
        arrays["humanoid"] = np.array(sorted(skeleton.humanoid.items()))
    if skeleton.soles:
        arrays["sole_joints"] = np.repeat(list(skeleton.soles), [len(points) for points in skeleton.soles.values()])
        arrays["sole_points"] = np.concatenate(list(skeleton.soles.values()))
    if (poses := skeleton.poses) is not None:
        arrays |= {"pose_root": poses.root, "pose_rotations": poses.rotations}
        if poses.translations is not None:
            arrays |= {"pose_translations": poses.translations}
    return arrays
