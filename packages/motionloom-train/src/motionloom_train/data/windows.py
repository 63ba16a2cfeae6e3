"""What a few seconds of motion measurably show, as labels of `data.words.LABELS`.

Captions of whole clips say little about the five seconds a network sees: a clip called "walk, 90-degree left turn" may
show a straight walk. These rules read displacement, heading, heights and swings, and for gestures also need the
action in the clip's own text. They describe training windows only and share no thresholds with
`lab.metrics.obedience`, which judges what comes out.
"""

import functools
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from motionloom.core.reading import read_table
from motionloom.kinematics import physics as ph
from motionloom.kinematics.gestures import longest, wrist_thrust
from motionloom.kinematics.physics import Array

Measures = dict[str, float]
_ANKLES, _FEET, _WRISTS, _SHOULDERS, _HIPS = [7, 8], [7, 8, 10, 11], [20, 21], [16, 17], [1, 2]


def measure(p: Array, fps: float) -> Measures:
    smooth = ph.smooth(p, 3)
    velocity = ph.velocity(smooth, fps)
    body = ph.in_body(smooth)
    return (
        _path_measures(smooth, velocity, fps)
        | _limb_measures(smooth, velocity, body, fps)
        | _posture_measures(smooth, body, fps)
    )


def _path_measures(p: Array, velocity: Array, fps: float) -> Measures:
    heading = ph.smooth(ph.heading(p), ph.odd(fps / 4))
    way = ph.smooth(ph.turned(velocity[:, 0] * [1, 0, 1], heading), ph.odd(fps / 4))
    pace = np.linalg.norm(way, axis=-1)
    seconds = len(p) / fps
    moving = pace > 0.3
    few = min(round(2.5 * fps), len(p) - 1)
    course = np.unwrap(np.arctan2(velocity[moving, 0, 0], velocity[moving, 0, 2])) if moving.sum() > 2 else np.zeros(2)
    travel = max(float(pace.mean() * seconds), 0.3)
    return {
        "travel": float(pace.mean() * seconds),
        "left": float(way[:, 0].mean() * seconds),
        "advance": float(way[:, 2].mean() * seconds),
        "facing_share": float(way[:, 2].mean() * seconds) / travel,
        "side_share": abs(float(way[:, 0].mean() * seconds)) / travel,
        "pace": float(np.median(pace[moving])) if moving.any() else 0.0,
        "gap": float(np.linalg.norm((p[-1, 0] - p[0, 0])[[0, 2]])) / travel,
        "turn": float(np.degrees(heading[-1] - heading[0])),
        "turn_within": float(np.degrees(np.abs(heading[few:] - heading[:-few]).max())),
        "winding": float(np.degrees(abs(course[-1] - course[0]))),
    }


def _limb_measures(p: Array, velocity: Array, body: Array, fps: float) -> Measures:
    feet = p[:, _FEET, 1]
    lift = (feet - np.percentile(feet, 5, axis=0)).min(axis=1)
    air = np.flatnonzero(np.diff(np.concatenate([[0], (lift > 0.05).astype(int), [0]])) == 1)
    apart = p[:, 7, 1] - p[:, 8, 1]
    reach = np.linalg.norm(p[:, _WRISTS] - p[:, _SHOULDERS], axis=-1)
    leg = np.linalg.norm(p[:, _ANKLES] - p[:, _HIPS], axis=-1)
    level = np.abs(p[:, _WRISTS, 1] - p[:, _SHOULDERS, 1]) < 0.4
    thrust = np.where(level, ph.velocity(reach, fps), 0)
    forward = wrist_thrust(p, fps).max(axis=0)
    raised = p[:, _WRISTS, 1] - p[:, 9:10, 1]
    lower = ph.smooth(p[:, [10, 11], 1].min(axis=1), ph.odd(fps / 2))
    fifth = max(1, len(p) // 5)
    return {
        "flights": float(len(air)),
        "jump_clearance": float(lift.max()),
        "jump_rise": float(p[:, 0, 1].max() - np.median(p[:, 0, 1])),
        "hops": float(sum(abs(apart[max(a - 1, 0)]) > 0.1 for a in air)),
        "one_leg": longest(np.asarray(np.abs(apart) > 0.12)) / fps,
        "rise": float(lower[-fifth:].mean() - lower[:fifth].mean()),
        "kick_height": float(np.abs(apart).max() / leg.max()),
        "left_kick": float(apart.max() / leg.max()),
        "right_kick": float(-apart.min() / leg.max()),
        "kick_snap": float(ph.velocity(leg, fps).max()),
        "foot_speed": float(np.percentile(np.linalg.norm(ph.velocity(body[:, _ANKLES], fps), axis=-1).max(axis=1), 98)),
        "punch_speed": float(thrust.max()),
        "left_punch": float(thrust[:, 0].max()),
        "right_punch": float(thrust[:, 1].max()),
        "left_forward": float(forward[0]),
        "right_forward": float(forward[1]),
        "both_over_head": float((p[:, _WRISTS, 1].min(axis=1) - p[:, 15, 1]).max()),
        "hand_over_neck": float((p[:, _WRISTS, 1] - p[:, 12:13, 1]).max()),
        "both_raised": float((raised.min(axis=1) > 0).mean()),
        "hands_up": longest(p[:, _WRISTS, 1].min(axis=1) > p[:, 12, 1]) / fps,
        "wave_swings": float(max(_swings(body[:, w, 0][raised[:, k] > 0], 0.07) for k, w in enumerate(_WRISTS))),
        "stir": float(np.percentile(np.linalg.norm(velocity, axis=-1).max(axis=1), 90)),
        "mean_stir": float(np.linalg.norm(velocity, axis=-1).mean()),
    }


def _posture_measures(p: Array, body: Array, fps: float) -> Measures:
    shin = np.linalg.norm(p[:, [4, 5]] - p[:, _HIPS], axis=-1) + np.linalg.norm(p[:, _ANKLES] - p[:, [4, 5]], axis=-1)
    height = (p[:, 0, 1] - p[:, _ANKLES, 1].min(axis=1)) / np.median(shin)
    spine = body[:, 12] - body[:, 0]
    upper, lower = p[:, [4, 5]] - p[:, _HIPS], p[:, _ANKLES] - p[:, [4, 5]]
    knees = np.arctan2(np.linalg.norm(np.cross(upper, lower), axis=-1), (upper * lower).sum(-1)).min(axis=1)
    tilt = np.degrees(np.arctan2(np.linalg.norm(spine[:, [0, 2]], axis=-1), spine[:, 1]))
    few = max(1, round(0.3 * fps))
    return {
        "height_first": float(height[:few].mean()),
        "height_last": float(height[-few:].mean()),
        "low_share": float((height < 0.8).mean()),
        "tilt_first": float(tilt[:few].mean()),
        "tilt_last": float(tilt[-few:].mean()),
        "dips": float(_swings(height, 0.2) // 2) if min(height[:few].mean(), height[-few:].mean()) > 0.88 else 0.0,
        "pelvis_low": float(np.percentile(height, 2)),
        "low_seconds": longest(height < 0.8) / fps,
        "bend": float(np.degrees(np.percentile(np.arctan2(spine[:, 2], spine[:, 1]), 98))),
        "knees": float(np.degrees(np.percentile(knees, 98))),
    }


def _swings(signal: Array, amplitude: float) -> int:
    """Turns back by at least ``amplitude`` metres."""
    count, way, extreme = 0, 0, float(signal[0]) if len(signal) else 0.0
    for value in signal:
        if way == 0:
            way = int(np.sign(value - extreme)) if abs(value - extreme) >= amplitude else 0
            extreme = value if way else extreme
        elif (value - extreme) * way > 0:
            extreme = value
        elif (extreme - value) * way >= amplitude:
            count, way, extreme = count + 1, -way, value
    return count


class Rule(NamedTuple):
    """The labels of a window whose clip's words and own measures fulfil conditions."""

    labels: str
    """The names it gets, with commas; none where a window like this has no name."""
    measures: str
    """Comparisons with commas, all of which must hold: of `measure`'s numbers and those of `compare`."""
    words: tuple[str, ...] = ()
    """Patterns, each of which the clip's text must hold."""
    without: str = ""
    """A pattern that it must not hold."""
    choice: str = ""
    """Of the rules of one choice only the first that holds counts; every rule without one is a choice of its own."""
    closes: tuple[str, ...] = ()
    """Other choices that are closed by this rule."""

    def holds(self, compared: Measures, words: str) -> bool:
        """Whether all of it is so. ``words`` are in lower case."""
        return (
            all(re.search(pattern, words) for pattern in self.words)
            and not (self.without and re.search(self.without, words))
            and all(is_so(compared[name], number) for name, is_so, number in comparisons(self.measures))
        )


_OPERATORS = {"<": operator.lt, ">": operator.gt, "<=": operator.le, ">=": operator.ge}


@functools.cache
def comparisons(text: str) -> tuple[tuple[str, Callable[[float, float], bool], float], ...]:
    parts = (part.split() for part in text.split(",") if part)
    return tuple((name, _OPERATORS[sign], float(number)) for name, sign, number in parts)


def _rules(rows: Sequence[Mapping[str, Any]]) -> tuple[Rule, ...]:
    """Rules of ``windows.toml``, with their names replaced by what they mean."""
    named = _ROWS["words"] | _ROWS["measures"]

    def whole(value: Any) -> Any:
        if isinstance(value, list):
            return tuple(map(whole, value))
        return re.sub(r"\$(\w+)", lambda match: named[match[1]], value)

    return tuple(Rule(**{"measures": "", **{key: whole(value) for key, value in row.items()}}) for row in rows)


_ROWS = read_table("motionloom_train.data", "windows.toml")
ALONE, GESTURES, PATHS = (_rules(_ROWS[name]) for name in ("alone", "gestures", "paths"))
"""The first of the first is a window's only label; every choice of the second may give labels to one window; the first
of the last names where a window without a gesture goes."""


def label_window(positions: Array, fps: float, text: str) -> list[str]:
    """Labels of one window. ``positions`` (frames, 22, 3) metres, floor near 0; ``text``: all the clip's own words."""
    return labels_of(measure(positions, fps), len(positions) / fps, text)


def labels_of(measures: Measures, seconds: float, text: str) -> list[str]:
    """Labels of a window that measures so and lasts so long, by the rules above."""
    compared, words = compare(measures, seconds), text.lower()
    return _first(ALONE, compared, words) or _every(GESTURES, compared, words) or _first(PATHS, compared, words)


def compare(m: Measures, seconds: float) -> Measures:
    """The measures, and what rules need of two of them: degrees of turn, metres per second, metres too far ahead."""
    off_place = abs(m["advance"]) - 0.15 * seconds
    return {**m, "turned": abs(m["turn"]), "speed": m["travel"] / seconds, "off_place": off_place}


def _first(rules: Sequence[Rule], compared: Measures, words: str) -> list[str]:
    held = next((rule for rule in rules if rule.holds(compared, words)), None)
    return held.labels.split(",") if held and held.labels else []


def _every(rules: Sequence[Rule], compared: Measures, words: str) -> list[str]:
    labels: list[str] = []
    closed: set[str] = set()
    for rule in rules:
        if rule.choice not in closed and rule.holds(compared, words):
            labels += rule.labels.split(",")
            closed |= {rule.choice, *rule.closes} - {""}
    return labels


LENGTHS = (2.5, 4.0, 6.0)
"""Seconds of the windows that are labelled."""


def label_clip(positions: Array, fps: float, text: str) -> list[tuple[int, int, str]]:
    """(first frame, end frame, label) of every labelled window of a clip; the whole clip where it is shorter."""
    spans: list[tuple[int, int, str]] = []
    for seconds in LENGTHS:
        size = round(seconds * fps)
        if len(positions) < size:
            if seconds == LENGTHS[0] and len(positions) >= fps:
                spans += [(0, len(positions), name) for name in label_window(positions, fps, text)]
            break
        for start in range(0, len(positions) - size + 1, round(fps / 2)):
            window = positions[start : start + size]
            window = window - np.array([0.0, min(0.0, float(np.percentile(window[..., 1].min(-1), 5))), 0.0])
            spans += [(start, start + size, name) for name in label_window(window, fps, text)]
    return spans
