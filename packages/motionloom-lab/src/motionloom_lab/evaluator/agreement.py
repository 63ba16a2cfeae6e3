"""Does an evaluator rank generated motions as physics does: does it score those higher that do what the words say?"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.models.prior import Prior
from motionloom.kinematics.physics import Array
from motionloom.tasks.text import sample_features
from motionloom_lab.evaluator.evaluators import Caption, Evaluator
from motionloom_lab.metrics.actions import measure
from motionloom_lab.metrics.obedience import CHECKS, Check
from motionloom_lab.report.report import Report, Row, Value
from motionloom_lab.report.tables import columns
from motionloom_train.data.progress import Say, silent

SETTINGS: dict[str, dict[str, Any]] = {
    "as generate": {},
    "2 steps": {"steps": 2},
    "guidance 0": {"guidance": 0.0},
}
"""Ways to sample of clearly different obedience."""
COLUMNS = columns("agreement")


@dataclass(frozen=True, eq=False)
class Scored:
    """Motions of one way to sample."""

    prompts: np.ndarray
    """(motions,) number of the check."""
    obeyed: np.ndarray
    """(motions,) bool, by physics."""
    distances: Array
    """(motions, checks) to the prompts."""

    @property
    def own(self) -> Array:
        """(motions,) distance to the own prompt."""
        return self.distances[np.arange(len(self.prompts)), self.prompts]


def score(
    evaluator: Evaluator, prior: Prior, checks: Sequence[Check], *, seeds: int, settings: dict[str, Any]
) -> Scored:
    """``seeds`` motions for the prompt of every check, judged by physics and by the evaluator."""
    prompts, obeyed, features = [], [], []
    for number, check in enumerate(checks):
        frames = [round(check.seconds * prior.fps)] * seeds
        for one in sample_features(prior, [check.prompt] * seeds, frames, seeds=list(range(seeds)), **settings):
            motion = one.astype(np.float64)
            features.append(motion)
            prompts.append(number)
            obeyed.append(check.obeyed(measure(humanml.decode_positions(motion), prior.fps)))
    texts = evaluator.texts([Caption(check.prompt) for check in checks])
    far = np.linalg.norm(evaluator.motions(features)[:, None] - texts[None], axis=-1)
    return Scored(np.array(prompts), np.array(obeyed), far)


def within_prompts(scored: Sequence[Scored]) -> Value:
    """Chance that an obeying motion is nearer to its prompt than a disobeying one of the same prompt, all pooled.

    The interval is that of the mean over prompts, by drawing the prompts that have both kinds anew (bootstrap).
    """
    prompts = np.concatenate([s.prompts for s in scored])
    obeyed, own = np.concatenate([s.obeyed for s in scored]), np.concatenate([s.own for s in scored])
    wins, pairs = [], []
    for number in np.unique(prompts):
        good, bad = own[(prompts == number) & obeyed], own[(prompts == number) & ~obeyed]
        if len(good) and len(bad):
            gap = bad[None] - good[:, None]
            wins.append(float((gap > 0).sum() + 0.5 * (gap == 0).sum()))
            pairs.append(gap.size)
    if not pairs:
        return Value(float("nan"))
    won, of = np.array(wins), np.array(pairs)
    picks = np.random.default_rng(0).integers(len(of), size=(1000, len(of)))
    spread = (won[picks].sum(1) / of[picks].sum(1)).std()
    return Value(float(won.sum() / of.sum()), float(1.96 * spread), len(of))


def agreement(
    evaluator: Evaluator,
    prior: Prior,
    *,
    seeds: int = 4,
    checks: Sequence[Check] = CHECKS,
    settings: dict[str, dict[str, Any]] = SETTINGS,
    progress: Say = silent,
) -> Report:
    """An evaluator beside physical obedience, for several ways to sample a prior."""
    if not 1 <= seeds <= 1000 or not checks:
        raise MotionloomError(f"1 to 1000 seeds and at least one prompt are needed; got {seeds} and {len(checks)}")
    scored: dict[str, Scored] = {}
    for name, how in settings.items():
        scored[name] = score(evaluator, prior, checks, seeds=seeds, settings=how)
        progress(f"{name}: {scored[name].obeyed.mean():.0%} obey")
    rows = [_row(name, one) for name, one in scored.items()]
    rows.append(Row("all ways together", {"auc": within_prompts(list(scored.values()))}))
    about = {"evaluator": evaluator.name, "weights": prior.card.name, "seeds": seeds, "prompts": len(checks)}
    return Report(
        "agreement",
        f"The evaluator {evaluator.name} beside physical obedience",
        "motionloom evaluate evaluator --data SET",
        {**about, "settings": settings},
        COLUMNS,
        tuple(rows),
        tuple(_notes(rows)),
    )


def _row(name: str, scored: Scored) -> Row:
    count = len(scored.prompts)
    top1 = float((scored.distances.argmin(1) == scored.prompts).mean())
    values = {
        "obeyed": Value(float(scored.obeyed.mean()), count=count),
        "nearness": Value.of((2.0 - scored.own).tolist()),
        "top1": Value(top1, count=count),
        "auc": within_prompts([scored]),
    }
    return Row(name, values)


def _notes(rows: Sequence[Row]) -> list[str]:
    ranked = [row for row in rows if "obeyed" in row.values]
    sentences = []
    for column in ("nearness", "top1"):
        orders = [sorted(ranked, key=lambda row, c=c: -row.values[c].mean) for c in ("obeyed", column)]
        same = [row.name for row in orders[0]] == [row.name for row in orders[1]]
        sentences.append(
            f"The ways to sample are {'' if same else 'NOT '}in the same order by {column} as by obedience."
        )
    return sentences
