"""What the words of one action allow to check: where to, which way round, what is done, how low.

Not a judge of motion (`motionloom_lab` has one): the few things that words say plainly and joints show plainly, by
which one of several candidates is chosen (`motionloom.tasks.best`).
"""

import re
from collections.abc import Callable
from functools import partial

import numpy as np

from motionloom.goals.amounts import countable_actions
from motionloom.goals.verbs import base_of, kind_of_verb
from motionloom.kinematics.counts import Counted, Side, count
from motionloom.kinematics.gestures import hands_height, pelvis_height, wrist_swings
from motionloom.kinematics.physics import displacement, travel, turn

Check = Callable[[np.ndarray, float], bool]
"""(positions (frames, 22, 3) metres, frames per second) to whether something is done."""
_GOES = 0.6
"""Metres that somebody goes who goes anywhere."""
_TURNS, _TURNS_ROUND = np.radians(25), np.radians(120)
_LOW = 0.85
"""Leg lengths of the pelvis over the feet below which somebody crouches, kneels or sits."""


def share_met(text: str, positions: np.ndarray, fps: float) -> float:
    """Share of what the words of one action allow to check that a motion does; 1 where they allow nothing."""
    checks = checks_of(text)
    return float(np.mean([check(positions, fps) for check in checks])) if checks else 1.0


def asks_for_rest(text: str) -> bool:
    """Whether somebody is to stand, sit, lie or wait."""
    return "state" in _kinds(text.lower())


def checks_of(text: str) -> list[Check]:
    """What can be checked of the words of one action."""
    phrase = text.lower()
    kinds, sides = _kinds(phrase), set(re.findall(r"\b(left|right)\b", phrase))
    side: Side = "" if len(sides) != 1 else "left" if "left" in sides else "right"
    sign, hands = 1 if side == "left" else -1, {"": (0, 1), "left": (0,), "right": (1,)}
    limb = side if re.search(r"\b(?:arm|hand|leg|foot|fist|knee|shoulder|elbow)s?\b", phrase) else ""
    checks: list[Check] = [partial(_repeats, what, limb) for what in countable_actions(phrase)]
    if "turn" in kinds or re.search(r"\bturn", phrase):
        if side and not limb:
            checks.append(lambda p, fps: sign * turn(p) > _TURNS)
        if re.search(r"\b(?:around|round|about|180)\b", phrase):
            checks.append(lambda p, fps: abs(turn(p)) > _TURNS_ROUND)
    elif "locomotion" in kinds and not re.search(r"\b(?:in place|on (?:the|one) spot|treadmill)\b", phrase):
        checks.append(_travels(phrase, side))
    if re.search(r"\b(?:crouch|kneel|squat|sit down|sits down|sitting down|duck)", phrase):
        checks.append(lambda p, fps: float(pelvis_height(p).min()) < _LOW)
    if re.search(r"\b(?:rais|lift)\w* (?:\w+ ){0,3}(?:arm|hand)s?\b", phrase):
        checks.append(lambda p, fps: bool(hands_height(p, over="neck")[:, hands[side]].max() > 0))
    if re.search(r"\bwav(?:e|es|ing)\b", phrase):
        checks.append(lambda p, fps: max(wrist_swings(p, fps)[hand] for hand in hands[limb]) >= 3)
    return checks


def _kinds(phrase: str) -> set[str]:
    words = [word for word in re.findall(r"[a-z]+", phrase) if word != "left"]
    return {kind_of_verb(word, phrase) for word in words if base_of(word)}


def _repeats(what: Counted, side: Side, p: np.ndarray, fps: float) -> bool:
    return count(what, p, fps, side=side) > 0


def _travels(phrase: str, side: Side) -> Check:
    if re.search(r"\b(?:backwards?|in reverse)\b", phrase):
        return lambda p, fps: displacement(p, fps).forward < -_GOES
    if side and re.search(r"\b(?:side|strafe)", phrase):
        sign = 1 if side == "left" else -1
        return lambda p, fps: sign * displacement(p, fps).left > _GOES
    if re.search(r"\bforwards?\b", phrase):
        return lambda p, fps: displacement(p, fps).forward > _GOES
    return lambda p, fps: travel(p, fps) > _GOES
