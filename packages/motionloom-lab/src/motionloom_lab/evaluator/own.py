"""The own evaluator: its file, and what it notices on held-out real motions.

Whether its numbers can be trusted is a measurement like any other: motions are damaged by known amounts, and the
distances must grow with the amount.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.layout import FPS
from motionloom.core.features.representation import HUMANML3D
from motionloom.core.files.atomic import finished
from motionloom.kinematics.physics import Array
from motionloom_lab.evaluator.evaluators import Caption, Evaluator
from motionloom_lab.evaluator.net import Embedder, is_embedder, load_embedder
from motionloom_lab.evaluator.pairs import TIMED, backwards
from motionloom_lab.metrics.retrieval import fid, fid_bias, matching_distance, r_precision
from motionloom_lab.report.report import Report, Row, Value
from motionloom_lab.report.tables import columns
from motionloom_train.data.clips import Clip
from motionloom_train.data.progress import Say, silent
from motionloom_train.data.sets import read_clips
from motionloom_train.data.words import LABELS, mirror_text
from motionloom_train.prior import text_encoder

SHIPPED = "evaluator"
TEXT = "default"
"""Shipped prior whose embedded text encoder the evaluator reads."""
SPLITS = ("val", "test")
SHORTEST, WINDOW = 20, 100
"""Frames: the least that is shown, and of the windows that FID is taken over."""
BATCH = 32
NOISE = (0.005, 0.01, 0.02, 0.04, 0.08)
"""Metres: standard deviation on each coordinate of each joint in each frame."""
SHARES = (0.25, 0.5, 0.75, 1.0)
SPEEDS = (0.5, 0.71, 1.41, 2.0)

COLUMNS = columns("evaluator")


def load_own(path: Path | None = None) -> Embedder:
    """The evaluator in a file, or the shipped one; its text encoder is the one inside the shipped prior."""
    if path is None and SHIPPED not in evaluators():
        raise MotionloomError("no evaluator ships with this installation; make one with 'motionloom train evaluator'")
    return load_embedder(path or evaluators()[SHIPPED], text_encoder(TEXT))


def evaluators() -> dict[str, Path]:
    """Names and places of the evaluators inside the package."""
    from importlib import resources

    folder = Path(str(resources.files("motionloom"))) / "weights"
    return {path.stem: path for path in finished(folder, "*.safetensors") if is_embedder(path)}


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Held-out motions: captioned stretches, and windows of everything."""

    captioned: tuple[np.ndarray, ...]
    captions: tuple[tuple[str, ...], ...]
    windows: tuple[np.ndarray, ...]
    turns: tuple[tuple[np.ndarray, str], ...] = ()
    """Windows that measurably turn, step or circle to one side, and words for it that name the side."""


TURNS = 200
"""At most so many of `HeldOut.turns`."""


def held_out(clips: Sequence[Clip]) -> HeldOut:
    """The stretches that people described, and consecutive windows of all clips; mirrored copies included."""
    captioned, captions, windows, turns = [], [], [], []
    for clip in clips:
        for note in clip.notes:
            piece = clip.features[note.first : note.last]
            if note.kind == "human" and len(piece) >= SHORTEST:
                captioned.append(piece)
                captions.append(note.texts)
            elif note.kind in LABELS and re.search(r"left|right", note.kind):
                named = [text for text in LABELS[note.kind] if mirror_text(text) != text]
                turns.append((piece[: 2 * WINDOW], f"a person {named[len(turns) % len(named)]}"))
        for start in range(0, len(clip.features), WINDOW):
            if len(part := clip.features[start : start + WINDOW]) >= 2 * SHORTEST:
                windows.append(part)
    few = np.linspace(0, len(turns) - 1, min(TURNS, len(turns))).astype(int)
    return HeldOut(tuple(captioned), tuple(captions), tuple(windows), tuple(turns[i] for i in few))


Damage = Callable[[np.ndarray, np.random.Generator], np.ndarray]


def noise(metres: float) -> Damage:
    """Every coordinate of every joint moved at random, each frame for itself."""

    def damage(features: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        positions = _positions(features)
        return _features(positions + metres * rng.standard_normal(positions.shape))

    return damage


def frozen(share: float) -> Damage:
    """The last ``share`` of the frames stand still."""

    def damage(features: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        positions = _positions(features)
        last = max(0, round((1 - share) * len(positions)) - 1)
        return _features(positions[np.minimum(np.arange(len(positions)), last)])

    return damage


def playback(factor: float) -> Damage:
    """The same movement ``factor`` times as fast."""

    def damage(features: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        return _features(humanml.resample_positions(_positions(features), FPS * factor))

    return damage


def reverse(features: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The film run backwards."""
    return backwards(features)


def mirror(features: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Left and right exchanged."""
    return humanml.mirror(features)


def _positions(features: np.ndarray) -> Array:
    return humanml.decode_positions(features.astype(np.float64))


def _features(positions: Array) -> np.ndarray:
    return humanml.encode(positions, heading="corrected")


@dataclass(frozen=True, eq=False)
class Judge:
    """An evaluator with the points of the undamaged motions and all captions."""

    evaluator: Evaluator
    held: HeldOut
    repeats: int
    seed: int

    @cached_property
    def owner(self) -> np.ndarray:
        """(captions,) the motion of each caption."""
        return np.repeat(np.arange(len(self.held.captions)), [len(captions) for captions in self.held.captions])

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """All captions in order."""
        return tuple(text for captions in self.held.captions for text in captions)

    @cached_property
    def texts(self) -> Array:
        """(captions, width)."""
        return self.evaluator.texts([Caption(text) for text in self.sentences])

    @cached_property
    def motions(self) -> Array:
        """(motions, width) of the captioned stretches."""
        return self.evaluator.motions(self.held.captioned)

    @cached_property
    def windows(self) -> Array:
        """(windows, width)."""
        return self.evaluator.motions(self.held.windows)

    def retrieval(self, motions: Array, *, shuffled: float = 0.0, pool: np.ndarray | None = None) -> dict[str, Value]:
        """R-precision, median rank and distance over ``repeats`` reshuffles, each with one caption per motion.

        motions: (motions, width). shuffled: share of the captions that are handed on to other motions. pool: numbers
        of the captions to take from; None: all. Too few motions for a batch: nothing.
        """
        numbers: dict[str, list[float]] = {"top1": [], "top2": [], "top3": [], "rank": [], "distance": []}
        usable = np.arange(len(self.sentences)) if pool is None else pool
        rng = np.random.default_rng((self.seed, 7))
        for _ in range(self.repeats):
            mixed = rng.permutation(usable)
            _, first = np.unique(self.owner[mixed], return_index=True)  # one random caption each
            picks = rng.permutation(mixed[first])
            if len(picks) < BATCH:
                return {}
            texts, points = self.texts[_handed_on(picks, shuffled, rng)], motions[self.owner[picks]]
            for name, value in zip(("top1", "top2", "top3"), r_precision(texts, points, batch=BATCH), strict=True):
                numbers[name].append(float(value))
            numbers["rank"].append(median_rank(texts, points))
            numbers["distance"].append(matching_distance(texts, points))
        return {name: Value.of(values) for name, values in numbers.items()}

    def noticed(self, damaged: Array, pool: np.ndarray) -> Value:
        """Share of the captions ``pool`` nearer to their own motion than to its damaged copy (motions, width)."""
        texts, own = self.texts[pool], self.owner[pool]
        before, after = (np.linalg.norm(texts - motions[own], axis=1) for motions in (self.motions, damaged))
        return Value(float((before < after).mean()), count=len(pool))

    def sides(self) -> Value:
        """Share of `HeldOut.turns` whose words are nearer to them than to their mirror image."""
        texts = self.evaluator.texts([Caption(text) for _, text in self.held.turns])
        windows = [motion for motion, _ in self.held.turns]
        before, after = (
            np.linalg.norm(texts - self.evaluator.motions(motions), axis=1)
            for motions in (windows, [humanml.mirror(motion) for motion in windows])
        )
        return Value(float((before < after).mean()), count=len(windows))

    def row(self, name: str, damage: Damage, *, pool: np.ndarray | None = None) -> Row:
        """Everything about one damage."""
        rng = np.random.default_rng((self.seed, 11))
        damaged = self.evaluator.motions([damage(one, rng) for one in self.held.captioned])
        values = self.retrieval(damaged, pool=pool)
        every = np.arange(len(self.sentences)) if pool is None else pool
        if len(every):
            values["noticed"] = self.noticed(damaged, every)
        if pool is None:
            windows = self.evaluator.motions([damage(one, rng) for one in self.held.windows])
            values["fid"] = Value(fid(windows, self.windows))
        return Row(name, values)


def median_rank(texts: Array, motions: Array) -> float:
    """Median place, 1 is best, of each text's own motion (same row) among all by distance; (n, width) twice."""
    far = np.linalg.norm(texts[:, None] - motions[None], axis=-1)
    return float(np.median((far < np.diag(far)[:, None]).sum(1)) + 1)


def _handed_on(picks: np.ndarray, share: float, rng: np.random.Generator) -> np.ndarray:
    """``picks`` with a share of its entries, chosen at random, moved round by one place among themselves."""
    moved = rng.permutation(len(picks))[: round(share * len(picks))]
    result = picks.copy()
    result[moved] = picks[np.roll(moved, 1)]
    return result


def validate(
    evaluator: Evaluator,
    data: Path | str,
    *,
    sources: Sequence[str] = ("cmu",),
    repeats: int = 20,
    seed: int = 0,
    progress: Say = silent,
) -> Report:
    """What an evaluator notices on the held-out clips of a built set; one row per damage and amount.

    Raises MotionloomError where the set holds too few captioned held-out motions (32 are needed).
    """
    clips = read_clips(data, sources=sources, splits=SPLITS)
    if evaluator.representation is not HUMANML3D or clips[0].representation is not HUMANML3D:
        raise MotionloomError(
            f"what is planted here are faults of {HUMANML3D}; {evaluator.name} reads {evaluator.representation} and "
            f"{data} holds {clips[0].representation}"
        )
    held = held_out(clips)
    if len(held.captioned) < BATCH or len(held.windows) < BATCH:
        raise MotionloomError(
            f"{data} holds {len(held.captioned)} captioned held-out motions; {BATCH} are needed to rank them"
        )
    judge = Judge(evaluator, held, repeats, seed)
    rows = [_real(judge), _chance(judge)]
    rows += [Row(f"captions shuffled, {s:.0%}", judge.retrieval(judge.motions, shuffled=s)) for s in SHARES]
    sided = np.array([i for i, text in enumerate(judge.sentences) if mirror_text(text) != text], dtype=int)
    timed = np.array([i for i, text in enumerate(judge.sentences) if TIMED.search(text)], dtype=int)
    damages: list[tuple[str, Damage, np.ndarray | None]] = [
        ("re-encoded, undamaged", noise(0.0), None),
        *((f"noise {100 * m:g} cm", noise(m), None) for m in NOISE),
        *((f"last {s:.0%} frozen", frozen(s), None) for s in SHARES),
        *((f"played {f:g} times as fast", playback(f), None) for f in SPEEDS),
        ("reversed in time", reverse, None),
        ("reversed, captions of ways and levels", reverse, timed),
        ("mirrored, captions with a side", mirror, sided),
    ]
    rows.append(Row("real, captions with a side", judge.retrieval(judge.motions, pool=sided)))
    for name, damage, pool in damages:
        rows.append(judge.row(name, damage, pool=pool))
        progress(name)
    if held.turns:
        rows.append(Row("mirrored, measured turns to a side", {"noticed": judge.sides()}))
    about = {
        "evaluator": evaluator.name,
        "splits": list(SPLITS),
        "sources": list(sources),
        "repeats": repeats,
        "seed": seed,
        "captioned motions": len(held.captioned),
        "captions": len(judge.sentences),
        "windows": len(held.windows),
    }
    return Report(
        "evaluator",
        f"What the evaluator {evaluator.name} notices on held-out real motions",
        "motionloom evaluate evaluator --data SET",
        about,
        COLUMNS,
        tuple(rows),
        tuple(notes(rows, judge)),
    )


def _real(judge: Judge) -> Row:
    half = len(judge.windows) // 2
    bias = fid_bias(judge.windows, half, repeats=10, seed=judge.seed)
    return Row("real", {**judge.retrieval(judge.motions), "fid": Value(bias)})


def _chance(judge: Judge) -> Row:
    values = {f"top{k}": Value(k / BATCH) for k in (1, 2, 3)}
    return Row("chance", {**values, "rank": Value((len(judge.motions) + 1) / 2)})


def series() -> dict[str, list[str]]:
    """Names of rows by growing amount of one damage."""
    return {
        "noise": [f"noise {100 * m:g} cm" for m in NOISE],
        "frozen frames": [f"last {s:.0%} frozen" for s in SHARES],
        "slower": [f"played {f:g} times as fast" for f in SPEEDS if f < 1][::-1],
        "faster": [f"played {f:g} times as fast" for f in SPEEDS if f > 1],
        "shuffled captions": [f"captions shuffled, {s:.0%}" for s in SHARES],
    }


def notes(rows: Sequence[Row], judge: Judge) -> list[str]:
    """Which responses are monotone in the amount, and what the rows are."""
    by_name = {row.name: row.values for row in rows}
    sentences = [
        f"FID in the row 'real' is that of one half of the {len(judge.windows)} windows against the other; a damaged "
        "row compares the same windows before and after, so that no damage gives 0.",
        "Mirrored copies of the held-out clips are among them, so FID cannot see mirroring; captions can.",
    ]
    for name, amounts in series().items():
        for column, way in (("fid", 1), ("top3", -1), ("distance", 1)):
            chain = [by_name[row][column] for row in amounts if column in by_name[row]]
            begin = Value(0.0) if column == "fid" else by_name["real"].get(column)
            if begin and chain and len(chain) == len(amounts):
                right = monotone([begin, *chain], way)
                sentences.append(
                    f"{name}: {column} is {'' if right else 'NOT '}monotone in the amount, within intervals."
                )
    return sentences


def monotone(values: Sequence[Value], way: int) -> bool:
    """True where no step goes against ``way`` (1 up, -1 down) by more than both intervals, and the ends agree."""
    steps = [(way * (b.mean - a.mean), np.nansum([a.interval, b.interval])) for a, b in pairwise(values)]
    return all(step >= -doubt for step, doubt in steps) and way * (values[-1].mean - values[0].mean) > 0
