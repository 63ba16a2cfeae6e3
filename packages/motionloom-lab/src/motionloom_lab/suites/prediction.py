"""How good predicted futures are: the tables of stochastic motion prediction, on data that somebody has.

Rows: the real futures, both baselines that need no model, the weights as they are sampled by default and with many
steps, and the same weights by the published recipe (`core.methods.humanmac`). Every number is a mean over windows; see
`motionloom_lab.metrics.prediction` for what each is. What others published is kept apart (`report.tables`).
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any, get_args

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.methods.humanmac import published_futures
from motionloom.core.models.predictor import Predictor, find_predictor
from motionloom.requests.sampling import PredictionSampling
from motionloom.tasks.completion import SOLVER, SPACING, STEPS, futures
from motionloom_lab.metrics import prediction as metrics
from motionloom_lab.metrics.prediction import Singles
from motionloom_lab.report.report import REAL, SAME, Report, Row
from motionloom_lab.report.tables import columns, notes, published
from motionloom_lab.suites import prediction_trial as trials
from motionloom_lab.suites.harness import Run, check_names, check_steps, digest, replicated, row_of
from motionloom_lab.suites.prediction_trial import Array, PredictionTrial, Way
from motionloom_lab.suites.protocol import GUIDANCES, SEEDS, check_ranges, reported

ZERO, CONSTANT = "zero velocity", "constant velocity"
KINDS = ("real", "zero", "constant", "ours", "ours-many", "published")
"""Rows of the table."""
COLUMNS = columns("prediction")
WHOLE = {"h36m": ("Human3.6M", 5168), "humaneva": ("HumanEva-I", None), "amass": ("AMASS", 12727)}
"""Data sets whose published figures share our data if all of it is there: their names there and test windows."""


@dataclass(frozen=True)
class PredictionSettings:
    """How it is measured."""

    samples: int = 50
    windows: int | None = None
    """Evenly chosen test windows; None: all."""
    steps: int = STEPS
    guidance: float = 1.0
    singles: Singles = "all"
    published_steps: int = 100
    """Steps of the published recipe, and of our own with many."""
    replications: int = 1
    seed: int = 0

    def __post_init__(self) -> None:
        some = (1, 1000)
        check_ranges(self, {"samples": some, "steps": some, "published_steps": some, "replications": some})
        check_ranges(self, {"guidance": GUIDANCES, "seed": SEEDS})
        if self.singles not in get_args(Singles):
            raise MotionloomError(f"singles are one of {', '.join(get_args(Singles))}; got {self.singles!r}")


QUICK = PredictionSettings(samples=6, windows=6, published_steps=20)


def run(
    run: Run,
    *,
    name: str | None = None,
    how: PredictionSettings | None = None,
    kinds: Sequence[str] = KINDS,
    with_published: bool = True,
) -> Report:
    """Measure a predictor on the test part of ``run.data``.

    Args:
        run: the predictor, the data, and where rows are kept.
        name: which data set that is; None: recognised by its files.
        how: how it is measured.
        kinds: the rows, out of `KINDS`.
        with_published: whether the report has what others published.
    """
    how = how or PredictionSettings()
    check_names(kinds, KINDS, "rows")
    if run.data is None:
        raise MotionloomError("futures are compared with what came, and no recordings are shipped; name some: --data")
    predictor = Predictor.load(run.weights, device=run.device)
    for steps in (how.steps, how.published_steps):
        check_steps(steps, predictor.schedule.steps - 1)
    protocol = trials.fitted(predictor, trials.read_test(run.data, name, say=run.progress))
    return measure(
        predictor,
        trials.prepare(protocol, count=how.windows, singles=how.singles),
        how,
        kinds,
        run=run,
        with_published=with_published,
        about={"weights file": digest(find_predictor(run.weights))[:12], "device": run.device},
    )


def measure(
    predictor: Predictor,
    trial: PredictionTrial,
    how: PredictionSettings,
    kinds: Sequence[str] = KINDS,
    *,
    run: Run | None = None,
    with_published: bool = True,
    about: Mapping[str, Any] | None = None,
) -> Report:
    """The report of a predictor on a trial; ``about``: further settings that change the numbers."""
    run = run or Run("predictor")
    protocol = protocol_of(trial, how, predictor) | dict(about or {})
    parts = run.parts({**protocol, **asdict(how), "windows chosen": _identity(trial)})
    rows = []
    for title, way, repeats in _ways(predictor, trial, how, kinds, label=run.label):

        def scored(k: int, title: str = title, way: Callable[[int], Way] | None = way) -> dict[str, float]:
            run.progress(f"{title}: {len(trial.windows)} windows")
            return trials.score(
                trial,
                way(how.seed + k) if way else None,
                samples=how.samples,
                root=predictor.layout.root or title in (ZERO, CONSTANT),
                say=lambda line: run.progress(f"{title}: {line}"),
            )

        rows.append(row_of(title, replicated(title, repeats, scored, parts, str), COLUMNS))
    others = _published(trial, how, [c.name for c in COLUMNS]) if with_published else ()
    title = "Prediction: many futures of what was seen"
    return run.report("prediction", title, protocol, (*rows, *others), _notes(trial))


def as_published(predictor: Predictor, seed: int, *, samples: int, steps: int) -> Way:
    """The published recipe; every past alone, since noise there goes by the number of a past in its call."""
    how = {"count": samples, "seed": seed, "steps": steps, "rows": trials.ROWS}
    return lambda past: np.concatenate([published_futures(predictor, one[None], **how) for one in past])


def by_rule(rule: Callable[[np.ndarray, int], Array], frames: int) -> Way:
    """A baseline of `motionloom_lab.metrics.prediction`, root included."""
    return lambda past: np.stack([rule(one, frames) for one in past])


def _ways(
    predictor: Predictor, trial: PredictionTrial, how: PredictionSettings, kinds: Sequence[str], *, label: str
) -> list[tuple[str, Callable[[int], Way] | None, int]]:
    """Name, the way of each seed (None: real futures), and how often it is measured."""
    frames, many = trial.protocol.future, how.published_steps
    again = how.replications
    sampling = PredictionSampling(count=how.samples, guidance=how.guidance, batch_size=trials.ROWS)

    def sampled(seed: int, steps: int) -> Way:
        return partial(futures, predictor, sampling=replace(sampling, seed=seed, steps=steps))

    ways: dict[str, tuple[str, Callable[[int], Way] | None, int]] = {
        "real": (REAL, None, 1),
        "zero": (ZERO, lambda seed: by_rule(metrics.zero_velocity, frames), 1),
        "constant": (CONSTANT, lambda seed: by_rule(metrics.constant_velocity, frames), 1),
        "ours": (f"{label}, {how.steps} steps", lambda s: sampled(s, how.steps), again),
        "ours-many": (f"{label}, {many} steps", lambda s: sampled(s, many), again),
        "published": (
            f"{label}, published sampler, {many} steps",
            lambda s: as_published(predictor, s, samples=how.samples, steps=many),
            again,
        ),
    }
    same = how.steps == many
    return [ways[kind] for kind in KINDS if kind in kinds and not (same and kind == "ours-many" and "ours" in kinds)]


def protocol_of(trial: PredictionTrial, how: PredictionSettings, predictor: Predictor) -> dict[str, Any]:
    """What is printed with every table."""
    data = trial.protocol
    classes = {recording.action for recording, _ in trial.windows}
    values = {
        "data": data,
        "trial": trial,
        "predictor": predictor,
        "how": how,
        "recordings": len(data.split("test")),
        "every": len(trial.every),
        "windows": len(trial.windows),
        "singles": how.singles.replace("_", " "),
        "joints": data.layout.joints - 1,
        "classes": len(classes),
        "speeds": "published" if classes <= data.speeds.keys() else "of the real futures",
        "solver": SOLVER,
        "spacing": SPACING,
    }
    return reported("prediction", values)


def _identity(trial: PredictionTrial) -> str:
    digest = hashlib.sha256()
    for number, (recording, start) in enumerate(trial.windows):
        digest.update(f"{recording.name} {start} {len(trial.alike[number])} ".encode())
        digest.update(trial.future(number).astype(np.float32).tobytes())
    return digest.hexdigest()[:16]


def _notes(trial: PredictionTrial) -> tuple[str, ...]:
    count, several = len(trial.windows), trial.several
    return notes("prediction", {"several": several, "count": count, "single": count - several})


def _published(trial: PredictionTrial, how: PredictionSettings, names: Sequence[str]) -> tuple[Row, ...]:
    """What others published, marked where it was measured on what was measured here."""
    name, windows = WHOLE.get(trial.protocol.name, ("", None))
    whole = len(trial.windows) == len(trial.every) and windows in (None, len(trial.every))
    same = bool(name) and whole and how.samples == 50 and how.singles == "all"
    rows = published("prediction", names)
    return tuple(
        replace(row, measured_on=SAME + row.measured_on) if same and row.measured_on.startswith(name) else row
        for row in rows
    )
