"""What single actions look like in numbers: jumps, hops, steps, arms, strikes, posture.

The same conventions as :mod:`motionloom.kinematics.physics`: ``positions`` (frames, 22, 3) metres, SMPL order.
Heights that depend on how tall somebody is are given in leg lengths.
"""

from dataclasses import dataclass

import numpy as np

from motionloom.core.arrays import true_spans
from motionloom.kinematics.physics import ANKLES, FEET, TOES, WRISTS, Array, J, in_body, odd, smooth, velocity


def oscillations(signal: np.ndarray, amplitude: float) -> int:
    """Number of swings of at least ``amplitude`` between turning points of a one-dimensional signal.

    A full wave is two swings; wiggles smaller than ``amplitude`` are passed over (hysteresis).
    """
    low = high = extreme = float(signal[0])
    way, count = 0, 0
    for value in np.asarray(signal, dtype=np.float64):
        if way == 0:
            low, high = min(low, value), max(high, value)
            if high - low >= amplitude:
                way, extreme, count = (1 if value == high else -1), value, 1
        elif (value - extreme) * way > 0:
            extreme = value
        elif (extreme - value) * way >= amplitude:
            way, extreme, count = -way, value, count + 1
    return count


@dataclass(frozen=True)
class Flight:
    """A time when both feet are off the floor."""

    start: int
    stop: int
    """Half-open range of frames."""
    clearance: float
    """Metres: greatest height of the lowest foot point over its height on the floor."""
    rise: float
    """Metres: greatest height of the pelvis over its median height in the clip."""


def longest(mask: np.ndarray | np.bool_) -> int:
    """Frames of the longest unbroken stretch of True."""
    return max((stop - start for start, stop in true_spans(mask)), default=0)


def airborne(positions: np.ndarray, *, clearance: float = 0.05) -> list[Flight]:
    """Times when toes and ankles of both feet are all at least ``clearance`` metres above where they stand.

    Where a joint stands is its 20th percentile: a toe that dips when it pushes off must not make the flat foot fly.
    """
    p = np.asarray(positions, dtype=np.float64)
    stand = np.percentile(p[:, FEET, 1], 20, axis=0)
    lowest = (p[:, FEET, 1] - stand).min(axis=1)
    usual = np.median(p[:, 0, 1])
    return [
        Flight(a, b, float(lowest[a:b].max()), float(p[a:b, 0, 1].max() - usual))
        for a, b in true_spans(lowest > clearance)
    ]


def foot_lifts(positions: np.ndarray) -> Array:
    """(frames, 2) metres: height of the left and right ankle above where each stands in the clip (5th percentile)."""
    height = np.asarray(positions, dtype=np.float64)[:, ANKLES, 1]
    return height - np.percentile(height, 5, axis=0)


def foot_height_peaks(positions: np.ndarray, *, lift: float = 0.06) -> tuple[int, int]:
    """How often the left and the right foot are lifted by at least ``lift`` metres and lowered again: steps."""
    lifts = foot_lifts(positions)
    left, right = (oscillations(lifts[:, side], lift) // 2 for side in (0, 1))
    return left, right


def single_foot_hops(positions: np.ndarray, *, clearance: float = 0.04, apart: float = 0.10) -> tuple[int, int]:
    """Number of hops on the left and on the right foot alone.

    A hop is a flight before and after which the same foot is the lower one, by at least ``apart`` metres.
    """
    p = np.asarray(positions, dtype=np.float64)
    difference = p[:, ANKLES[1], 1] - p[:, ANKLES[0], 1]  # positive: the left foot is lower
    hops = [0, 0]
    for flight in airborne(p, clearance=clearance):
        before, after = difference[max(flight.start - 1, 0)], difference[min(flight.stop, len(p) - 1)]
        if before > apart and after > apart:
            hops[0] += 1
        elif before < -apart and after < -apart:
            hops[1] += 1
    return hops[0], hops[1]


def leg_length(positions: np.ndarray) -> float:
    """Metres from hip over knee and ankle to the toe's height: median thigh + shin of both legs + ankle height."""
    p = np.asarray(positions, dtype=np.float64)
    chains = [(J[f"{s}_hip"], J[f"{s}_knee"], J[f"{s}_ankle"]) for s in ("left", "right")]
    bones = [np.linalg.norm(p[:, x] - p[:, y], axis=-1) for a, b, c in chains for x, y in ((a, b), (b, c))]
    return float(np.median(np.sum(bones, axis=0) / 2))


def pelvis_height(positions: np.ndarray) -> Array:
    """(frames,) height of the pelvis over the lower ankle, in leg lengths: about 1.1 standing, 0.6 on a chair."""
    p = np.asarray(positions, dtype=np.float64)
    return (p[:, 0, 1] - p[:, ANKLES, 1].min(axis=1)) / leg_length(p)


def torso_inclination(positions: np.ndarray) -> Array:
    """(frames,) radians between the line from pelvis to neck and the vertical."""
    p = np.asarray(positions, dtype=np.float64)
    spine = p[:, J["neck"]] - p[:, 0]
    return np.arctan2(np.linalg.norm(spine[:, [0, 2]], axis=-1), spine[:, 1])


def still_from(positions: np.ndarray, fps: float, *, slower: float = 0.2) -> float | None:
    """Seconds from which on no joint is faster than ``slower`` m/s, to the end; None where one is at the end."""
    speed = np.linalg.norm(smooth(velocity(positions, fps), 3), axis=-1).max(axis=1)
    moving = np.flatnonzero(speed > slower)
    begin = int(moving[-1]) + 1 if len(moving) else 0
    return None if begin >= len(speed) else begin / fps


@dataclass(frozen=True)
class Seat:
    """What somebody sits on who is drawn without it: when, how high, and where."""

    begin: float
    end: float
    """Seconds."""
    height: float
    """Metres of its top over the floor y = 0, from the middle of the hip joints."""
    x: float
    z: float
    """Metres: below the pelvis."""


FLESH = 0.09
"""Metres from a hip joint down to what one sits on."""


def seats(positions: np.ndarray, fps: float, *, shortest: float = 1.0) -> list[Seat]:
    """Where somebody sits for at least ``shortest`` seconds: still, upright, low, with the feet ahead and on the floor.

    Who sits on the floor itself needs no seat and has none here; who kneels has the feet below. Who crouches or picks
    something up goes lower, leans further forward, or comes up again sooner.
    """
    p = np.asarray(positions, dtype=np.float64)
    leg, hips = leg_length(p), p[:, [J["left_hip"], J["right_hip"]], 1].mean(axis=1)
    still = np.linalg.norm(smooth(velocity(p[:, 0], fps), odd(fps / 4)), axis=-1) < 0.25
    ahead = in_body(p)[:, ANKLES, 2].mean(axis=1) > 0.12 * leg
    low = (hips - p[:, ANKLES, 1].min(axis=1) < 0.7 * leg) & (hips > FLESH + 0.28)
    sits = still & ahead & low & (torso_inclination(p) < np.radians(40)) & (p[:, ANKLES, 1].max(axis=1) < 0.3 * leg)
    return [
        Seat(a / fps, b / fps, float(np.median(hips[a:b])) - FLESH, *np.median(p[a:b, 0][:, [0, 2]], axis=0).tolist())
        for a, b in true_spans(sits)
        if b - a >= shortest * fps
    ]


def forward_bend(positions: np.ndarray) -> Array:
    """(frames,) radians by which pelvis to neck leans to where the person faces; backwards is negative."""
    spine = in_body(positions)[:, J["neck"]] - in_body(positions)[:, 0]
    return np.arctan2(spine[:, 2], spine[:, 1])


def knee_bend(positions: np.ndarray) -> Array:
    """(frames, 2) radians by which the left and right knee are bent; 0 is a straight leg."""
    p = np.asarray(positions, dtype=np.float64)
    return np.stack([_bend(p, f"{s}_hip", f"{s}_knee", f"{s}_ankle") for s in ("left", "right")], axis=-1)


def _bend(p: Array, a: str, b: str, c: str) -> Array:
    upper, lower = p[:, J[b]] - p[:, J[a]], p[:, J[c]] - p[:, J[b]]
    return np.arctan2(np.linalg.norm(np.cross(upper, lower), axis=-1), (upper * lower).sum(-1))


def hands_height(positions: np.ndarray, *, over: str = "head") -> Array:
    """(frames, 2) metres of the left and right wrist above a joint such as head, neck or pelvis."""
    p = np.asarray(positions, dtype=np.float64)
    return p[:, WRISTS, 1] - p[:, J[over], 1][:, None]


def wrist_swings(
    positions: np.ndarray, fps: float, *, amplitude: float = 0.08, above: str = "spine3"
) -> tuple[int, int]:
    """Back-and-forth swings of the left and right wrist about its shoulder, counted while it is above joint ``above``.

    Measured along the direction of greatest variance in the frame of the body, in swings of ``amplitude`` metres.
    """
    body = smooth(in_body(positions), odd(fps / 10))
    counts = []
    for wrist, shoulder in zip(WRISTS, (J["left_shoulder"], J["right_shoulder"]), strict=True):
        raised = hands_height(positions, over=above)[:, 0 if wrist == WRISTS[0] else 1] > 0
        arm = body[:, wrist] - body[:, shoulder]
        counts.append(sum(_swings(arm[a:b], amplitude) for a, b in true_spans(raised) if b - a > fps / 4))
    return counts[0], counts[1]


def _swings(path: Array, amplitude: float) -> int:
    centred = path - path.mean(axis=0)
    axis = np.linalg.svd(centred, full_matrices=False)[2][0]
    return oscillations(centred @ axis, amplitude)


def foot_extension_speed(positions: np.ndarray, fps: float) -> Array:
    """(frames, 2) m/s at which the left and right ankle move away from their hip: the snap of a kick."""
    p = np.asarray(positions, dtype=np.float64)
    return velocity(np.linalg.norm(p[:, ANKLES] - p[:, (J["left_hip"], J["right_hip"])], axis=-1), fps)


def limb_speed(positions: np.ndarray, fps: float, joints: tuple[int, ...]) -> Array:
    """(frames, joints) m/s of joints in the turning and travelling frame of the body, without its travel."""
    return np.linalg.norm(velocity(in_body(positions)[:, list(joints)], fps), axis=-1)


def kick_reach(positions: np.ndarray, fps: float, *, distance: float = 0.4) -> tuple[float, float]:
    """The best kick: height in leg lengths of an ankle over the other one, and m/s of that ankle just before.

    Only an ankle at least ``distance`` leg lengths away from the pelvis across the floor, and not behind it, counts:
    the high heels of a runner are behind.
    """
    body, leg = in_body(positions), leg_length(positions)
    ankles = body[:, ANKLES]
    height = (ankles[..., 1] - ankles[:, ::-1, 1]) / leg
    away = (np.linalg.norm(ankles[..., [0, 2]], axis=-1) > distance * leg) & (ankles[..., 2] > -0.1 * leg)
    height = np.where(away, height, 0.0)
    frame, side = np.unravel_index(int(np.argmax(height)), height.shape)
    pace = smooth(limb_speed(positions, fps, ANKLES), 3)[max(0, frame - round(fps / 2)) : frame + 1, side]
    return float(height[frame, side]), float(pace.max())


def wrist_thrust(positions: np.ndarray, fps: float) -> Array:
    """(frames, 2) m/s at which each wrist shoots forward, away from the upright axis of the body, at chest height.

    Unlike the extension of the arm it counts a blow that comes out of the turning trunk; a hand that is raised more
    than it is thrust does not count.
    """
    p = np.asarray(positions, dtype=np.float64)
    out = velocity(np.linalg.norm((p[:, WRISTS] - p[:, :1])[..., [0, 2]], axis=-1), fps)
    up = velocity(p[:, WRISTS, 1] - p[:, :1, 1], fps)
    level = (hands_height(p, over="spine1") > 0) & (hands_height(p) < 0.1) & (in_body(p)[:, WRISTS, 2] > 0.1)
    return np.where(level & (smooth(out, 3) > np.abs(smooth(up, 3))), smooth(out, 3), 0.0)


def stance_rise(positions: np.ndarray, fps: float) -> float:
    """Metres by which the lower foot rose from one place to a later one, having stayed at both for 3/4 of a second.

    Somebody on stairs or a ladder stays up; a jump comes down again; going down is no rise.
    """
    window = odd(0.75 * fps)
    lower = smooth(np.asarray(positions)[:, TOES, 1].min(axis=1), 3)
    kept = np.array([lower[start : start + window].min() for start in range(max(1, len(lower) - window))])
    return float((kept - np.minimum.accumulate(kept)).max())
