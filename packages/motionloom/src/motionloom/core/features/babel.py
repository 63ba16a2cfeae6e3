"""The BABEL representation: a person as 135 numbers per frame at 30 fps, and back.

Root height, planar root velocity, and the rotations of the 22 body joints: what the BABEL models of PriorMDM (Shafir et
al. 2024, after TEACH, Athanasiou et al. 2022) read and write. The numbers live in AMASS's world: metres, **+Z up**. A
`Motion` lives in this project's: +Y up. One point is (x, y, z) there and (x, z, -y) here; rotations of joints 1..21 are
relative to their parents and the same in both.

Rotations are SMPL's own, with twist: identity is the T-pose with +Y up, facing +Z, which is also the rest pose of
`SMPL22`. A 6-number rotation is the first two **rows** of its matrix here, and two columns in `humanml`.
Features are float32; arithmetic is float64.
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.arrays import Numbers, cross, namespace, stack, unit
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22

Array = NDArray[np.float64]
Start = Literal["compatible", "corrected", "kept"]

WIDTH = 135
"""Numbers per frame."""
FPS = 30.0
"""Frames per second of the representation."""

LAYOUT: dict[str, slice] = {
    "root_height": slice(0, 1),
    "root_velocity": slice(1, 3),
    "rot6d": slice(3, 135),
}
"""Blocks in order: root z (m), root x and y since the frame before (m; 0 in frame 0), rotations of joints 0..21 as two
matrix *rows*. All in the +Z-up world, not in the person's heading."""

Y_UP: Array = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Takes a point of the +Z-up world to the +Y-up one: (x, y, z) to (x, z, -y)."""
_Y_UP_QUATERNION: Array = rot.matrix_to_quat(Y_UP)


# Motions to features


def encode(motion: Motion, *, start: Start = "compatible") -> NDArray[np.float32]:
    """A motion on the 22-joint skeleton, at any frame rate, to features (frames, 135) at 30 fps; as many frames.

    ``start`` says how the whole motion is turned about the vertical. ``compatible`` repeats the published training
    data (`published_turn`: no true yaw, so equal motions that start in other directions get other numbers);
    ``corrected`` makes frame 0 face -X exactly, where the published rule leaves a person who faces -Y in AMASS;
    ``kept`` does not turn. Where frame 0 stood on the ground is not kept.
    Raises `MotionloomError` for another skeleton.
    """
    if motion.skeleton.names != SMPL22.names:
        raise MotionloomError(
            f"these features need the {len(SMPL22)} joints of the SMPL skeleton; this motion has "
            f"{len(motion.skeleton)} joints of another one: retarget it first"
        )
    if start not in ("compatible", "corrected", "kept"):
        raise MotionloomError(f"start must be 'compatible', 'corrected' or 'kept'; got {start!r}")
    motion = motion.resample(FPS)
    place = motion.root @ Y_UP  # the rows times the matrix: its inverse
    turned = motion.rotations.copy()
    turned[:, 0] = rot.multiply(rot.inverse(_Y_UP_QUATERNION), turned[:, 0])
    back = rot.rotvec_to_quat(np.array([0.0, 0.0, -_turn(motion, turned[0, 0], start)]))
    turned[:, 0] = rot.multiply(back, turned[:, 0])
    speed = np.zeros_like(place)
    speed[1:] = np.diff(rot.rotate(back, place), axis=0)
    rows = rot.quat_to_matrix(turned)[..., :2, :].reshape(len(place), -1)
    return np.concatenate([place[:, 2:], speed[:, :2], rows], axis=-1).astype(np.float32)


def _turn(motion: Motion, orientation: Array, start: Start) -> float:
    if start == "kept":
        return 0.0
    if start == "compatible":
        return published_turn(orientation)
    x, _, z = facing(motion)
    return float(np.arctan2(-z, x) - np.pi)  # (x, z) is (x, -z) in the +Z-up plane; -X lies at pi


def published_turn(orientation: np.ndarray) -> float:
    """Radians about +Z that the published training data takes off: the z number of the rotation vector, plus pi/2.

    ``orientation`` (4,): joint 0 of frame 0 in the +Z-up world. A rotation vector has no separate yaw, so this is one
    only near the upright person who faces -Y. (Inherited from TEACH; published weights expect it.)
    """
    return float(rot.quat_to_rotvec(orientation)[2] + np.pi / 2)


def facing(motion: Motion) -> Array:
    """(3,) horizontal unit vector in the +Y-up world: where frame 0 faces, by hips and shoulders as in `humanml`."""
    first = motion.frames(0, 1).positions()[0]
    across = first[1] - first[2] + first[16] - first[17]  # right to left
    forward = np.cross(across, [0.0, 1.0, 0.0])
    length = np.linalg.norm(forward)
    return forward / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])


# Features to motions


def decode(features: np.ndarray, fps: float = FPS) -> Motion:
    """Features (frames, 135), not standardised, to a motion in the +Y-up world on the uniform 22-joint person.

    Frame 0 stands over the origin; the height is the stored one. Nothing is turned: features of the published kind
    start facing about -X (`forward` turns them). Raises `MotionloomError` for another shape and for NaN.
    """
    features = np.asarray(features, dtype=np.float64)
    if features.ndim != 2 or not len(features):
        raise MotionloomError(f"features must be (frames, {WIDTH}) with at least one frame; got {features.shape}")
    root, local = _pose(features)
    return Motion(SMPL22, fps, root, rot.unroll(rot.normalize(rot.matrix_to_quat(local))))


def forward(motion: Motion) -> Motion:
    """The motion turned about the vertical through the origin so that frame 0 faces +Z, as HumanML3D motions start."""
    x, _, z = facing(motion)
    turn = rot.rotvec_to_quat(np.array([0.0, -np.arctan2(x, z), 0.0]))
    turned = motion.rotations.copy()
    turned[:, 0] = rot.multiply(turn, turned[:, 0])
    return Motion(motion.skeleton, motion.fps, rot.rotate(turn, motion.root), turned, motion.translations)


def decode_positions(features: Numbers) -> Numbers:
    """Features (..., frames, 135) to joint positions (..., frames, 22, 3) in metres, +Y up; differentiable for tensors.

    Forward kinematics on the uniform person, in the world of `decode`. (Published code puts the same rotations on the
    SMPL-H body of zero shape, whose files have a licence of their own.)
    """
    xp = namespace(features)
    root, local = _pose(features)
    bones = xp.asarray(SMPL22.offsets, dtype=features.dtype, device=features.device)
    world, places = [local[..., 0, :, :]], [root]
    for j, p in enumerate(SMPL22.parents[1:], start=1):
        places.append(places[p] + world[p] @ bones[j])
        world.append(world[p] @ local[..., j, :, :])
    return xp.stack(places, axis=-2)


def _pose(features: Numbers) -> tuple[Numbers, Numbers]:
    """Root (..., frames, 3) and rotations (..., frames, 22, 3, 3), the first in the world; +Y up."""
    if features.ndim < 2 or features.shape[-1] != WIDTH:
        raise MotionloomError(f"features must be (..., frames, {WIDTH}); got {tuple(features.shape)}")
    xp = namespace(features)
    speed = features[..., LAYOUT["root_velocity"]]
    planar = speed.cumsum(-2) - speed[..., :1, :]
    root = stack(planar[..., 0], features[..., 0], -planar[..., 1])
    local = _rows_to_matrix(features[..., LAYOUT["rot6d"]].reshape(*features.shape[:-1], len(SMPL22), 6))
    up = xp.asarray(Y_UP, dtype=features.dtype, device=features.device)
    return root, xp.concatenate([up @ local[..., :1, :, :], local[..., 1:, :, :]], axis=-3)


def _rows_to_matrix(rows: Numbers) -> Numbers:
    """(..., 6) to matrices (..., 3, 3): Gram-Schmidt on the first two rows (Zhou et al., CVPR 2019; PyTorch3D)."""
    first, second = rows[..., :3], rows[..., 3:]
    x = unit(first)
    y = unit(second - (x * second).sum(-1, keepdims=True) * x)
    return namespace(rows).stack([x, y, cross(x, y)], axis=-2)
