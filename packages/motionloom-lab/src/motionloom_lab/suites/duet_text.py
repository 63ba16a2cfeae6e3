"""Duets from words beside real pairs: where the two are to each other, what they touch, whether they move together.

Each quantity that separates partners from shuffled people is compared with how much real recordings differ from one
another (`lab.metrics.pair_groups`); strangers, real and generated, are rows of their own, and so is the prior without
communication whose people at least begin where real partners do.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features import pair as two
from motionloom.core.features.pair import PairMotion
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.kinematics.physics import Array
from motionloom.tasks.pair import PairEdits, generate_pair, pair_features, person_seeds
from motionloom.tasks.people import Duet, finish_person, known_state
from motionloom.tasks.text import GUIDANCE, STEPS, frames_in
from motionloom_lab.metrics import pair as mp
from motionloom_lab.metrics import pair_groups as groups
from motionloom_lab.report.report import REAL, Column, Report, Row, Value
from motionloom_lab.report.tables import columns, notes
from motionloom_lab.suites.duet import HELD_OUT, chosen_block
from motionloom_lab.suites.duet_ways import no_communication_net
from motionloom_lab.suites.harness import Run, check_names
from motionloom_lab.suites.items import pairs_of
from motionloom_lab.suites.protocol import SEEDS, check_ranges, reported
from motionloom_train.data.pairs import Pair, windows
from motionloom_train.data.progress import Say

KINDS = ("real", "held-out", "strangers", "ours", "our-strangers", "silent")
"""Rows of the table."""
DEEP = 3.0
"""Centimetres of mean penetration that no group may reach."""
FEW = 24
"""Duets whose synchrony is held against all their shuffles."""
_STATS = {
    "distance": 1.0,
    "looking_away": 180 / np.pi,
    "hand_contact": 1.0,
    "touch": 1.0,
    "penetration": 100.0,
    "skate_share": 100.0,
    "skate_speed": 1.0,
    "skate_slide": 1.0,
}
"""Columns out of `pair_stats`, and times what."""
COLUMNS = columns("duet-text")


class DuetDrawing(TypedDict):
    """How people are sampled, as the tasks take it."""

    guidance: float
    steps: int
    foot_lock: bool


@dataclass(frozen=True)
class DuetSettings:
    """How duets are generated and measured."""

    duets: int = 24
    seconds: float = 6.0
    steps: int = STEPS
    guidance: float = GUIDANCE
    seed: int = 0
    clean: bool = True
    """Feet cleaned up, as `motionloom duet` writes them."""

    def __post_init__(self) -> None:
        check_ranges(self, {"duets": (2, 10_000), "seconds": (1, 30), "seed": SEEDS})

    @property
    def drawing(self) -> "DuetDrawing":
        """The options of every task that samples people, beside the seed."""
        return {"guidance": self.guidance, "steps": self.steps, "foot_lock": self.clean}


FULL, QUICK = DuetSettings(), DuetSettings(duets=4, steps=6)
Make = Callable[[str, int, int], Sequence[Duet]]
"""(caption, count, seed) to that many duets."""
Cut = Callable[[Array], Array]
"""A stretch of a duet (2, frames, 22, 3), of as many frames as the real windows have."""
NOTES = notes("duets")


@dataclass(frozen=True)
class Table:
    """Which duets are measured, and what of them."""

    suite: str
    title: str
    captions: tuple[str, ...]
    """What duets are generated for, in turn."""
    notes: tuple[str, ...] = NOTES
    cuts: tuple[tuple[str, Cut], ...] = (("", lambda duet: duet),)
    """Stretches that are rows, and what the rows' names end in; strangers are of the first, and so is the prior without
    communication."""
    columns: tuple[Column, ...] = COLUMNS
    more: Callable[[Sequence[Array]], Mapping[str, Value]] = lambda duets: {}
    """Further columns of all duets, in the order of `turns`."""


Parts = tuple[Table, Make, Make, dict[str, Any]]
"""A suite of duets: its table, duets of the block, duets of the prior alone, and further entries of its protocol."""


def run(
    run: Run,
    parts_of: Callable[[Prior, PairBlock, Sequence[Pair], Any], Parts],
    *,
    block: str | Path | None = None,
    how: DuetSettings,
    kinds: Sequence[str] = KINDS,
) -> Report:
    """Measure a two-person block against the pairs of ``run.data`` and their captions.

    Args:
        run: the prior and the data.
        parts_of: the suite: `parts` of this module, of `duet_answers` or of `duet_long`.
        block: a shipped name or a file; None: the shipped one.
        how: how duets are generated and measured.
        kinds: the rows, out of `KINDS`.
    """
    check_names(kinds, KINDS, "rows")
    prior = Prior.load(run.weights, device=run.device)
    loaded = PairBlock.load(chosen_block(block), prior)
    pairs = pairs_of(run.data, say=run.progress)
    table, ours, silent, about = parts_of(prior, loaded, pairs, how)
    about = {"weights": run.label, "block": loaded.name, "device": run.device} | about
    return measure(pairs, ours, silent, how, table=table, run=run, kinds=kinds, about=about)


def parts(prior: Prior, block: PairBlock, pairs: Sequence[Pair], how: DuetSettings) -> Parts:
    """Duets for the captions of the train pairs."""
    ours: Make = lambda caption, count, seed: generate_pair(  # noqa: E731
        prior, block, caption, seconds=how.seconds, count=count, seed=seed, **how.drawing
    )
    return text_table(pairs), ours, beside(prior, pairs, how), {}


def text_table(pairs: Sequence[Pair]) -> Table:
    """The columns of duets from words."""
    return Table("duet-text", "Two people from words", captions_of(pairs), (*NOTES, *notes("duet-text")))


def beside(prior: Prior, pairs: Sequence[Pair], how: DuetSettings) -> Make:
    """The prior without communication, its people beginning where partners of random train windows are."""
    frames, net, begun = frames_in(how.seconds, prior.fps), no_communication_net(prior), beginnings(pairs, how)

    def make(caption: str, count: int, seed: int) -> list[Duet]:
        nothing = np.zeros((count, 2, 0, len(prior.mean)), np.float32)
        known = PairMotion(nothing, np.stack(begun(count, seed)))
        sampled = pair_features(
            prior,
            net,
            [caption] * (2 * count),
            frames,
            seeds=[s for number in range(count) for s in person_seeds(seed, number)],
            edits=PairEdits(known_state(net, known, frames)),
            guidance=how.guidance,
            steps=how.steps,
        )
        return [
            (finish_person(prior, one, 0, foot_lock=how.clean), finish_person(prior, one, 1, foot_lock=how.clean))
            for one in sampled.each()
        ]

    return make


def beginnings(pairs: Sequence[Pair], how: DuetSettings) -> Callable[[int, int], list[Array]]:
    """(count, seed) to ground poses (2, 4) of partners at the beginning of random train windows."""
    frames = frames_in(how.seconds, mp.FPS)
    real = [window for pair in pairs if pair.split == "train" for window in windows(pair, frames, frames // 2)]

    def begun(count: int, seed: int) -> list[Array]:
        rng = np.random.default_rng((how.seed, seed))
        return [two.encode(real[int(rng.integers(len(real)))].positions).poses for _ in range(count)]

    return begun


def measure(
    pairs: Sequence[Pair],
    ours: Make,
    silent: Make | None,
    how: DuetSettings,
    *,
    table: Table,
    run: Run | None = None,
    kinds: Sequence[str] = KINDS,
    about: dict[str, Any] | None = None,
) -> Report:
    """The report of duets generated for captions, beside all pairs there are."""
    run = run or Run()
    recorded = _recorded(pairs, frames_in(how.seconds, mp.FPS))
    real = list(recorded.values())
    rows = _real_rows(recorded, {pair.name for pair in pairs if pair.split in HELD_OUT}, kinds)
    for kind, make, name in (("ours", ours, "ours"), ("silent", silent, "prior without communication")):
        if make is None or not {kind, "our-strangers" if kind == "ours" else kind} & set(kinds):
            continue
        duets, seconds = _generated(make, table.captions, how, lambda line, n=name: run.progress(f"{n}: {line}"))
        for end, cut in table.cuts if kind == "ours" else table.cuts[:1]:
            clips = [cut(duet) for duet in duets]
            if kind in kinds:
                rows.append(_row(f"{name}{end}", clips, real, seconds=seconds, more=table.more(clips)))
            if kind == "ours" and "our-strangers" in kinds and end == table.cuts[0][0]:
                strangers = groups.shuffled(clips)
                rows.append(_row(f"{name}{end}, partners shuffled", strangers, real, more=table.more(strangers)))
    terms = protocol_of(recorded, table.captions, how) | (about or {})
    under = (*verdicts(rows), *table.notes)
    return run.report(table.suite, table.title, terms, rows, under, columns=table.columns)


def _recorded(pairs: Sequence[Pair], frames: int) -> dict[str, list[Array]]:
    """Half-overlapping windows of every recording that is long enough."""
    by_name = {pair.name: [w.positions for w in windows(pair, frames, frames // 2)] for pair in pairs}
    by_name = {name: clips for name, clips in by_name.items() if clips}
    if len(by_name) < 2:
        raise MotionloomError(f"fewer than two pairs have the {frames} frames of a duet; nothing can be compared")
    return by_name


def _real_rows(recorded: dict[str, list[Array]], held_out: set[str], kinds: Sequence[str]) -> list[Row]:
    rows, real = [], list(recorded.values())
    everything = [clip for clips in real for clip in clips]
    if "real" in kinds:
        rows.append(_row(REAL, everything, None))
    rest = [clips for name, clips in recorded.items() if name not in held_out]
    if "held-out" in kinds and 2 <= len(rest) < len(real):
        held = [clip for name, clips in recorded.items() if name in held_out for clip in clips]
        rows.append(_row("real, held-out pairs", held, rest))
    if "strangers" in kinds:
        away = max(map(len, real))  # to another recording
        strangers = groups.shuffled(everything, shift=away if away % len(everything) else 1)
        rows.append(_row("real, partners shuffled", strangers, real))
    return rows


def captions_of(pairs: Sequence[Pair]) -> tuple[str, ...]:
    """The captions of the train pairs, each once."""
    captions = tuple(dict.fromkeys(text for pair in pairs if pair.split == "train" for text in pair.captions))
    if not captions:
        raise MotionloomError("the train pairs have no captions; duets are made for them, so add captions.txt")
    return captions


def turns(captions: Sequence[str], how: DuetSettings) -> list[tuple[str, int, int]]:
    """(caption, count, seed) of all duets, captions in turn."""
    counts = [len(range(number, how.duets, len(captions))) for number in range(len(captions))]
    return [
        (caption, count, how.seed * len(captions) + number)
        for number, (caption, count) in enumerate(zip(captions, counts, strict=True))
        if count
    ]


def _generated(make: Make, captions: Sequence[str], how: DuetSettings, say: Say) -> tuple[list[Array], float]:
    """Positions of all duets, in the order of `turns`, and seconds for one."""
    duets, began = [], time.perf_counter()
    for caption, count, seed in turns(captions, how):
        say(f"{count} duets of {caption!r}")
        duets += [np.stack([person.positions() for person in duet]) for duet in make(caption, count, seed)]
    return duets, (time.perf_counter() - began) / how.duets


def _row(
    name: str,
    clips: Sequence[Array],
    real: Sequence[Sequence[Array]] | None,
    *,
    seconds: float | None = None,
    more: Mapping[str, Value] | None = None,
) -> Row:
    stats = [mp.pair_stats(clip) for clip in clips]
    values = {name: Value.of([times * one[name] for one in stats]) for name, times in _STATS.items()}
    some = [clips[k] for k in np.unique(np.linspace(0, len(clips) - 1, min(FEW, len(clips))).round().astype(int))]
    values["synchrony"] = Value.of([one["speed_synchrony"] for one in stats])
    if len(some) > 1:
        values["over_strangers"] = Value(groups.synchrony_against_shuffled(some).size)
    if real is not None:
        gaps = groups.compare(clips, real, names=groups.JUDGED)
        values |= {f"ratio_{one}": Value(gaps[one].ratio) for one in groups.JUDGED}
        inside = sum(gaps[one].within() for one in groups.JUDGED)
        values["within"] = Value(inside / len(groups.JUDGED), count=len(groups.JUDGED))
    if seconds is not None:
        values["seconds"] = Value(seconds)
    return Row(name, {**values, **(more or {})})


def verdicts(rows: Sequence[Row]) -> tuple[str, ...]:
    """What holds, in words."""
    notes = []
    for row in rows:
        if not row.name.startswith("ours"):
            continue
        ratios = [(name, row.values[f"ratio_{name}"].mean) for name in groups.JUDGED]
        words = ", ".join(f"{name.replace('_', ' ')} {ratio:.2f}" for name, ratio in ratios)
        inside = "within" if all(ratio <= groups.LIMIT for _, ratio in ratios) else "not within"
        notes.append(f"{row.name}: {inside} {groups.LIMIT:g} times of the real pairs' spread ({words}).")
        depth = row.values["penetration"].mean
        if "shuffled" not in row.name:
            notes.append(
                f"{row.name}: mean penetration {depth:.2f} cm, {'under' if depth < DEEP else 'not under'} {DEEP:g} cm."
            )
    return tuple(notes)


def protocol_of(recorded: dict[str, list[Array]], captions: Sequence[str], how: DuetSettings) -> dict[str, Any]:
    """What is printed with the table."""
    values = {
        "how": how,
        "recordings": len(recorded),
        "windows": sum(map(len, recorded.values())),
        "fps": mp.FPS,
        "captions": list(captions),
        "feet": "cleaned up" if how.clean else "as drawn",
    }
    return reported("duets", values)
