"""The control suite: motions that should follow real ones, in the layout of the paper's Table 4 and beyond it.

Every goal is taken out of a held-out real motion with its caption and length (Shafir et al. 2024, section 5.3). The
papers' numbers are of how real the result looks and not of whether the goal was met; here both are, in the world.
Each way of control is a function, so that an artificial one can be tested. Every replication of every row is kept in a
small file as it is done; a run that was stopped goes on with the next one.
"""

import hashlib
import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.models.adapter import adapters
from motionloom.kinematics.physics import Array
from motionloom.tasks.text import GUIDANCE, STEPS
from motionloom_lab.evaluator.evaluators import Caption, Evaluator
from motionloom_lab.metrics import control as metrics
from motionloom_lab.metrics.control import ControlError
from motionloom_lab.metrics.retrieval import fid, fid_bias, r_precision
from motionloom_lab.report.report import REAL, Report
from motionloom_lab.report.tables import columns, notes
from motionloom_lab.suites import control_kinds, text_reference
from motionloom_lab.suites.control_kinds import Kind, Target
from motionloom_lab.suites.control_methods import BASE, METHODS, Maker, Track, checked, fits, maker, trained_controls
from motionloom_lab.suites.harness import Parts, Run, check_names, digest, diversity, physical_mean, replicated, row_of
from motionloom_lab.suites.items import Item, fitting, pick, read_items, spread
from motionloom_lab.suites.protocol import Protocol, Selection

COUNT, REPLICATIONS = 32, 3
RATIOS = {
    "share_ratio": "skate_share",
    "speed_ratio": "skate_speed",
    "slide_ratio": "skate_slide",
    "jerk_ratio": "jerk",
}
"""Columns that compare a number with that of the uncontrolled row of the same kind and finish (`BASE`)."""
VISIBLE = {"skate_share": 0.1, "skate_speed": 0.1, "skate_slide": 0.01, "jerk": 0.1}
"""Of uncontrolled motions: what is smaller is nothing, and nothing is compared with it."""

COLUMNS = columns("control")


@dataclass(frozen=True, eq=False)
class ControlTrial:
    """Everything that a row is measured with."""

    items: tuple[Item, ...]
    texts: tuple[Array, ...]
    """For each item (captions, width): its captions as the evaluator sees them."""
    motions: Array
    """(items, width): the real motions of the items."""
    everyone: Array
    """(motions, width): all real motions of the selection, which FID compares with."""
    evaluator: Evaluator
    make: Maker
    protocol: Protocol
    scale: Array
    """(263,) standard deviations of the representation's numbers."""
    data: str
    selection: Selection
    plain: dict[tuple[str, int], tuple[list[Track], float]] = field(default_factory=dict)
    """What is the same for every kind, the uncontrolled motions of each replication, and the seconds they took."""

    def captions(self, replication: int) -> tuple[list[Caption], Array]:
        """One caption per item for a replication, in words and as (items, width)."""
        picked = pick([item.captions for item in self.items], np.random.default_rng((self.protocol.seed, replication)))
        words = [item.captions[k] for item, k in zip(self.items, picked, strict=True)]
        return words, np.stack([several[k] for several, k in zip(self.texts, picked, strict=True)])

    def targets(self, one: Kind, replication: int) -> list[Target]:
        """The target of each motion of a replication."""
        captions, _ = self.captions(replication)
        return [control_kinds.target_of(one, i.features, c.text) for i, c in zip(self.items, captions, strict=True)]


def prepare(
    items: Sequence[Item],
    evaluator: Evaluator,
    make: Maker,
    protocol: Protocol,
    *,
    scale: np.ndarray,
    selection: Selection,
) -> ControlTrial:
    """Choose the items, spread evenly, and embed them; MotionloomError where they do not fill a batch."""
    real = text_reference.measure(items, evaluator, selection)
    rows = spread(protocol.count or len(items), len(items))
    least = protocol.batch or 4
    if len(rows) < least:
        raise MotionloomError(f"there are {len(rows)} real items and a batch needs {least}; ask for a smaller --count")
    chosen = tuple(items[k] for k in rows)
    flat = [caption for item in chosen for caption in item.captions]
    cuts = np.cumsum([len(item.captions) for item in chosen])[:-1]
    texts = tuple(np.split(evaluator.texts(flat), cuts))
    return ControlTrial(
        chosen,
        texts,
        real.motions[rows],
        real.motions,
        evaluator,
        make,
        protocol,
        np.asarray(scale, dtype=np.float64),
        real.data,
        selection,
    )


# ---- the numbers of one replication ----------------------------------------------------------------------------------


def measured(
    trial: ControlTrial, replication: int, tracks: Sequence[Track], targets: Sequence[Target]
) -> dict[str, float]:
    """What one motion per target is worth; a number that has no meaning for this kind is left out."""
    embedded = trial.evaluator.motions([one.features for one in tracks])
    return {
        **_judged(trial, replication, embedded),
        **met(tracks, targets, trial.scale),
        **physical_mean([one.positions for one in tracks]),
    }


def _judged(trial: ControlTrial, replication: int, embedded: Array) -> dict[str, float]:
    _, texts = trial.captions(replication)
    order = np.random.default_rng((trial.protocol.seed, replication, 1)).permutation(len(texts))
    return {
        "r3": float(r_precision(texts[order], embedded[order], top=3, batch=trial.protocol.batch)[2]),
        "fid": fid(embedded, trial.everyone),
        "diversity": diversity(embedded, replication),
    }


def met(tracks: Sequence[Track], targets: Sequence[Target], scale: np.ndarray) -> dict[str, float]:
    """How far the motions are from their targets: cm, shares, degrees, standard deviations."""
    pairs = list(zip(tracks, targets, strict=True))
    apart = [metrics.distances(one.positions, target.goal.positions, target.goal.mask) for one, target in pairs]
    root, joints, both = metrics.of_root(apart), metrics.of_joints(apart), metrics.control_error(apart)
    numbers = {**_error("root", root), **_error("joint", joints)}
    if both is not None:
        numbers |= {"worst": both.worst, "beyond_20": both.beyond_20, "beyond_50": both.beyond_50}
    turns = [
        metrics.facing_error(one.positions, target.goal.positions, target.goal.facing_mask) for one, target in pairs
    ]
    numbers["facing"] = float(np.mean(every)) if (every := np.concatenate(turns)).size else math.nan
    numbers["feature_error"] = metrics.feature_error(
        [one.features / scale for one in tracks],
        [target.known / scale for target in targets],
        [target.mask for target in targets],
    )
    return {name: number for name, number in numbers.items() if math.isfinite(number)}


def _error(of: str, error: ControlError | None) -> dict[str, float]:
    return {} if error is None else {f"{of}_error": error.error, f"{of}_sequences": error.sequences}


def of_real(trial: ControlTrial, replication: int) -> dict[str, float]:
    """The real motions themselves; they meet every goal, which they are."""
    clips = [humanml.decode_positions(item.features.astype(np.float64)) for item in trial.items]
    return {**_judged(trial, replication, trial.motions), **physical_mean(clips)}


def of_method(trial: ControlTrial, one: Kind, name: str, replication: int) -> dict[str, float]:
    """One way of control on one kind of goal; the time is that of making the motions."""
    targets = trial.targets(one, replication)
    tracks, seconds = trial.plain.get((name, replication)) or _generated(trial, one, name, replication, targets)
    if name in BASE.values():
        trial.plain[name, replication] = tracks, seconds
    return {**measured(trial, replication, tracks, targets), "seconds": seconds / len(targets)}


def _generated(
    trial: ControlTrial, one: Kind, name: str, replication: int, targets: Sequence[Target]
) -> tuple[list[Track], float]:
    """One motion per target, and the seconds that all took."""
    make = trial.make(one, name)
    start = time.perf_counter()
    tracks = make(targets, seeds=trial.protocol.seeds(replication, len(targets)))
    return checked(tracks, targets), time.perf_counter() - start


# ---- the run ---------------------------------------------------------------------------------------------------------


def measure(
    trial: ControlTrial,
    kinds: Sequence[Kind],
    methods: Sequence[str] = METHODS,
    run: Run | None = None,
    *,
    parts: Parts | None = None,
) -> Report:
    """All rows: the real motions, then each way of control for each kind of goal.

    A way that these weights cannot go (no adapter of that name) is reported in a note and stops nothing. The
    uncontrolled rows are measured wherever something is compared with them.
    """
    run, parts, count = run or Run(), parts or Parts(None, ""), range(trial.protocol.replications)
    chosen = {*methods, *(BASE[name] for name in methods)}
    fixed = ("skate_share", "skate_speed", "skate_slide", "jerk", "penetration", "fid")  # the same motion each time
    rows, missing = [row_of(REAL, [of_real(trial, r) for r in count], COLUMNS, fixed)], list[str]()
    for one in kinds:
        table: dict[str, list[dict[str, float]]] = {}
        for name in [name for name in METHODS if name in chosen and fits(one, name)]:
            row = f"{one.name} {name}"
            for r in count:
                parts.find(f"{row} {r}")  # those of another run are refused
            try:
                table[name] = replicated(
                    row,
                    len(count),
                    lambda r, one=one, name=name: of_method(trial, one, name, r),
                    parts,
                    _in_words,
                    run.progress,
                )
            except MotionloomError as error:
                missing.append(f"{one.title}, {name}: not measured ({error})")
                run.progress(missing[-1])
        rows += [
            row_of(f"{one.title}, {name}", against(numbers, table.get(BASE[name])), COLUMNS)
            for name, numbers in table.items()
        ]
    protocol = trial.protocol
    described = protocol.described(
        trial.selection, data=trial.data, items=len(trial.items), evaluator=trial.evaluator.name
    )
    described |= {
        "representation": "HumanML3D, 263 numbers per frame: as drawn, or encoded again from what is exported",
        "goals": [one.name for one in kinds],
        "fid": f"of {len(trial.items)} motions to all {len(trial.everyone)} real ones",
    }
    under = (*_notes(trial), *missing)
    return run.report("control", f"Control: {run.label}", described, rows, under, beside="control")


def _in_words(numbers: Mapping[str, float]) -> str:
    errors = [f"{k} {numbers[k]:.2f} cm" for k in ("root_error", "joint_error") if k in numbers]
    return ", ".join([*errors, f"{numbers['seconds']:.2f} s per motion"])


def against(numbers: Sequence[dict[str, float]], base: Sequence[dict[str, float]] | None) -> list[dict[str, float]]:
    """The numbers of each replication with their `RATIOS` to the uncontrolled row's, if there is one."""
    if base is None:
        return list(numbers)
    return [
        {**own, **{name: own[of] / plain[of] for name, of in RATIOS.items() if plain[of] > VISIBLE[of]}}
        for own, plain in zip(numbers, base, strict=True)
    ]


def _notes(trial: ControlTrial) -> tuple[str, ...]:
    count, every = len(trial.items), len(trial.everyone)
    bias = f"FID compares {count} motions with {every} real ones in {trial.everyone.shape[1]} dimensions"
    if every > count + 1:
        floor = fid_bias(trial.everyone, count, other=every - count, repeats=5, seed=trial.protocol.seed)
        bias += f", and so few make it large: {count} real motions and the {every - count} others are {floor:.3f} apart"
    return (*notes("control", {"bias": bias}), *notes("time"))


def run(
    run: Run,
    *,
    kinds: Sequence[str] = control_kinds.DEFAULT,
    methods: Sequence[str] = METHODS,
    selection: Selection | None = None,
    protocol: Protocol | None = None,
    trained: Sequence[str | Path] = (),
) -> Report:
    """Measure the control of weights on goals out of the real motions of ``run.data``.

    Args:
        run: the weights, the data, who judges, and where pieces are kept.
        kinds: names of kinds of goals.
        methods: ways of control, a row each.
        selection: which real motions of the data; None: the usual ones.
        protocol: as of `settings`.
        trained: networks for the rows "fine-tuned" and "DiffusionBlending" (`control_methods.trained_controls`); none:
            the shipped adapters, which belong to the shipped prior.
    """
    protocol, goals = protocol or settings(), control_kinds.kinds(kinds)
    check_names(methods, METHODS, "ways of control")
    if run.data is None:
        raise MotionloomError("goals are taken out of real motions, and none are shipped; name a set with --data")
    prior = run.prior(protocol.steps[0])  # unusable weights are reported before anything is read
    controls = trained_controls(prior, trained) if trained else None
    judge, selection = run.judge(), fitting(run.data, selection)
    trial = prepare(
        read_items(run.data, selection),
        judge,
        maker(prior, protocol.drawing(protocol.steps[0]), controls),
        protocol,
        scale=prior.std,
        selection=selection,
    )
    files = {name: digest(path) for name, path in adapters().items()}
    if trained:
        places = [str(word).rpartition("=")[2] for word in trained]
        files = {
            str(word): files.get(place) or digest(Path(place)) for word, place in zip(trained, places, strict=True)
        }
    about = {**protocol.sampling(), "steps": list(protocol.steps), "adapters": files, "items": identity(trial.items)}
    parts = run.parts({**about, **run.settings(judge)})
    return measure(trial, goals, methods, run, parts=parts)


def settings(
    *,
    count: int = COUNT,
    replications: int = REPLICATIONS,
    steps: int = STEPS,
    guidance: float = GUIDANCE,
    seed: int = 0,
) -> Protocol:
    """How it is measured by default; fewer motions than 32 are one batch."""
    return Protocol(
        count=count,
        batch=min(32, max(count, 4)),
        replications=replications,
        multimodality=(0, 0),
        steps=(steps,),
        guidance=guidance,
        seed=seed,
    )


def identity(items: Sequence[Item]) -> str:
    """Changes with the items, their words and their motions."""
    digest = hashlib.sha256(json.dumps([[i.name, [c.text for c in i.captions]] for i in items]).encode())
    for item in items:
        digest.update(np.ascontiguousarray(item.features, dtype=np.float32).tobytes())
    return digest.hexdigest()[:16]
