"""`Motion`: a skeleton moving through time. What every part of the project outside diffusion speaks.

Metres, seconds, radians; right-handed, +Y up, a person faces +Z at rest; quaternions ``(w, x, y, z)``;
frames before joints before coordinates.
"""

from dataclasses import dataclass, replace
from importlib import import_module

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.ground import GroundPose
from motionloom.core.skeleton import SMPL22, Skeleton

Array = NDArray[np.float64]
MAX_POSES = 100_000_000
"""Frames times joints of the longest motion that is generated or read; some 10 GB."""
_LEFT_HIP, _RIGHT_HIP, _LEFT_SHOULDER, _RIGHT_SHOULDER = map(
    SMPL22.index, ("left_hip", "right_hip", "left_shoulder", "right_shoulder")
)


@dataclass(frozen=True, eq=False, repr=False)
class Motion:
    """Poses of one skeleton at a constant frame rate."""

    skeleton: Skeleton
    fps: float
    """Frames per second."""
    root: Array
    """(frames, 3) metres: joint 0 in the world."""
    rotations: Array
    """(frames, joints, 4): each joint's orientation in its parent's frame; joint 0 in the world."""
    translations: Array | None = None
    """(frames, joints, 3) metres in the parent's frame, for the rare motion whose bones change length; row 0 unused."""

    def __post_init__(self) -> None:
        for name in ("root", "rotations", "translations"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, np.asarray(value, dtype=np.float64))
        frames, joints = len(self.root), len(self.skeleton)
        if self.root.shape != (frames, 3) or self.rotations.shape != (frames, joints, 4) or frames == 0:
            raise MotionloomError(
                f"a motion of {joints} joints needs root (frames, 3) and rotations (frames, {joints}, 4), at least one "
                f"frame; got {self.root.shape} and {self.rotations.shape}"
            )
        moved = self.translations
        if moved is not None and moved.shape != (frames, joints, 3):
            raise MotionloomError(f"translations must be ({frames}, {joints}, 3); got {moved.shape}")
        if not (np.isfinite(self.fps) and self.fps > 0):
            raise MotionloomError(f"the frame rate must be a positive number; got {self.fps}")
        values = [self.root, self.rotations] + ([] if moved is None else [moved])
        if not all(np.isfinite(v).all() for v in values):
            raise MotionloomError("the motion has numbers that are not finite (NaN or infinity)")

    def __len__(self) -> int:
        return len(self.root)

    @property
    def seconds(self) -> float:
        """Length in seconds: frames / fps."""
        return len(self) / self.fps

    def __repr__(self) -> str:
        """One line: thousands of numbers tell nobody what a motion is."""
        return (
            f"Motion({len(self.skeleton)} joints, {len(self)} frames, {self.seconds:.2f} s at {self.fps:g} per second)"
        )

    def _repr_html_(self) -> str:
        """What a notebook shows of the motion: a poster, and a player on a click (`motionloom.viz.notebook.framed`)."""
        return import_module("motionloom.viz.notebook").framed(self)

    def world_rotations(self) -> Array:
        """(frames, joints, 4): world_from_joint."""
        world = np.empty_like(self.rotations)
        world[:, 0] = self.rotations[:, 0]
        for j, p in enumerate(self.skeleton.parents[1:], start=1):
            world[:, j] = rot.multiply(world[:, p], self.rotations[:, j])
        return world

    def positions(self) -> Array:
        """(frames, joints, 3) metres in the world: forward kinematics."""
        world = self.world_rotations()
        places = np.empty((len(self), len(self.skeleton), 3))
        places[:, 0] = self.root
        for j, p in enumerate(self.skeleton.parents[1:], start=1):
            offset = self.skeleton.offsets[j] if self.translations is None else self.translations[:, j]
            places[:, j] = places[:, p] + rot.rotate(world[:, p], np.broadcast_to(offset, (len(self), 3)))
        return places

    def frames(self, start: int, stop: int, step: int = 1) -> "Motion":
        """Frames ``start`` to ``stop`` (half-open), every ``step``-th of them."""
        some = slice(start, stop, step)
        moved = None if self.translations is None else self.translations[some]
        turned = self.rotations[some]
        return Motion(self.skeleton, self.fps, self.root[some], turned, moved)

    def thinned(self, most: int) -> "Motion":
        """Every so many-th frame, at the rate that goes with it, so that there are at most ``most``."""
        step = -(-len(self) // most)
        return replace(self.frames(0, len(self), step), fps=self.fps / step)

    def crop(self, start_s: float, end_s: float) -> "Motion":
        """The part from ``start_s`` to ``end_s`` seconds; raises `MotionloomError` where that is no frame."""
        start, stop = round(start_s * self.fps), round(end_s * self.fps)
        if not 0 <= start < stop <= len(self):
            raise MotionloomError(
                f"cannot crop {start_s:g} to {end_s:g} s from a motion of {self.seconds:.3f} s; give a start below the "
                f"end, both from 0 to {self.seconds:.3f}, at least a frame ({1 / self.fps:.3g} s) apart"
            )
        return self.frames(start, stop)

    def resample(self, fps: float) -> "Motion":
        """The same motion at another frame rate: places linearly, rotations spherically interpolated by time.

        Raises `MotionloomError` for a rate that is no positive number, or that makes more than `MAX_POSES`.
        """
        if not (np.isfinite(fps) and fps > 0):
            raise MotionloomError(f"the frame rate must be a positive number; got {fps}")
        if fps == self.fps:
            return self
        frames = (len(self) - 1) / self.fps * fps
        if frames * len(self.skeleton) > MAX_POSES:
            raise MotionloomError(
                f"{self.seconds:g} s at {fps:g} fps make {frames:.0f} frames of {len(self.skeleton)} joints "
                f"and at most {MAX_POSES:,} of both together are made; ask for a lower rate or crop the motion first"
            )
        count = int(np.floor(frames + 1e-6)) + 1
        return self.at(np.arange(count) * (self.fps / fps), fps)

    def at(self, places: np.ndarray, fps: float) -> "Motion":
        """The poses at fractional frame numbers, as a motion of rate ``fps``; beyond either end that end's pose."""
        low = np.clip(np.floor(places).astype(int), 0, len(self) - 1)
        high = np.minimum(low + 1, len(self) - 1)
        amount = np.asarray(places - low, dtype=np.float64).clip(0, 1)

        def lerp(x: Array) -> Array:
            a = amount.reshape(-1, *[1] * (x.ndim - 1))
            return x[low] * (1 - a) + x[high] * a

        first, last = self.rotations[low], self.rotations[high]
        turned = rot.slerp(first, last, np.broadcast_to(amount[:, None], first.shape[:2]))
        moved = None if self.translations is None else lerp(self.translations)
        return Motion(self.skeleton, float(fps), lerp(self.root), turned, moved)

    def placed(self, place: GroundPose) -> "Motion":
        """A motion that starts at the origin facing +Z, started at ``place`` instead."""
        rotations = self.rotations.copy()
        rotations[:, 0] = rot.multiply(rot.rotvec_to_quat(np.array([0.0, place.facing, 0.0])), rotations[:, 0])
        return replace(self, root=place.to_world(self.root), rotations=rot.unroll(rotations))

    def turned(self, turn: np.ndarray) -> "Motion":
        """The motion turned about the world's origin by a quaternion (4,)."""
        rotations = self.rotations.copy()
        rotations[:, 0] = rot.multiply(turn, rotations[:, 0])
        return replace(self, root=rot.rotate(turn, self.root), rotations=rotations)

    def scaled(self, size: float) -> "Motion":
        """The same motion of a body, and over a way, ``size`` times as large."""
        moved = None if self.translations is None else self.translations * size
        skeleton = self.skeleton.scaled(size)
        return Motion(skeleton, self.fps, self.root * size, self.rotations, moved)

    def mirror(self) -> "Motion":
        """Left and right exchanged: reflected in the plane x = 0, joint names swapped by side.

        Exact on a skeleton whose two sides have the same lengths; elsewhere each limb keeps its own bones.
        """
        pairs = list(self.skeleton.mirror_pairs())
        flip = np.array([-1.0, 1.0, 1.0])
        moved = None if self.translations is None else self.translations[:, pairs] * flip
        turned = self.rotations[:, pairs] * np.array([1.0, 1.0, -1.0, -1.0])
        return Motion(self.skeleton, self.fps, self.root * flip, turned, moved)


def local_rotations(skeleton: Skeleton, world: Array) -> Array:
    """World orientations (frames, joints, 4) to each joint's in its parent's frame, without sign flips in time."""
    local, parents = world.copy(), list(skeleton.parents[1:])
    local[:, 1:] = rot.multiply(rot.inverse(world[:, parents]), world[:, 1:])
    return rot.unroll(rot.normalize(local))


def heading(positions: np.ndarray) -> Array:
    """Where a person faces, square to the hips and shoulders.

    Args:
        positions: (frames, 22, 3) metres, joints of `SMPL22`, +Y up.

    Returns:
        (frames,) radians, unwrapped: 0 faces +Z, growing to the left (towards +X).
    """
    p = np.asarray(positions, dtype=np.float64)
    across = p[:, _LEFT_HIP] - p[:, _RIGHT_HIP]
    across = across + p[:, _LEFT_SHOULDER] - p[:, _RIGHT_SHOULDER]
    return np.unwrap(np.arctan2(-across[:, 2], across[:, 0]))


def ground_pose(places: np.ndarray) -> GroundPose:
    """Where a person of places (22, 3) metres is on the ground, and which way they face."""
    return GroundPose.of(places[0], float(heading(places[None])[0]))
