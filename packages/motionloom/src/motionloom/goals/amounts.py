"""Numbers with units in a sentence: how far, how many steps, how much of a turn, how long, how often (docs/words.md).

"turns left 90 degrees", "walks 3 meters forward", "takes three steps back", "walks in a half circle to the right",
"for ten seconds", "jumps twice". Not what could mean something else, "a man of 25 years", "throws a ball 10 meters".
"""

import math
import re
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from motionloom.core.motion import ground_pose
from motionloom.goals.goal import FPS, Goal
from motionloom.goals.heads import head_said
from motionloom.goals.numerals import NUMBER, in_digits
from motionloom.goals.paths import check_speed
from motionloom.goals.verbs import TABLES, asserted, base_of, kind_of_verb, word_patterns
from motionloom.kinematics.counts import Counted, Side, count, foot_moves

_WORDS = word_patterns("amounts")

Kind = Literal["turn", "way", "steps", "arc", "count"]
Direction = Literal["forward", "backward", "left", "right"]

MOST_DEGREES = 720.0
MOST_STEPS = 40
MOST_METRES = 200.0
MOST_SECONDS = 60.0


@dataclass(frozen=True)
class Amount:
    """What the words of one action say in numbers."""

    kind: Kind
    size: float
    """Degrees of a turn or an arc, metres of a way, number of steps or repetitions."""
    direction: Direction
    """Where somebody goes; of turns and arcs the side, left or right; of repetitions the limb's, forward for either."""
    stride: float = 0.0
    """Metres of one step."""
    speed: float = 0.0
    """Metres per second."""
    backward: bool = False
    """Whether an arc is walked backwards."""
    of: Counted | None = None
    """What is repeated."""
    in_place: bool = False
    """Whether repetitions stay in one place: jumps that go nowhere in the words, and which the weights take along."""
    metre: float = 1.0
    """Metres of ``size`` that one of the 22-joint person's becomes."""

    @property
    def unit(self) -> str:
        """Unit of the requested and of the measured size: degrees, m, steps, or what is repeated."""
        if self.kind == "count":
            return str(self.of)
        return {"way": "m", "steps": "steps"}.get(self.kind, "degrees")

    def __str__(self) -> str:
        if self.kind == "count":
            return f"{self.size:g} {self.of if self.size > 1 else _SINGLE[self.of or '']}"
        if self.kind == "turn":
            return f"a turn of {self.size:g} degrees to the {self.direction}"
        if self.kind == "arc":
            how = "backwards " if self.backward else ""
            return f"an arc of {self.size:g} degrees {how}to the {self.direction}"
        way = {"left": "to the left", "right": "to the right"}.get(self.direction, self.direction)
        if self.kind == "steps":
            return f"{self.size:g} step{'s' if self.size > 1 else ''} {way}"
        return f"{self.size:g} m {way}"

    @property
    def side(self) -> Side:
        """The limb's side of repetitions, the side of steps that go to one; empty for none."""
        return self.direction if self.direction in ("left", "right") else ""

    @property
    def metres(self) -> float:
        """The length of the way of the 22-joint person; 0 for a turn."""
        if self.kind == "steps":
            return self.size * self.stride
        if self.kind == "arc":
            return RADIUS * math.radians(self.size)
        return self.size / self.metre if self.kind == "way" else 0.0


RADIUS = 1.0
"""Metres: of a half circle that is walked where its size is not said."""
_UNITS = {"m": 1.0, "meter": 1.0, "metre": 1.0, "cm": 0.01, "centimeter": 0.01, "centimetre": 0.01, "yard": 0.9144}
_UNITS |= {"foot": 0.3048, "feet": 0.3048, "ft": 0.3048}
_SPEEDS = {"km/h": 1 / 3.6, "kmh": 1 / 3.6, "kph": 1 / 3.6, "mph": 0.447}
FASTEST = 8.0
"""m/s that words may say; beyond it the number is left."""
_COUNTED: tuple[tuple[str, Counted], ...] = tuple((row[0], what) for what, row in TABLES["counted"].items())
MOST_TIMES = 12
_SINGLE = {of: of.removesuffix("es" if of == "punches" else "s") for of in get_args(Counted)}
_TURNS = {"turn", "rotate", "spin", "pivot", "twirl"}
_PACES: dict[str, float] = TABLES["paces"]
_RUNS = {"run", "jog", "sprint", "race"}
"""Who does so leans far into a circle of `RADIUS`, which is run only where a side is said."""
_WALKING = 1.1
_GOING = {"walk", "stroll", "step", "go", "move", "pace", "stride", "wander", "back", *_PACES}
_STEPPING = {"take", "make", "walk", "go", "move", "step", "march", "run", "sidestep", "stroll", "back"}


def read_amount(text: str, *, around: bool = False) -> Amount | None:
    """The turn, way, steps, arc or repetitions that the words of one action ask for in numbers; None without.

    text: one action (`motionloom.goals.sequence.split_actions`). around: whether to turn around is a turn of 180
    degrees, as between other actions, where the weights alone turn too little.
    """
    phrase = in_digits(asserted(text))
    verbs = [base for word in re.findall(r"[a-z]+", phrase) if word != "left" and (base := base_of(word))]
    if _WORDS["ages"].search(phrase):
        phrase = _WORDS["ages"].sub(" ", phrase)
    if repetitions := _repetitions(phrase):
        return repetitions
    if not verbs or {kind_of_verb(verb, phrase) for verb in verbs} & {"jump", "fight", "dance"}:
        return None
    phrase = _WORDS["steps_often"].sub(r"\1 \3 steps\2", phrase)
    return _turn(phrase, verbs, around) or _arc(phrase, verbs) or _steps(phrase, verbs) or _distance(phrase, verbs)


def read_seconds(text: str) -> float | None:
    """The seconds that "for ten seconds", "for half a minute" ask for; None without, and beyond a minute."""
    matches = list(_WORDS["seconds"].finditer(in_digits(text)))
    if len(matches) != 1:
        return None
    seconds = float(matches[0][1]) * (60.0 if matches[0][2].startswith("min") else 1.0)
    return seconds if 0.2 <= seconds <= MOST_SECONDS else None


def unread_numbers(text: str, amount: Amount | None, seconds: float | None) -> list[str]:
    """The quantities in the words of one action that are not kept: "3 km", "15 times".

    amount, seconds: what was read of it (`read_amount`, `read_seconds`); None for nothing.
    """
    kind, phrase = (amount.kind if amount else ""), in_digits(text)
    often = kind in ("count", "steps") or (kind == "turn" and not _WORDS["degrees"].search(phrase))
    kept = {
        "length": kind == "way",
        "angle": kind in ("turn", "arc"),
        "steps": kind == "steps",
        "time": seconds is not None,
        "speed": kind in ("way", "arc") and exact_speed(phrase) is not None,
        "other": False,
        "": often or head_said(text) is not None,
    }
    return [one[0] for one in _WORDS["quantity"].finditer(phrase) if not kept[one.lastgroup or ""]]


def exact_speed(phrase: str) -> float | None:
    """The metres per second that a phrase says in numbers, up to `FASTEST`; None without."""
    match = _WORDS["speed"].search(phrase)
    speed = float(match[1]) * _SPEEDS.get(match[2], 1.0) if match else 0.0
    return speed if 0.1 <= speed <= FASTEST else None


def single_stroke(text: str) -> str:
    """The words of one stroke of what is counted: "a person jumps" of "a person jumps three times"."""
    phrase = in_digits(text, lower=False)
    less = _WORDS["often"].sub("", phrase)
    if less == phrase:
        less = re.sub(rf"\b{NUMBER} (?=(?:[a-z]+ )?[a-z]+)", "", phrase, count=1)
    return " ".join(less.split()).strip(" ,")


def countable_actions(phrase: str) -> set[Counted]:
    """Kinds of countable actions in a phrase of lower-case letters."""
    kinds: set[Counted] = {what for words, what in _COUNTED if re.search(rf"\b(?:{words})\b", phrase)}
    return kinds - {"jumps"} if "jumping jacks" in kinds else kinds


def _repetitions(phrase: str) -> Amount | None:
    """Repetitions of one action whose strokes can be counted."""
    often, many = (
        _WORDS["often"].findall(_WORDS["often_of_limbs"].sub(" ", phrase)),
        list(_WORDS["many"].finditer(phrase)),
    )
    if len(often) + len(many) != 1 or _WORDS["counts_another"].search(phrase):
        return None
    kinds = countable_actions(phrase)
    if len(kinds) != 1:
        return None
    size = float(many[0][1]) if many else _repeat_count(*often[0])
    if not 1 <= size <= MOST_TIMES or size != int(size):
        return None
    of = kinds.pop()
    in_place = of in ("jumps", "hops") and not _WORDS["travels"].search(_WORDS["on_one_leg"].sub("", phrase))
    return Amount("count", size, _side(phrase) or "forward", of=of, in_place=in_place)


def _repeat_count(word: str, number: str) -> float:
    return {"once": 1.0, "twice": 2.0, "thrice": 3.0}.get(word) or float(number)


def _turn(phrase: str, verbs: list[str], around: bool) -> Amount | None:
    if (
        not _TURNS & set(verbs)
        or _WORDS["body"].search(_WORDS["held"].sub("", phrase))
        or set(verbs) & {"throw", "look"}
    ):
        return None
    matches, part = list(_WORDS["degrees"].finditer(phrase)), _WORDS["part_of_turn"].search(phrase)
    often = _WORDS["turns_often"].search(phrase) or _WORDS["often"].search(_WORDS["often_of_limbs"].sub(" ", phrase))
    sizes = len(matches) + bool(part) + bool(often)
    aside = around and not sizes and _WORDS["turns_aside"].search(phrase)
    if sizes > 1 or not (sizes or aside or (around and _WORDS["turns_round"].search(phrase))):
        return None
    if not sizes:
        degrees = 90.0 if aside else 180.0
    elif often:
        degrees = 360.0 * (float(often[1]) if often.re is _WORDS["turns_often"] else _repeat_count(often[1], often[2]))
    else:
        parts = {"half": 180.0, "0.5": 180.0, "quarter": 90.0, "full": 360.0}
        degrees = float(matches[0][1]) if matches else parts.get(part[1], 270.0)  # type: ignore[index]
    side = _side(phrase)
    if not side and degrees % 180 == 0 and not re.search(r"\b(?:left|right)\b", phrase):
        side = "left"
    if not side or not 5 <= degrees <= MOST_DEGREES or set(verbs) & (_GOING - {"step", "back"}):
        return None
    return Amount("turn", degrees, side)


def _arc(phrase: str, verbs: list[str]) -> Amount | None:
    match, side = _WORDS["arc"].search(phrase) or _WORDS["circle"].search(phrase), _side(phrase)
    if match and match.re is _WORDS["circle"] and not (set(verbs) & _RUNS or re.search(r"\b(?:left|right)\b", phrase)):
        side = side or "left"
    if not match or not side or not set(verbs) & _GOING or _WORDS["body"].search(_WORDS["held"].sub("", phrase)):
        return None
    backward = _is_backward(phrase)
    size = match[1] if match.re is _WORDS["arc"] else "full"
    degrees = 90.0 if size == "quarter" else 180.0 if size in ("half", "semi", "0.5") else 360.0
    return Amount("arc", degrees, side, speed=_pace(phrase, verbs), backward=backward)


def _steps(phrase: str, verbs: list[str]) -> Amount | None:
    matches = list(_WORDS["steps"].finditer(phrase))
    if len(matches) != 1 or not set(verbs) & _STEPPING or _WORDS["else"].search(phrase):
        return None
    size, direction = matches[0][2] or "", _direction(phrase, aside=True)
    count = float(matches[0][1]) if matches[0][1] else 1.0
    if direction is None or not 1 <= count <= MOST_STEPS or count != int(count):
        return None
    stride = {"forward": 0.62, "backward": 0.4}.get(direction, 0.4)
    if size in ("small", "tiny", "short", "baby", "little"):
        stride *= 0.6
    elif size in ("big", "large", "long", "giant", "huge"):
        stride *= 1.3
    seconds = 0.5 if direction != "forward" or _is_slow(phrase) else 0.4 if "run" in verbs else 0.45
    return Amount("steps", count, direction, stride=stride, speed=stride / seconds)


def _distance(phrase: str, verbs: list[str]) -> Amount | None:
    matches, direction = (
        list(_WORDS["way"].finditer(phrase)),
        _direction(phrase, aside=bool({"move", "step"} & set(verbs))),
    )
    going = [verb for verb in verbs if verb in _GOING]
    if len(matches) != 1 or direction is None or not going or _WORDS["else"].search(phrase):
        return None
    if set(verbs) - set(going) - {"stop", "halt", "track", "return", "keep", "continue"} - {"open", "place"}:
        return None
    unit = matches[0][2]
    metres = float(matches[0][1]) * _UNITS[unit if unit in _UNITS else unit.removesuffix("s")]
    if not 0.2 <= metres <= MOST_METRES:
        return None
    return Amount("way", round(metres, 3), direction, speed=_pace(phrase, verbs))


def _pace(phrase: str, verbs: list[str]) -> float:
    pace = next((_PACES[verb] for verb in verbs if verb in _PACES), _WALKING)
    if _is_backward(phrase):
        pace *= 0.65
    elif _direction(phrase, aside=False) in ("left", "right"):
        pace = min(pace, 0.7)
    if (exact := exact_speed(phrase)) is not None:
        return exact
    if _is_slow(phrase):
        return 0.65 * pace
    return 1.35 * pace if re.search(r"\b(?:quickly|quick|fast|briskly|rapidly|hastily)\b", phrase) else pace


def _is_slow(phrase: str) -> bool:
    return bool(re.search(r"\b(?:slowly|slow|carefully|careful|cautiously|gently)\b", phrase))


def _is_backward(phrase: str) -> bool:
    return bool(
        re.search(r"\b(?:backwards?|(?<!his )(?<!her )(?<!its )(?<!their )back|in reverse|rearwards?)\b", phrase)
    )


def _side(phrase: str) -> Side:
    """The one side that a phrase names, seen from above for clockwise; empty for none and for both."""
    if re.search(r"\b(?:counter|anti)[ -]?clockwise\b", phrase):
        return "left"
    if re.search(r"\bclockwise\b", phrase):
        return "right"
    sides: set[Side] = set(
        re.findall(r"\b(left|right)(?!(?:[ -]handed| after| before| away| in front))(?:wards?)?\b", phrase)
    )
    return sides.pop() if len(sides) == 1 else ""


def _direction(phrase: str, *, aside: bool) -> Direction | None:
    """Where a way leads; None where that is not clear. ``aside``: a side alone is enough for a step to it."""
    back, side = _is_backward(phrase), _side(phrase)
    named = bool(re.search(r"\b(?:left|right)\b", phrase))
    sideways = bool(re.search(r"\b(?:sideways?|side[ -]?steps?|sidestepping|side steps?|laterally)\b", phrase))
    if sideways or (aside and named):
        return None if back else side or None
    if named or (back and re.search(r"\bforwards?\b", phrase)):
        return None
    return "backward" if back else "forward"


# A number as a goal: how long it takes, where the pelvis goes, where the person faces. Metres in the ground pose at the
# beginning: +Z forward, +X left; radians about +Y; 20 frames per second.

BEFORE, AFTER = 0.3, 0.6
"""Seconds of standing around a way or a turn."""
RAMP = 0.4
"""Seconds of setting out, and of stopping."""
TURNING = 75.0
"""Degrees per second of somebody who turns on the spot."""
SLOWEST = 0.5
"""Share of the pace of the words that a way may be slowed to for a longer time; beyond it the person stands still."""
TURN_OFF, WAY_OFF = 10.0, 0.1
"""Degrees (10 of a full turn), and share of a way, by which a motion may miss what was read."""
STROKES: dict[Counted, float] = {what: row[1] for what, row in TABLES["counted"].items()}
"""Seconds of one stroke; how often they come is measured, and tried again (`motionloom.tasks.worded`)."""
CHAINED = 1.4
"""Seconds from which on a stroke is a segment of its own; quicker ones follow each other in one."""


def seconds_for(amount: Amount) -> float:
    """How long it takes at the pace of the words, standing before and after."""
    if amount.kind == "count":
        assert amount.of is not None
        return amount.size * STROKES[amount.of] + (0.5 if STROKES[amount.of] < CHAINED else 0.0)
    moving = amount.size / TURNING if amount.kind == "turn" else amount.metres / amount.speed
    return round((BEFORE + moving + RAMP + AFTER) * FPS) / FPS


def goal_for(amount: Amount, seconds: float) -> Goal:
    """The goal for one action of ``seconds``: a turn on the spot, or a way of the pelvis and where it is faced.

    A longer time slows the person down to `SLOWEST`, who stands still for the rest; a shorter time is a faster way.
    Raises `MotionloomError` where nobody runs as fast.
    """
    check_speed(np.array([[0.0, 0.0], [0.0, amount.metres]]), np.array([0.0, seconds]))
    frames = round(seconds * FPS)
    goal = Goal.nothing(frames)
    share = _shares(frames, seconds, seconds_for(amount))
    side = 1.0 if amount.direction == "left" else -1.0
    goal.facing_mask[:] = True
    if amount.kind == "turn":
        goal.facing[:] = side * np.radians(amount.size) * share
        return goal
    if amount.kind == "arc":
        angle = np.radians(amount.size) * share
        ahead = -1.0 if amount.backward else 1.0
        x, z = side * RADIUS * (1 - np.cos(angle)), ahead * RADIUS * np.sin(angle)
        goal.facing[:] = side * ahead * angle
    else:
        toward = {"forward": (0.0, 1.0), "backward": (0.0, -1.0), "left": (1.0, 0.0), "right": (-1.0, 0.0)}
        x, z = (amount.metres * share * part for part in toward[amount.direction])
    goal.positions[:, 0, 0], goal.positions[:, 0, 2] = x, z
    goal.mask[:, 0, [0, 2]] = True
    return goal


def goal_in_place(seconds: float) -> Goal:
    """The goal of staying where one is: the pelvis over one place of the floor."""
    goal = Goal.nothing(round(seconds * FPS))
    goal.mask[:, 0, [0, 2]] = True
    return goal


def _shares(frames: int, seconds: float, natural: float) -> np.ndarray:
    """(frames,) from 0 to 1: the share of a way behind one, setting out and stopping softly."""
    rest = min(1.0, seconds / natural)
    moving = natural - BEFORE - AFTER
    lasting = min(moving / SLOWEST, seconds - rest * (BEFORE + AFTER))
    ramp = min(RAMP, lasting / 2)
    at = (np.arange(frames) / FPS - rest * BEFORE).clip(0, lasting)
    fine = np.linspace(0, lasting, 512)
    speed = np.minimum(1, np.minimum(fine, lasting - fine) / ramp)
    way = np.concatenate([[0], np.cumsum((speed[1:] + speed[:-1]) / 2)])
    return np.interp(at, fine, way / way[-1])


def measured(amount: Amount, positions: np.ndarray, fps: float = FPS) -> float:
    """Degrees turned to the amount's side, metres travelled, steps, or repetitions.

    positions: (frames, 22, 3) metres in the world. Of an arc the turn is measured; of steps to a side those of the foot
    on that side, which the other follows.
    """
    if amount.kind == "count":
        assert amount.of is not None
        return count(amount.of, positions, fps, side=amount.side)
    if amount.kind == "steps":
        moves = foot_moves(positions, fps)
        return moves[("left", "right").index(amount.direction)] if amount.side else sum(moves)
    if amount.kind in ("turn", "arc"):
        facing = np.unwrap([ground_pose(frame).facing for frame in positions])
        against = amount.kind == "arc" and amount.backward
        side = 1.0 if (amount.direction == "left") != against else -1.0
        return float(side * np.degrees(facing[-1] - facing[0]))
    moved = positions[-1, 0] - positions[0, 0]
    return amount.metre * float(np.hypot(moved[0], moved[2]))


def is_met(amount: Amount, size: float) -> bool:
    """Whether the `measured` size is the amount's own, within the tolerance."""
    if amount.kind in ("turn", "arc"):
        return abs(size - amount.size) <= max(TURN_OFF, amount.size / 36)
    return size == amount.size if amount.kind != "way" else abs(size / amount.size - 1) <= WAY_OFF
