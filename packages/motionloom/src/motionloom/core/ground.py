"""`GroundPose`: where somebody is on the ground and which way they face. Rigid motions of the ground plane, SE(2).

Metres, +Y up; radians about +Y: 0 faces +Z, growing to the left, so that a quarter turn faces +X. Networks and batches
use the same value as four numbers (..., 4): cos, sin, x, z. Functions on these take arrays and tensors, with any
leading axes that broadcast.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core.arrays import Numbers, namespace
from motionloom.core.arrays import stack as stack

Array = NDArray[np.float64]


def turned(points: np.ndarray, angle: np.ndarray | float) -> Array:
    """Points (..., 3) turned about +Y by ``angle`` radians to the left; the angle broadcasts against (...)."""
    p = np.asarray(points, dtype=np.float64)
    sin, cos = np.sin(angle), np.cos(angle)
    x, z = p[..., 0], p[..., 2]
    return np.stack([cos * x + sin * z, p[..., 1], cos * z - sin * x], axis=-1)


@dataclass(frozen=True)
class GroundPose:
    """A place on the ground and a direction; also the world seen from there."""

    x: float = 0.0
    """Metres."""
    z: float = 0.0
    facing: float = 0.0
    """Radians."""

    @staticmethod
    def of(origin: np.ndarray, facing: float) -> "GroundPose":
        """Below a point (3,) metres, facing so."""
        return GroundPose(float(origin[0]), float(origin[2]), float(facing))

    @staticmethod
    def of_numbers(numbers: np.ndarray) -> "GroundPose":
        """From (4,) cos, sin, x, z."""
        c, s, x, z = map(float, numbers)
        return GroundPose(x, z, float(np.arctan2(s, c)))

    def numbers(self) -> Array:
        """(4,) cos, sin, x, z."""
        return np.array([np.cos(self.facing), np.sin(self.facing), self.x, self.z])

    def to_world(self, points: np.ndarray) -> Array:
        """(..., 3) from here (origin, facing +Z) into the world."""
        return turned(points, self.facing) + np.array([self.x, 0, self.z])

    def from_world(self, points: np.ndarray) -> Array:
        """(..., 3) from the world to here."""
        return turned(np.asarray(points, dtype=np.float64) - [self.x, 0, self.z], -self.facing)

    def seen_from(self, place: "GroundPose") -> "GroundPose":
        """This one in coordinates in which ``place`` is the origin and faces +Z."""
        x, _, z = place.from_world(np.array([self.x, 0.0, self.z]))
        return GroundPose(float(x), float(z), self.facing - place.facing)

    def apart(self, other: "GroundPose") -> tuple[float, float]:
        """Metres and radians, 0 to pi, from one to the other."""
        turn = (self.facing - other.facing + np.pi) % (2 * np.pi) - np.pi
        return float(np.hypot(self.x - other.x, self.z - other.z)), abs(turn)

    def inverse(self) -> "GroundPose":
        """The world's origin as seen from here."""
        return GroundPose().seen_from(self)


# The same as four numbers (..., 4): cos, sin, x, z


def compose(base: Numbers, pose: Numbers) -> Numbers:
    """A pose (..., 4) given relative to ``base`` (..., 4), in the world of ``base``."""
    (c, s, x, z), (c1, s1, x1, z1) = parts(base), parts(pose)
    return stack(c * c1 - s * s1, s * c1 + c * s1, x + c * x1 + s * z1, z + c * z1 - s * x1)


def relative(base: Numbers, pose: Numbers) -> Numbers:
    """A pose (..., 4) in the world of ``base`` (..., 4), relative to it: the inverse of `compose`."""
    (c, s, x, z), (c1, s1, x1, z1) = parts(base), parts(pose)
    dx, dz = x1 - x, z1 - z
    return stack(c * c1 + s * s1, c * s1 - s * c1, c * dx - s * dz, c * dz + s * dx)


def to_world(points: Numbers, pose: Numbers) -> Numbers:
    """Points (..., 3) relative to a pose (..., 4) into the world."""
    c, s, x, z = parts(pose)
    px, y, pz = points[..., 0], points[..., 1], points[..., 2]
    return stack(c * px + s * pz + x, y + 0 * c, c * pz - s * px + z)


def from_world(points: Numbers, pose: Numbers) -> Numbers:
    """The inverse of `to_world`."""
    c, s, x, z = parts(pose)
    dx, y, dz = points[..., 0] - x, points[..., 1], points[..., 2] - z
    return stack(c * dx - s * dz, y + 0 * c, c * dz + s * dx)


def normalized(poses: Numbers) -> Numbers:
    """Poses (..., 4) whose first two numbers are only about a cosine and a sine, made exact; no direction is +Z."""
    c, s, x, z = parts(poses)
    length = (c * c + s * s) ** 0.5
    here = length > 1e-6
    xp = namespace(poses)
    size = xp.where(here, length, xp.ones_like(length))
    return stack(xp.where(here, c / size, xp.ones_like(c)), xp.where(here, s / size, 0 * s), x, z)


def mirrored(poses: Numbers) -> Numbers:
    """Poses (..., 4) in the world with left and right exchanged (x becomes -x)."""
    c, s, x, z = parts(poses)
    return stack(c, -s, -x, z)


def parts(poses: Any) -> tuple[Any, Any, Any, Any]:
    """cos, sin, x, z of (..., 4), each (...)."""
    return poses[..., 0], poses[..., 1], poses[..., 2], poses[..., 3]
