"""How two people move together: errors of a completion, and what errors cannot see.

Every function takes ``positions`` (2, frames, 22, 3) in metres in one world, SMPL joint order, +Y up, the floor at
y = 0, at 20 frames per second unless ``fps`` is given. Angles are radians. `motionloom_lab.metrics.pair_groups`
compares groups of duets with real ones.
"""

from dataclasses import dataclass

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.kinematics import physics as ph
from motionloom.kinematics.capsules import RADII, capsule_ends, gaps, overlap
from motionloom.kinematics.physics import Array
from motionloom_lab.metrics.skate import skate

FPS = 20.0
PREFIX = 20
"""Frames that are given in prefix completion."""
HORIZONS = (1, 2, 3)
"""Seconds after the prefix; each counts from its end."""
HOLD = 0.25
"""Metres from wrist to wrist below which hands may hold: each palm is some 8 cm beyond its wrist."""
TOUCH = 0.10
"""Metres from a wrist to the surface of the other's body below which the hand may lie on it."""
LOOK = np.pi / 3
"""Radians between where someone faces and where the other one is, below which the other is in view."""
_GROUND = np.array([1.0, 0.0, 1.0])


# Errors --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class HorizonError:
    """Metres, averaged over crops, both people and the frames from the end of the prefix to the horizon."""

    seconds: float
    root: float
    """Distance of the roots."""
    joint: float
    """Distance of joints 1 to 21, each from its own root; mean over joints."""
    absolute: float
    """Distance of all 22 joints where they are in the world; mean over joints."""


def completion_errors(real: np.ndarray, predicted: np.ndarray) -> tuple[HorizonError, ...]:
    """Prefix completion of two people (Shafir et al., priorMDM, 2023, table 3): one `HorizonError` per horizon.

    Both are (crops, 2, frames, 22, 3) or one crop without the first axis. Each is in the frame of its own person 0
    at frame 0 (`in_first_frame`), as the published evaluation decodes it. Horizons are cumulative: seconds k averages
    frames `PREFIX` to ``PREFIX + k FPS``. Raises MotionloomError for other shapes or too few frames.
    """
    r, p = (_crops(positions) for positions in (real, predicted))
    need = PREFIX + round(max(HORIZONS) * FPS)
    if r.shape != p.shape or r.shape[2] < need:
        raise MotionloomError(
            f"completions need as many crops of as many frames as the real ones, {need} or more; got {p.shape[:3]} "
            f"against {r.shape[:3]} (crops, people, frames)"
        )
    r, p = (np.stack([in_first_frame(crop) for crop in positions]) for positions in (r, p))
    apart = p - r
    root = np.linalg.norm(apart[:, :, :, 0], axis=-1)
    joint = np.linalg.norm(apart[:, :, :, 1:] - apart[:, :, :, :1], axis=-1).mean(axis=-1)
    absolute = np.linalg.norm(apart, axis=-1).mean(axis=-1)
    spans = [(k, slice(PREFIX, PREFIX + round(k * FPS))) for k in HORIZONS]
    return tuple(
        HorizonError(float(k), *(float(e[:, :, span].mean()) for e in (root, joint, absolute))) for k, span in spans
    )


def in_first_frame(positions: np.ndarray) -> Array:
    """Both people moved rigidly so that person 0 begins over x = z = 0, facing +Z; heights stay."""
    p = _pair(positions)
    moved = p - p[0, 0, 0] * _GROUND
    return ph.turned(moved, float(ph.heading(p[0, :1])[0]))


# Where they are ------------------------------------------------------------------------------------------------------


def distance(positions: np.ndarray) -> Array:
    """(frames,) metres on the ground from pelvis to pelvis."""
    p = _pair(positions)
    return np.linalg.norm((p[1] - p[0])[:, 0] * _GROUND, axis=-1)


def facing_angle(positions: np.ndarray) -> Array:
    """(frames,) 0 to pi: between the two headings; 0 both face the same way, pi opposite ways."""
    p = _pair(positions)
    return _between(ph.heading(p[1]) - ph.heading(p[0]))


def looking_away(positions: np.ndarray) -> Array:
    """(2, frames) 0 to pi: how far each one's heading is turned from the direction to the other; 0 looks at them."""
    p = _pair(positions)
    apart = (p[1] - p[0])[:, 0]
    way = np.arctan2(apart[:, 0], apart[:, 2])
    return np.stack([_between(way - ph.heading(p[0])), _between(way + np.pi - ph.heading(p[1]))])


def mutual(positions: np.ndarray) -> float:
    """Share of frames in which each has the other within `LOOK` radians of the heading."""
    return float((looking_away(positions) < LOOK).all(axis=0).mean())


# Touch ---------------------------------------------------------------------------------------------------------------


def hand_distance(positions: np.ndarray) -> Array:
    """(frames,) metres from a wrist of one to a wrist of the other, the nearest of the four."""
    p = _pair(positions)
    wrists = p[:, :, list(ph.WRISTS)]
    return np.linalg.norm(wrists[0][:, :, None] - wrists[1][:, None], axis=-1).min(axis=(1, 2))


def hand_contact(positions: np.ndarray) -> float:
    """Share of frames in which a wrist of one is nearer than `HOLD` metres to a wrist of the other."""
    return float((hand_distance(positions) < HOLD).mean())


def hand_to_body(positions: np.ndarray) -> Array:
    """(frames,) metres from a wrist of one to the surface of the other's `CAPSULES`, the nearest; below 0 inside."""
    p = _pair(positions)
    apart = []
    for person, other in ((0, 1), (1, 0)):
        points = p[person][:, list(ph.WRISTS)]
        ends = capsule_ends(p[other])
        apart.append(gaps(np.stack([points, points], axis=2), np.zeros((2, 2)), ends, RADII).min(axis=(1, 2)))
    return np.minimum(*apart)


def touch(positions: np.ndarray) -> float:
    """Share of frames in which a wrist of one is nearer than `TOUCH` metres to the other's body, hands and all."""
    return float((hand_to_body(positions) < TOUCH).mean())


def penetration_depth(positions: np.ndarray) -> Array:
    """(frames,) metres: how deep the deepest capsule of one is in a capsule of the other; 0 where none touch."""
    return overlap(*_pair(positions))


def penetration(positions: np.ndarray) -> float:
    """Metres: `penetration_depth` averaged over all frames."""
    return float(penetration_depth(positions).mean())


# Together ------------------------------------------------------------------------------------------------------------


def synchrony(positions: np.ndarray, fps: float = FPS) -> float:
    """-1 to 1: correlation of the two pelvis velocities on the ground, averaged over a quarter of a second.

    Both components together, each less its mean: 1 where one moves as the other does (partners in hold), -1 where they
    always move against each other, 0 where they have nothing to do with each other or one stands still.
    """
    return _correlation(*_root_velocities(positions, fps))


def speed_synchrony(positions: np.ndarray, fps: float = FPS) -> float:
    """-1 to 1: correlation of how fast the two pelvises go, wherever to. Partners who turn about each other move
    against each other and those who travel move alike, so that `synchrony` is near 0 for a mix; this one is not."""
    first, second = (np.linalg.norm(v, axis=-1) for v in _root_velocities(positions, fps))
    return _correlation(first, second)


def _root_velocities(positions: np.ndarray, fps: float) -> list[Array]:
    return [ph.smooth(ph.velocity(one[:, 0, [0, 2]], fps), ph.odd(fps / 4)) for one in _pair(positions)]


def _correlation(first: Array, second: Array) -> float:
    a, b = first - first.mean(axis=0), second - second.mean(axis=0)
    size = float(np.sqrt((a**2).sum() * (b**2).sum()))
    return float((a * b).sum() / size) if size > 1e-9 else 0.0


def pair_stats(positions: np.ndarray, fps: float = FPS) -> dict[str, float]:
    """All numbers of one duet of at least two frames, means over frames and people unless noted otherwise.

    Metres: ``distance`` from pelvis to pelvis on the ground and ``distance_range``, its standard deviation;
    ``hand_distance`` between the nearest wrists; ``penetration``, the deepest overlap of the bodies. Radians:
    ``facing`` between the headings, pi: opposite; ``looking_away`` that each is turned away from the other. Shares of
    frames: ``mutual``, both have the other in view; ``hand_contact``, wrists nearer than `HOLD`; ``touch``, a wrist
    nearer than `TOUCH` to the other's body. Correlations: ``synchrony`` of the root velocities, ``speed_synchrony`` of
    their speeds. ``skate_share``, ``skate_speed`` (cm/s) and ``skate_slide`` (mm per frame): see `skate.Skate`.
    """
    p = _pair(positions)
    apart, hands = distance(p), hand_distance(p)
    feet = [skate(person, fps) for person in p]
    return {
        "distance": float(apart.mean()),
        "distance_range": float(apart.std()),
        "facing": float(facing_angle(p).mean()),
        "looking_away": float(looking_away(p).mean()),
        "mutual": mutual(p),
        "hand_distance": float(hands.mean()),
        "hand_contact": float((hands < HOLD).mean()),
        "touch": touch(p),
        "penetration": penetration(p),
        "synchrony": synchrony(p, fps),
        "speed_synchrony": speed_synchrony(p, fps),
        **{f"skate_{name}": float(np.mean([getattr(f, name) for f in feet])) for name in ("share", "speed", "slide")},
    }


# Parts ---------------------------------------------------------------------------------------------------------------


def _pair(positions: np.ndarray) -> Array:
    p = np.asarray(positions, dtype=np.float64)
    if p.ndim != 4 or p.shape[0] != 2 or p.shape[1] < 1 or p.shape[2:] != (22, 3):
        raise MotionloomError(f"two people must be (2, frames, 22, 3), at least one frame; got {p.shape}")
    if not np.isfinite(p).all():
        raise MotionloomError("the positions of the two people have numbers that are not finite (NaN or infinity)")
    return p


def _crops(positions: np.ndarray) -> Array:
    p = np.asarray(positions, dtype=np.float64)
    p = p[None] if p.ndim == 4 else p
    if p.ndim != 5 or len(p) == 0:
        raise MotionloomError(f"crops of two people must be (crops, 2, frames, 22, 3), at least one; got {p.shape}")
    return p


def _between(angle: np.ndarray) -> Array:
    """0 to pi: how far an angle of any size is from no turn."""
    return np.abs((angle + np.pi) % (2 * np.pi) - np.pi)
