"""More motion from the same recordings: loops, time reversal, and one body's arms on another's walk."""

import numpy as np

from motionloom import rotations as rot
from motionloom.blending import crossfade, shares, smootherstep
from motionloom.features import humanml as hml
from motionloom.features.layout import LAYOUT
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array
from motionloom_train.data.idle import Idle, extended

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

    Where an end stands as people in ``idle`` do, one of those recordings leads to it or goes on from it. Any other pose
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
