"""What shows a manner, in numbers: steps, feet, posture, arms. Of windows of some seconds, of anybody.

Degrees, metres of the uniform person, seconds. ``l`` and ``r`` are the left and the right side.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from motionloom.core.body.feet import planted_feet
from motionloom.kinematics import physics as ph
from motionloom.kinematics.gestures import true_spans
from motionloom.kinematics.physics import Array
from motionloom_train.data.gait import Gait

_FEET = ((1, 4, 7, 10), (2, 5, 8, 11))
_ARMS = ((16, 18, 20, 1.0), (17, 19, 21, -1.0))
Measures = dict[str, float]


def measure(places: Array, fps: float) -> Measures:
    """The numbers of (frames, 22, 3) metres, +Y up, floor at 0."""
    body = ph.in_body(places)
    result = _steps(places, body, fps) | _posture(places, body, fps)
    for name, arm in zip("lr", _ARMS):
        result |= _arm(body, arm, name, fps)
    result["hand_top"] = max(result["hand_up_l"], result["hand_up_r"])
    result["arm_swing"] = (result["swing_l"] + result["swing_r"]) / 2
    result["hands_apart"] = float(np.linalg.norm(places[:, 20] - places[:, 21], axis=-1).mean())
    hands = body[:, [20, 21]] - ph.smooth(body[:, [20, 21]], 3)
    result["tremble"] = float(1000 * np.sqrt((hands**2).sum(-1).mean()))
    return result


class _Foothold(NamedTuple):
    seconds: float
    """When, in the middle of its stance."""
    foot: int
    outward: float
    """Metres to the foot's own side of the way."""
    toes: Array
    """(3,) metres on the ground."""


def _footholds(gait: Gait, path: Array) -> list[_Foothold]:
    p, ground = gait.places, np.array([1.0, 0.0, 1.0])
    facing = ph.smooth(ph.heading(p), ph.odd(gait.fps))
    found = []
    for i, (_, _, ankle, toes) in enumerate(_FEET):
        for a, b in gait.spans[i]:
            m = (a + b) // 2
            aside = ph.turned((p[a:b, ankle] + p[a:b, toes]).mean(axis=0) / 2 - path[m], facing[m])[0]
            found.append(_Foothold(m / gait.fps, i, float(aside) * (1 - 2 * i), p[m, toes] * ground))
    return sorted(found, key=lambda hold: hold.seconds)


def _steps(p: Array, body: Array, fps: float) -> Measures:
    gait = Gait(p, planted_feet(p, fps), fps)
    path = ph.smooth(ph.smooth(p[:, 0] * [1, 0, 1], ph.odd(fps)), ph.odd(fps / 2))
    holds = _footholds(gait, path)
    steps = [(a, b) for a, b in pairwise(holds) if a.foot != b.foot]
    gaps = np.array([b.seconds - a.seconds for a, b in steps] or [len(p) / fps])
    lengths = np.array([np.linalg.norm(b.toes - a.toes) for a, b in steps] or [0.0])
    widths = np.array([hold.outward for hold in holds] or [0.1])
    line = (p[-1, 0] - p[0, 0]) * [1, 0, 1]
    line = line / max(float(np.linalg.norm(line)), 0.3)
    off = (path - path[0]) @ np.array([line[2], 0, -line[0]])
    pace = float(np.median(ph.speed(p, fps)))
    result = {
        "pace": pace,
        "cadence": 60 / float(np.median(gaps)) if pace > 0.2 else 0.0,
        "step": float(np.median(lengths)),
        "step_spread": float(lengths.std()),
        "time_spread": float(gaps.std() / max(gaps.mean(), 0.1)),
        "width": float(2 * widths.mean()),
        "width_spread": float(widths.std()),
        "wander": float(np.abs(off - np.linspace(off[0], off[-1], len(off))).max()),
        "both": float(gait.standing.all(axis=1).mean()),
        "none": float((~gait.standing.any(axis=1)).mean()),
    }
    for i, name in enumerate("lr"):
        whole = [(b - a) / fps for a, b in gait.spans[i] if a > 0 and b < len(p)]
        result[f"stance_{name}"] = float(np.median(whole or [0.6]))
        result |= _leg(p, body, gait.standing[:, i], _FEET[i], name)
    return result | _of_both_legs(result)


def _of_both_legs(m: Measures) -> Measures:
    names = ("toe_lift", "ankle_lift", "thigh", "heel", "swing_knee", "stance_knee")
    left, right = m["stance_l"], m["stance_r"]
    return {
        **{name: (m[f"{name}_l"] + m[f"{name}_r"]) / 2 for name in names},
        "stance_ratio": right / max(left, 0.1),
        "stance_short": min(left, right) / max(left, right, 0.1),
        "knee_gap": m["swing_knee_r"] - m["swing_knee_l"],
        "stiffer": abs(m["swing_knee_r"] - m["swing_knee_l"]),
    }


def _leg(p: Array, body: Array, stands: np.ndarray, leg: tuple[int, int, int, int], name: str) -> Measures:
    hip, knee, ankle, toes = leg
    swings = [s for s in true_spans(~stands) if s[1] - s[0] > 2] or [(0, len(p))]
    thigh, shin = body[:, knee] - body[:, hip], body[:, ankle] - body[:, knee]
    bend = np.degrees(np.arctan2(np.linalg.norm(np.cross(thigh, shin), axis=-1), (thigh * shin).sum(-1)))
    rise = np.degrees(np.arctan2(thigh[:, 2], -thigh[:, 1]))

    def top(values: Array) -> float:
        return float(np.median([values[a:b].max() for a, b in swings]))

    on = stands if stands.any() else ~stands
    return {
        f"toe_lift_{name}": top(p[:, toes, 1]) - float(np.percentile(p[:, toes, 1], 15)),
        f"ankle_lift_{name}": top(p[:, ankle, 1]) - float(np.percentile(p[:, ankle, 1], 10)),
        f"thigh_{name}": top(rise),
        f"heel_{name}": float(np.percentile(p[on, ankle, 1], 20)),
        f"swing_knee_{name}": top(bend),
        f"stance_knee_{name}": float(np.median(bend[on])),
    }


def _posture(p: Array, body: Array, fps: float) -> Measures:
    spine, chest = body[:, 12] - body[:, 0], body[:, 12] - body[:, 9]
    neck = body[:, 15] - body[:, 12]
    hips, girdle = p[:, 1] - p[:, 2], p[:, 16] - p[:, 17]
    ahead = np.degrees(np.arctan2(spine[:, 2], spine[:, 1]))
    aside = np.degrees(np.arctan2(spine[:, 0], spine[:, 1]))
    turn = np.unwrap(np.arctan2(-girdle[:, 2], girdle[:, 0])) - np.unwrap(np.arctan2(-hips[:, 2], hips[:, 0]))
    feet = p[:, [10, 11], 1].min()
    return {
        "height": float(np.median(p[:, 0, 1]) - feet),
        "bob": float(np.std(p[:, 0, 1] - ph.smooth(p[:, 0, 1], ph.odd(1.5 * fps)))),
        "lean": float(np.median(ahead)),
        "chest": float(np.median(np.degrees(np.arctan2(chest[:, 2], chest[:, 1])))),
        "head": float(np.median(np.degrees(np.arctan2(neck[:, 2], neck[:, 1])))),
        "lean_spread": float(ahead.std()),
        "roll_spread": float(aside.std()),
        "roll": float(aside.mean()),
        "twist": float(np.degrees(turn - turn.mean()).std()),
        "list": float(np.degrees(np.arcsin((hips[:, 1] / np.linalg.norm(hips, axis=-1)).clip(-1, 1))).std()),
        "sway": float(np.std(body[:, 0, 0] - (body[:, 7, 0] + body[:, 8, 0]) / 2)),
        "shrug": float(np.mean(p[:, [16, 17], 1].mean(1) - p[:, 9, 1])),
    }


def _arm(body: Array, arm: tuple[int, int, int, float], name: str, fps: float) -> Measures:
    shoulder, elbow, wrist, outward = arm
    upper, lower = body[:, elbow] - body[:, shoulder], body[:, wrist] - body[:, elbow]
    ahead = np.degrees(np.arctan2(upper[:, 2], -upper[:, 1]))
    bend = np.degrees(np.arctan2(np.linalg.norm(np.cross(upper, lower), axis=-1), (upper * lower).sum(-1)))
    hand = body[:, wrist] - (body[:, 16] + body[:, 17]) / 2
    place = hand.mean(axis=0) * [outward, 1, 1]
    return {
        f"swing_{name}": float(ahead.std()),
        f"elbow_{name}": float(bend.mean()),
        f"hand_out_{name}": float(place[0]),
        f"hand_up_{name}": float(place[1]),
        f"hand_ahead_{name}": float(place[2]),
        f"hand_moves_{name}": float(hand.std(axis=0).sum()),
    }
