"""Two people in one world: two canonical motions, and the ground pose of each.

HumanML3D features describe each motion relative to its own first frame. What relates two people is thus lost, but for
four numbers per person, a ground pose (cos f, sin f, x, z) of `core.ground`: where somebody is at frame 0, in
metres, and which way they face. All functions but `encode` take arrays and tensors, with any leading axes.

`PlaceCode` says how ground poses become the numbers D of a network of two people (Shafir et al. 2024, section 3.2).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionloom.core.arrays import Numbers, namespace
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.humanml import Heading, recover_root
from motionloom.core.features.positions import SMPL_LAYOUT
from motionloom.core.ground import compose, from_world, mirrored, normalized, parts, relative, stack, to_world

Array = NDArray[np.float64]
__all__ = ["compose", "mirrored"]


class PairMotion(NamedTuple):
    """Two people in one world: what each of them does, and where they are. A batch of pairs has axes before these."""

    features: NDArray[Any]
    """(2, frames, 263), not standardised."""
    poses: NDArray[Any]
    """(2, 4) ground poses in the world, at frame 0."""

    @staticmethod
    def stack(pairs: "Sequence[PairMotion]") -> "PairMotion":
        """A batch of pairs of one length."""
        return PairMotion(np.stack([one.features for one in pairs]), np.stack([one.poses for one in pairs]))

    def each(self) -> "Iterator[PairMotion]":
        """The pairs of a batch, ground poses in float64."""
        return map(PairMotion, self.features, self.poses.astype(np.float64))

    def places(self) -> NDArray[Any]:
        """(2, frames, 22, 3) metres in the world."""
        return decode(self.features, self.poses)

    def ways(self) -> NDArray[Any]:
        """(2, frames, 4) ground poses."""
        return compose(self.poses[..., None, :], along(self.features))

    def crop(self, first: int, last: int) -> "PairMotion":
        """The frames from ``first`` to before ``last``, with the ground poses at the first of them.

        (The published code keeps those of the file's first frame for every crop.)
        """
        poses = compose(self.poses, along(self.features[..., : first + 1, :])[..., first, :])
        return PairMotion(self.features[..., first:last, :], poses)

    def moved_to(self, pose: np.ndarray, person: int) -> "PairMotion":
        """The same moved rigidly on the ground so that the ground pose (4,) of ``person`` at frame 0 is ``pose``."""
        return self._replace(poses=compose(pose, relative(self.poses[person], self.poses)))

    def changed(self, change: np.ndarray, shares: np.ndarray) -> "PairMotion":
        """With the second person's facing, x and z changed (frames, 3) relative to the first: by shares (2,) of it."""
        features, poses, ways = self.features.copy(), self.poses.copy(), self.ways()
        for person, share in ((0, -shares[0]), (1, shares[1])):
            features[person] = moved_along(features[person], ways[person], share * change)
            poses[person] = on_the_spot(poses[person, None], share * change[:1, 0])[0]
            poses[person, 2:] += share * change[0, 1:]
        return PairMotion(features, poses)


def swapped(pair: Numbers, axis: int = 0) -> Numbers:
    """The two people exchanged; ``axis`` is the one of length 2."""
    return namespace(pair).roll(pair, 1, axis)


# Features and ground poses


def floors(positions: np.ndarray) -> Array:
    """(2,) metres: the height that the features of each person call 0; positions (2, frames, 22, 3)."""
    return np.asarray(positions, dtype=np.float64)[..., 1].min(axis=(1, 2))


def encode(positions: np.ndarray, *, heading: Heading = "corrected") -> PairMotion:
    """Two people in one world, (2, frames, 22, 3) metres at 20 fps, +Y up, of which features have a frame less.

    Each is relative to the own ground pose in frame 0 and to the own of `floors`, as `humanml.canonical` does. The
    bodies are taken as they are: people of the uniform size, for the shipped weights, which were trained on
    ``corrected`` headings (smoothed ones, in frame 0 too); ``compatible`` is the published way, for published weights.
    """
    p = _checked(positions)
    place = SMPL_LAYOUT.place(p[:, 0])
    angle, (x, _, z) = place.facing, place.origin.T
    poses = stack(np.cos(angle), np.sin(angle), x, z)
    local = from_world(p - floors(p)[:, None, None, None] * np.array([0.0, 1.0, 0.0]), poses[:, None, None])
    if heading == "corrected":
        turn = np.stack([humanml.heading_quaternions(one, heading=heading)[0] for one in local])
        w, y, zero = turn[:, 0], turn[:, 2], np.zeros(2)
        poses = compose(poses, stack(1 - 2 * y * y, -2 * w * y, zero, zero))
    return PairMotion(np.stack([humanml.encode(one, heading=heading) for one in local]), poses)


def decode(features: Numbers, poses: Numbers) -> Numbers:
    """Features (..., frames, 263) and ground poses (..., 4) to places (..., frames, 22, 3) metres in the world.

    The first axis of the two, or any other, may be the one of the people. Differentiable for tensors.
    """
    places: Any = humanml.decode_positions(features)
    return to_world(places, poses[..., None, None, :])


def along(features: Numbers) -> Numbers:
    """Ground poses (..., frames, 4) along a motion (..., frames, 263), relative to frame 0 as the features have it."""
    quaternion, place = recover_root(features)
    w, y = quaternion[..., 0], quaternion[..., 2]
    return stack(1 - 2 * y * y, -2 * w * y, place[..., 0], place[..., 2])  # it turns the world into the heading


def on_the_spot(poses: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Ground poses (rows, 4) of people who turn on the spot, in radians (rows,) to their left."""
    c, s = np.cos(angle), np.sin(angle)
    return stack(c * poses[:, 0] - s * poses[:, 1], s * poses[:, 0] + c * poses[:, 1], poses[:, 2], poses[:, 3])


def moved_along(features: np.ndarray, way: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Features (frames, 263) of somebody who goes ``way`` (frames, 4), with a change (frames, 3) of facing, x and z."""
    new = features.copy()
    turn, step = change[1:, 0], change[1:, 1:] - change[:-1, 1:]
    new[:-1, 0] -= (change[1:, 0] - change[:-1, 0]) / 2
    # velocities are in the heading of the frame after them
    x, z = _back(features[:-1, 1], features[:-1, 2], np.cos(turn), np.sin(turn))
    there = on_the_spot(way[1:], turn)
    more = _back(step[:, 0], step[:, 1], there[:, 0], there[:, 1])
    new[:-1, 1], new[:-1, 2] = x + more[0], z + more[1]
    return new


def _back(x: np.ndarray, z: np.ndarray, c: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A way on the ground as somebody who turned by an angle of this cosine and sine sees it."""
    return c * x - s * z, c * z + s * x


# Numbers for a network


@dataclass(frozen=True)
class PlaceCode:
    """How two ground poses become 4 numbers per person for a network, and back."""

    kind: Literal["mutual", "world"] = "mutual"
    """``mutual``: for each person the ground pose of the *other* as seen from there, so that nothing depends on the
    world's axes; ``world``: everybody's own ground pose, as published."""
    turn: float = 1.0
    """What cosine and sine are multiplied with; 0.1 as published."""
    ground: float = 1.0
    """What metres are multiplied with; 0.1 as published."""

    def __post_init__(self) -> None:
        scales = (self.turn, self.ground)
        numbers = all(isinstance(n, int | float) and not isinstance(n, bool) and 1e-3 <= n <= 1e3 for n in scales)
        if self.kind not in ("mutual", "world") or not numbers:
            raise MotionloomError(f"the places of two people cannot be coded by {self}; give mutual or world")

    def encode(self, poses: Numbers) -> Numbers:
        """Ground poses (..., 2, 4) in one world to numbers (..., 2, 4); those of exchanged people are exchanged.

        ``world``: (cos f, -sin f, x, z), which are the entries 0, 2, 6 and 8 of the published nine: the first row of
        the rotation from the world to the person, and the ground translation.
        """
        c, s, x, z = parts(relative(poses, swapped(poses, -2)) if self.kind == "mutual" else poses)
        return stack(self.turn * c, self.turn * (s if self.kind == "mutual" else -s), self.ground * x, self.ground * z)

    def raw(self, numbers: Numbers) -> Numbers:
        """Numbers (..., 4) without their scales: of ``mutual`` the other's ground pose as a person sees it, of
        ``world`` the person's own."""
        c, s, x, z = parts(numbers)
        s = s if self.kind == "mutual" else -s
        return stack(c / self.turn, s / self.turn, x / self.ground, z / self.ground)

    def decode(self, numbers: Numbers) -> Numbers:
        """Numbers (..., 2, 4), exact or predicted, to ground poses (..., 2, 4).

        ``mutual``: the first person is at the origin facing +Z, and the two views, which may disagree a little when
        they are predicted, are averaged; so the relative pose of exchanged people is as before. ``world``: in that
        world.
        """
        poses = self.raw(numbers)
        if self.kind == "world":
            return normalized(poses)
        first, second = poses[..., 0, :], poses[..., 1, :]
        both = stack(
            first[..., 0] + second[..., 0], first[..., 1] - second[..., 1], 0 * first[..., 0], 0 * first[..., 0]
        )
        c, s, x, z = parts(normalized(both))
        # the first person as the second sees him, turned round: the second as the first sees him
        x2, z2 = -(c * second[..., 2] + s * second[..., 3]), -(c * second[..., 3] - s * second[..., 2])
        other = stack(c, s, (first[..., 2] + x2) / 2, (first[..., 3] + z2) / 2)
        return namespace(other).stack((stack(1 + 0 * c, 0 * s, 0 * x, 0 * z), other), axis=-2)


PUBLISHED_CODE = PlaceCode("world", 0.1, 0.1)
"""The numbers of the published two-person checkpoints."""


def as_published(poses: Numbers) -> Numbers:
    """Ground poses (..., 2, 4) to where the published tools draw people: the first one at the origin facing +Z.

    p_1 becomes R_0 R_1' p_1 + (t_1 - t_0): the difference on the ground is not turned, which is right only where the
    first person faces +Z in the world. For comparison with published numbers; `relative` is the right one.
    """
    first, second = poses[..., 0, :], poses[..., 1, :]
    turned = relative(first, second)
    there = stack(turned[..., 0], turned[..., 1], *parts(second - first)[2:])
    return namespace(poses).stack((relative(first, first), there), axis=-2)


def _checked(positions: np.ndarray) -> Array:
    p = np.asarray(positions, dtype=np.float64)
    if p.ndim != 4 or p.shape[0] != 2 or p.shape[2:] != (22, 3) or p.shape[1] < 2:
        raise MotionloomError(f"two people must be (2, frames, 22, 3) with at least 2 frames; got {p.shape}")
    if not np.isfinite(p).all():
        raise MotionloomError("the places of the two people have numbers that are not finite (NaN or infinity)")
    return p
