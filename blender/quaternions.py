"""Rotations and places as arrays: quaternions (..., 4) in the order w, x, y, z, and 4 by 4 matrices."""

import numpy as np


def multiply(a, b):
    """The rotation b, then a; (..., 4) each, broadcast."""
    aw, ax, ay, az = np.moveaxis(np.asarray(a, dtype=np.float64), -1, 0)
    bw, bx, by, bz = np.moveaxis(np.asarray(b, dtype=np.float64), -1, 0)
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=-1,
    )


def inverse(q):
    """The rotation back."""
    return np.asarray(q) * [1.0, -1.0, -1.0, -1.0]


def rotate(q, points):
    """Points (..., 3) turned by unit quaternions (..., 4)."""
    return np.einsum("...ij,...j->...i", to_matrix(q), points)


def to_matrix(q):
    """(..., 3, 3) of unit quaternions."""
    w, x, y, z = np.moveaxis(np.asarray(q, dtype=np.float64), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def from_matrix(m):
    """(..., 4) unit quaternions of rotations (..., 3, 3), by the largest of the four numbers."""
    m = np.asarray(m, dtype=np.float64)
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    four = np.stack([1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz], axis=-1)
    a, b, c = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    xy, xz, yz = m[..., 0, 1] + m[..., 1, 0], m[..., 0, 2] + m[..., 2, 0], m[..., 1, 2] + m[..., 2, 1]
    rows = [
        np.stack([four[..., 0], a, b, c], axis=-1),
        np.stack([a, four[..., 1], xy, xz], axis=-1),
        np.stack([b, xy, four[..., 2], yz], axis=-1),
        np.stack([c, xz, yz, four[..., 3]], axis=-1),
    ]
    largest = four.argmax(axis=-1)[..., None, None]
    return normalize(np.take_along_axis(np.stack(rows, axis=-2), largest, axis=-2)[..., 0, :])


def normalize(q):
    """Of length 1."""
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def unroll(q):
    """Quaternions (frames, ..., 4) of the same rotations without jumps of sign from frame to frame."""
    flips = np.where((q[1:] * q[:-1]).sum(axis=-1) < 0, -1.0, 1.0)
    signs = (
        np.concatenate([np.ones_like(flips[:1]), np.cumprod(flips, axis=0)]) if len(flips) else np.ones(q.shape[:-1])
    )
    return q * signs[..., None]


def between(a, b, share):
    """From a to b (..., 4) by a share (...) of the way; neighbours in time are near, so the chord is normalized."""
    near = np.where((a * b).sum(axis=-1, keepdims=True) < 0, -b, b)
    return normalize(a + (near - a) * np.asarray(share)[..., None])


def arc(a, b):
    """(4,) the smallest turn from the direction a (3,) to b."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    cosine = float(a @ b)
    if cosine < -0.999999:
        other = np.cross(a, [1.0, 0.0, 0.0] if abs(a[0]) < 0.9 else [0.0, 1.0, 0.0])
        return np.array([0.0, *(other / np.linalg.norm(other))])
    return normalize(np.array([1.0 + cosine, *np.cross(a, b)]))
