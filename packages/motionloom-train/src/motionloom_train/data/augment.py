"""More motion from the same recordings: loops, time reversal, one body's arms on another's walk, and people who stand.

Actions that end go on with stretches of recordings in which somebody stands and is alive: people who have thrown a ball
or sat down are no statues.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.blending import crossfade, shares, smootherstep
from motionloom.core.features import humanml as hml
from motionloom.core.features.layout import FPS, LAYOUT
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
    stretches: list[tuple[float, Array]] = []
    for clip in clips:
        if clip.way != "plain" or clip.split != "train" or clip.kind != "capture" or clip.name.startswith("M"):
            continue
        positions = clip.positions()
        for first, last in _spans(_is_standing(positions)):
            speed = np.linalg.norm(ph.velocity(positions[first:last], FPS), axis=-1).max(axis=1)
            alive = float((speed >= 0.2).mean())
            if alive >= _ALIVE:
                stretches.append((alive, positions[first:last]))
    stretches.sort(key=lambda one: -one[0])
    return Idle(tuple(stretch for _, stretch in stretches[:MOST]))


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


NO_IDLE = Idle(())
STANDING = 0.12
"""Metres rms from a recorded standing pose that a pose may be for that recording to go on from it."""
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
    amount = shares(blend)[:, None]
    while count < frames:
        join = crossfade(features[last : last + blend], features[first : first + blend], amount)
        pieces += [join, features[first + blend : last]]
        count += last - first
    pieces.append(features[last:])
    return np.concatenate(pieces)[:frames].astype(np.float32)


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


def can_hold(positions: Array, fps: float, *, end: bool, fastest: float = 0.45) -> bool:
    """True where the first (``end``: last) pose of (frames, 22, 3) could be held: slow, and not in the air.

    ``fastest``: m/s that the joints may move on average; the pelvis three quarters of that.
    """
    few = positions[-6:] if end else positions[:6]
    moved = np.linalg.norm(ph.velocity(few, fps), axis=-1)
    lowest = positions[..., 1].min()
    return bool(moved.mean() < fastest and moved[:, 0].mean() < 0.75 * fastest and few[..., 1].min() < lowest + 0.12)


def with_pauses(positions: Array, before: int, after: int, *, fps: float, seed: int, idle: Idle = NO_IDLE) -> Array:
    """What was before and after a stretch (frames, 22, 3): ``before`` and ``after`` more frames of somebody alive.

    Where an end stands as people in ``idle`` do, one of those recordings ends in it or goes on from it. Any other pose
    is held, swaying as a recorded person does, or, with nothing recorded, by about a centimetre at the head and hardly
    at the feet (Winter 1995, quiet stance). The speed at the ends runs out within a third of a second.
    """
    rng = np.random.default_rng(seed)
    longer = _continued(positions, after, fps, rng, idle)
    return _continued(longer[::-1], before, fps, rng, idle)[::-1]


def stands_on(pose: Array, idle: Idle) -> bool:
    """Whether a pose (22, 3) is one from which recorded people go on standing."""
    return idle.nearest(pose, np.random.default_rng(0), limit=STANDING) is not None


def _continued(positions: Array, frames: int, fps: float, rng: np.random.Generator, idle: Idle) -> Array:
    """``positions`` and ``frames`` more."""
    if frames <= 0:
        return positions
    stretch = idle.nearest(positions[-1], rng, limit=STANDING)
    whole = None if stretch is None else joined(positions, extended(stretch, frames + 1)[1:], blend=16, limit=0.25)
    if whole is not None:
        return whole
    return np.concatenate([positions, _pause(positions[-1], positions[-1] - positions[-2], frames, fps, rng, idle)])


def _pause(pose: Array, step: Array, frames: int, fps: float, rng: np.random.Generator, idle: Idle) -> Array:
    """A pose (22, 3) that is held for some frames: it runs out of its last ``step`` (22, 3) and sways."""
    time = np.arange(1, frames + 1) / fps
    high = np.clip((pose[:, 1] - 0.08) / 1.4, 0, 1)
    run_out = 0.1 * (1 - np.exp(-time / 0.1))[:, None, None] * (step * fps)[None] * (high > 0)[:, None]
    sway = idle.sway(frames + 1, rng)
    if sway is not None:
        recorded = np.clip((pose[:, 1] - 0.08) / 0.6, 0, 1)
        turn = -float(ph.heading(pose[None])[0])
        return pose + run_out + recorded[:, None] * ph.turned(sway[1:], np.full((frames, 1), turn))
    starts = np.minimum(time / 1.0, 1.0)[:, None]
    periods, phases = rng.uniform(1.8, 6.0, (2, 5, 3)), rng.uniform(0, 2 * np.pi, (2, 5, 3))
    waves = np.sin(2 * np.pi * time[:, None, None, None] / periods + phases) - np.sin(phases)
    body, arms = (waves[:, i].mean(1) * [1, 0.2, 1] * starts for i in (0, 1))
    loose = np.zeros(len(pose))
    loose[[18, 19]], loose[[20, 21]] = 0.4, 1.0
    drift = 0.014 * high[:, None] * body[:, None] + 0.012 * (loose * (high > 0.2))[:, None] * arms[:, None]
    return pose + run_out + drift


def joined(first: Array, second: Array, *, blend: int = 10, limit: float = 0.16) -> Array | None:
    """``second`` (frames, 22, 3) behind ``first``, turned and moved to where it ended; None where the poses differ.

    The difference of the two poses fades within ``blend`` frames; ``limit``: metres rms that they may differ by.
    """
    turn = float(ph.heading(first)[-1] - ph.heading(second)[0])
    half = np.array([np.cos(turn / 2), 0, np.sin(turn / 2), 0])
    moved = rot.rotate(half, second - second[0, 0] * [1, 0, 1]) + first[-1, 0] * [1, 0, 1]
    gap = first[-1] - moved[0]
    if np.sqrt((gap**2).sum(-1).mean()) > limit or np.linalg.norm(gap[[7, 8, 10, 11]], axis=-1).max() > 1.6 * limit:
        return None
    fade = np.zeros(len(moved))
    count = min(blend, len(moved) - 1)
    fade[:count] = smootherstep(shares(count)[::-1])
    return np.concatenate([first, moved + fade[:, None, None] * gap])
