"""How people stand: stretches of recordings in which somebody stands and is alive.

Actions that end are continued with them, since people who have thrown a ball or sat down are no statues.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motionloom.features.layout import FPS
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array
from motionloom_train.data.clips import Clip

SHORTEST = 30
"""Frames that a stretch has at least."""
MOST = 60
"""Stretches that are kept of all; the liveliest."""
_ALIVE = 0.15
"""Share of the frames in which some joint moves at 0.2 m/s or more: less is a statue."""
_PLANTED = 0.4
"""Metres per second that the stiller end of each foot moves at most."""
_HANDS = 1.5
"""Metres per second that hands move at most."""


@dataclass(frozen=True, eq=False)
class Idle:
    """Stretches of standing."""

    stretches: tuple[Array, ...]
    """(frames, 22, 3) metres each, in the world of its clip."""

    def nearest(self, pose: Array, rng: np.random.Generator, *, limit: float) -> Array | None:
        """A stretch that may follow a pose (22, 3): one of the nearest that begin within ``limit`` metres rms.

        The middle of the feet is where the pose has it, and the stretch faces as the pose does. None if all are too
        far from it.
        """
        if not self.stretches:
            return None
        own = _from_feet(np.stack([pose, pose]))[0]
        starts = np.stack([_from_feet(s[:2])[0] for s in self.stretches])
        gaps = np.sqrt(((starts - own) ** 2).sum(-1))
        order = np.sqrt((gaps**2).mean(-1)) + gaps[:, [7, 8, 10, 11]].max(-1)
        near = [k for k in np.argsort(order)[:6] if np.sqrt((gaps[k] ** 2).mean()) < limit and order[k] < 2.5 * limit]
        return self.stretches[near[rng.integers(len(near))]] if near else None

    def body(self, frames: int, rng: np.random.Generator) -> Array | None:
        """Somebody who stands for so many frames: (frames, 22, 3) metres."""
        return extended(self.stretches[rng.integers(len(self.stretches))], frames) if self.stretches else None

    def sway(self, frames: int, rng: np.random.Generator) -> Array | None:
        """How a standing body moves about its first pose: (frames, 22, 3) metres, left, up and forward of it."""
        stretch = self.body(frames, rng)
        if stretch is None:
            return None
        own = _from_feet(stretch)
        return own - own[:1]


def _from_feet(positions: Array) -> Array:
    """(frames, 22, 3) as (left, up, forward) of the person in the first frame, from the floor between the feet."""
    origin = positions[0, [7, 8, 10, 11]].mean(axis=0) * np.array([1.0, 0.0, 1.0])
    return ph.turned(positions - origin, np.full((len(positions), 1), ph.heading(positions)[0]))


def extended(stretch: Array, frames: int) -> Array:
    """A stretch (n, 22, 3) of standing played forwards and backwards in turn until there are ``frames``."""
    there_and_back = np.concatenate([stretch, stretch[-2:0:-1]])
    return there_and_back[np.arange(frames) % len(there_and_back)]


def find_idle(clips: Sequence[Clip]) -> Idle:
    """The stretches of standing in recorded clips for training."""
    found: list[tuple[float, Array]] = []
    for clip in clips:
        if clip.way != "plain" or clip.split != "train" or clip.kind != "capture" or clip.name.startswith("M"):
            continue
        positions = clip.positions()
        for first, last in _spans(_is_standing(positions)):
            alive = _liveliness(positions[first:last])
            if alive >= _ALIVE:
                found.append((alive, positions[first:last]))
    found.sort(key=lambda one: -one[0])
    return Idle(tuple(stretch for _, stretch in found[:MOST]))


def _is_standing(positions: Array) -> np.ndarray:
    """(frames,) bool: upright on both planted feet that are side by side, with hanging hands that do nothing fast."""
    speed = np.linalg.norm(ph.velocity(positions, FPS), axis=-1)
    trunk = positions[:, [16, 17]].mean(axis=1) - positions[:, [1, 2]].mean(axis=1)
    upright = trunk[:, 1] > 0.94 * np.linalg.norm(trunk, axis=-1)
    hanging = positions[:, [20, 21], 1].max(axis=1) < positions[:, 9, 1]
    apart = np.linalg.norm((positions[:, 7] - positions[:, 8])[:, [0, 2]], axis=-1) < 0.5
    planted = (np.minimum(speed[:, [7, 8]], speed[:, [10, 11]]) < _PLANTED).all(axis=1)
    low = positions[:, [10, 11], 1].max(axis=1) < 0.1
    return (
        planted & low & upright & hanging & apart & (positions[:, 0, 1] > 0.84) & (speed[:, [20, 21]] < _HANDS).all(1)
    )


def _spans(holds: np.ndarray) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2]) if b - a >= SHORTEST]


def _liveliness(stretch: Array) -> float:
    """The share of frames in which some joint moves at 0.2 m/s or more."""
    return float((np.linalg.norm(ph.velocity(stretch, FPS), axis=-1).max(axis=1) >= 0.2).mean())
