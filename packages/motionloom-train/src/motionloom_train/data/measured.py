"""Descriptions of windows by what is measured in them: pace, counts, sides, degrees, and what does not happen.

A caption says "walks" of ten seconds; whether somebody walked slowly, took four steps or never turned is measured
window by window (``measured.toml``), so that adverbs, numbers and negations are read as what they mean.
"""

import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from motionloom.core.reading import read_table
from motionloom.kinematics import gestures
from motionloom.kinematics import physics as ph
from motionloom.kinematics.counts import count, foot_moves
from motionloom.kinematics.physics import Array
from motionloom_train.data.actions import ACTIONS, core, strike
from motionloom_train.data.clips import MEASURED, Note
from motionloom_train.data.windows import Measures, compare, comparisons, measure
from motionloom_train.data.words import PEOPLE, STATES, gerund, imperative, sentence

_FACT_SENTENCES, _NEGATED_SENTENCES = 8, 6
"""Sentences in the pool of a fact, and of one thing that does not happen; the number bounds what an encoder reads."""
_EACH = 3
"""Sentences that a window takes from the pool of each row that holds."""
_NUMERALS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
_STEADY = {"sidestep left", "sidestep right", "walk left turn", "walk right turn", "arms up"}
"""Labels besides `STATES` of windows any part of which shows them."""


@dataclass(frozen=True)
class Row:
    """A row of ``measured.toml``, which explains the parts."""

    of: frozenset[str]
    holds: str
    adds: tuple[str, ...] = ()
    says: tuple[str, ...] = ()
    what: tuple[str, ...] = ()
    number: str = ""
    near: float = 0.5
    whole: bool = False

    def is_so(self, measures: Measures) -> bool:
        """Whether all comparisons hold, and the number is near a whole one."""
        off = abs(measures[self.number] - round(measures[self.number])) if self.number else 0.0
        return off <= self.near and all(test(measures[name], bound) for name, test, bound in comparisons(self.holds))


def measure_facts(positions: Array, fps: float) -> Measures:
    """The measures that rows compare, by name.

    positions: of a window, (frames, 22, 3) metres. fps: frames a second.
    """
    p = ph.smooth(positions, 3)
    seconds = len(p) / fps
    pace, turn = ph.smooth(ph.speed(p, fps), ph.odd(fps / 2)), np.degrees(ph.smooth(ph.heading(p), ph.odd(fps / 4)))
    over = p[:, [20, 21], 1] - p[:, [16, 17], 1]
    begin, end = core(positions, fps)
    both = {
        f"{what}_{side}": float(count(what, positions, fps, side=side))
        for what in ("kicks", "punches")
        for side in ("left", "right")
    }
    hops, waves = gestures.single_foot_hops(positions), gestures.wrist_swings(positions, fps)
    return {
        **compare(measure(positions, fps), seconds),
        **both,
        "hops_left": float(hops[0]),
        "hops_right": float(hops[1]),
        "waves_left": float(waves[0] // 2),
        "waves_right": float(waves[1] // 2),
        "jumps": float(count("jumps", positions, fps)),
        "steps": float(sum(foot_moves(positions, fps))),
        "pace_least": float(pace.min()),
        "pace_most": float(pace.max()),
        "turn_range": float(np.ptp(turn)),
        "turn_rate": float(abs(turn[-1] - turn[0])) * fps / max(end - begin, 1),
        "left_hand": float(over[:, 0].max()),
        "right_hand": float(over[:, 1].max()),
        "hands_most": float(over.max()),
        "hands_least": float(over.min()),
        "arms_swing": float(np.ptp(ph.in_body(p)[:, [20, 21], 2], axis=0).max()),
        "height_most": float(gestures.pelvis_height(p).max()),
        "lasts": (end - begin) / fps,
    }


def measured_notes(positions: Array, fps: float, windows: Iterable[tuple[int, int, str]]) -> Iterator[Note]:
    """Notes of what is measured in windows of a clip.

    positions: of the clip, (frames, 22, 3) metres, the floor at y = 0. windows: first frame, end frame, and what the
    window shows: a label of `data.words` or an action of `data.actions`. At most one window of a name begins within
    half its length.
    """
    reached: dict[tuple[str, int], int] = {}
    for first, end, name in sorted(windows):
        size = end - first
        if name not in BASES or first < reached.get((name, size), 0):
            continue
        reached[name, size] = first + size // 2
        window = positions[first:end]
        measures = measure_facts(window, fps)
        rows = [row for row in ROWS if name in row.of and row.is_so(measures)]
        rng = np.random.default_rng((zlib.crc32(name.encode()), first, size))
        for whole in (False, True):
            texts = _texts(name, [row for row in rows if row.whole == whole], measures, rng)
            if texts:
                shown = (first, end) if whole else _shown(window, fps, name, first)
                yield Note(first, end, MEASURED + name, texts, shown)


def _shown(window: Array, fps: float, name: str, first: int) -> tuple[int, int] | None:
    """Frames of the clip without which a part of the window does not show what its name says."""
    action = ACTIONS.get(name)
    if name in STATES or name in _STEADY or (action and action.kind in ("cycle", "state")):
        return None
    limb = next((limb for word, limb in (("kick", "foot"), ("punch", "hand"), ("throw", "hand")) if word in name), "")
    begin, end = strike(window, fps, limb)[0] if limb else core(window, fps)
    return first + begin, first + end


def _texts(name: str, rows: Sequence[Row], measures: Measures, rng: np.random.Generator) -> tuple[str, ...]:
    chosen: dict[str, None] = {}
    for row in rows:
        number = round(measures[row.number]) if row.number else 0
        pool = sentences_of(name, row, number)
        picks = rng.choice(len(pool), min(_EACH, len(pool)), replace=False)
        chosen |= dict.fromkeys(pool[pick] for pick in picks)
    return tuple(chosen)


def sentences_of(name: str, row: Row, number: int = 0) -> tuple[str, ...]:
    """The sentences with which a row describes what has a name; always the same ones.

    name: a label or action of `BASES`. number: what ``{number}`` stands for.
    """
    bases = BASES[name]
    rng = np.random.default_rng(zlib.crc32(f"{name} {row} {number}".encode()))
    if row.what:
        return tuple(dict.fromkeys(text for what in row.what for text in _negated(bases, what, rng)))
    numeral = _NUMERALS[number] if number < len(_NUMERALS) else str(number)
    said = [text.format(number=numeral) for text in row.says]
    said += [f"{bases[k % len(bases)]} {add}" for k, add in enumerate(row.adds)]
    texts = (sentence(said[k % len(said)], rng) for k in range(max(_FACT_SENTENCES, len(said))))
    return tuple(dict.fromkeys(texts))


def _negated(bases: Sequence[str], what: str, rng: np.random.Generator) -> list[str]:
    undone = {"verb": imperative(what), "verbs": what, "verbing": gerund(what)}
    texts = []
    for form in rng.choice(len(_FORMS), _NEGATED_SENTENCES, replace=False):
        base, who = str(rng.choice(bases)), str(rng.choice(PEOPLE))
        texts.append(_FORMS[form].format(who=who, does=base, do=imperative(base), doing=gerund(base), **undone))
    return texts


_FORMS = (
    "{who} {does} without {verbing}",
    "{who} {does} and does not {verb}",
    "{who} {does} but never {verbs}",
    "{who} {does} and doesn't {verb}",
    "{who} {does}, without {verbing}",
    "without {verbing}, {who} {does}",
    "{who} is {doing}, never {verbing}",
    "{do} without {verbing}",
    "{do}, do not {verb}",
    "{do} and don't {verb}",
    "{doing} without {verbing}",
    "{doing}, not {verbing}",
)
"""How people speak of what does not happen."""


def _read(table: Mapping[str, Any]) -> tuple[Row, ...]:
    sets = {"$" + name: tuple(names) for name, names in table["sets"].items()}
    rows = []
    for entry in (*table["facts"], *table["undone"]):
        of = frozenset(name for part in entry["of"] for name in sets.get(part, (part,)))
        rest: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in entry.items() if k != "of"}
        rows.append(Row(of, **rest))
    return tuple(rows)


_TABLE = read_table("motionloom_train.data", "measured.toml")
BASES: dict[str, tuple[str, ...]] = {name: tuple(phrases) for name, phrases in _TABLE["bases"].items()}
"""Verb phrases of labels and actions without adverbs."""
ROWS = _read(_TABLE)
"""What is said of windows, and when."""
