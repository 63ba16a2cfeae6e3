"""Curves through points: walked at even speed or at given times, and the direction somebody on them faces.

Points on the ground are (x, z) in metres; directions are radians about +Y, 0 along +Z and a quarter turn along +X.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from motionloom.core.blending import hermite
from motionloom.core.errors import MotionloomError
from motionloom.core.ground import turned
from motionloom.goals.goal import FPS, Goal, turn_between
from motionloom.requests.goal import CURVES

Array = NDArray[np.float64]

WALKING = 1.2
"""Metres per second of somebody for whom no speed is requested."""
FASTEST = 12.0
"""Metres per second: nobody runs faster."""
STANDING = 0.02
"""Metres per second below which a path has no direction of its own."""
TURNING = 5
"""Frames on either side over which the facing along a path is averaged: nobody turns at a corner within a frame."""
_FINE = 32
"""Straight pieces per stretch of a smooth curve that is walked at even speed."""


def through(points: np.ndarray, times: np.ndarray, at: np.ndarray, *, smooth: bool = True) -> Array:
    """(n, d) points reached at ``times`` (n,), rising, to the (len(at), d) places between them.

    Smooth: the cubic Hermite curve with time-weighted mean velocities at the points, shortened to three times the
    slower neighbour and to nothing where the way turns back or stands (Fritsch & Carlson 1980, carried from numbers to
    vectors). So two equal points are a stop, no coordinate overshoots on a line, and the curve turns with its points.
    """
    points, times, at = (np.asarray(part, dtype=np.float64) for part in (points, times, at))
    if len(points) == 1:
        return np.repeat(points, len(at), axis=0)
    piece = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    span = np.diff(times)
    u = ((at - times[piece]) / span[piece]).clip(0, 1)[:, None]
    if not smooth:
        return points[piece] * (1 - u) + points[piece + 1] * u
    velocity = np.diff(points, axis=0) / span[:, None]
    tangent = _tangents(velocity, span, closed=len(points) > 3 and np.array_equal(points[0], points[-1]))
    h = span[piece][:, None]
    start, leaving, end, coming = hermite(u)
    way = start * points[piece] + leaving * h * tangent[piece]
    return way + end * points[piece + 1] + coming * h * tangent[piece + 1]


def _tangents(velocity: Array, span: Array, *, closed: bool) -> Array:
    """Velocities (pieces, d) that last ``span`` to velocities at the pieces + 1 points."""
    ends = (velocity[-1:], velocity[:1]) if closed else (velocity[:1], velocity[-1:])
    before, after = np.concatenate([ends[0], velocity]), np.concatenate([velocity, ends[1]])
    lasts = (span[-1:], span[:1]) if closed else (span[:1], span[-1:])
    past, coming = np.concatenate([lasts[0], span])[:, None], np.concatenate([span, lasts[1]])[:, None]
    mean = (before * coming + after * past) / (past + coming)
    slow, fast = np.sort([np.linalg.norm(before, axis=-1), np.linalg.norm(after, axis=-1)], axis=0)
    cosine = (before * after).sum(-1) / np.maximum(slow * fast, 1e-300)
    limit = 3 * slow * (1 + np.minimum(cosine, 0))
    size = np.linalg.norm(mean, axis=-1)
    return mean * np.minimum(1, limit / np.maximum(size, 1e-300))[:, None]


def even(points: np.ndarray, shares: np.ndarray, *, smooth: bool = True) -> Array:
    """(n, d) points to the places at ``shares`` (0 to 1) of the length of the way through them."""
    points = np.asarray(points, dtype=np.float64)
    moved = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    points = points[np.concatenate([[True], moved > 0])]
    if len(points) == 1:
        return np.repeat(points, len(shares), axis=0)
    if smooth and len(points) > 2:
        chord = lengths_along(points)
        parts = [np.linspace(a, b, _FINE, endpoint=False) for a, b in pairwise(chord)]
        points = through(points, chord, np.concatenate([*parts, chord[-1:]]))
    length = lengths_along(points)
    return np.stack([np.interp(np.asarray(shares) * length[-1], length, column) for column in points.T], axis=-1)


def lengths_along(points: np.ndarray) -> Array:
    """(n,) metres from the first point along straight lines."""
    return np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=-1).cumsum()])


def along(path: np.ndarray, fps: float) -> Array:
    """(n, 2) places per frame to (n,) radians: the way the path goes, turned evenly while it stands still.

    Averaged over `TURNING` frames on either side (fewer near the ends, so that an even turn stays even). A path that
    never moves faces +Z.
    """
    steps = np.diff(path, axis=0)
    moving = np.flatnonzero(np.linalg.norm(steps, axis=-1) * fps > STANDING)
    if len(moving) == 0:
        return np.zeros(len(path))
    angle = np.unwrap(np.arctan2(steps[moving, 0], steps[moving, 1]))
    turn = np.interp(np.arange(len(path)) - 0.5, moving, angle)
    if len(moving) > 1 and (moving[0], moving[1]) == (0, 1) and abs(angle[1] - angle[0]) < 0.3:
        turn[0] = angle[0] - (angle[1] - angle[0]) / 2
    if len(moving) > 1 and moving[-2:].tolist() == [len(path) - 3, len(path) - 2] and abs(angle[-1] - angle[-2]) < 0.3:
        turn[-1] = angle[-1] + (angle[-1] - angle[-2]) / 2
    total = np.concatenate([[0.0], turn.cumsum()])
    frame = np.arange(len(path))
    reach = np.minimum(TURNING, np.minimum(frame, len(path) - 1 - frame))
    return (total[frame + reach + 1] - total[frame - reach]) / (2 * reach + 1)


def curve(name: str, size: float, *, turn: str = "left") -> Array:
    """A named curve of ``size`` metres as (n, 2) fine points from the origin, setting out along +Z.

    ``line``: straight, ``size`` long. ``circle``: of that diameter. ``figure_eight``: a circle to the left, then one to
    the right, ``size`` wide together. ``s``: half a circle to the left, half one to the right, ending ``size`` to the
    left. ``turn="right"`` begins to the right instead. Left is +X.
    """
    if name not in CURVES:
        raise MotionloomError(f"no curve {name!r}; there are {', '.join(CURVES)}")
    angle = np.linspace(0, 2 * np.pi, 721)
    side = size / 2 if name == "circle" else size / 4
    loop = np.stack([side * (1 - np.cos(angle)), side * np.sin(angle)], axis=-1)
    half = loop[:361]
    points = {
        "line": np.array([[0.0, 0.0], [0.0, size]]),
        "circle": loop,
        "figure_eight": np.concatenate([loop, loop[1:] * [-1, 1]]),
        "s": np.concatenate([half, half[-1] + half[1:] * [1, -1]]),
    }[name]
    return points if turn == "left" else points * [-1.0, 1.0]


def root_path(
    points: np.ndarray | Sequence[Sequence[float]],
    times: Sequence[float] | None = None,
    *,
    frames: int,
    facing: str | float | Sequence[float] = "along",
    smooth: bool = True,
    span: tuple[float, float] | None = None,
    fps: float = FPS,
) -> Goal:
    """A path of the pelvis on the ground as a goal of so many frames.

    points: (n, 2) metres, x and z in the world. times: seconds at the points, rising; None: walked at even speed from
    ``span[0]`` to ``span[1]`` seconds (None: the whole motion). smooth: a curve through the points (`through`) instead
    of straight lines. facing: "along" the path (`along`), "free", or degrees: one number, or one per point in between
    which it turns evenly as written (0 to 360 is a whole turn). Frames before the first and after the last time are
    free. Raises `MotionloomError` for points that nobody can reach in time (`FASTEST`).
    """
    points = np.asarray(points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) == 0 or not np.isfinite(points).all():
        raise MotionloomError(f"a path needs (n, 2) finite places x, z, at least one; got an array {points.shape}")
    if times is not None and (len(times) != len(points) or not (np.diff(times) > 0).all()):
        raise MotionloomError(f"a path of {len(points)} points needs as many times, rising; got {list(times)[:20]}")
    begin, end = span or ((0.0, (frames - 1) / fps) if times is None else (times[0], times[-1]))
    first, last = int(np.ceil(begin * fps - 1e-6)), min(frames - 1, int(np.floor(end * fps + 1e-6)))
    if last < first:
        raise MotionloomError(f"a path from {begin:g} to {end:g} s has no frame in a motion of {frames / fps:g} s")
    at = np.arange(first, last + 1) / fps
    if times is None:
        way = even(points, ((at - begin) / max(end - begin, 1e-9)).clip(0, 1), smooth=smooth)
        lengths = lengths_along(points)  # of chords, no longer than the curve
        check_speed(lengths[[0, -1], None], np.array([begin, end]))
        reached = begin + (end - begin) * lengths / max(lengths[-1], 1e-9)
    else:
        reached = np.asarray(times, dtype=np.float64)
        check_speed(points, reached)
        way = through(points, reached, at, smooth=smooth)
    goal = Goal.nothing(frames)
    goal.positions[first : last + 1, 0, 0], goal.positions[first : last + 1, 0, 2] = way.T
    goal.mask[first : last + 1, 0, 0] = goal.mask[first : last + 1, 0, 2] = True
    if facing != "free" and not (facing == "along" and np.ptp(way, axis=0).max() < 1e-3):
        goal.facing[first : last + 1] = _facing(facing, way, reached, at, fps)
        goal.facing_mask[first : last + 1] = True
    return goal


def _facing(facing: str | float | Sequence[float], way: Array, times: Array, at: Array, fps: float) -> Array:
    if isinstance(facing, str):
        if facing != "along":
            raise MotionloomError(f"a path's facing is 'along', 'free' or degrees; got {facing!r}")
        return along(way, fps)
    degrees = np.atleast_1d(np.asarray(facing, dtype=np.float64))
    if len(degrees) == 1:
        return np.full(len(at), np.radians(degrees[0]))
    if len(degrees) != len(times):
        raise MotionloomError(f"a path of {len(times)} points needs as many facings; got {len(degrees)}")
    return np.radians(np.interp(at, times, degrees))


def check_speed(places: np.ndarray, times: np.ndarray) -> None:
    """MotionloomError where (n, d) places at ``times`` (n,) are further apart than anybody runs (`FASTEST`)."""
    spans = np.maximum(np.diff(times), 1e-9)
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=-1)
    speed = lengths / spans
    if speed.max(initial=0.0) <= FASTEST:
        return
    worst = int(speed.argmax())
    raise MotionloomError(
        f"from {times[worst]:.2f} to {times[worst + 1]:.2f} s the path is {lengths[worst]:.1f} m long and asks for "
        f"{speed[worst]:.1f} m/s, and nobody runs faster than {FASTEST:g} m/s; give it at least "
        f"{np.ceil(lengths[worst] / FASTEST * 100) / 100:.2f} s"
    )


def turned_to(points: np.ndarray, facing: float) -> Array:
    """(n, 2) points about the origin turned so that +Z becomes the direction ``facing``."""
    if not abs(turn_between(facing, 0.0)):
        return np.asarray(points, dtype=np.float64)
    x, z = np.asarray(points, dtype=np.float64).T
    return turned(np.stack([x, 0 * x, z], axis=-1), facing)[:, [0, 2]]
