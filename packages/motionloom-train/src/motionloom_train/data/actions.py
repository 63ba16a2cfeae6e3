"""Everyday actions by name: which captions name them, how else people say it, which part of a recording shows them.

Training samples actions evenly instead of captions (`data.sets`), so that rare ones are seen as often as walks.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from motionloom.core.reading import read_table
from motionloom.kinematics import physics as ph
from motionloom.kinematics.gestures import wrist_thrust
from motionloom.kinematics.physics import Array
from motionloom_train.data.words import sentence

Kind = Literal["cycle", "repeats", "change", "once", "state"]
PREFIX = "action:"
"""What the kind of a note begins with that names an action."""
SENTENCES = 20
"""Sentences generated for an action besides the captions themselves."""


@dataclass(frozen=True)
class Action:
    """One entry of ``actions.toml``, which explains each part."""

    name: str
    words: tuple[str, ...]
    says: tuple[str, ...]
    kind: Kind
    unless: str = r"(?!)"
    sided: tuple[str, ...] = ()
    reverse: str = ""
    clips: str = r"(?!)"
    limb: Literal["", "hand", "foot"] = ""
    turns: bool = False
    phase: bool = False
    is_a: str = ""

    def named_by(self, texts: Sequence[str]) -> bool:
        """True where at least half of the captions name this action."""
        lowered = [text.lower() for text in texts]
        hits = sum(any(_in_order(p, t) for p in self.words) and not re.search(self.unless, t) for t in lowered)
        return 2 * hits >= len(lowered) > 0


def _in_order(pattern: str, text: str) -> bool:
    """As `re.search`, in time linear in the text: what `.*` joins is searched one after the other.

    The first place of each part is as good as any other, since what comes behind it may lie anywhere. `re` itself tries
    all places of all parts, which a long text without the last part makes very many.
    """
    at = 0
    for part in pattern.split(".*"):
        match = re.compile(part).search(text, at)
        if match is None:
            return False
        at = match.end()
    return True


def _read() -> dict[str, Action]:
    table = read_table("motionloom_train.data", "actions.toml")
    actions = {}
    for name, entry in table.items():
        words = entry.pop("words")
        entry["words"] = (words,) if isinstance(words, str) else tuple(words)
        phrases = {key: tuple(entry.pop(key, ())) for key in ("says", "sided")}
        actions[name] = Action(name, **phrases, **entry)
    return actions


ACTIONS: dict[str, Action] = _read()


def action_of(texts: Sequence[str], clip: str = "") -> Action | None:
    """The action that the name of the recording names, else the first that at least half of the captions name."""
    by_clip = next((action for action in ACTIONS.values() if clip and re.search(action.clips, clip)), None)
    return by_clip or next((action for action in ACTIONS.values() if action.named_by(texts)), None)


def side_of(texts: Sequence[str]) -> str:
    """``left`` or ``right`` where all captions that name a side name the same one, else empty."""
    sides = {side for text in texts for side in re.findall(r"\b(left|right)\b", text.lower())}
    return sides.pop() if len(sides) == 1 else ""


def sentences(action: Action, texts: Sequence[str] = (), *, side: str = "", count: int = SENTENCES) -> tuple[str, ...]:
    """Other ways of saying an action, as whole sentences; with a ``side``, or the one that ``texts`` name."""
    side = side or side_of(texts)
    plain = () if action.turns and side == "right" else action.says
    phrases = [*plain, *(phrase.format(side=side) for phrase in action.sided if side)]
    if not phrases:
        return ()
    rng = np.random.default_rng(int.from_bytes(action.name.encode()[:8].ljust(8), "little"))
    wordings = (sentence(phrases[i % len(phrases)], rng) for i in range(max(count, 2 * len(phrases))))
    return tuple(dict.fromkeys(wordings))


def core(positions: Array, fps: float, *, tail: float = 0.12) -> tuple[int, int]:
    """Frames (first, end) within which a body changes: the middle part of the total variation of slow measures.

    ``positions`` (frames, 22, 3) metres. The measures are pelvis height, pace, heading, tilt of the trunk and heights
    of the wrists, each in units of what people notice and averaged over half a second, so that steps do not count.
    ``tail``: share of the variation left out at either end.
    """
    p = ph.smooth(positions, 3)
    spine = p[:, 12] - p[:, 0]
    measures = np.stack(
        [
            p[:, 0, 1] / 0.2,
            ph.speed(p, fps) / 0.7,
            ph.heading(p) / 1.2,
            np.linalg.norm(spine[:, [0, 2]], axis=-1) / 0.25,
            p[:, 20, 1] / 0.4,
            p[:, 21, 1] / 0.4,
        ],
        axis=-1,
    )
    change = np.abs(np.diff(ph.smooth(measures, ph.odd(fps / 2)), axis=0)).sum(-1)
    total = np.cumsum(change)
    if total[-1] < 0.5:
        return 0, len(p)
    first, last = np.searchsorted(total, [tail * total[-1], (1 - tail) * total[-1]])
    margin = round(0.3 * fps)
    return max(0, int(first) - margin), min(len(p), int(last) + margin + 1)


def turned_to(positions: Array) -> str:
    """``left`` or ``right``: the side to which (frames, 22, 3) turns between its two ends."""
    heading = ph.heading(positions)
    return "left" if heading[-1] > heading[0] else "right"


_LIMBS = {"hand": (20, 21), "foot": (7, 8)}


def strike(positions: Array, fps: float, limb: str, *, side: str = "") -> tuple[tuple[int, int], str]:
    """Frames (first, end) about the moment at which a hand (``foot``: ankle) is fastest against the body; its side.

    ``positions`` (frames, 22, 3) metres. ``side``: the one that punches: the moment is that at which its fist shoots
    forward. The side is empty where the other one is more than 0.6 times as fast.
    """
    speeds = np.linalg.norm(ph.velocity(ph.in_body(ph.smooth(positions, 3))[:, _LIMBS[limb]], fps), axis=-1)
    if side:
        thrusts = wrist_thrust(positions, fps)[:, ["left", "right"].index(side)]
        if thrusts.max() > 0:
            at = int(thrusts.argmax())
            return (max(0, at - round(0.5 * fps)), min(len(positions), at + round(0.3 * fps) + 1)), side
    peaks = speeds.max(axis=0)
    one = int(peaks.argmax())
    at = int(speeds[:, one].argmax())
    around = max(0, at - round(0.5 * fps)), min(len(positions), at + round(0.3 * fps) + 1)
    return around, ("left", "right")[one] if peaks[1 - one] < 0.6 * peaks[one] else ""


BRISK = {"hand": 6.0, "foot": 8.0}
"""Metres per second of a hand or foot against the body in a brisk strike."""


def briskness(positions: Array, fps: float, limb: str) -> float:
    """The share of `BRISK` that a hand (``foot``: ankle) reaches; at most 1. ``positions`` (frames, 22, 3) metres."""
    against = ph.in_body(positions)[:, _LIMBS[limb]]
    fastest = np.linalg.norm(ph.velocity(against, fps), axis=-1).max()
    return min(float(fastest) / BRISK[limb], 1.0)


def rests(positions: Array, fps: float) -> list[int]:
    """Frames at which somebody who repeats an exercise is about to begin: pelvis high, hands and feet low.

    ``positions`` (frames, 22, 3) metres. Local maxima over 0.8 s each way, within a quarter of the range from the top.
    """
    p = ph.smooth(positions, 3)
    score = p[:, 0, 1] - 0.5 * p[:, [20, 21], 1].max(axis=1) - 0.5 * p[:, [7, 8], 1].max(axis=1)
    enough, reach = score.max() - 0.25 * np.ptp(score), round(0.8 * fps)
    return [
        i
        for i, value in enumerate(score)
        if value >= enough and value == score[max(0, i - reach) : i + reach + 1].max()
    ]
