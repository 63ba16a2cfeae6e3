"""The suite of long motion: how good the middles of its segments are, and how smooth the transitions between them.

Rows and columns of PriorMDM's tables 1 and 2 (Shafir et al. 2024) with FlowMDM's jerk (Barquero et al. 2024), foot
skate and speed. A way to make a long motion comes in as a function (`long_baselines.Method`). Every replication of
every way is kept in a small file as it is done; a run that was stopped goes on with the next one.
"""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features.representation import Representation
from motionloom.core.models.prior import find_weights
from motionloom.kinematics.physics import Array
from motionloom_lab.evaluator.evaluators import Caption, Evaluator
from motionloom_lab.metrics.retrieval import fid, fid_bias, matching_distance, r_precision
from motionloom_lab.metrics.transitions import (
    JERK_HUMANML3D,
    area_under_jerk,
    jerk_curve,
    sequence_jerk,
    transition_distance,
)
from motionloom_lab.report.report import REAL, Report
from motionloom_lab.report.tables import columns, notes
from motionloom_lab.suites import harness, text_reference
from motionloom_lab.suites.harness import Parts, Run, digest, diversity, embedded, replicated, row_of
from motionloom_lab.suites.items import fitting, read_items
from motionloom_lab.suites.long_baselines import Long, Method, methods, titled
from motionloom_lab.suites.protocol import Selection, Transitions
from motionloom_lab.suites.real_seams import PHYSICAL, SeamCrops, Shipped, averaged, jerks, load_shipped
from motionloom_lab.suites.text import identity
from motionloom_lab.suites.text_reference import TextReference
from motionloom_train.data.progress import Say

LEAST_INSIDE = 8
"""Frames: what is left of a segment between its transitions is measured from so many on."""

COLUMNS = columns("transitions")


@dataclass(frozen=True, eq=False)
class SeamTrial:
    """Everything that a way is measured with."""

    evaluator: Evaluator
    real: TextReference
    how: Transitions
    mean_jerk: float
    """m/frame³ of the real windows."""
    crops: SeamCrops | None
    """Windows of real motion; None where only the shipped numbers are at hand."""
    shipped: Shipped | None = None
    handshakes: SeamCrops | None = None
    """Windows of real motion as long as a handshake: what transitions are compared with that have no margin."""

    @property
    def kind(self) -> Representation:
        """What the numbers of all motions are."""
        return self.evaluator.representation

    def requests(self, replication: int) -> Iterator[tuple[list[int], list[Caption], list[int]]]:
        """For each long motion of a replication: its items, their captions, and the visible frames."""
        rng = np.random.default_rng((self.how.seed, replication))
        order = rng.permutation(len(self.real.names))
        for unfolding in range(self.how.unfoldings):
            items = order[unfolding * self.how.intervals : (unfolding + 1) * self.how.intervals].tolist()
            several = [self.real.captions[k] for k in items]
            picks = [captions[int(rng.integers(len(captions)))] for captions in several]
            frames = [min(max(self.real.frames[k], self.how.shortest), self.how.longest) for k in items]
            yield items, picks, frames


def prepare(
    evaluator: Evaluator,
    real: TextReference,
    how: Transitions,
    crops: SeamCrops | None,
    shipped: Shipped | None = None,
    *,
    handshakes: SeamCrops | None = None,
) -> SeamTrial:
    """Checks that there is enough real motion; MotionloomError where there is not."""
    need = how.unfoldings * how.intervals
    if how.intervals < 4:
        raise MotionloomError(f"{how.intervals} intervals are too few for R@3; ask for at least 4")
    if need > len(real.names):
        raise MotionloomError(
            f"{how.unfoldings} unfoldings of {how.intervals} intervals need {need} real items and there are "
            f"{len(real.names)}; ask for fewer, or name more data"
        )
    if crops is not None and len(crops.embeddings) < max(2, how.seams):
        raise MotionloomError(
            f"there are {len(crops.embeddings)} real stretches of {how.window} frames and {how.seams} transitions are "
            "compared with them; ask for fewer intervals, or name more data"
        )
    if crops is None and shipped is None:
        raise MotionloomError("this copy ships no numbers of real transitions; name real motions with --data")
    mean = crops.mean_jerk if crops is not None else shipped.mean_jerk  # type: ignore[union-attr]
    return SeamTrial(evaluator, real, how, mean, crops, shipped, handshakes)


# ---- one replication -------------------------------------------------------------------------------------------------


def cut(frames: Sequence[int], margin: int) -> list[slice]:
    """Of each interval what lies at least ``margin`` frames from its seams; its open ends are kept."""
    ends = np.cumsum(frames).tolist()
    starts, last = [0, *ends[:-1]], len(frames) - 1
    return [
        slice(start + (margin if row > 0 else 0), end - (margin if row < last else 0))
        for row, (start, end) in enumerate(zip(starts, ends, strict=True))
    ]


def windows(frames: Sequence[int], size: int) -> list[slice]:
    """``size`` frames around each seam: from ``size`` // 2 before it on."""
    return [slice(seam - size // 2, seam - size // 2 + size) for seam in np.cumsum(frames)[:-1].tolist()]


def of_method(trial: SeamTrial, method: Method, replication: int) -> dict[str, float]:
    """All columns for one way; the time goes to making the motions alone."""
    how = trial.how
    middles, seams, shakes, texts, around, inside, steps = [], [], [], [], [], [], []
    spent = total = 0.0
    for unfolding, (_, captions, frames) in enumerate(trial.requests(replication)):
        start = time.perf_counter()
        motion = method([caption.text for caption in captions], frames, how.first_seed(replication, unfolding))
        spent, total = spent + time.perf_counter() - start, total + sum(frames) / trial.kind.fps
        _check(motion, sum(frames), trial.kind)
        texts += captions
        middles += [motion.features[part] for part in cut(frames, how.handshake // 2)]
        parts = windows(frames, how.window)
        seams += [motion.features[part] for part in parts]
        shakes += [motion.features[part] for part in windows(frames, how.handshake)]
        around += [motion.positions[part] for part in parts]
        inside += [motion.positions[p] for p in cut(frames, how.window // 2) if p.stop - p.start >= LEAST_INSIDE]
        steps += transition_distance(motion.positions, np.cumsum(frames)[:-1].tolist()).tolist()
    result = _matched(trial, texts, embedded(trial.evaluator, middles), replication)
    result |= _around(trial, seams, np.stack(around), replication)
    result |= _handshakes(trial, shakes, replication)
    result |= {"step": 1000 * float(np.mean(steps)), "cost": spent / total}
    if inside:
        result |= {f"inside_{name}": value for name, value in averaged(inside, trial.kind.fps).items()}
        own = np.concatenate([sequence_jerk(part[None])[0] for part in inside]).mean()
        result["auj_own"] = area_under_jerk(jerk_curve(np.stack(around)), float(own))
    return result


def of_real(trial: SeamTrial, replication: int) -> dict[str, float]:
    """Real motions with their own captions; other random windows of real motion in place of transitions."""
    rows = [item for items, _, _ in trial.requests(replication) for item in items]
    several = [caption for _, captions, _ in trial.requests(replication) for caption in captions]
    result = _matched(trial, several, trial.real.motions[rows], replication)
    numbers = harness.averaged(trial.real.physical, trial.real.frames)
    result |= {f"inside_{short}": numbers[name] for short, name in PHYSICAL.items()}
    if trial.crops is not None:
        seed = trial.how.seed, replication, 1
        other = trial.crops.again(trial.how.seams, seed=seed)
        result |= _around(trial, other.features, other.positions, replication)
        result["step"] = 1000 * other.step
        if trial.handshakes is not None:
            result |= _handshakes(trial, trial.handshakes.again(trial.how.seams, seed=seed).features, replication)
    elif trial.shipped is not None:
        result |= trial.shipped.row(trial.how)
    if "auj" in result:
        result["auj_own"] = result["auj"]  # real windows are windows like any other
    return result


def _matched(trial: SeamTrial, captions: Sequence[Caption], motions: Array, replication: int) -> dict[str, float]:
    """Segments (segments, width) beside their captions."""
    texts = trial.evaluator.texts(captions)
    return {
        "r3": float(r_precision(texts, motions, top=3, batch=trial.how.intervals)[2]),
        "mm_dist": matching_distance(texts, motions, batch=trial.how.intervals),
        "fid": fid(motions, trial.real.motions),
        "diversity": diversity(motions, replication),
    }


def _around(
    trial: SeamTrial, features: Sequence[np.ndarray], positions: np.ndarray, replication: int
) -> dict[str, float]:
    """Numbers of windows: features of each, and positions (windows, frames, 22, 3)."""
    result = {
        **jerks(positions, trial.mean_jerk, trial.kind.fps),
        **{f"seam_{name}": value for name, value in averaged(list(positions), trial.kind.fps).items()},
    }
    if trial.crops is not None:
        embeddings = embedded(trial.evaluator, features)
        result["transition_fid"] = fid(embeddings, trial.crops.embeddings)
        result["transition_diversity"] = diversity(embeddings, replication)
    return result


def _handshakes(trial: SeamTrial, features: Sequence[np.ndarray], replication: int) -> dict[str, float]:
    """Numbers of windows that are as long as a handshake."""
    if trial.handshakes is None:
        return {}
    embeddings = embedded(trial.evaluator, features)
    distance = fid(embeddings, trial.handshakes.embeddings)
    return {"handshake_fid": distance, "handshake_diversity": diversity(embeddings, replication)}


def _check(motion: Long, frames: int, kind: Representation) -> None:
    if motion.features.shape != (frames, kind.width) or motion.positions.shape != (frames, 22, 3):
        raise ValueError(f"a method gave {motion.features.shape} and {motion.positions.shape} for {frames} frames")
    if not (np.isfinite(motion.features).all() and np.isfinite(motion.positions).all()):
        raise MotionloomError("a method drew numbers that are not finite; these weights cannot be measured so")


# ---- the run ---------------------------------------------------------------------------------------------------------


def measure(
    trial: SeamTrial, ways: Mapping[str, Method], run: Run | None = None, *, parts: Parts | None = None
) -> Report:
    """All rows: real motion, then every way by the name it was given."""
    run, parts, how = run or Run(), parts or Parts(None, ""), trial.how
    real = [of_real(trial, r) for r in range(how.replications)]
    looked_up = [name for name in real[0] if len({numbers.get(name) for numbers in real}) == 1]
    rows = [row_of(REAL, real, COLUMNS, looked_up)]
    for name, method in ways.items():
        results = replicated(
            name,
            how.replications,
            lambda r, method=method: of_method(trial, method, r),
            parts,
            lambda n: f"AUJ {n['auj']:.3f}, peak jerk {n['pj']:.4f}, FID {n['fid']:.3f}, {n['cost']:.2f} s per second",
            run.progress,
        )
        rows.append(row_of(titled(name, how.steps), results, COLUMNS))
    about = {
        "data": trial.real.data,
        **trial.real.selection.described(),
        "items": len(trial.real.names),
        "evaluator": trial.evaluator.name,
        "representation": f"{trial.kind}, positions as the network draws them (not finished)",
        **how.described(),
    }
    title = f"Long motion and its transitions: {run.label}"
    return run.report("transitions", title, about, rows, _notes(trial), beside="long")


def _notes(trial: SeamTrial) -> tuple[str, ...]:
    how, segments = trial.how, trial.how.unfoldings * trial.how.intervals
    half = len(trial.real.motions) // 2
    some = min(half, segments)
    bias = fid_bias(trial.real.motions, some, other=half, repeats=10, seed=how.seed)
    jerk = {"frames": how.window - 3, "jerk": trial.mean_jerk, "published": JERK_HUMANML3D}
    lines = notes("transitions", dict(how=how, segments=segments, some=some, half=half, bias=bias, **jerk))
    return (*lines, *(notes("transitions-without-data") if trial.crops is None else ()), *notes("time"))


def run(
    run: Run,
    *,
    selection: Selection | None = None,
    how: Transitions | None = None,
    names: Sequence[str] | None = None,
    beside: Sequence[str] = (),
) -> Report:
    """Measure weights by the named ways of making long motion (default `long_baselines.DEFAULT`).

    Args:
        run: the weights, the data, who judges, and where pieces are kept.
        selection: which real motions of the data; None: the usual ones.
        how: the protocol; None: the usual one for what the evaluator reads.
        names: the rows.
        beside: further weights, each of which has all rows too; the names of rows then end with those of the weights.
    """
    judge = run.judge(None)
    how = how or Transitions.of(judge.representation)
    ways = _ways_of(run, beside, how, names, judge.representation)
    trial = real_motion(judge, run.data, selection, how, run.progress)
    more: dict[str, object] = {"windows": trial.crops is not None}
    if beside:
        more["beside"] = [digest(find_weights(weights)) for weights in beside]
    parts = run.parts({**how.sampling(), **run.settings(judge), "real": identity(trial.real), **more})
    return measure(trial, ways, run, parts=parts)


def _ways_of(
    run: Run, beside: Sequence[str], how: Transitions, names: Sequence[str] | None, kind: Representation
) -> dict[str, Method]:
    """The ways of the run's weights and of those beside them, by the names of rows."""
    if not beside:
        return methods(run.prior(how.steps, kind), how, names)
    runs = [replace(run, weights=str(weights)) for weights in (run.weights, *beside)]
    if len({one.label for one in runs}) < len(runs):
        raise MotionloomError(
            f"rows are called by the names of weights, and these are not all different: "
            f"{', '.join(one.label for one in runs)}; name each file once, by a name of its own"
        )
    every = [(one.label, methods(one.prior(how.steps, kind), how, names)) for one in runs]
    return {f"{name}, {label}": method for label, ways in every for name, method in ways.items()}


def real_motion(
    judge: Evaluator, data: Path | str | None, selection: Selection | None, how: Transitions, progress: Say
) -> SeamTrial:
    """Real motions out of ``data``, or the shipped numbers."""
    if data is None:
        return prepare(judge, text_reference.load_shipped(judge, selection), how, None, load_shipped())
    chosen = fitting(data, selection)
    items = read_items(data, chosen)
    width = items[0].features.shape[1]
    if width != judge.representation.width:
        raise MotionloomError(f"{data} has {width} numbers per frame; {judge.name} reads {judge.representation}")
    real = text_reference.measure(items, judge, chosen, progress)
    features = [item.features for item in items]
    crops = SeamCrops.of(features, how.window, judge, seed=how.seed)
    enough = how.handshake >= LEAST_INSIDE
    handshakes = SeamCrops.of(features, how.handshake, judge, seed=how.seed) if enough else None
    return prepare(judge, real, how, crops, handshakes=handshakes)
