"""Curves through points: walked at even speed or at given times, and the direction somebody on them faces.

Points on the ground are (x, z) in metres; directions are radians about +Y, 0 along +Z and a quarter turn along +X.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from motionloom.errors import MotionloomError
from motionloom.tasks.goals import turn_between

Array = NDArray[np.float64]

FASTEST = 12.0
"""Metres per second: nobody runs faster."""
STANDING = 0.02
"""Metres per second below which a path has no direction of its own."""
TURNING = 5
"""Frames on either side over which the facing along a path is averaged: nobody turns at a corner within a frame."""
_FINE = 32
"""Straight pieces per stretch of a smooth curve that is walked at even speed."""
CURVES = ("line", "circle", "figure_eight", "s")


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
    return (
        (2 * u**3 - 3 * u**2 + 1) * points[piece]
        + (u**3 - 2 * u**2 + u) * h * tangent[piece]
        + (3 * u**2 - 2 * u**3) * points[piece + 1]
        + (u**3 - u**2) * h * tangent[piece + 1]
    )


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


def even(points: np.ndarray, count: int, *, smooth: bool = True) -> Array:
    """(n, d) points to ``count`` places along the way through them, equally far apart; the ends are the ends."""
    points = np.asarray(points, dtype=np.float64)
    moved = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    points = points[np.concatenate([[True], moved > 0])]
    if len(points) == 1:
        return np.repeat(points, count, axis=0)
    if smooth and len(points) > 2:
        chord = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=-1).cumsum()])
        parts = [np.linspace(a, b, _FINE, endpoint=False) for a, b in zip(chord[:-1], chord[1:], strict=True)]
        points = through(points, chord, np.concatenate([*parts, chord[-1:]]))
    length = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=-1).cumsum()])
    at = np.linspace(0, length[-1], count)
    return np.stack([np.interp(at, length, column) for column in points.T], axis=-1)


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


def check_speed(path: np.ndarray, times: np.ndarray) -> None:
    """MotionloomError where (n, 2 or 3) places at ``times`` (n,) are further apart than anybody runs (`FASTEST`)."""
    if len(path) < 2:
        return
    lengths, spans = np.linalg.norm(np.diff(path, axis=0), axis=-1), np.diff(times)
    speed = lengths / spans
    if speed.max() <= FASTEST:
        return
    worst = int(speed.argmax())
    if speed.max() <= 1.05 * np.median(speed):
        piece, length, needs = "the path", lengths.sum(), lengths.sum() / FASTEST
    else:
        piece = f"the path from {times[worst]:.2f} to {times[worst + 1]:.2f} s"
        length, needs = lengths[worst], lengths[worst] / FASTEST
    raise MotionloomError(
        f"{piece} is {length:.1f} m long and asks for {speed.max():.1f} m/s, and nobody runs faster than "
        f"{FASTEST:g} m/s; give it at least {needs:.1f} s"
    )


def facing_through(degrees: Sequence[float], times: np.ndarray, at: np.ndarray) -> Array:
    """(n,) degrees at ``times`` to radians at ``at``, linearly and as written: 0 to 360 is a whole turn."""
    return np.radians(np.interp(at, times, np.asarray(degrees, dtype=np.float64)))


def turned_to(points: np.ndarray, facing: float) -> Array:
    """(n, 2) points about the origin turned so that +Z becomes the direction ``facing``."""
    if not abs(turn_between(facing, 0.0)):
        return np.asarray(points, dtype=np.float64)
    c, s = np.cos(facing), np.sin(facing)
    x, z = np.asarray(points, dtype=np.float64).T
    return np.stack([c * x + s * z, c * z - s * x], axis=-1)
