"""The HumanML3D representation: 22 joint positions to 263 numbers per frame at 20 fps, and back.

Guo et al., "Generating Diverse and Natural 3D Human Motions From Text", CVPR 2022, as its published code behaves.
Metres, +Y up, a person faces +Z and has the left side at +X. Arithmetic is float64; features are float32.

The numbers carry habits of the published code, kept under ``heading="compatible"`` (weights and statistics out there
expect them) and absent under ``heading="corrected"``: the hip labels are swapped, so hips partly cancel the shoulders
in the heading; the heading of frame 0 is forced to +Z (see `heading_quaternions`); and the turn of the one frame in
which somebody comes to face away from the start, -Z, has the wrong sign, so that the rest is decoded turned by twice
that. Rotations are shortest arcs from the rest directions, without twist, and not those of a body model;
`motionloom.core.body.ik` makes real ones.
"""

from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.arrays import Numbers, cross, namespace, stack, unit
from motionloom.core.blending import hermite
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FEET, FPS, LAYOUT, WIDTH
from motionloom.core.features.layout import mask as mask
from motionloom.core.motion import Motion
from motionloom.core.skeleton import HUMANML_BONE_LENGTHS, SMPL22

Array = NDArray[np.float64]
Heading = Literal["compatible", "corrected"]

CONTACT_THRESHOLD = 0.002
"""Square metres: a foot joint whose squared displacement to the next frame is smaller counts as planted."""
SMOOTHING = 20.0
"""Frames: standard deviation of the Gaussian that smooths the facing direction."""

_CHAINS = (
    (0, 2, 5, 8, 11),
    (0, 1, 4, 7, 10),
    (0, 3, 6, 9, 12, 15),
    (9, 14, 17, 19, 21),
    (9, 13, 16, 18, 20),
)
_PARENTS = np.array(SMPL22.parents)
_FORWARD = np.array([0.0, 0.0, 1.0])
_MIRROR = list(SMPL22.mirror_pairs())


def _rest_directions() -> Array:
    directions = np.tile([0.0, -1.0, 0.0], (22, 1))
    directions[[3, 6, 9, 12]] = [0, 1, 0]
    directions[[1, 13]] = [1, 0, 0]
    directions[[2, 14]] = [-1, 0, 0]
    directions[[10, 11, 15]] = [0, 0, 1]
    directions[0] = 0
    return directions


REST_DIRECTIONS: Array = _rest_directions()
"""(22, 3) unit vectors of the bones when all rotations are the identity; they are not a pose anybody can take."""
OFFSETS: Array = REST_DIRECTIONS * np.array([0.0, *HUMANML_BONE_LENGTHS])[:, None]
"""(22, 3) metres: the bones of the uniform person."""


# Positions to features


def uniform(positions: np.ndarray) -> Array:
    """Fit a motion of anybody to the uniform person: (frames, 22, 3) to the same, metres.

    The root path is scaled by the ratio of the leg lengths (thigh and shin of frame 0), every bone keeps its direction
    and takes the uniform one's length. (The published inverse and forward kinematics amount to that exactly.)
    """
    positions = checked(positions)
    bones = positions[:, 1:] - positions[:, _PARENTS[1:]]
    lengths = np.linalg.norm(OFFSETS, axis=-1)
    # the published code measures the legs by the largest coordinate of the rest offset, which lies on one axis
    legs = np.linalg.norm(bones[0, [4, 7]], axis=-1).sum()
    if legs < 1e-6:
        raise MotionloomError("the legs have no length in the first frame; these are not 22 body joints in metres")
    result = np.empty_like(positions)
    result[:, 0] = positions[:, 0] * (np.abs(OFFSETS[[5, 8]]).max(-1).sum() / legs)
    bones = bones / np.linalg.norm(bones, axis=-1, keepdims=True).clip(1e-9) * lengths[1:, None]
    for j, p in enumerate(SMPL22.parents[1:], start=1):
        result[:, j] = result[:, p] + bones[:, j - 1]
    return result


def canonical(positions: np.ndarray) -> Array:
    """Stand on the floor and start at the origin facing +Z: (frames, 22, 3) to the same, metres.

    The lowest joint of all frames gets y = 0, the root of frame 0 x = z = 0; frame 0 faces along up x (left to right
    hip + left to right shoulder).
    """
    positions = checked(positions)
    positions = positions - [0, positions[..., 1].min(), 0]
    positions = positions - positions[0, 0] * [1, 0, 1]
    turn = rot.shortest_arc(_facing(positions[:1], swapped_hips=False), _FORWARD)
    return rot.rotate(turn[:, None], positions)


def heading_quaternions(positions: np.ndarray, *, heading: Heading = "compatible") -> Array:
    """(frames, 4) quaternions that turn the world into the heading frame, where the smoothed facing is +Z.

    ``compatible`` repeats the published code: hip labels swapped, and the identity in frame 0.
    """
    if heading not in ("compatible", "corrected"):
        raise MotionloomError(f"heading must be 'compatible' or 'corrected'; got {heading!r}")
    facing = _smooth(_facing(positions, swapped_hips=heading == "compatible"))
    result = rot.shortest_arc(facing, _FORWARD)
    if heading == "compatible":
        result[0] = rot.IDENTITY
    return result


def rotations6d(positions: np.ndarray, heading: np.ndarray) -> Array:
    """(frames, 21, 6): first two columns of each joint's rotation relative to the one before it in its chain.

    The rotation of a bone is the shortest arc from its rest direction; all five chains start at the heading
    (frames, 4), the arms too.
    """
    bones = positions[:, 1:] - positions[:, _PARENTS[1:]]
    arcs = rot.quat_to_matrix(rot.shortest_arc(np.broadcast_to(REST_DIRECTIONS[1:], bones.shape), bones))
    root = rot.quat_to_matrix(heading)
    local = np.empty_like(arcs)
    for chain in _CHAINS:
        before = root
        for j in chain[1:]:
            local[:, j - 1] = before.swapaxes(-1, -2) @ arcs[:, j - 1]
            before = arcs[:, j - 1]
    return np.concatenate([local[..., 0], local[..., 1]], axis=-1)


def contacts(positions: np.ndarray) -> Array:
    """(frames - 1, 4): 1 where a joint of `FEET` moves less than 4.5 cm to the next frame; height does not matter."""
    moved = np.diff(positions[:, list(FEET)], axis=0)
    return ((moved**2).sum(-1) < CONTACT_THRESHOLD).astype(np.float64)


def encode(positions: np.ndarray, *, heading: Heading = "compatible") -> NDArray[np.float32]:
    """(frames, 22, 3) metres at 20 fps, `uniform` and `canonical`, to features (frames - 1, 263).

    With ``corrected`` the smoothed facing of frame 0 need not be +Z; decoding gives the motion turned so that it is.
    """
    positions = checked(positions)
    if len(positions) < 2:
        raise MotionloomError("features need at least 2 frames of positions; got 1")
    turn = heading_quaternions(positions, heading=heading)
    step = rot.multiply(turn[1:], rot.inverse(turn[:-1]))
    if heading == "corrected":
        step = np.where(step[:, :1] < 0, -step, step)
    moved = np.diff(positions, axis=0)
    places = rot.rotate(turn[:-1, None], positions[:-1, 1:] - positions[:-1, :1] * [1, 0, 1])
    frames = len(moved)
    blocks = (
        np.arcsin(step[:, 2:3].clip(-1, 1)),
        rot.rotate(turn[1:], moved[:, 0])[:, [0, 2]],
        positions[:-1, 0, 1:2],
        places.reshape(frames, -1),
        rotations6d(positions[:-1], turn[:-1]).reshape(frames, -1),
        rot.rotate(turn[:-1, None], moved).reshape(frames, -1),
        contacts(positions),
    )
    return np.concatenate(blocks, axis=-1).astype(np.float32)


def positions_to_features(positions: np.ndarray, fps: float, *, heading: Heading = "compatible") -> NDArray[np.float32]:
    """The whole published pipeline from anybody's 22 joints: (frames, 22, 3) metres at ``fps`` to (n - 1, 263)."""
    return encode(canonical(uniform(resample_positions(positions, fps))), heading=heading)


def motion_to_features(motion: Motion, *, heading: Heading = "compatible") -> NDArray[np.float32]:
    """Features (n - 1, 263) of a motion on the 22-joint skeleton at any frame rate."""
    if motion.skeleton.names != SMPL22.names:
        raise MotionloomError(
            f"features need the {len(SMPL22)} joints of the SMPL skeleton; this motion has "
            f"{len(motion.skeleton)} joints of another one: retarget it first"
        )
    return positions_to_features(motion.positions(), motion.fps, heading=heading)


def resample_positions(positions: np.ndarray, fps: float, *, target: float = FPS) -> Array:
    """(frames, 22, 3) at ``fps`` to ``target`` frames per second, by cubic (Catmull-Rom) interpolation in time.

    Straight lines would shorten the arcs of limbs in every frame that falls between two of the source.
    """
    x = checked(positions)
    if not (np.isfinite(fps) and fps > 0):
        raise MotionloomError(f"the frame rate must be a positive number; got {fps}")
    if fps == target or len(x) == 1:
        return x
    return positions_at(x, np.arange(int(np.floor((len(x) - 1) / fps * target + 1e-6)) + 1) * (fps / target))


def positions_at(positions: np.ndarray, at: np.ndarray) -> Array:
    """Places (frames, joints, 3), two frames or more, at fractional frames ``at``; beyond the ends straight on."""
    x = np.asarray(positions, dtype=np.float64)
    low = np.clip(np.floor(at).astype(int), 0, len(x) - 2)
    u = (at - low)[:, None, None]
    tangents = np.gradient(x, axis=0)
    h00, h10, h01, h11 = hermite(u)
    inside = h00 * x[low] + h10 * tangents[low] + h01 * x[low + 1] + h11 * tangents[low + 1]
    return np.where((u < 0) | (u > 1), x[low] + u * (x[low + 1] - x[low]), inside)


# Features to positions


def recover_root(features: Numbers) -> tuple[Numbers, Numbers]:
    """Integrate the root: features (..., frames, 263) to heading (..., frames, 4) and place (..., frames, 3) in metres.

    The quaternion turns the world into the heading frame; frame 0 is at x = z = 0 facing +Z.
    """
    xp = namespace(features)
    half = _later(features[..., 0]).cumsum(-1)
    x, z = _turn_back(half, _later(features[..., 1]), _later(features[..., 2]))
    quaternion = stack(xp.cos(half), 0 * half, xp.sin(half), 0 * half)
    return quaternion, stack(x.cumsum(-1), features[..., 3], z.cumsum(-1))


def decode_positions(features: Numbers) -> Numbers:
    """Features (..., frames, 263) to joint positions (..., frames, 22, 3) in metres; differentiable for tensors.

    Reads the root and the places of the joints (the first 67 numbers) only, which need not have constant bones.
    """
    _check_width(features)
    _, root = recover_root(features)
    half = _later(features[..., 0]).cumsum(-1)[..., None]
    local = features[..., LAYOUT["ric"]].reshape(*features.shape[:-1], 21, 3)
    x, z = _turn_back(half, local[..., 0], local[..., 2])
    joints = stack(x + root[..., :1], local[..., 1], z + root[..., 2:])
    return namespace(features).concatenate([root[..., None, :], joints], axis=-2)


def displacements(features: Numbers) -> Numbers:
    """How far joints go to the next frame, (..., frames, 263) to (..., frames - 1, 22, 3) metres; differentiable.

    In the heading frame, read from the root and the places (the first 67 numbers): of a real motion it equals the
    ``joint_velocity`` block, of a generated one it is what `decode_positions` shows.
    """
    _check_width(features)
    height, lead = features[..., 3], features.shape[:-1]
    root = stack(0 * height, height, 0 * height)[..., None, :]
    joints = features[..., LAYOUT["ric"]].reshape(*lead, 21, 3)
    places = namespace(features).concatenate([root, joints], axis=-2)
    now, following = places[..., :-1, :, :], places[..., 1:, :, :]
    half, x, z = (features[..., :-1, None, n] for n in range(3))
    x, z = _turn_back(half, following[..., 0] + x, following[..., 2] + z)
    return stack(x, following[..., 1], z) - now


def positions_from_rot6d(features: Numbers, offsets: np.ndarray = OFFSETS) -> Numbers:
    """The other decoder: (..., frames, 22, 3) metres by forward kinematics of the rotations on constant bones.

    As published, the heading quaternion itself (world into heading, not its inverse) is at the head of every chain.
    """
    _check_width(features)
    xp, lead = namespace(features), features.shape[:-1]
    quaternion, root = recover_root(features)
    local = _columns_to_matrix(features[..., LAYOUT["rot6d"]].reshape(*lead, 21, 6))
    w, y = quaternion[..., 0], quaternion[..., 2]
    zero, one, c, s = 0 * w, 0 * w + 1, 1 - 2 * y * y, 2 * w * y
    head = stack(c, zero, s, zero, one, zero, -s, zero, c).reshape(*lead, 3, 3)
    bones = xp.asarray(offsets, dtype=features.dtype, device=features.device)
    places = [root] * 22
    for chain in _CHAINS:
        world = head
        for before, j in pairwise(chain):
            world = world @ local[..., j - 1, :, :]
            places[j] = places[before] + world @ bones[j]
    return xp.stack(places, axis=-2)


def mirror(features: np.ndarray) -> NDArray[np.float32]:
    """Left and right exchanged, (..., frames, 263) to the same: what `encode` gives for the mirrored positions."""
    _check_width(features)
    flip = np.array([-1.0, 1.0, 1.0])
    lead = features.shape[:-1]
    joints = [j - 1 for j in _MIRROR[1:]]
    result = np.array(features)
    result[..., :2] *= -1  # half yaw angle and sideways velocity
    ric = features[..., LAYOUT["ric"]].reshape(*lead, 21, 3)
    result[..., LAYOUT["ric"]] = (ric[..., joints, :] * flip).reshape(*lead, -1)
    # a rotation R becomes M R M with M = diag(-1, 1, 1)
    columns = features[..., LAYOUT["rot6d"]].reshape(*lead, 21, 6)
    result[..., LAYOUT["rot6d"]] = (columns[..., joints, :] * [1, -1, -1, -1, 1, 1]).reshape(*lead, -1)
    moved = features[..., LAYOUT["joint_velocity"]].reshape(*lead, 22, 3)
    result[..., LAYOUT["joint_velocity"]] = (moved[..., _MIRROR, :] * flip).reshape(*lead, -1)
    result[..., LAYOUT["contacts"]] = features[..., LAYOUT["contacts"]][..., [2, 3, 0, 1]]
    return result


# Parts


def checked(positions: np.ndarray) -> Array:
    """Positions (frames, 22, 3); raises `MotionloomError` for another shape and numbers that are not finite."""
    positions = np.asarray(positions, dtype=np.float64)
    if positions.ndim != 3 or positions.shape[1:] != (22, 3) or len(positions) == 0:
        raise MotionloomError(f"positions must be (frames, 22, 3) with at least one frame; got {positions.shape}")
    if not np.isfinite(positions).all():
        raise MotionloomError("the positions have numbers that are not finite (NaN or infinity)")
    return positions


def _check_width(features: Any) -> None:
    if features.ndim < 2 or features.shape[-1] != WIDTH:
        raise MotionloomError(f"features must be (..., frames, {WIDTH}); got {tuple(features.shape)}")


def _facing(positions: np.ndarray, *, swapped_hips: bool) -> Array:
    """(frames, 3) up x unit(across): horizontal, and shorter than 1 when the line across the body is tilted."""
    hips = positions[:, 2] - positions[:, 1]
    across = positions[:, 17] - positions[:, 16] + (-hips if swapped_hips else hips)
    across = across / np.linalg.norm(across, axis=-1, keepdims=True).clip(1e-9)
    return np.cross([0.0, 1.0, 0.0], across)


def _smooth(facing: np.ndarray) -> Array:
    """Gaussian over time, cut at 4 standard deviations, edge frames repeated. Returns the same shape."""
    radius = int(4 * SMOOTHING + 0.5)
    kernel = np.exp(-0.5 * (np.arange(-radius, radius + 1) / SMOOTHING) ** 2)
    padded = np.pad(facing, ((radius, radius), (0, 0)), mode="edge")
    return np.stack([np.convolve(column, kernel / kernel.sum(), "valid") for column in padded.T], axis=-1)


def _later(x: Numbers) -> Numbers:
    """One frame later, 0 in frame 0."""
    return namespace(x).concatenate([0 * x[..., :1], x[..., :-1]], axis=-1)


def _turn_back(half: Numbers, x: Numbers, z: Numbers) -> tuple[Numbers, Numbers]:
    """Turn by -2 half about +Y: from the heading frame into the world."""
    xp = namespace(half)
    c, s = xp.cos(2 * half), xp.sin(2 * half)
    return x * c - z * s, x * s + z * c


def _columns_to_matrix(columns: Numbers) -> Numbers:
    """(..., 6) to matrices (..., 3, 3): Gram-Schmidt on the first two columns (Zhou et al., CVPR 2019)."""
    x = unit(columns[..., :3])
    z = unit(cross(x, columns[..., 3:]))
    return namespace(columns).stack([x, cross(z, x), z], axis=-1)
