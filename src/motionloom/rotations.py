"""Rotations on numpy arrays: unit quaternions ``(w, x, y, z)``, matrices, angles; the mathematics is `roma`'s.

Every function takes any leading axes and computes in float64. Names are arrows: ``a_from_b`` or ``b_to_a``
as in `roma`; a quaternion named ``world_from_joint`` turns joint coordinates into world coordinates.
"""

from collections.abc import Callable, Sequence

import numpy as np
import roma
import torch
from numpy.typing import NDArray

Array = NDArray[np.float64]
IDENTITY: Array = np.array([1.0, 0.0, 0.0, 0.0])


def _call(function: Callable[..., torch.Tensor], *arrays: np.ndarray) -> Array:
    tensors = (torch.from_numpy(np.array(a, dtype=np.float64)) for a in arrays)
    return function(*tensors).numpy()


def _xyzw(q: np.ndarray) -> Array:
    return np.roll(np.asarray(q, dtype=np.float64), -1, axis=-1)


def _wxyz(q: np.ndarray) -> Array:
    return np.roll(q, 1, axis=-1)


def multiply(a: np.ndarray, b: np.ndarray) -> Array:
    """Quaternion product ``a b``: first turn by b, then by a."""
    a, b = np.broadcast_arrays(np.asarray(a, dtype=np.float64), b)
    return _wxyz(_call(roma.quat_product, _xyzw(a), _xyzw(b)))


def inverse(q: np.ndarray) -> Array:
    """Inverse of unit quaternions."""
    return np.asarray(q, dtype=np.float64) * np.array([1.0, -1.0, -1.0, -1.0])


def rotate(q: np.ndarray, v: np.ndarray) -> Array:
    """Turn vectors ``(..., 3)`` by unit quaternions ``(..., 4)``."""
    q = np.asarray(q, dtype=np.float64)
    v = np.asarray(v, dtype=np.float64)
    t = 2.0 * np.cross(q[..., 1:], v)
    return v + q[..., :1] * t + np.cross(q[..., 1:], t)


def normalize(q: np.ndarray) -> Array:
    """Scale to unit length; zero quaternions become the identity."""
    q = np.asarray(q, dtype=np.float64)
    length = np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(length > 1e-12, q / np.maximum(length, 1e-12), IDENTITY)


def quat_to_matrix(q: np.ndarray) -> Array:
    """Unit quaternions to matrices ``(..., 3, 3)``."""
    return _call(roma.unitquat_to_rotmat, _xyzw(q))


def matrix_to_quat(m: np.ndarray) -> Array:
    """Rotation matrices ``(..., 3, 3)`` to unit quaternions."""
    return _wxyz(_call(roma.rotmat_to_unitquat, m))


def rotvec_to_quat(v: np.ndarray) -> Array:
    """Rotation vectors (radians) to unit quaternions."""
    return _wxyz(_call(roma.rotvec_to_unitquat, v))


def quat_to_rotvec(q: np.ndarray) -> Array:
    """Unit quaternions to rotation vectors (radians), the shorter way round."""
    return _call(roma.unitquat_to_rotvec, _xyzw(q))


def euler_to_quat(order: str, angles: np.ndarray) -> Array:
    """Intrinsic Euler angles ``(..., 3)`` in radians, in the given axis order such as ``"ZXY"``, to quaternions."""
    half = np.asarray(angles, dtype=np.float64) / 2
    result: Array | None = None
    for i, axis in enumerate(order.upper()):
        q = np.zeros((*half.shape[:-1], 4))
        q[..., 0] = np.cos(half[..., i])
        q[..., 1 + "XYZ".index(axis)] = np.sin(half[..., i])
        result = q if result is None else multiply(result, q)
    assert result is not None
    return result


def quat_to_euler(order: str, q: np.ndarray) -> Array:
    """Unit quaternions to intrinsic Euler angles (radians) in three distinct axes such as ``"ZXY"``."""
    angles = roma.unitquat_to_euler(order.upper(), torch.from_numpy(_xyzw(q).copy()), as_tuple=False)
    assert isinstance(angles, torch.Tensor)
    return angles.numpy()


def shortest_arc(a: np.ndarray, b: np.ndarray) -> Array:
    """Smallest rotation that turns the direction of a into the direction of b; no twist about either."""
    a = np.asarray(a, dtype=np.float64) / np.linalg.norm(a, axis=-1, keepdims=True).clip(1e-12)
    b = np.asarray(b, dtype=np.float64) / np.linalg.norm(b, axis=-1, keepdims=True).clip(1e-12)
    a, b = np.broadcast_arrays(a, b)
    w = 1.0 + (a * b).sum(-1, keepdims=True)
    q = np.concatenate([w, np.cross(a, b)], axis=-1)
    opposite = w[..., 0] < 1e-8
    if opposite.any():
        other = np.where(np.abs(a[..., :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
        q = np.where(opposite[..., None], np.concatenate([0 * w, np.cross(a, other)], axis=-1), q)
    return normalize(q)


def slerp(a: np.ndarray, b: np.ndarray, amount: np.ndarray) -> Array:
    """Spherical interpolation from a to b along the shorter way; ``amount`` (...) from 0 to 1."""
    turn = quat_to_rotvec(multiply(inverse(a), b))
    return normalize(multiply(a, rotvec_to_quat(turn * np.asarray(amount)[..., None])))


def unroll(q: np.ndarray) -> Array:
    """Flip signs along axis 0 so that neighbouring frames lie in the same half of the sphere."""
    q = np.asarray(q, dtype=np.float64)
    signs = np.ones(q.shape[:-1])
    signs[1:] = np.cumprod(np.where((q[1:] * q[:-1]).sum(-1) < 0, -1.0, 1.0), axis=0)
    return q * signs[..., None]


def from_axes(columns: Sequence[np.ndarray]) -> Array:
    """Quaternion whose matrix has the given orthonormal columns (images of x, y, z)."""
    return matrix_to_quat(np.stack(columns, axis=-1))
