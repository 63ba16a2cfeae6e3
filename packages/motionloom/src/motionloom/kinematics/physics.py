"""Measurements of a moving body, on plain joint positions: where it went, how it turned, how real it looks.

Every function takes ``positions`` (frames, 22, 3) in metres, SMPL joint order, +Y up, left +X for a person who
faces +Z, and ``fps`` in frames per second where time matters. Angles are radians; a turn to the left is positive.
What single actions look like (jumps, kicks, waves) is in :mod:`motionloom.kinematics.gestures`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.core import ground
from motionloom.core.motion import heading
from motionloom.core.skeleton import SMPL22

Array = NDArray[np.float64]
J: dict[str, int] = {name: i for i, name in enumerate(SMPL22.names)}
"""Joint numbers by name."""
TOES = (J["left_foot"], J["right_foot"])
ANKLES = (J["left_ankle"], J["right_ankle"])
FEET = (*ANKLES, *TOES)
WRISTS = (J["left_wrist"], J["right_wrist"])
_PARENTS = list(SMPL22.parents[1:])


def smooth(values: np.ndarray, frames: int) -> Array:
    """Centred moving average over an odd number of frames along axis 0; the ends average what is there."""
    values = np.asarray(values, dtype=np.float64)
    half = frames // 2
    if half == 0 or len(values) < 2:
        return values
    total = np.concatenate([np.zeros_like(values[:1]), np.cumsum(values, axis=0)])
    at = np.arange(len(values))
    low, high = np.maximum(at - half, 0), np.minimum(at + half + 1, len(values))
    return (total[high] - total[low]) / (high - low).reshape(-1, *[1] * (values.ndim - 1))


def turned(vectors: np.ndarray, angle: np.ndarray | float) -> Array:
    """World vectors (..., 3) as (left, up, forward) of someone whose heading is ``angle`` (broadcast)."""
    return ground.turned(vectors, -angle)


def in_body(positions: np.ndarray) -> Array:
    """(frames, 22, 3) positions as (left, up, forward) of the person in each frame, from the pelvis' floor point."""
    p = np.asarray(positions, dtype=np.float64)
    origin = p[:, :1] * np.array([1.0, 0.0, 1.0])
    return turned(p - origin, heading(p)[:, None])


def velocity(values: np.ndarray, fps: float) -> Array:
    """Time derivative along axis 0 by central differences (one-sided at the ends), per second."""
    values = np.asarray(values, dtype=np.float64)
    return np.zeros_like(values) if len(values) < 2 else np.gradient(values, axis=0) * fps


def speed(positions: np.ndarray, fps: float) -> Array:
    """(frames,) m/s: horizontal speed of the pelvis, averaged over a quarter of a second."""
    # velocities are averaged, not places: an average of places lags behind at both ends
    return np.linalg.norm(smooth(velocity(np.asarray(positions)[:, 0, [0, 2]], fps), odd(fps / 4)), axis=-1)


def odd(frames: float) -> int:
    """The nearest odd number of frames, at least 1."""
    return max(1, 2 * round((frames - 1) / 2) + 1)


def root_velocity_in_heading(positions: np.ndarray, fps: float) -> Array:
    """(frames, 3) m/s: pelvis velocity as (left, up, forward) of the person in each frame."""
    p = np.asarray(positions, dtype=np.float64)
    return turned(velocity(p[:, 0], fps), heading(p))


@dataclass(frozen=True)
class Displacement:
    """Metres from first to last frame, in the directions of the person at the start."""

    forward: float
    left: float
    up: float


def displacement(positions: np.ndarray, fps: float) -> Displacement:
    """How far the pelvis got, along the heading averaged over the first quarter of a second."""
    p = np.asarray(positions, dtype=np.float64)
    start = float(np.mean(heading(p)[: odd(fps / 4)]))
    left, up, forward = turned(p[-1, 0] - p[0, 0], start)
    return Displacement(float(forward), float(left), float(up))


def travel(positions: np.ndarray, fps: float) -> float:
    """Metres of horizontal path walked by the pelvis, sway smoothed over a quarter of a second."""
    pace = speed(positions, fps)
    return float((pace[1:] + pace[:-1]).sum() / 2 / fps)


def turn(positions: np.ndarray) -> float:
    """Net change of heading in radians, positive to the left; more than one full turn counts in full."""
    angle = smooth(heading(positions), 3)
    return float(angle[-1] - angle[0])


def winding(positions: np.ndarray, fps: float, *, step: float = 0.3) -> float:
    """Net turn of the direction of travel in radians, + left: 2 pi for a full circle, whatever way the body faces.

    The path is sampled every ``step`` metres, so that standing and sway do not count.
    """
    path = smooth(np.asarray(positions)[:, 0, [0, 2]], odd(fps / 2))
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=-1))])
    count = int(along[-1] / step)
    if count < 2:
        return 0.0
    points = np.stack([np.interp(np.arange(count + 1) * step, along, path[:, k]) for k in (0, 1)], axis=-1)
    ways = np.diff(points, axis=0)
    angle = np.unwrap(np.arctan2(ways[:, 0], ways[:, 1]))
    return float((angle[-1] - angle[0]) * count / (count - 1))


# ---- how real it looks -------------------------------------------------------------------------------------------


def floor_height(positions: np.ndarray) -> float:
    """Metres: the 2nd percentile of the lowest foot point, where the floor is for anyone who ever stands on it."""
    return float(np.percentile(np.asarray(positions)[:, FEET, 1].min(axis=1), 2))


@dataclass(frozen=True)
class FootSkate:
    """The three definitions in use; they do not agree with one another, so all are given."""

    ratio: float
    """Share of frames with a toe below 5 cm that moves faster than 0.5 m/s (2.5 cm per frame at 20 fps), both in the
    step itself and on a five-frame average: Karunratanakul et al., GMD, 2023."""
    contact_speed: float
    """Mean horizontal toe speed in cm/s while the toe is below 5 cm (as NVIDIA's Kimodo reports it)."""
    weighted: float
    """Mean of v (2 - 2^(h/H)) over frames, in cm/s, for toes at height h below H = 2.5 cm: Zhang et al.,
    mode-adaptive networks, 2018; NeMF, 2022."""


def foot_skate(positions: np.ndarray, fps: float, *, floor: float = 0.0) -> FootSkate:
    """How much the toes slide while they are on the floor (at height ``floor``). 0 in all three for planted feet."""
    toes = np.asarray(positions, dtype=np.float64)[:, TOES]
    if len(toes) < 2:
        return FootSkate(0.0, 0.0, 0.0)
    height = toes[..., 1] - floor
    sliding = np.linalg.norm(np.diff(toes[..., [0, 2]], axis=0), axis=-1) * fps
    low = (height[:-1] < 0.05) & (height[1:] < 0.05)
    quick = (sliding > 0.5) & (smooth(sliding, 5) > 0.5)
    depth = np.clip(np.minimum(height[:-1], 0.025), 0.0, None)
    weighted = sliding * (2.0 - 2.0 ** (depth / 0.025))
    return FootSkate(
        ratio=float((low & quick).any(axis=1).mean()),
        contact_speed=float(100 * sliding[low].mean()) if low.any() else 0.0,
        weighted=float(100 * weighted.mean()),
    )


def penetration(positions: np.ndarray, *, floor: float = 0.0) -> float:
    """Metres: how deep the lowest joint of the body is below the floor, averaged over all frames."""
    lowest = np.asarray(positions)[..., 1].min(axis=1)
    return float(np.clip(floor - lowest, 0.0, None).mean())


def float_height(positions: np.ndarray, *, floor: float = 0.0) -> float:
    """Metres: how far the lowest joint of the body is above the floor, averaged over all frames."""
    lowest = np.asarray(positions)[..., 1].min(axis=1)
    return float(np.clip(lowest - floor, 0.0, None).mean())


@dataclass(frozen=True)
class Jerk:
    """Third derivative of joint positions in m/s^3: the mean over joints and frames, and the largest anywhere."""

    mean: float
    peak: float


def jerk(positions: np.ndarray, fps: float) -> Jerk:
    """Length of the third finite difference times fps^3; 0 for fewer than four frames."""
    third = np.linalg.norm(np.diff(np.asarray(positions, dtype=np.float64), n=3, axis=0), axis=-1) * fps**3
    return Jerk(float(third.mean()), float(third.max())) if third.size else Jerk(0.0, 0.0)


def bone_lengths(positions: np.ndarray) -> Array:
    """(frames, 21) metres: length of each bone, by child joint 1..21."""
    p = np.asarray(positions, dtype=np.float64)
    return np.linalg.norm(p[:, 1:] - p[:, _PARENTS], axis=-1)


def bone_length_error(positions: np.ndarray, *, lengths: np.ndarray | None = None) -> float:
    """Metres: mean absolute difference of the bones from ``lengths`` (21,), or from their own median over the clip."""
    bones = bone_lengths(positions)
    expected = np.median(bones, axis=0) if lengths is None else np.asarray(lengths)
    return float(np.abs(bones - expected).mean())
