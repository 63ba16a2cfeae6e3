"""More motion from the same recordings: loops, time reversal, and one body's arms on another's walk."""

import numpy as np

from motionloom import rotations as rot
from motionloom.features import humanml as hml
from motionloom.features.layout import LAYOUT
from motionloom.metrics import physics as ph
from motionloom.metrics.physics import Array

UPPER = (12, 13, 14, 15, 16, 17, 18, 19, 20, 21)
"""Neck, head and arms."""


def loop(features: np.ndarray, frames: int, *, blend: int = 5, limit: float = 0.09) -> np.ndarray | None:
    """Repeat a periodic stretch of features (n, 263) until there are ``frames``; None where nothing recurs.

    The root is stored as velocities, so a repeated stretch walks on. The stretch runs between the two frames whose
    poses (and poses a few frames later) are most alike; ``limit``: metres rms they may differ by. At least 0.6 s long.
    """
    shortest = 12
    n = len(features) - blend
    if n < shortest + 2:
        return None
    pose = features[:, LAYOUT["ric"]].astype(np.float64)
    look = np.concatenate([pose[:n], pose[blend : blend + n]], axis=1)
    gap = np.sqrt(((look[:, None] - look[None]) ** 2).sum(-1) / 42)
    i, j = np.triu_indices(n, k=shortest)
    # of nearly equal recurrences prefer the longer stretch: more variety, fewer joins
    best = int(np.argmin(gap[i, j] - 0.0005 * np.minimum(j - i, 60)))
    first, last = int(i[best]), int(j[best])
    if gap[first, last] > limit:
        return None
    pieces = [features[:last]]
    count = last
    amount = np.linspace(0, 1, blend + 2)[1:-1, None]
    while count < frames:
        join = features[last : last + blend] * (1 - amount) + features[first : first + blend] * amount
        pieces += [join, features[first + blend : last]]
        count += last - first
    pieces.append(features[last:])
    joined = np.concatenate(pieces)
    return joined[:frames].astype(np.float32)


def bend(features: np.ndarray, rate: float) -> np.ndarray:
    """The same steps along a curve: ``rate`` radians per frame added to the heading (+: to the left), (n, 263).

    The root is stored as velocities in the heading frame, so the path turns with it. A planted foot pivots a little.
    """
    turned = features.astype(np.float64)
    turned[:, LAYOUT["yaw_velocity"]] -= rate / 2  # half angles, and the stored quaternion undoes the heading
    return hml.encode(hml.decode_positions(turned), heading="corrected")


def reversed_in_time(positions: Array) -> Array:
    """The film run backwards. Walking backward is very nearly forward walking reversed (Thorstensson 1986)."""
    return positions[::-1].copy()


def wear_arms(body: Array, arms: Array) -> Array:
    """``body`` (frames, 22, 3) with neck, head and arms of ``arms``, turned to the body's heading; the shorter length.

    Spatial composition in the manner of SINC (Athanasiou et al. 2023): joints hang from spine3 as they do in ``arms``.
    """
    n = min(len(body), len(arms))
    body, arms = body[:n].copy(), arms[:n]
    turn = ph.heading(body) - ph.heading(arms)
    quaternion = np.stack([np.cos(turn / 2), 0 * turn, np.sin(turn / 2), 0 * turn], axis=-1)
    hang = arms[:, UPPER] - arms[:, 9:10]
    body[:, UPPER] = body[:, 9:10] + rot.rotate(quaternion[:, None], hang)
    return body
