"""What a few seconds of motion measurably show, as labels of `data.words.LABELS`.

Captions of whole clips say little about the five seconds a network sees: a clip called "walk, 90-degree left turn" may
show a straight walk. These rules read displacement, heading, heights and swings, and for gestures also ask that the
clip's own text names the action. They describe training windows only and share no thresholds with
`lab.metrics.obedience`, which judges what comes out.
"""

import re

import numpy as np

from motionloom.kinematics import physics as ph
from motionloom.kinematics.gestures import longest
from motionloom.kinematics.physics import Array

Measures = dict[str, float]
_BENT_OTHERWISE = r"danc|climb|cartwheel|dive|snake|fish|whale|crawl|flip|roll"
_ANKLES, _FEET, _WRISTS, _SHOULDERS, _HIPS = [7, 8], [7, 8, 10, 11], [20, 21], [16, 17], [1, 2]


def _measure(p: Array, fps: float) -> Measures:
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
        "kick_snap": float(ph.velocity(leg, fps).max()),
        "foot_speed": float(np.percentile(np.linalg.norm(ph.velocity(body[:, _ANKLES], fps), axis=-1).max(axis=1), 98)),
        "punch_speed": float(np.where(level, ph.velocity(reach, fps), 0).max()),
        "both_over_head": float((p[:, _WRISTS, 1].min(axis=1) - p[:, 15, 1]).max()),
        "hand_over_neck": float((p[:, _WRISTS, 1] - p[:, 12:13, 1]).max()),
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


def label_window(positions: Array, fps: float, text: str) -> list[str]:
    """Labels of one window. ``positions`` (frames, 22, 3) metres, floor near 0; ``text``: all the clip's own words."""
    m = _measure(positions, fps)
    seconds = len(positions) / fps
    words = text.lower()
    gestures = _gestures(m, words, seconds)
    if gestures:
        return gestures
    return _path(m, seconds, words)


def _says(words: str, pattern: str) -> bool:
    return re.search(pattern, words) is not None


def _gestures(m: Measures, words: str, seconds: float) -> list[str]:
    found: list[str] = []
    if _says(words, r"cartwheel") and m["bend"] > 70:
        return ["cartwheel"]
    if _says(words, r"\bjack") and m["both_over_head"] > 0.1 and m["flights"] >= 2:
        return ["jumping jacks"]
    if _says(words, r"punch|strike|boxing|oiduki") and m["punch_speed"] > 1.4:
        found.append("punch")
    if _says(words, r"kick|geri|karate|martial") and m["kick_height"] > 0.5 and m["foot_speed"] > 4.4:
        found.append("kick ball" if _says(words, r"soccer|ball") else "kick")
    elif _says(words, r"soccer") and m["kick_height"] > 0.3 and m["foot_speed"] > 5.0:
        found.append("kick ball")
    jumpy = _says(words, r"jump|hop|leap|exercise")
    if jumpy and m["hops"] >= 3 and m["flights"] >= 3 and _says(words, r"hop|one foot|one leg"):
        found.append("hop")
    elif jumpy and m["jump_rise"] > 0.2 and m["jump_clearance"] > 0.16:
        several = m["flights"] >= 3 and abs(m["advance"]) < 0.15 * seconds
        found.append("jump repeatedly" if several else "jump forward" if m["advance"] > 0.8 else "jump")
    if _says(words, r"wav|traffic|bye") and m["wave_swings"] >= 4 and m["hand_over_neck"] > -0.1 and m["travel"] < 2:
        found.append("wave")
    if _says(words, r"climb|stair|steps|ladder") and abs(m["rise"]) > 0.35:
        found.append("climb" if m["rise"] > 0 else "descend")
    if _says(words, r"danc|salsa|ballet|pirouette") and m["mean_stir"] > 0.45:
        found.append("dance")
    if _says(words, r"balance|one leg") and m["one_leg"] > 1.5 and m["travel"] < 1.0:
        found.append("balance")
    found += _postures(m, words)
    if m["hands_up"] > 0.6 and m["both_over_head"] > 0.05 and not _says(words, r"climb|ladder|danc|hang"):
        found.append("arms up")
    return found


def _postures(m: Measures, words: str) -> list[str]:
    """Changes are seen whole: upright before sitting down, crouching and bending, upright behind standing up."""
    if _says(words, r"\bsit|seat|chair|stool"):
        if m["low_share"] > 0.9 and m["bend"] < 75:
            return ["sit"]
        if m["height_first"] > 0.88 and m["height_last"] < 0.78 and m["tilt_last"] < 45:
            return ["sit down"]
        if m["height_first"] < 0.78 and m["height_last"] > 0.88 and m["tilt_first"] < 45:
            return ["stand up"]
    found: list[str] = []
    squats = ("squat once", "squat twice", "squat three times")
    if _says(words, r"squat") and 1 <= m["dips"] <= 3:
        found.append(squats[int(m["dips"]) - 1])
    deep = (
        m["pelvis_low"] < 0.72 and m["knees"] > 80 and not _says(words, r"climb|danc|snake|fish|whale|ladder|crawl|sit")
    )
    if deep and m["height_first"] > 0.85:
        found.append("crouch")
    upright = max(m["tilt_first"], m["tilt_last"]) < 35
    if m["bend"] > 60 and m["pelvis_low"] > 0.6 and upright and not _says(words, _BENT_OTHERWISE):
        found.append("bend")
    return found


def _path(m: Measures, seconds: float, words: str) -> list[str]:
    stays = m["travel"] < 0.15 and abs(m["turn"]) < 25
    if m["stir"] < 0.28 and stays and m["pelvis_low"] > 0.9 and m["hand_over_neck"] < -0.2:
        return ["stand"]
    if _says(words, r"danc|salsa|climb|playground|acrobat|karate|cartwheel"):
        return []
    speed = m["travel"] / seconds
    straight = abs(m["turn"]) < 40 and m["winding"] < 70
    if m["pelvis_low"] < 0.8 or speed < 0.25:
        if abs(m["turn"]) > 60 and m["travel"] < 0.8 and m["pelvis_low"] > 0.85:
            around = abs(m["turn"]) > 135
            return ["turn left" if m["turn"] > 0 else "turn right"] + (["turn around"] if around else [])
        return []
    if m["winding"] > 250 and m["gap"] < 0.5 and m["facing_share"] > 0.6:
        return ["run circle"] if m["pace"] > 2 else ["circle left" if m["turn"] > 0 else "circle right"]
    if m["facing_share"] > 0.75 and straight:
        if m["pace"] > 2.7:
            return ["run"]
        if m["pace"] > 2.0:
            return ["jog"]
        return ["walk", "walk slow"] if m["pace"] < 0.85 else ["walk", "walk fast"] if m["pace"] > 1.5 else ["walk"]
    if m["facing_share"] < -0.75 and straight:
        return ["walk backward"] if m["pace"] < 1.7 else ["jog backward"]
    if m["side_share"] > 0.7 and abs(m["turn"]) < 60:
        return ["sidestep left" if m["left"] > 0 else "sidestep right"]
    if 55 < abs(m["turn"]) < 135 and m["facing_share"] > 0.5 and m["pace"] < 1.9:
        return ["walk left turn" if m["turn"] > 0 else "walk right turn"]
    if abs(m["turn"]) >= 135 and m["winding"] < 250 and m["facing_share"] > 0.3 and m["pace"] < 1.9:
        return ["turn around"]
    return []


def label_clip(
    positions: Array, fps: float, text: str, *, lengths: tuple[float, ...] = (2.5, 4.0, 6.0)
) -> list[tuple[int, int, str]]:
    """(first frame, end frame, label) of every labelled window of a clip; the whole clip where it is shorter."""
    spans: list[tuple[int, int, str]] = []
    for seconds in lengths:
        size = round(seconds * fps)
        if len(positions) < size:
            if seconds == lengths[0] and len(positions) >= fps:
                spans += [(0, len(positions), name) for name in label_window(positions, fps, text)]
            break
        for start in range(0, len(positions) - size + 1, round(fps / 2)):
            window = positions[start : start + size]
            window = window - np.array([0.0, min(0.0, float(np.percentile(window[..., 1].min(-1), 5))), 0.0])
            spans += [(start, start + size, name) for name in label_window(window, fps, text)]
    return spans
