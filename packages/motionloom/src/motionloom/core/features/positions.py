"""Joint places as prediction networks see them: from the root, in the frame of the last observed pose.

A `Layout` says which joints there are and which numbers describe them. The published systems (Chen et al. 2023,
HumanMAC) take the places of all joints but the root, relative to the root, and leave the root's way through the world
out; here it can be three further numbers, and the person can be turned to face +Z in the last observed frame.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.ground import turned
from motionloom.core.skeleton import SMPL22

Array = NDArray[np.float64]
MAX_JOINTS = 256


@dataclass(frozen=True)
class Layout:
    """The joints of a predictor and how their places become numbers; joint 0 is the root."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    pairs: tuple[int, ...]
    """For each joint the one on the other side, itself on the middle line."""
    across: tuple[tuple[int, int], ...] = ()
    """(left, right) joints, such as hips and shoulders: the lines between them show where the person faces. Empty:
    places keep the world's axes, as published."""
    root: bool = True
    """Whether the root's path through the world is among the numbers, as three before the others."""
    z_up: bool = False
    """Whether the numbers have +Z up, as in Human3.6M files; positions handed in and out always have +Y up."""

    def __post_init__(self) -> None:
        n = len(self.names)
        tree = self.parents[:1] == (-1,) and all(0 <= p < j for j, p in enumerate(self.parents[1:], start=1))
        pairs = len(self.pairs) == n and all(0 <= p < n and self.pairs[p] == j for j, p in enumerate(self.pairs))
        sides = all(len(pair) == 2 and all(0 <= j < n for j in pair) for pair in self.across)
        if not (2 <= n <= MAX_JOINTS and len(self.parents) == n and tree and pairs and sides):
            raise MotionloomError(f"the layout of {n} joints is not usable; parents, pairs and names must fit together")
        if self.z_up and self.across:
            raise MotionloomError("a layout is turned to the person's facing with +Y up only")

    @property
    def joints(self) -> int:
        """Joints, the root among them."""
        return len(self.names)

    @property
    def parts(self) -> int:
        """Joints that have numbers: the root only if its path is among them."""
        return self.joints - (not self.root)

    @property
    def channels(self) -> int:
        """Numbers per frame."""
        return 3 * self.parts

    def encode(self, positions: np.ndarray, place: "Place") -> Array:
        """(..., frames, joints, 3) metres in the world to (..., frames, channels), seen from ``place`` (...)."""
        p = place.into(np.asarray(positions, dtype=np.float64))
        p = np.concatenate([p[..., :1, :], p[..., 1:, :] - p[..., :1, :]], axis=-2)
        p = p if self.root else p[..., 1:, :]
        if self.z_up:
            p = np.stack([p[..., 2], p[..., 0], p[..., 1]], axis=-1)
        return p.reshape(*p.shape[:-2], self.channels)

    def decode(self, features: np.ndarray, place: "Place") -> Array:
        """The inverse of `encode`; a root without numbers stays in its place."""
        p = np.asarray(features, dtype=np.float64).reshape(*features.shape[:-1], self.parts, 3)
        if self.z_up:
            p = np.stack([p[..., 1], p[..., 2], p[..., 0]], axis=-1)
        root = p[..., :1, :] if self.root else np.zeros_like(p[..., :1, :])
        rest = p[..., 1:, :] if self.root else p
        return place.out(np.concatenate([root, rest + root], axis=-2))

    def place(self, positions: np.ndarray) -> "Place":
        """Ground pose of the person of poses (..., joints, 3), facing +Z if ``across`` is empty; batch shape (...)."""
        p = np.asarray(positions, dtype=np.float64)
        origin = p[..., 0, :] * (np.array([1.0, 0.0, 1.0]) if self.root else 1.0)
        if not self.across:
            return Place(origin, np.zeros(origin.shape[:-1]))
        line = sum((p[..., left, :] - p[..., right, :] for left, right in self.across), np.zeros(3))
        return Place(origin, np.arctan2(-line[..., 2], line[..., 0]))

    def mirrored(self, positions: np.ndarray) -> Array:
        """Left and right exchanged: reflected in x = 0 with the joints of both sides swapped."""
        return np.asarray(positions)[..., list(self.pairs), :] * np.array([-1.0, 1.0, 1.0])

    def part(self, joint: int) -> int:
        """Which triple of numbers a joint has; raises MotionloomError for a root that has none."""
        if joint == 0 and not self.root:
            raise MotionloomError("this predictor does not see the root's way, so it cannot be held")
        return joint - (not self.root)

    @staticmethod
    def parse(values: dict[str, Any]) -> "Layout":
        """From plain data out of a weight file; raises MotionloomError."""
        try:
            return Layout(
                tuple(map(str, values["names"])),
                tuple(map(int, values["parents"])),
                tuple(map(int, values["pairs"])),
                tuple((int(a), int(b)) for a, b in values["across"]),
                values["root"] is True,
                values["z_up"] is True,
            )
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise MotionloomError(f"the layout of the joints is not usable: {error!r}") from None

    def plain(self) -> dict[str, Any]:
        """What `parse` reads."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Place:
    """A point on the way and a facing, one per batch entry: what numbers are relative to."""

    origin: Array
    """(..., 3) metres."""
    facing: Array
    """(...) radians, 0 faces +Z, growing to the left."""

    def into(self, positions: Array) -> Array:
        """(..., frames, joints, 3) of the world as seen from here."""
        return turned(positions - self.origin[..., None, None, :], -self.facing[..., None, None])

    def out(self, positions: Array) -> Array:
        """The inverse of `into`."""
        return turned(positions, self.facing[..., None, None]) + self.origin[..., None, None, :]


def with_bones(positions: np.ndarray, parents: tuple[int, ...], *, like: np.ndarray) -> Array:
    """(..., frames, joints, 3) with every bone as long as in the frames of ``like``, its mean; the root stays."""
    p, long = np.asarray(positions, dtype=np.float64), bone_lengths(like, parents)[..., None, :, None]
    result = p.copy()
    for j, parent in enumerate(parents[1:], start=1):
        bone = p[..., j, :] - p[..., parent, :]
        scale = long[..., j, :] / np.maximum(np.linalg.norm(bone, axis=-1, keepdims=True), 1e-9)
        result[..., j, :] = result[..., parent, :] + bone * scale
    return result


def bone_lengths(positions: np.ndarray, parents: tuple[int, ...]) -> Array:
    """(..., joints) metres: of places (..., frames, joints, 3) the mean length of each joint's bone to its parent."""
    p = np.asarray(positions, dtype=np.float64)
    bones = np.linalg.norm(p[..., 1:, :] - p[..., list(parents[1:]), :], axis=-1).mean(axis=-2)
    return np.concatenate([np.zeros((*bones.shape[:-1], 1)), bones], axis=-1)


SMPL_LAYOUT = Layout(SMPL22.names, SMPL22.parents, SMPL22.mirror_pairs(), ((1, 2), (16, 17)))
"""The 22 joints of the uniform person, its path through the world and its facing included."""
