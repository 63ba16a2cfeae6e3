"""The text-to-motion suite: does a motion go with its words, does it look like real ones, what does it cost.

Generation comes in as a function, so that an artificial one can be tested and any prior measured. Every replication of
every row is kept in a small file as it is done; a run that was stopped goes on with the next one.
"""

import hashlib
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol as Interface
from typing import cast

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.models.prior import Prior
from motionloom.kinematics.physics import Array
from motionloom.tasks.text import sample_features
from motionloom_lab.evaluator.evaluators import Caption, Evaluator
from motionloom_lab.metrics.retrieval import fid, fid_bias, matching_distance, multimodality_of, r_precision
from motionloom_lab.report.report import REAL, Report, Row, Value
from motionloom_lab.report.tables import columns, notes
from motionloom_lab.suites import text_reference
from motionloom_lab.suites.harness import (
    PHYSICAL,
    Parts,
    Run,
    averaged,
    diversity,
    embedded,
    plain_words,
    readable,
    replicated,
    row_of,
)
from motionloom_lab.suites.items import fitting, pick, read_items, spread
from motionloom_lab.suites.protocol import Protocol, Selection
from motionloom_lab.suites.text_reference import TextReference
from motionloom_train.data.progress import Say

MULTIMODAL_PAIRS = 10
CHANCE_ROWS = 500
"""Captions at most whose distances to all motions of others are averaged."""
SHUFFLED, CHANCE = "real, captions shuffled", "chance"

COLUMNS = columns("text")


class Draw(Interface):
    """Features (frames, 263), not standardised, one per prompt, row i from its own seed."""

    def __call__(
        self, prompts: Sequence[str], frames: Sequence[int], *, seeds: Sequence[int], steps: int
    ) -> list[np.ndarray]:
        """Motion i has ``frames[i]`` frames at 20 per second."""
        ...


@dataclass(frozen=True, eq=False)
class TextTrial:
    """Everything that a row is measured with."""

    draw: Draw
    evaluator: Evaluator
    real: TextReference
    protocol: Protocol
    texts: tuple[Array, ...]
    """For each item (captions, width): its captions as they are."""
    inputs: tuple[Array, ...]
    """The same as they are read beside generated motions, see `Protocol.caption_length`."""

    def shuffle(self, replication: int) -> tuple[list[int], np.ndarray, np.random.Generator]:
        """For one replication: a caption for each item, the order of the items, and the generator for what follows."""
        rng = np.random.default_rng((self.protocol.seed, replication))
        chosen = pick(self.real.captions, rng)
        return chosen, rng.permutation(len(chosen)), rng

    def sentences(self, chosen: Sequence[int]) -> list[str]:
        """The chosen captions in words."""
        return [several[k].text for several, k in zip(self.real.captions, chosen, strict=True)]


def prepare(draw: Draw, evaluator: Evaluator, real: TextReference, protocol: Protocol) -> TextTrial:
    """Choose the items and embed their captions; MotionloomError where that cannot be done."""
    chosen = real.chosen(protocol)
    flat = [caption for several in chosen.captions for caption in several]
    cuts = np.cumsum([len(several) for several in chosen.captions])[:-1]
    texts = tuple(np.split(evaluator.texts(flat), cuts))
    inputs = texts
    if protocol.caption_length == "published":
        inputs = tuple(np.split(_as_published(evaluator, flat), cuts))
    return TextTrial(draw, evaluator, chosen, protocol, texts, inputs)


def _as_published(evaluator: Evaluator, captions: Sequence[Caption]) -> Array:
    other = getattr(evaluator, "with_caption_length", None)
    if other is None:
        raise MotionloomError(
            f"the evaluator {evaluator.name!r} pads no captions, so it has no published caption length; use true"
        )
    return cast(Callable[[str], Evaluator], other)("published").texts(captions)


# ---- the numbers of one replication ----------------------------------------------------------------------------------


def matched(trial: TextTrial, texts: Array, motions: Array, words: Sequence[str]) -> dict[str, float]:
    """How well (items, width) texts and motions in one order go together."""
    batch = trial.protocol.batch
    r1, r2, r3 = r_precision(texts, motions, top=3, batch=batch)
    return {
        "r1": float(r1),
        "r2": float(r2),
        "r3": float(r3),
        "r3_same": same_words_precision(texts, motions, words, top=3, batch=batch),
        "mm_dist": matching_distance(texts, motions, batch=batch),
    }


def same_words_precision(texts: Array, motions: Array, words: Sequence[str], *, top: int, batch: int | None) -> float:
    """Share of texts with a motion of a caption of the same words among the ``top`` nearest of its batch.

    Batches as in `r_precision`. A motion of other words exactly as near goes before: equal embeddings are no hits.
    """
    plain = np.array([plain_words(text) for text in words])
    size = batch or len(texts)
    hits = []
    for row in range(len(texts) // size * size):
        part = slice(row // size * size, row // size * size + size)
        distance = np.linalg.norm(motions[part] - texts[row], axis=1)  # a row at a time: the set may be one batch
        same = plain[part] == plain[row]
        hits.append((~same & (distance <= distance[same].min())).sum() < top)
    return float(np.mean(hits))


def of_real(trial: TextTrial, replication: int, *, shuffled: bool = False) -> dict[str, float]:
    """Real motions with their captions, or with anybody's: the captions then are dealt out anew over all items."""
    chosen, order, rng = trial.shuffle(replication)
    texts = np.stack([several[k] for several, k in zip(trial.texts, chosen, strict=True)])
    motions, words = trial.real.motions, trial.sentences(chosen)
    if shuffled:
        dealt = rng.permutation(len(texts))
        return matched(trial, texts[dealt][order], motions[order], [words[k] for k in dealt[order]])
    numbers = matched(trial, texts[order], motions[order], [words[k] for k in order])
    physical = averaged(trial.real.physical, trial.real.frames)
    return {
        **numbers,
        "fid": fid(motions, trial.real.motions),
        "diversity": diversity(motions, replication),
        **physical,
    }


def of_generated(trial: TextTrial, replication: int, steps: int) -> dict[str, float]:
    """One motion per item, measured; the time goes to sampling alone."""
    chosen, order, _ = trial.shuffle(replication)
    prompts, frames = trial.sentences(chosen), trial.real.frames
    start = time.perf_counter()
    features = _sampled(trial, prompts, frames, seeds=trial.protocol.seeds(replication, len(prompts)), steps=steps)
    seconds = time.perf_counter() - start
    motions = embedded(trial.evaluator, features)
    texts = np.stack([several[k] for several, k in zip(trial.inputs, chosen, strict=True)])
    numbers = matched(trial, texts[order], motions[order], [prompts[k] for k in order])
    numbers["fid"], numbers["diversity"] = fid(motions, trial.real.motions), diversity(motions, replication)
    numbers |= averaged([list(text_reference.of_features(one).values()) for one in features], frames)
    numbers |= {"ms": 1000 * seconds / len(prompts), "per_second": len(prompts) / max(seconds, 1e-9)}
    captions, samples = trial.protocol.multimodality
    if captions and replication < trial.protocol.multimodal_replications:
        numbers["multimodality"] = _several(trial, replication, steps, captions=captions, samples=samples)
    return numbers


def _sampled(
    trial: TextTrial, prompts: Sequence[str], frames: Sequence[int], *, seeds: Sequence[int], steps: int
) -> list[np.ndarray]:
    """Motions of the wanted lengths, cut to them where they are generated longer."""
    padded = trial.protocol.lengths == "padded"
    lengths = [trial.real.selection.longest] * len(prompts) if padded else list(frames)
    motions = trial.draw(prompts, lengths, seeds=seeds, steps=steps)
    if [len(features) for features in motions] != lengths:
        raise ValueError("the generator gave other lengths than asked for")
    return [features[:length] for features, length in zip(motions, frames, strict=True)]


def _several(trial: TextTrial, replication: int, steps: int, *, captions: int, samples: int) -> float:
    """MultiModality of different motions of one caption: unlike the published draw, none is paired with itself."""
    chosen, order, rng = trial.shuffle(replication)
    items = order[:captions]
    prompts, frames = trial.sentences(chosen), trial.real.frames
    seeds = trial.protocol.seeds(replication, len(items) * samples, after=len(prompts))
    features = _sampled(
        trial,
        [prompts[k] for k in items for _ in range(samples)],
        [frames[k] for k in items for _ in range(samples)],
        seeds=seeds,
        steps=steps,
    )
    motions = embedded(trial.evaluator, features).reshape(len(items), samples, -1)
    pairs = min(MULTIMODAL_PAIRS, samples // 2)
    mixed = rng.permutation(samples)
    return multimodality_of(motions, mixed[:pairs], mixed[pairs : 2 * pairs])


def of_chance(trial: TextTrial) -> dict[str, float]:
    """What an evaluator that knows nothing would find: k of the batch, and captions against all other motions."""
    size = trial.protocol.batch or len(trial.texts)
    motions = trial.real.motions
    rows = spread(CHANCE_ROWS, len(motions))
    apart = [np.linalg.norm(trial.texts[k][0] - np.delete(motions, k, axis=0), axis=1).mean() for k in rows]
    return {"r1": 1 / size, "r2": 2 / size, "r3": 3 / size, "mm_dist": float(np.mean(apart))}


# ---- the run ---------------------------------------------------------------------------------------------------------


def measure(
    trial: TextTrial,
    run: Run | None = None,
    *,
    parts: Parts | None = None,
    memory: Callable[[int], float] | None = None,
) -> Report:
    """All rows. ``memory`` gives the peak in MB of generating with so many steps; ``run`` names what is measured."""
    run, parts = run or Run(), parts or Parts(None, "")
    protocol, count = trial.protocol, range(trial.protocol.replications)
    rows = [
        row_of(REAL, [of_real(trial, r) for r in count], COLUMNS, (*PHYSICAL, "fid")),
        row_of(SHUFFLED, [of_real(trial, r, shuffled=True) for r in count], COLUMNS),
        row_of(CHANCE, [of_chance(trial)], COLUMNS),
    ]
    for steps in protocol.steps:
        results = replicated(
            f"{steps} steps",
            len(count),
            lambda r, steps=steps: of_generated(trial, r, steps),
            parts,
            lambda n: f"R@3 {n['r3']:.3f}, FID {n['fid']:.3f}, {n['ms']:.0f} ms per motion",
            run.progress,
        )
        values = dict(row_of("", results, COLUMNS).values)
        if memory is not None:
            peak = parts.once(f"{steps} steps memory", lambda steps=steps: {"memory": memory(steps)})
            values["memory"] = Value(peak["memory"])
        rows.append(Row(f"{run.label}, {steps} steps", values))
    selection, data, judge = trial.real.selection, trial.real.data, trial.evaluator.name
    described = protocol.described(selection, data=data, items=len(trial.texts), evaluator=judge)
    return run.report("text", f"Text to motion: {run.label}", described, rows, _notes(trial), beside="text")


def _notes(trial: TextTrial) -> tuple[str, ...]:
    real = trial.real
    count, half = len(real.motions), len(real.motions) // 2
    bias = fid_bias(real.motions, half, repeats=10, seed=trial.protocol.seed)
    words = [plain_words(caption.text) for several in real.captions for caption in several]
    numbers = {"captions": len(words), "repeated": len(words) - len(set(words)), "width": real.motions.shape[1]}
    lines = notes("text", dict(count=count, half=half, bias=bias, **numbers))
    about = "; ".join(f"{name}: {text}" for name, text in trial.evaluator.about.items())
    judge = (f"Evaluator {trial.evaluator.name}. {about}",) if about else ()
    return (*lines, *judge, *notes("cost"))


def run(
    run: Run,
    *,
    selection: Selection | None = None,
    protocol: Protocol | None = None,
    memory: Callable[[int], float] | None = None,
) -> Report:
    """Measure weights against the shipped reference, or the real motions of ``run.data``.

    Args:
        run: the weights, the data, who judges, and where pieces are kept.
        selection: which real motions of the data; None: the usual ones.
        protocol: how motions are generated and judged.
        memory: the peak in MB of generating with so many steps; None: not measured.
    """
    protocol = protocol or Protocol()
    draw = drawer(run.prior(max(protocol.steps)), protocol)  # what is quickly seen to be wrong goes first
    judge = run.judge()
    if protocol.caption_length == "published":
        _as_published(judge, [text_reference.SENTENCE])
    trial = prepare(draw, judge, reference(judge, run.data, selection, run.progress), protocol)
    parts = run.parts({**protocol.sampling(), **run.settings(judge), "real": identity(trial.real)})
    return measure(trial, run, parts=parts, memory=memory)


def reference(judge: Evaluator, data: Path | str | None, selection: Selection | None, progress: Say) -> TextReference:
    """Real motions: those of ``data``, or the shipped numbers, which nobody can select from."""
    if data is not None:
        selection = fitting(data, selection)
        return text_reference.measure(read_items(data, selection), judge, selection, progress)
    return text_reference.load_shipped(judge, selection)


def drawer(prior: Prior, protocol: Protocol) -> Draw:
    """A prior as `Draw`; MotionloomError for one that does not draw HumanML3D features at 20 frames per second."""
    readable(prior, max(protocol.steps))

    def draw(prompts: Sequence[str], frames: Sequence[int], *, seeds: Sequence[int], steps: int) -> list[np.ndarray]:
        motions = sample_features(prior, prompts, frames, seeds=seeds, **protocol.drawing(steps))
        return [features.astype(np.float64) for features in motions]

    return draw


def identity(real: TextReference) -> str:
    """Changes with the items; not with the embeddings, whose last digits depend on the number of threads."""
    text = json.dumps([real.names, [[c.text for c in several] for several in real.captions], real.frames])
    return hashlib.sha256(text.encode() + real.physical.astype(np.float32).tobytes()).hexdigest()[:16]
