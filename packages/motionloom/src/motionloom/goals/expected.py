"""What the words of one action allow to check: where to, which way round, what is done, how fast, how low.

Not a judge of motion (`motionloom_lab` has one): the few things that words say plainly and joints show plainly. A
motion that does not show them is sampled again from another seed (`motionloom.tasks.worded`), and of several candidates
one is selected that shows the most (`motionloom.tasks.best`).
"""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from motionloom.core.motion import heading
from motionloom.goals.amounts import countable_actions
from motionloom.goals.tumbling import FLAT, faces_up, log_roll, pitch
from motionloom.goals.verbs import FALL_WAYS, asserted, base_of, in_plainer_words, kind_of_verb, word_patterns
from motionloom.kinematics.counts import Side, count
from motionloom.kinematics.gestures import (
    foot_lifts,
    hands_height,
    leg_length,
    longest,
    oscillations,
    pelvis_height,
    seats,
    single_foot_hops,
    torso_inclination,
    true_spans,
    wrist_swings,
)
from motionloom.kinematics.physics import (
    ANKLES,
    WRISTS,
    Array,
    J,
    displacement,
    floor_height,
    in_body,
    smooth,
    speed,
    travel,
    turn,
)
from motionloom.kinematics.stairs import FLIGHT

_WORDS = word_patterns("expected")

Check = Callable[[Array, float], bool]
"""(positions (frames, 22, 3) metres, frames per second) to whether something is done."""
_GOES, _PACE, _FAR = 0.6, 0.25, 1.25
"""Metres that somebody goes who goes anywhere, metres per second who goes on for longer, and the most that is asked."""
_BRISK, _SLOW, _RUNS = 1.4, 1.0, 2.0
"""m/s above which a walk is fast, below which it is slow, that somebody reaches who runs."""
_CURVES, _CIRCLES = np.radians(15), np.radians(270)
_TURNS, _TURNS_ROUND, _SPINS = np.radians(25), (np.radians(120), np.radians(240)), np.radians(300)
_LOW, _DOWN, _UP = 0.85, 0.4, 0.85
"""Leg lengths of the pelvis over the feet: below it somebody crouches, kneels or sits; over the floor of somebody who
sits or lies on it; over the feet of somebody who is up."""
_UPRIGHT = np.radians(50)
"""Inclination of the trunk below which somebody is upright, above which somebody lies."""
_BENDS, _LEANS = np.radians(30), np.radians(8)
"""Inclination of the trunk of who bends, and its sideways part of who leans to a side."""
_FACES = np.radians(60)
_KNEE = 0.15
"""Leg lengths that a knee which is pulled up may be below the hip."""
_HANGS, _SPREAD = 0.15, 0.4
"""Metres that a hanging hand is over the pelvis at most, and that hands of arms that are out are away from it."""
_LEAPS, _CHAIR = 0.2, 0.45
"""Metres that the pelvis of who falls rises by at most, and that the feet are over the floor of who lies."""
_CROSSED = 0.27
"""Metres from a wrist to the other arm's elbow of who has crossed the arms."""
_FLOATS = 0.1
_FOOT, _FLIGHT = 0.15, 0.34
"""Metres that a foot is raised by, and of two stairs."""
_DET = r"(?:the|his|her|their|its|your|my)"
_TIPS = 0.1
"""Metres of the neck beyond the feet, on the average of half a second, of who falls to a side."""
_LIMB = r"\b(?:arm|hand|leg|foot|fist|knee|shoulder|elbow)s?\b"


FLOOR = "the floor under the feet"
"""What is asked of every motion whose words do not climb."""


@dataclass(frozen=True)
class Expectation:
    """Something that the words of one action say plainly."""

    name: str
    """What, for a sentence: "a turn to the left"."""
    check: Check


@dataclass(frozen=True)
class _Phrase:
    """The words of one action, in lower case."""

    text: str

    def has(self, *patterns: str | re.Pattern[str]) -> bool:
        """Whether each of some patterns is in it."""
        return all(re.search(pattern, self.text) for pattern in patterns)

    @property
    def kinds(self) -> set[str]:
        """The kinds of its verbs."""
        words = [word for word in re.findall(r"[a-z]+", self.text) if word != "left"]
        return {kind_of_verb(word, self.text) for word in words if base_of(word)}

    @property
    def side(self) -> Side:
        """The one side that it names, of a way, or of a limb."""
        behind = (
            r"(?:wards?)?\b(?=$|[,.]| (?:side(?! of)|and|then|with|while|as|at|by|for|again|twice|in|into|\w+ly|\d+)\b)"
        )
        sides = set(
            re.findall(rf"\b(left|right)(?:{behind}|(?= (?:\w+ )?{_LIMB[2:]}|[ -]?(?:punch|kick|hook|jab)))", self.text)
        )
        return "" if len(sides) != 1 else "left" if "left" in sides else "right"


def share_met(text: str, positions: np.ndarray, fps: float) -> float:
    """Share of what the words of one action allow to check that a motion does; 1 where they allow nothing.

    positions (frames, 22, 3) metres, +Y up; fps: frames per second.
    """
    expectations = expectations_of(text)
    return 1 - len(missing(text, positions, fps)) / max(len(expectations), 1)


def missing(text: str, positions: np.ndarray, fps: float) -> list[str]:
    """The names of what the words of one action say plainly and a motion does not show; arguments as of `share_met`."""
    p = np.asarray(positions, dtype=np.float64)
    names = [one.name for one in expectations_of(text) if not one.check(p, fps)]
    return names + [FLOOR] * bool(floating(p, fps) and not climbs([text]))


def floating(p: Array, fps: float) -> list[tuple[int, int]]:
    """Half-open ranges of frames, `FLIGHT` or longer, in which no joint is within 10 cm of the floor y = 0.

    p: (frames, 22, 3) metres. A seat in the air bears nobody.
    """
    return [(a, b) for a, b in true_spans(p[..., 1].min(axis=1) > _FLOATS) if b - a > FLIGHT * fps]


def climbs(texts: Iterable[str]) -> bool:
    """Whether some words are of stairs, of a ladder, of climbing, or of something that people are on or hang from."""
    return any(_WORDS["climb"].search(text.lower()) for text in texts)


def asks_for_rest(text: str) -> bool:
    """Whether somebody is to stand, sit, lie or wait."""
    return "state" in _Phrase(asserted(text)).kinds


def expectations_of(text: str) -> list[Expectation]:
    """What can be checked of the words of one action, and of common words for its rare ones."""
    found: dict[str, Check] = {}
    for words in dict.fromkeys((in_plainer_words(text), text)):
        phrase = _Phrase(asserted(words))
        limb: Side = phrase.side if phrase.has(_LIMB) else ""
        way: Side = "" if limb else phrase.side
        parts = _repeated(phrase, limb), _ways(phrase, way), _postures(phrase), _arms(phrase, limb), _whole_body(phrase)
        found = dict(named for part in parts for named in part) | found
    return [Expectation(name, check) for name, check in found.items()]


_Named = tuple[str, Check]


def _repeated(phrase: _Phrase, limb: Side) -> Iterator[_Named]:
    often = phrase.has(r"\b(?:keeps|again and again|over and over|repeatedly|continuous|up and down|in place)\b")
    for what in sorted(countable_actions(phrase.text)):
        if what == "squats" and "state" in phrase.kinds:  # stays down
            continue
        least = 3 if often else 2 if what in ("claps", "jumping jacks") else 1
        name = f"{least} {what}" if least > 1 else what
        yield name, lambda p, fps, what=what, least=least: count(what, p, fps, side=limb) >= least  # type: ignore[misc]
        if limb and what in ("kicks", "punches"):
            other: Side = "left" if limb == "right" else "right"
            yield (
                f"{what} of the {limb} side alone",
                lambda p, fps, what=what, other=other: (  # type: ignore[misc]
                    count(what, p, fps, side=other) == 0
                ),
            )
    if limb and "hops" in countable_actions(phrase.text):
        own, other_one = (0, 1) if limb == "left" else (1, 0)
        yield f"hops on the {limb} foot", lambda p, fps: single_foot_hops(p)[own] > single_foot_hops(p)[other_one]
    if phrase.has(r"\b(?:clap|applau)"):
        yield "hands that meet", lambda p, fps: float(np.percentile(_between_hands(p), 3)) < 0.25


def _ways(phrase: _Phrase, side: Side) -> Iterator[_Named]:
    sign, turns = (
        (1 if side == "left" else -1),
        phrase.has(r"\b(?:turn|pivot|rotat)") and not phrase.has(_WORDS["no_turn"]),
    )
    if phrase.has(r"\bturn\w* (?:\w+ )?head\b"):
        return
    if phrase.has(_WORDS["no_turn"]):
        yield "facing one way", lambda p, fps: abs(turn(p)) < _FACES
    if phrase.has(r"\b(?:spin|twirl|pirouet)"):
        yield "a full turn", lambda p, fps: float(np.abs(np.diff(smooth(heading(p), 3))).sum()) > _SPINS
    elif turns and side and not phrase.has(_LIMB):
        yield f"a turn to the {side}", lambda p, fps: sign * turn(p) > _TURNS
    elif turns and phrase.has(
        r"\b(?:turn|pivot|rotat)\w* (?:\w+ly |right |all the way )?(?:(?:around|round|about)(?! (?:the|an?|corners?)\b)"
        r"|180|to (?:face )?the (?:other|opposite)|the other way|in the opposite|to look (?:behind|back))"
    ):
        yield "a half turn", lambda p, fps: _TURNS_ROUND[0] < abs(turn(p)) < _TURNS_ROUND[1]
    elif turns and phrase.has(r"\baway\b"):
        yield "a turn", lambda p, fps: abs(turn(p)) > 2 * _TURNS
    if phrase.has(_WORDS["in_place"]):
        yield "staying in place", lambda p, fps: float(np.hypot(*_from_start(p).max(axis=0))) < 2 * _GOES
    elif phrase.has(_WORDS["way_back"]) and not phrase.has(_WORDS["backwards"]):
        yield (
            "coming back to the start",
            lambda p, fps: float(np.linalg.norm(p[-1, 0, [0, 2]] - p[0, 0, [0, 2]])) < travel(p, fps) / 2,
        )
    elif phrase.has(r"\bstairs?\b|\bstaircase\b|\bladder\b"):
        falls = phrase.has(r"\bdown|\bdescend")
        yield (
            ("a way down" if falls else "a way up"),
            lambda p, fps: (p[-1, 0, 1] - p[0, 0, 1]) * (1, -1)[falls] > _FLIGHT,
        )
    elif _travels(phrase) and not turns and not phrase.has(_WORDS["falls"]):
        yield _direction(phrase, side, sign)
    if phrase.has(_WORDS["gait"], r"\bin an? (?:[\w-]+ ){0,2}circle\b"):
        yield "a circle", lambda p, fps: abs(turn(p)) > _CIRCLES and (not side or sign * turn(p) > 0)
    if side and phrase.has(_WORDS["gait"]) and phrase.has(r"\b(?:curv|veer|arc)"):
        yield f"a curve to the {side}", lambda p, fps: sign * turn(p) > _CURVES
    if side and phrase.has(_WORDS["gait"], r"\bdiagonal"):
        yield f"a way aside to the {side}", lambda p, fps: sign * displacement(p, fps).left > _GOES / 2
    yield from _paces(phrase)


def _travels(phrase: _Phrase) -> bool:
    return phrase.has(_WORDS["gait"]) or (phrase.has(_WORDS["backwards"]) and not phrase.has(_WORDS["stays_there"]))


def _direction(phrase: _Phrase, side: Side, sign: int) -> _Named:
    if phrase.has(_WORDS["backwards"]):
        return "a way backwards", lambda p, fps: displacement(p, fps).forward < -_GOES
    if side and phrase.has(r"\b(?:side|strafe|shuffl|over to the (?:left|right))"):
        return f"a way to the {side}", lambda p, fps: sign * displacement(p, fps).left > _GOES
    if phrase.has(r"\b(?:forwards?|ahead)\b") and not side:
        return "a way forward", lambda p, fps: displacement(p, fps).forward > _GOES
    short = phrase.has(r"\bstep|\b(?:stand|start|stop|wait)")
    return (
        "moving from the spot",
        lambda p, fps: travel(p, fps) > (_GOES if short else min(max(_GOES, _PACE * len(p) / fps), _FAR)),
    )


def _paces(phrase: _Phrase) -> Iterator[_Named]:
    walks = phrase.has(r"\b(?:walk|stroll|stride)")
    runs = phrase.has(r"\b(?:run|runs|running|sprint\w*)\b(?!-up)") and not (
        phrase.has(_WORDS["backwards"]) or phrase.has(_WORDS["in_place"])
    )
    if runs and not walks:
        yield "a run", lambda p, fps: float(speed(p, fps).max()) > _RUNS
    elif walks and phrase.has(r"\b(?:fast|quick|brisk|hurr|rush|swift)"):
        yield "a fast walk", lambda p, fps: _pace(p, fps) > _BRISK
    elif walks and phrase.has(r"\bslow(?:ly)?\b|\bleisure"):
        yield "a slow walk", lambda p, fps: _pace(p, fps) < _SLOW
    if phrase.has(r"\b(?:stops|halts|comes to a (?:stop|halt|standstill))\b|^(?:stop|halt|come to a stop)\b(?! sign)"):
        yield "a stop", lambda p, fps: float(speed(p, fps)[-max(1, round(fps / 4)) :].mean()) < 0.3


def _postures(phrase: _Phrase) -> Iterator[_Named]:
    sits = phrase.has(r"\b(?:sit|sits|sitting|sat|takes? a seat|taking a seat)\b(?!-| ups?\b)")
    if sits and phrase.has(_WORDS["floor"]) and not phrase.has(_WORDS["seat"]):
        yield "sitting on the floor", lambda p, fps: _lasts((_over_floor(p) < _DOWN) & _upright(p), 1.0, fps)
    elif sits:
        yield "sitting", lambda p, fps: bool(seats(p, fps, shortest=0.5))
    elif phrase.has(r"\b(?:gets?|stands?|rises?|rising|getting) .*\b(?:from|out of|off)\b", _WORDS["seat"]):
        yield "sitting at the start", lambda p, fps: any(one.begin < 1 for one in seats(p, fps, shortest=0.25))
    if phrase.has(r"\b(?:lie|lies|lying)\b|\blay(?:s|ing)? down\b") and not phrase.has(
        r"\b(?:gets?|stands?|rises?) (?:back )?up"
    ):
        yield "lying", lambda p, fps: _lasts((_over_floor(p) < _DOWN) & (torso_inclination(p) > FLAT), 0.5, fps)
        if up := re.search(r"\bon (?:the|his|her|their|its|your|my) (back|stomach|belly|front)\b", phrase.text):
            yield f"lying on the {up[1]}", lambda p, fps: (faces_up(p, fps) > 0) == (up[1] == "back")
    if phrase.has(r"\b(?:crouch|kneel|squat|duck)"):
        yield "going low", lambda p, fps: float(pelvis_height(p).min()) < _LOW
    if phrase.has(
        r"\b(?:gets?|getting|stands?|standing|rises?) (?:back )?"
        r"(?:up\b|on(?:to)? (?:the|his|her|their|its|your|my) feet)"
    ):
        yield "standing at the end", lambda p, fps: float(pelvis_height(p)[-max(1, round(fps / 4)) :].mean()) > _UP
    on_one_leg = r"\bon (?:one|(?:the |his |her |their |its |your |my )?(left|right)) (?:leg|foot)\b"
    if (match := re.search(on_one_leg, phrase.text)) and phrase.kinds <= {"state", "gesture", "other"}:
        lifted = [0, 1] if match[1] is None else [1] if match[1] == "left" else [0]
        yield "standing on one leg", lambda p, fps: any(_lasts(foot_lifts(p)[:, one] > 0.1, 1.0, fps) for one in lifted)


def _arms(phrase: _Phrase, limb: Side) -> Iterator[_Named]:
    hands = {"": (0, 1), "left": (0,), "right": (1,)}[limb]
    rest = [hand for hand in (0, 1) if hand not in hands]
    if phrase.has(
        r"\b(?:rais|lift|puts?|putting|holds?|reach)\w* (?:up )?(?:(?!(?:with|in|into|by|from|off|to) )\w+ ){0,4}"
        r"(?:arm|hand)s?\b",
        r"rais|lift|\bup\b|over (?:\w+ )?head",
    ):
        both = phrase.has(r"\b(?:arms|hands)\b") and not limb
        joint = "spine3" if phrase.has(_WORDS["level"]) else "neck"
        yield (
            "a raised arm",
            lambda p, fps: (
                (all if both else any)(_lasts(_over(p, joint)[:, hand], 0.3, fps) for hand in hands)
                and not any(_lasts(_over(p, "neck")[:, hand], 0.3, fps) for hand in rest)
            ),
        )
    if phrase.has(r"\b(?:lower|drop)\w* (?:\w+ ){0,3}(?:arm|hand)s?\b"):
        yield "a lowered arm", lambda p, fps: float(hands_height(p[-1:], over="pelvis")[:, list(hands)].max()) < _HANGS
    if phrase.has(_WORDS["arms_out"]):
        yield "arms out", lambda p, fps: _lasts(_arms_out(p), 0.4 * len(p) / fps, fps)
    if phrase.has(r"\b(?:rais|lift|pull|draw|bring|pick)\w* (?:up )?(?:(?!to )\w+ ){0,2}knees?\b"):
        yield "a raised knee", lambda p, fps: any(_lasts(_knees(p)[:, hand] > -_KNEE, 0.2, fps) for hand in hands)
    if phrase.has(r"\b(?:rais|lift)\w* (?:up )?(?:\w+ ){0,3}(?:leg|foot)\b"):
        yield "a raised foot", lambda p, fps: any(_lasts(foot_lifts(p)[:, hand] > _FOOT, 0.3, fps) for hand in hands)
    if phrase.has(r"(?<!\ba )(?<!\bthe )\bwav(?:e|es|ing)\b"):
        yield "a wave", lambda p, fps: max(wrist_swings(p, fps, amplitude=0.05)[hand] for hand in hands) >= 3
    if phrase.has(r"\b(?:cross|fold)\w* (?:\w+ )?arms\b|\barms (?:crossed|folded)\b|\bcrossed arms\b"):
        yield "crossed arms", lambda p, fps: _lasts(_hands_to_elbows(p) < _CROSSED, 0.3 * len(p) / fps, fps)
    if phrase.has(
        r"\bhands? (?:to|on|over|against) (?:the|his|her|their|its|your|my) (?:forehead|head|face|eyes|ears?|brow)\b"
    ):
        yield "a hand at the head", lambda p, fps: _lasts(_hand_to_head(p) < 0.3, 0.3, fps)
    if phrase.has(r"\bhands? on (?:the |his |her |their |its |your |my )?(?:hips|waist)\b"):
        yield "hands on the hips", lambda p, fps: _lasts(_near(p, "hip"), 0.5, fps)
    if phrase.has(_WORDS["throws"]):
        yield "a throw", lambda p, fps: _throws(_wrist_speed(p, fps).max(axis=0), hands)
    if phrase.has(r"(?<!\ba )(?<!\bthe )(?<!\bhis )(?<!\bher )\b(?:drink|sip|takes? a bite|eat)"):
        yield "a hand at the mouth", lambda p, fps: _lasts(_hand_to_head(p) < 0.3, 0.3, fps)
    if phrase.has(
        r"\b(?:put|set|lay|place)\w* (?!up)(?:\w+ ){1,4}down\b", r"\b(?:floor|ground|box|crate|suitcase|bucket)\b"
    ):
        yield "a hand near the floor", lambda p, fps: float(_hands_over_floor(p).min()) < _DOWN
    if phrase.has(
        r"\b(?:pick|grab|touch)",
        r"\b(?:floor|ground|bends?|bending|stoops?|(?:the|his|her|their|its|your|my) (?:toes|feet))\b",
    ):
        yield "a hand at the floor", lambda p, fps: float(_hands_over_floor(p).min()) < _DOWN


def _whole_body(phrase: _Phrase) -> Iterator[_Named]:
    if phrase.has(_WORDS["tumbles"]):
        yield "the head below the hips", lambda p, fps: float((p[:, J["head"], 1] - p[:, 0, 1]).min()) < -0.1
    if phrase.has(r"\bsway|\brock(?:s|ing)? (?:gently|slowly|from|left|to|side)"):
        yield "swings from side to side", lambda p, fps: oscillations(in_body(p)[:, J["neck"], 0] - _feet(p), 0.06) >= 3
    if phrase.has(r"\bbend(?:s|ing)? (?:down|over|forwards?|at)\b|\bhands on (?:\w+ )?knees\b"):
        yield "a bend", lambda p, fps: _lasts(torso_inclination(p) > _BENDS, 0.2, fps)
    if bent := re.search(_WORDS["side_bend"], phrase.text):
        sign = 1 if bent[1] == "left" else -1
        yield f"a lean to the {bent[1]}", lambda p, fps: _lasts(sign * _sideways(p) > _LEANS, 0.3, fps)
    if phrase.has(r"\bcrawl|\ball fours\b"):
        yield "hands and knees on the floor", lambda p, fps: float(np.median(_hands_over_floor(p))) < _DOWN
    if (rolls := re.search(r"\brolls? (forward|backward)|\b(forward|backward) rolls?\b", phrase.text)) is not None:
        way = rolls[1] or rolls[2]
        yield f"a roll {way}", lambda p, fps: pitch(p) * (1 if way == "forward" else -1) > np.pi
    if (aside := re.search(rf"\brolls? (?:over )?(?:on {_DET} \w+ )?to {_DET} (left|right)", phrase.text)) is not None:
        sign = 1 if aside[1] == "left" else -1
        yield f"a roll to the {aside[1]}", lambda p, fps: sign * log_roll(p) > np.pi / 2
    if phrase.has(_WORDS["falls"]):
        leaps = phrase.has(r"\b(?:jump|leap|flip|div|somersault)")
        for name, (words, to) in FALL_WAYS.items():
            if words.search(phrase.text):
                yield f"a fall {name.replace('_', ' ')}", lambda p, fps, to=to: _falls_to(p, fps, to)  # type: ignore[misc]
        yield "a fall", lambda p, fps: _lasts(_over_floor(p) < _DOWN, 0.25, fps) and (leaps or _falls_as_people(p, fps))


def _lasts(mask: np.ndarray, seconds: float, fps: float) -> bool:
    return longest(mask) >= seconds * fps


def _over(p: Array, joint: str) -> np.ndarray:
    return hands_height(p, over=joint) > 0


def _upright(p: Array) -> np.ndarray:
    return torso_inclination(p) < _UPRIGHT


def _sideways(p: Array) -> Array:
    """(frames,) radians by which the line from the pelvis to the neck is inclined to the body's left."""
    trunk = in_body(p)[:, J["neck"]] - in_body(p)[:, 0]
    return np.arctan2(trunk[:, 0], trunk[:, 1])


def _falls_as_people(p: Array, fps: float) -> bool:
    """Whether somebody who falls does not leap first, and does not hold the legs up who lies at the end."""
    begin, end = p[: max(1, round(fps / 4))], p[-max(1, round(fps / 2)) :]
    lies = float(end[:, 0, 1].mean()) < _DOWN * leg_length(p)
    leaps = float(p[:, 0, 1].max() - np.median(begin[:, 0, 1])) > _LEAPS
    return not leaps and not (lies and float(end[:, list(ANKLES), 1].max()) > _CHAIR)


def _falls_to(p: Array, fps: float, to: tuple[int, int]) -> bool:
    """Whether the trunk of somebody who goes down tips to that side (ahead, left) of where they were faced."""
    low = _over_floor(p) < 2 * _DOWN
    if not low.any():
        return False
    first = int(low.argmax())
    up = max(0, first - round(0.75 * fps))
    tips = (p[:, J["neck"]] - p[:, list(ANKLES)].mean(axis=1))[first : first + max(1, round(fps / 2)), :][:, [0, 2]]
    across = p[up, J["left_hip"], [0, 2]] - p[up, J["right_hip"], [0, 2]]
    left = across / max(float(np.linalg.norm(across)), 1e-9)
    front = np.array([-left[1], left[0]])
    turned_over = to[0] * faces_up(p, fps) > 0.1  # who falls backwards comes to lie on the back
    return not turned_over and float((tips @ (to[0] * front + to[1] * left)).mean()) > _TIPS


def _over_floor(p: Array) -> Array:
    """(frames,) leg lengths of the pelvis over the floor."""
    return (p[:, 0, 1] - floor_height(p)) / leg_length(p)


def _hands_over_floor(p: Array) -> Array:
    """(frames,) leg lengths of the lower wrist over the floor."""
    return (p[:, WRISTS, 1].min(axis=1) - floor_height(p)) / leg_length(p)


def _near(p: Array, joint: str) -> np.ndarray:
    """(frames,) whether both wrists are within a hand's length of the joint of their side."""
    ends = p[:, [J[f"left_{joint}"], J[f"right_{joint}"]]]
    return np.linalg.norm(p[:, WRISTS] - ends, axis=-1).max(axis=1) < 0.3


def _knees(p: Array) -> Array:
    """(frames, 2) leg lengths of the left and the right knee over the hips."""
    return (p[:, [J["left_knee"], J["right_knee"]], 1] - p[:, [J["left_hip"], J["right_hip"]], 1]) / leg_length(p)


def _arms_out(p: Array) -> np.ndarray:
    """(frames,) whether both hands are away from the body, to the sides or ahead."""
    hands = in_body(p)[:, list(WRISTS)]
    return np.hypot(hands[..., 0], hands[..., 2]).min(axis=1) > _SPREAD


def _between_hands(p: Array) -> Array:
    return np.linalg.norm(p[:, WRISTS[0]] - p[:, WRISTS[1]], axis=-1)


def _hands_to_elbows(p: Array) -> Array:
    """(frames,) metres from a wrist to the other arm's elbow, of the two the longer."""
    elbows = p[:, [J["right_elbow"], J["left_elbow"]]]
    return np.linalg.norm(p[:, list(WRISTS)] - elbows, axis=-1).max(axis=1)


def _hand_to_head(p: Array) -> Array:
    return np.linalg.norm(p[:, WRISTS] - p[:, J["head"], None], axis=-1).min(axis=1)


def _wrist_speed(p: Array, fps: float) -> Array:
    return np.linalg.norm(np.gradient(in_body(p)[:, list(WRISTS)], axis=0), axis=-1) * fps


def _throws(fastest: Array, hands: Sequence[int]) -> bool:
    """Whether one of the hands threw, by the fastest that each was: as fast as the other at least."""
    return float(fastest[list(hands)].max()) > max(2.4, float(fastest.max()) - 1e-9)


def _from_start(p: Array) -> Array:
    """(frames, 2) metres of the pelvis from where it began, along each axis of the floor."""
    return np.abs(p[:, 0, [0, 2]] - p[0, 0, [0, 2]])


def _feet(p: Array) -> Array:
    """(frames,) how far to the left of the pelvis the middle of the feet is."""
    return in_body(p)[:, list(ANKLES), 0].mean(axis=1)


def _pace(p: Array, fps: float) -> float:
    """m/s while somebody goes; 0 where nobody does."""
    paces = speed(p, fps)
    return float(np.median(paces[paces > 0.3])) if (paces > 0.3).any() else 0.0
