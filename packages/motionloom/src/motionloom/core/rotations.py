"""Rotations on numpy arrays: unit quaternions ``(w, x, y, z)``, matrices, angles.

Every function takes any leading axes and computes in float64. Names are arrows: ``a_from_b`` or ``b_to_a``;
a quaternion named ``world_from_joint`` turns joint coordinates into world coordinates. Rotations that tensors
must be differentiated through are written where they are needed (`features.humanml`); nothing here imports torch.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IDENTITY: Array = np.array([1.0, 0.0, 0.0, 0.0])
_NEARLY_LOCKED = 1e-7
"""Radians from the poles within which Euler angles are not unique."""


def multiply(a: np.ndarray, b: np.ndarray) -> Array:
    """Quaternion product ``a b``: first turn by b, then by a."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    aw, bw, av, bv = a[..., :1], b[..., :1], a[..., 1:], b[..., 1:]
    scalar = aw * bw - (av * bv).sum(-1, keepdims=True)
    return np.concatenate([scalar, aw * bv + bw * av + cross(av, bv)], axis=-1)


def inverse(q: np.ndarray) -> Array:
    """Inverse of unit quaternions."""
    return np.asarray(q, dtype=np.float64) * np.array([1.0, -1.0, -1.0, -1.0])


def cross(a: np.ndarray, b: np.ndarray) -> Array:
    """Cross product of vectors ``(..., 3)``; NumPy's own spends more on its axes than on the product."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def rotate(q: np.ndarray, v: np.ndarray) -> Array:
    """Turn vectors ``(..., 3)`` by unit quaternions ``(..., 4)``."""
    q = np.asarray(q, dtype=np.float64)
    v = np.asarray(v, dtype=np.float64)
    t = 2.0 * cross(q[..., 1:], v)
    return v + q[..., :1] * t + cross(q[..., 1:], t)


def normalize(q: np.ndarray) -> Array:
    """Scale to unit length; zero quaternions become the identity."""
    q = np.asarray(q, dtype=np.float64)
    length = np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(length > 1e-12, q / np.maximum(length, 1e-12), IDENTITY)


def quat_to_matrix(q: np.ndarray) -> Array:
    """Unit quaternions to matrices ``(..., 3, 3)``."""
    w, x, y, z = np.moveaxis(np.asarray(q, dtype=np.float64), -1, 0)
    rows = (
        (x * x - y * y - z * z + w * w, 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), -x * x + y * y - z * z + w * w, 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), -x * x - y * y + z * z + w * w),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def matrix_to_quat(m: np.ndarray) -> Array:
    """Rotation matrices ``(..., 3, 3)`` to unit quaternions.

    Each of four vectors is the quaternion times four times one of its parts; the longest is normalised
    (Markley, "Unit Quaternion from Rotation Matrix", 2008).
    """
    m = np.asarray(m, dtype=np.float64)
    x, y, z = (m[..., i, i] for i in range(3))
    xy, yz, zx = (m[..., i, j] + m[..., j, i] for i, j in ((0, 1), (1, 2), (2, 0)))
    wx, wy, wz = (m[..., i, j] - m[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0)))
    rows = (
        (1 + x + y + z, wx, wy, wz),
        (wx, 1 + x - y - z, xy, zx),
        (wy, xy, 1 + y - z - x, yz),
        (wz, zx, yz, 1 + z - x - y),
    )
    four = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    longest = np.diagonal(four, axis1=-2, axis2=-1).argmax(-1)
    q = np.take_along_axis(four, longest[..., None, None], axis=-2)[..., 0, :]
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def rotvec_to_quat(v: np.ndarray) -> Array:
    """Rotation vectors (radians) to unit quaternions."""
    v = np.asarray(v, dtype=np.float64)
    half = np.linalg.norm(v, axis=-1, keepdims=True) / 2
    return np.concatenate([np.cos(half), _ratio(np.sin(half), half) / 2 * v], axis=-1)


def quat_to_rotvec(q: np.ndarray) -> Array:
    """Unit quaternions to rotation vectors (radians), the shorter way round."""
    q = np.asarray(q, dtype=np.float64)
    q = q * np.where(q[..., :1] > 0, 1.0, -1.0)
    half = np.arctan2(np.linalg.norm(q[..., 1:], axis=-1, keepdims=True), q[..., :1])
    return 2 * _ratio(half, np.sin(half)) * q[..., 1:]


def _ratio(a: Array, b: Array) -> Array:
    """``a / b`` of two lengths that vanish together, 1 where they do."""
    return np.divide(a, b, out=np.ones_like(a), where=b != 0)


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
    """Unit quaternions to intrinsic Euler angles (radians) in three distinct axes such as ``"ZXY"``.

    The middle angle is within a quarter turn; where it is one, only a sum of the others is known, and the last is 0.
    (Bernardes & Viollet, "Quaternion to Euler angles conversion", 2022.)
    """
    k, j, i = ("XYZ".index(axis) for axis in order.upper())
    sign = (i - j) * (j - k) * (k - i) // 2
    q = np.asarray(q, dtype=np.float64)
    w, vector = q[..., 0], q[..., 1:]
    a, b = w - vector[..., j], vector[..., i] + vector[..., k] * sign
    c, d = vector[..., j] + w, vector[..., k] * sign - vector[..., i]
    middle = 2 * np.arctan2(np.hypot(c, d), np.hypot(a, b))
    low, high = middle <= _NEARLY_LOCKED, np.abs(middle - np.pi) <= _NEARLY_LOCKED
    total, rest = np.arctan2(b, a), np.arctan2(d, c)
    first = np.where(low, 2 * total, np.where(high, 2 * rest, total + rest)) * sign
    last = np.where(low | high, 0.0, total - rest)
    angles = np.stack([first, middle - np.pi / 2, last], axis=-1)
    return angles - 2 * np.pi * (1.0 * (angles > np.pi) - (angles < -np.pi))


def shortest_arc(a: np.ndarray, b: np.ndarray) -> Array:
    """Smallest rotation that turns the direction of a into the direction of b; no twist about either."""
    a = np.asarray(a, dtype=np.float64) / np.linalg.norm(a, axis=-1, keepdims=True).clip(1e-12)
    b = np.asarray(b, dtype=np.float64) / np.linalg.norm(b, axis=-1, keepdims=True).clip(1e-12)
    a, b = np.broadcast_arrays(a, b)
    w = 1.0 + (a * b).sum(-1, keepdims=True)
    q = np.concatenate([w, cross(a, b)], axis=-1)
    opposite = w[..., 0] < 1e-12
    if opposite.any():
        other = np.where(np.abs(a[..., :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
        q = np.where(opposite[..., None], np.concatenate([0 * w, cross(a, other)], axis=-1), q)
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
