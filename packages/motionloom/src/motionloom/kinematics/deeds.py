"""What somebody did, in numbers and in one sentence: the way, the turn, how often what, how high, where it ends.

Read off the joints alone, whatever the words were; `motionloom info`, the server and assistants tell it of any motion.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.kinematics.counts import count, foot_moves
from motionloom.kinematics.gestures import (
    airborne,
    pelvis_height,
    seats,
    single_foot_hops,
    stance_rise,
    torso_inclination,
    wrist_swings,
)
from motionloom.kinematics.physics import FEET, TOES, WRISTS, Array, displacement, floor_height, speed, travel
from motionloom.kinematics.physics import turn as turned_by
from motionloom.retarget import joints22

RATE = 20.0
"""Frames per second that are looked at, as the counts were made for."""
LONGEST = 1200.0
"""Seconds; what is longer is not described."""
RUNS, GOES, TURNS = 2.2, 0.6, 15.0
"""m/s from which on somebody runs, metres that count as a way, degrees that count as a turn."""
LOW, LYING = 0.75, np.radians(55)
"""Leg lengths of the pelvis over the feet, and the lean of the trunk, of somebody who is down, who lies."""
_VERBS = {
    "jumps": "jumps",
    "hops": "hops on one leg",
    "squats": "squats",
    "kicks": "kicks",
    "punches": "punches",
    "bows": "bows",
    "claps": "claps",
    "jumping jacks": "does jumping jacks",
    "left hand waves": "waves the left hand",
    "right hand waves": "waves the right hand",
}


@dataclass(frozen=True)
class Deeds:
    """What one person did; metres, degrees, seconds."""

    seconds: float
    way: float
    """Length of the pelvis' way along the floor."""
    forward: float
    left: float
    up: float
    """From the first to the last place, in the directions of the person at the start."""
    turn: float
    """Degrees, positive to the left."""
    pace: float
    """m/s while somebody goes; 0 where nobody does."""
    steps: tuple[int, int]
    """How often the left and the right foot was put down elsewhere."""
    counts: Mapping[str, int]
    """How often what was done, by its name; what was not done is left out."""
    pelvis: tuple[float, float]
    """Lowest and highest place of the pelvis over the floor."""
    highest_hand: float
    highest_foot: float
    """Over the floor, where the feet stand."""
    contacts: Mapping[str, float]
    """Share of the time that the ``left``, the ``right`` and ``neither`` foot is on the floor."""
    ends: str
    """``standing``, ``sitting``, ``lying`` or ``down`` (kneeling, crouching, on all fours)."""

    @property
    def sentence(self) -> str:
        """All that is worth a word: "walks 4.2 m forward, turns 88 degrees to the left, 7 steps"."""
        parts = [self._way()] if self._goes else []
        if abs(self.turn) >= TURNS:
            parts.append(f"turns {abs(self.turn):.0f} degrees to the {'left' if self.turn > 0 else 'right'}")
        parts += [f"{_VERBS[what]} {_often(number)}" for what, number in self.counts.items()]
        if abs(self.up) >= 0.3 and self.ends == "standing":
            parts.append(f"ends {abs(self.up):.1f} m {'higher' if self.up > 0 else 'lower'}")
        if sum(self.steps) and not self._leaps:
            parts.append(f"{sum(self.steps)} step{'s' if sum(self.steps) > 1 else ''}")
        stays = [] if parts else ["stays in place"]
        return ", ".join(stays + parts + ([] if self.ends == "standing" else [f"ends {self.ends}"]))

    def public(self) -> dict[str, Any]:
        """The same as plain values for JSON, the sentence among them."""
        return {"sentence": self.sentence, **_rounded(asdict(self))}

    @property
    def _net(self) -> float:
        return float(np.hypot(self.forward, self.left))

    @property
    def _goes(self) -> bool:
        return self._net >= GOES or self.way >= (2 if sum(self.steps) > 1 else 4) * GOES

    @property
    def _leaps(self) -> bool:
        """Whether the feet are put down elsewhere by what is counted already."""
        leaps = sum(self.counts.get(what, 0) for what in ("jumps", "hops", "jumping jacks"))
        return leaps > 0 and sum(self.steps) <= 4 * leaps and self.way <= 1.5 * leaps

    def _way(self) -> str:
        walks = sum(self.steps) > 1 and not self._leaps
        does = "runs" if walks and self.pace >= RUNS else "walks" if walks else "moves"
        if self._net >= 0.8 * self.way:
            return f"{does} {self._net:.1f} m {_direction(self.forward, self.left, 'forward', 'backward')}"
        if self._net < GOES:
            return f"{does} {self.way:.1f} m and ends where it began"
        where = _direction(self.forward, self.left, "ahead", "behind")
        return f"{does} {self.way:.1f} m, to a place {self._net:.1f} m {where}"


def happened(people: Iterable[Motion]) -> list[dict[str, Any] | None]:
    """What each of some people did, as plain values for JSON; None as of `measure_deeds`."""
    return [did and did.public() for did in map(measure_deeds, people)]


def measure_deeds(motion: Motion) -> Deeds | None:
    """What the person of a motion did.

    motion: of any humanoid skeleton, at any rate. None where the 22 joints are not found on its skeleton, for less than
    a quarter of a second, and for more than `LONGEST`.
    """
    if not 0.25 <= motion.seconds <= LONGEST:
        return None
    try:
        return deeds_at(_at_rate(joints22(motion), motion.fps))
    except MotionloomError:
        return None


def deeds_at(positions: np.ndarray) -> Deeds:
    """What a person did whose joints were at ``positions`` (frames, 22, 3), metres, +Y up, `RATE` times a second."""
    p = np.asarray(positions, dtype=np.float64)
    floor, net, paces = floor_height(p), displacement(p, RATE), speed(p, RATE)
    going = paces[paces > 0.3]
    down = p[:, TOES, 1] - floor < 0.05
    shares = {"left": down[:, 0].mean(), "right": down[:, 1].mean(), "neither": 1 - down.any(axis=1).mean()}
    ends, left_and_right = _end(p), foot_moves(p, RATE)
    return Deeds(
        seconds=len(p) / RATE,
        way=travel(p, RATE),
        forward=net.forward,
        left=net.left,
        up=net.up,
        turn=float(np.degrees(turned_by(p))),
        pace=float(np.median(going)) if len(going) else 0.0,
        steps=left_and_right,
        counts=_counts(p, paces, ends),
        pelvis=(float(p[:, 0, 1].min() - floor), float(p[:, 0, 1].max() - floor)),
        highest_hand=float(p[:, WRISTS, 1].max() - floor),
        highest_foot=float((p[:, FEET, 1].max()) - floor),
        contacts={name: float(share) for name, share in shares.items()},
        ends=ends,
    )


def _at_rate(places: Array, fps: float) -> Array:
    """Places (frames, 22, 3) at `RATE`, on straight lines between frames."""
    if fps == RATE:
        return places
    at = np.arange(max(round(len(places) * RATE / fps), 2)) * (fps / RATE)
    low = np.minimum(at.astype(int), len(places) - 1)
    high = np.minimum(low + 1, len(places) - 1)
    share = np.clip(at - low, 0, 1)[:, None, None]
    return places[low] + share * (places[high] - places[low])


def _end(p: Array) -> str:
    last = slice(-max(1, round(RATE / 4)), None)
    low = float(np.median(pelvis_height(p)[last])) < LOW
    if low and float(np.median(torso_inclination(p)[last])) > LYING:
        return "lying" if np.median(p[last, 0, 1] - p[last, :, 1].min(axis=1)) < 0.25 else "down"
    if any(seat.end >= (len(p) - 3) / RATE for seat in seats(p, RATE)):
        return "sitting"
    return "down" if low else "standing"


def _counts(p: Array, paces: Array, ends: str) -> dict[str, int]:
    """What is done, as `counts` counts it, without what else looks the same: a runner's flights, a seat taken."""
    level, low = abs(p[-1, 0, 1] - p[0, 0, 1]) < 0.3 or ends != "standing", pelvis_height(p)
    found: dict[str, int] = {}
    jacks, jumps, hops = count("jumping jacks", p, RATE), _jumps(p, paces), sum(single_foot_hops(p))
    if jacks > 2 and jumps > 2 and paces.mean() < 0.5:
        found["jumping jacks"] = jacks
    elif hops > 1:
        found["hops"] = hops
    else:
        found["jumps"] = jumps
    if found.get("jumps") == 0 and level:
        found["squats"] = count("squats", p, RATE)
    if ends == "standing" and "jumping jacks" not in found:
        found["kicks"] = count("kicks", p, RATE)
    if not any(found.values()) and low.min() > LOW and level:
        found["bows"] = count("bows", p, RATE)
    if not any(found.values()) and ends in ("standing", "sitting") and paces.mean() < 0.4:
        found |= _of_hands(p)
    return {what: number for what, number in found.items() if number > 0}


def _of_hands(p: Array) -> dict[str, int]:
    """Claps, punches or waving of somebody who stays in place."""
    claps, punches = count("claps", p, RATE), count("punches", p, RATE)
    if claps > 2:
        return {"claps": claps}
    if punches:
        return {"punches": punches}
    swings = dict(zip(("left", "right"), wrist_swings(p, RATE), strict=True))
    return {f"{side} hand waves": number // 2 for side, number in swings.items() if number > 3}


def _jumps(p: Array, paces: Array) -> int:
    """Flights of somebody upright, no longer than a jump, higher than a runner's."""
    if stance_rise(p, RATE) > 0.2:  # on stairs both feet are above where they stood
        return 0
    upright = torso_inclination(p) < LYING
    flights = [one for one in airborne(p, clearance=0.04) if 0.15 * RATE <= one.stop - one.start <= 1.2 * RATE]
    return sum(
        bool(upright[one.start : one.stop].all())
        and one.rise > (0.12 if paces[one.start : one.stop].mean() > 1.8 else 0.05)
        for one in flights
    )


def _direction(forward: float, left: float, ahead: str, behind: str) -> str:
    """One of eight directions in words."""
    along = "" if abs(forward) < 0.41 * abs(left) else ahead if forward > 0 else behind
    aside = "" if abs(left) < 0.41 * abs(forward) else f"to the {'left' if left > 0 else 'right'}"
    return " and ".join(filter(None, (along, aside)))


def _often(number: int) -> str:
    return {1: "once", 2: "twice"}.get(number, f"{number} times")


def _rounded(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _rounded(one) for name, one in value.items()}
    if isinstance(value, tuple | list):
        return [_rounded(one) for one in value]
    return round(value, 3) if isinstance(value, float) else value
