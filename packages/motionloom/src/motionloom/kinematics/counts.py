"""How often somebody does something: jumps, hops, squats, kicks, punches, bows, claps, jumping jacks, steps.

Conventions of :mod:`motionloom.kinematics.physics`: ``positions`` (frames, 22, 3) metres, SMPL order, +Y up; ``fps``.
"""

from collections.abc import Callable
from typing import Literal

import numpy as np

from motionloom.core.arrays import true_spans
from motionloom.kinematics.gestures import (
    airborne,
    forward_bend,
    hands_height,
    leg_length,
    oscillations,
    pelvis_height,
    single_foot_hops,
    wrist_thrust,
)
from motionloom.kinematics.physics import ANKLES, TOES, WRISTS, Array, in_body, odd, smooth

Counted = Literal["jumps", "hops", "squats", "kicks", "punches", "bows", "claps", "jumping jacks"]
Side = Literal["left", "right", ""]


def count(what: Counted, positions: np.ndarray, fps: float, *, side: Side = "") -> int:
    """How often ``what`` is done; of hops, kicks and punches those of one ``side``, or all."""
    return _COUNTERS[what](np.asarray(positions, dtype=np.float64), fps, side)


def foot_moves(positions: np.ndarray, fps: float, *, apart: float = 0.15) -> tuple[int, int]:
    """How often the left and the right foot is put down ``apart`` metres or more from where it was: steps."""
    moves = []
    for toe in TOES:
        place = np.asarray(positions, dtype=np.float64)[:, toe][:, [0, 2]]
        still = np.linalg.norm(np.gradient(place, axis=0), axis=-1) * fps < 0.35
        where, number = place[0], 0
        for frame in np.flatnonzero(still):
            if np.linalg.norm(place[frame] - where) > apart:
                where, number = place[frame], number + 1
        moves.append(number)
    return moves[0], moves[1]


def _rises(signal: Array, amplitude: float) -> int:
    """How often a signal rises by ``amplitude`` and falls again."""
    # a start in the air, or an end there, is no rise: both are brought down to where the signal is usually lowest
    low = float(np.percentile(signal, 5))
    return oscillations(np.concatenate([[low], signal, [low]]), amplitude) // 2


def _of(sides: tuple[int, int], side: Side) -> int:
    return sum(sides) if not side else sides[0 if side == "left" else 1]


def _jumps(p: Array, fps: float, side: Side) -> int:
    return sum(flight.stop - flight.start >= 0.1 * fps for flight in airborne(p, clearance=0.04))


def _hops(p: Array, fps: float, side: Side) -> int:
    return _of(single_foot_hops(p), side) or _jumps(p, fps, side)


def _squats(p: Array, fps: float, side: Side) -> int:
    """How often the pelvis goes down below the height of a chair and comes up again."""
    height = smooth(pelvis_height(p), odd(fps / 5))
    up = (height > 0.9)[(height < 0.76) | (height > 0.9)]  # between the two nothing is decided
    return int((np.diff(up[np.argmax(up) :].astype(int)) > 0).sum()) if up.any() else 0


def _kicks(p: Array, fps: float, side: Side) -> int:
    body, leg = in_body(p), leg_length(p)
    ankles = body[:, ANKLES]
    height = (ankles[..., 1] - ankles[:, ::-1, 1]) / leg
    away = (np.linalg.norm(ankles[..., [0, 2]], axis=-1) > 0.4 * leg) & (ankles[..., 2] > -0.1 * leg)
    reach = np.where(away, height, 0.0).clip(0, None)
    return _of((_rises(reach[:, 0], 0.25), _rises(reach[:, 1], 0.25)), side)


def _punches(p: Array, fps: float, side: Side) -> int:
    out = wrist_thrust(p, fps) > 1.4
    strokes = [len(true_spans(out[:, hand])) for hand in (0, 1)]
    return _of((strokes[0], strokes[1]), side)


def _bows(p: Array, fps: float, side: Side) -> int:
    return _rises(smooth(forward_bend(p), odd(fps / 5)), np.radians(25))


def _claps(p: Array, fps: float, side: Side) -> int:
    apart = np.linalg.norm(p[:, WRISTS[0]] - p[:, WRISTS[1]], axis=-1)
    return _rises(-np.minimum(apart, 0.5), 0.08)


def _jacks(p: Array, fps: float, side: Side) -> int:
    return _rises(smooth(hands_height(p, over="neck").min(axis=1), 3), 0.35)


_COUNTERS: dict[Counted, Callable[[Array, float, Side], int]] = {
    "jumps": _jumps,
    "hops": _hops,
    "squats": _squats,
    "kicks": _kicks,
    "punches": _punches,
    "bows": _bows,
    "claps": _claps,
    "jumping jacks": _jacks,
}
