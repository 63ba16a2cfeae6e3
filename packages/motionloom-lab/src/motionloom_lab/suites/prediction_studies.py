"""The studies of motion prediction, each one command: what in a predictor matters, on data that somebody has.

Some train small networks that differ in one thing (Chen et al. 2023, HumanMAC, tables 2 to 5 and 7), some look at given
weights: steps, and those of `prediction_behaviour`. Each writes ``NAME.md``, ``NAME.json`` and ``NAME.png`` into a
folder. A network that is finished is found again there, one that was stopped goes on.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from motionloom.core.diffusion import SCHEDULES
from motionloom.core.errors import MotionloomError
from motionloom.core.models.predictor import Predictor, find_predictor, load_predictor
from motionloom.requests.sampling import PredictionSampling
from motionloom.tasks.completion import SOLVER, SPACING, STEPS, futures
from motionloom_lab.papers.benchmarks import find_protocol
from motionloom_lab.report import files, plots, results
from motionloom_lab.report import report as reports
from motionloom_lab.report.report import REAL, Column, Report, Row, Value
from motionloom_lab.suites import prediction, prediction_behaviour
from motionloom_lab.suites import prediction_trial as trials
from motionloom_lab.suites.harness import Run, weight_marks
from motionloom_lab.suites.prediction_behaviour import Budget, Findings, Lab
from motionloom_lab.suites.prediction_trial import PredictionTrial
from motionloom_lab.suites.protocol import check_ranges, reported
from motionloom_train.loop import Training, changed
from motionloom_train.predictor import train_predictor
from motionloom_train.recipe import Recipe

BASE = {"kept": 24, "layers": 4, "width": 128, "heads": 4, "dropout": 0.1}
"""The small network that studies change one thing of."""
STUDIED: dict[str, tuple[str, tuple[Any, ...]]] = {
    "coefficients": ("kept", (6, 12, 24, 45)),
    "layers": ("layers", (2, 4, 6, 8)),
    "schedules": ("schedule", tuple(SCHEDULES)),
    "noising": ("levels", (100, 1000)),
    "dct": ("dct", (True, False)),
}
"""What each training study changes, and to what."""
SIZES = ("width", "layers", "heads", "kept", "variant")
"""Sizes of the networks of a study that can be set."""
TITLES = {
    "coefficients": "Number of cosine coefficients",
    "layers": "Layers",
    "schedules": "Noise schedules",
    "noising": "Noise levels in training, and sampling steps",
    "dct": "With and without the cosine transform",
    "steps": "Sampling steps, solvers and spacings",
    "horizon": "A long horizon: window after window",
    "hold": "Parts of the body held",
    "switch": "Arriving at another motion",
}
MOST = 1_000_000
PUBLISHED_STEPS = 100
"""Of the published sampler."""
SPREADS = ("index", "early", "snr")
MEASURES = ("apd", "ade", "fde", "mmade", "mmfde", "jerk", "seam_velocity", "seconds")


def budget(name: str, *, quick: bool = False, changes: Mapping[str, int] | None = None) -> Budget:
    """The usual budget of a study with ``changes`` of `Budget`; raises MotionloomError for what cannot be."""
    usual = {"steps": Budget(16, 10), "horizon": Budget(16, 4), "hold": Budget(16, 8), "switch": Budget(24, 1)}
    chosen = Budget(4, 2, 20, seconds=4.0, walks=(2, 4)) if quick else usual.get(name, Budget(64, 20))
    chosen = replace(chosen, **(changes or {}))  # type: ignore[arg-type]
    check_ranges(chosen, {"windows": (1, MOST), "samples": (1, MOST), "train_steps": (1, MOST)})
    return chosen


def values_of(name: str, words: Sequence[str]) -> tuple[Any, ...]:
    """What a study changes its setting to, out of words; raises MotionloomError for what the setting cannot be."""
    if not words:
        return ()
    if name not in STUDIED:
        raise MotionloomError(f"the study {name} changes nothing of a network; leave --values out")
    setting, usual = STUDIED[name]
    known = (
        {str(value).lower(): value for value in usual} if not isinstance(usual[0], int) or setting == "dct" else None
    )
    try:
        values = tuple(int(word) for word in words) if known is None else tuple(known[word.lower()] for word in words)
    except (ValueError, KeyError):
        kinds = "whole numbers" if known is None else ", ".join(known)
        raise MotionloomError(f"the values of the study {name} are {kinds}; got {' '.join(words)}") from None
    if known is None and not all(1 <= value <= 8192 for value in values):
        raise MotionloomError(f"the values of the study {name} are from 1 to 8192; got {' '.join(words)}")
    return tuple(dict.fromkeys(values))


def run(
    name: str,
    run: Run,
    *,
    protocol: str | None = None,
    keep: Path,
    budget: Budget,
    values: tuple[Any, ...] = (),
    net: Mapping[str, Any] | None = None,
) -> Report:
    """Do a study and write its table and picture into ``run.folder``.

    Args:
        name: the study, out of `TITLES`.
        run: the predictor, the data, and the folder.
        protocol: which data set that is; None: recognised by its files.
        keep: where trained networks lie.
        budget: how much is measured.
        values: what a study that trains changes its setting to (`values_of`); empty: its usual values.
        net: sizes of the networks that are trained, beside `BASE`; ``{"variant": "published"}`` trains and samples as
            Chen et al. 2023 do.

    Raises:
        MotionloomError: before any work if it cannot be done.
    """
    if name not in TITLES:
        raise MotionloomError(f"there is no study {name!r}; the studies are {', '.join(TITLES)}")
    if run.data is None or run.folder is None:
        raise MotionloomError("a study needs recordings and a folder for its table and picture")
    files.check_report(run.folder / f"{name}.json")
    trained = name in STUDIED
    if net and not trained:
        raise MotionloomError(f"the study {name} trains no network; leave sizes out")
    predictor = None if trained else Predictor.load(run.weights, device=run.device)
    if trained or name == "horizon":
        data = find_protocol(
            run.data, name=protocol, say=run.progress, splits=("train", "val", "test") if trained else ("train", "test")
        )
    else:
        data = trials.read_test(run.data, protocol, say=run.progress)
    if predictor is not None:
        data = trials.fitted(predictor, data)
    lab = Lab(data, budget, keep, net or {}, values, run.device, run.progress)
    report = replace(study(name, lab, predictor), command=run.command)
    if not trained:
        report = replace(
            report, protocol={**report.protocol, results.FILES: weight_marks([find_predictor(run.weights)])}
        )
    write(report, name, run.folder)
    return report


def study(name: str, lab: Lab, predictor: Predictor | None = None) -> Report:
    """The report of a study; ``predictor``: the given weights, None where networks are trained."""
    studies = prediction_behaviour.STUDIES | {"steps": _steps}
    columns, rows, settings = _trained(name, lab) if predictor is None else studies[name](lab, predictor)
    about = reported("study", {"data": lab.protocol, "budget": lab.budget}) | settings
    return Report(f"study-{name}", TITLES[name], "", about, tuple(columns), tuple(rows))


def write(report: Report, name: str, folder: Path) -> None:
    """``NAME.png``, ``NAME.md`` and ``NAME.json``, each whole or not at all.

    Figures of given weights lie in a place that names these, as `tools/fill_readme.py` holds against those that ship.
    """
    path = files.check_report(folder / f"{name}.json")
    plots.study(report, folder / f"{name}.png")
    picture = f"\n![{report.title}]({name}.png)\n"
    page = reports.markdown(report) + picture
    if results.FILES in report.protocol:
        place = f"{results.opening(report, 'figures')}{results.as_section(report)}{picture}<!-- end -->\n"
        page = f"# {report.title}\n\n{place}"
    files.write_text(folder / f"{name}.md", page)
    files.write_json(path, reports.encode(report))


# Networks that differ in one thing


def _trained(name: str, lab: Lab) -> Findings:
    setting, values = STUDIED[name]
    values = lab.values or values
    trial = trials.prepare(lab.protocol, count=lab.budget.windows)
    rows = [_row(REAL, trials.score(trial, None))]
    for value in values:
        if setting == "kept" and value > lab.protocol.frames:
            continue
        predictor = network(lab, setting, value)
        size = sum(values.size for values in predictor.net.weights.values())
        for steps in _steps_of(name, value, lab):
            label = f"{setting} {value}" if name != "noising" else f"{value} levels, {steps} steps"
            lab.say(f"{label}: {len(trial.windows)} windows")
            scored = _scored(lab, trial, predictor, PredictionSampling(steps=steps))
            rows.append(_row(label, scored | {"parameters": size / 1e6}))
    size, sizes = Column("parameters", "M parameters", "", "millions", 2), {**BASE, **lab.net}
    sampler = f"{SOLVER}, {SPACING} spacing, {STEPS} steps unless said"
    about = {
        "networks": f"width {sizes['width']}, {sizes['layers']} layers, {sizes['kept']} coefficients unless said",
        "training": f"{lab.budget.train_steps} steps of 64 windows, seed {lab.budget.seed}",
        "sampler": f"published, {PUBLISHED_STEPS} steps unless said" if _published(lab) else sampler,
    }
    return [*_columns(MEASURES), size], rows, about


def _published(lab: Lab) -> bool:
    return lab.net.get("variant") == "published"


def _steps_of(name: str, value: Any, lab: Lab) -> tuple[int, ...]:
    """The sampling steps of each row of a trained network: published ones have a tenth of the noise levels."""
    if _published(lab):
        return (max(min(PUBLISHED_STEPS, value // 10 if name == "noising" else PUBLISHED_STEPS), 1),)
    return tuple(steps for steps in (10, 50) if steps < value) if name == "noising" else (STEPS,)


def network(lab: Lab, setting: str, value: Any) -> Predictor:
    """The small network with one thing changed: trained, trained further, or as it lies in ``lab.keep``."""
    own = {setting: value} if setting in BASE or (setting, value) == ("dct", False) else {}
    net: dict[str, Any] = BASE | dict(lab.net) | own
    if _published(lab):
        net |= {"dropout": 0.2, "condition_dropout": 0.2}
    net["kept"] = min(net["kept"], lab.protocol.frames)
    other = {setting: value} if setting in ("schedule", "levels") else {}
    schedule, levels = other.get("schedule", "cosine"), other.get("levels", 1000)
    dct = "dct" if net.get("dct", True) else "frames"
    name = f"{dct}{net['kept']}-layers{net['layers']}-{schedule}-{levels}-steps{lab.budget.train_steps}"
    name += "".join(f"-{key}{net[key]}" for key in ("width", "heads", "variant") if key in lab.net)
    steps = lab.budget.train_steps
    recipe = Recipe(
        name=name,
        steps=steps,
        batch=64,
        warmup=min(100, steps // 5),
        cooldown=0.4,
        ema=0.99,
        schedule=schedule,
        levels=levels,
        seed=lab.budget.seed,
        save_every=200,
        predictor=net,
    )
    folder = lab.keep / name
    if changed(folder, recipe):
        raise MotionloomError(f"{folder} holds a network of other settings; name another folder with --keep")
    place = folder / f"{name}.safetensors"
    if not place.is_file() or load_predictor(place).card.notes.get("steps") != steps:
        say = lambda line: lab.say(f"{name}: {line}")  # noqa: E731
        train_predictor(Training(recipe, folder, lab.device, say=say), lab.protocol)
    return load_predictor(place).to(lab.device)


# Given weights


def _steps(lab: Lab, predictor: Predictor) -> Findings:
    trial = trials.prepare(lab.protocol, count=lab.budget.windows)
    walks = [n for n in lab.budget.walks if n < predictor.schedule.steps]
    rows = [_row(REAL, trials.score(trial, None))]
    for solver in ("ddim", "dpm2m"):
        for spacing in SPREADS:
            scores: dict[int, dict[str, float]] = {}
            for steps in reversed(walks):
                lab.say(f"{solver}, {spacing}, {steps} steps")
                how = PredictionSampling(steps=steps, solver=solver, spacing=spacing)
                scores[steps] = _scored(lab, trial, predictor, how)
            most = scores[max(walks)]
            for steps in walks:
                ratios = {f"{k}_ratio": scores[steps][k] / most[k] for k in ("ade", "fde", "jerk") if most[k] > 0}
                rows.append(_row(f"{solver}, {spacing}, {steps} steps", scores[steps] | ratios))
    meaning = f"over {max(walks)} steps of the same solver and spacing"
    ratios = [
        Column(f"{k}_ratio", f"{k.upper() if k != 'jerk' else k} ratio", "", meaning) for k in ("ade", "fde", "jerk")
    ]
    return [*_columns(MEASURES), *ratios], rows, {"weights": predictor.card.name}


def _scored(lab: Lab, trial: PredictionTrial, predictor: Predictor, how: PredictionSampling) -> dict[str, float]:
    samples = lab.budget.samples
    how = replace(how, count=samples, seed=lab.budget.seed, guidance=1.0, batch_size=trials.ROWS)
    if _published(lab):
        steps = how.steps or STEPS
        way = prediction.as_published(predictor, lab.budget.seed, samples=samples, steps=steps)
        return trials.score(trial, way, samples=samples, say=lab.say)
    return trials.score(trial, partial(futures, predictor, sampling=how), samples=samples, say=lab.say)


def _columns(names: Sequence[str]) -> list[Column]:
    return [c for c in prediction.COLUMNS if c.name in names]


def _row(name: str, numbers: dict[str, float]) -> Row:
    return Row(
        name, {key: Value(value) for key, value in numbers.items() if key in MEASURES or key not in trials.KNOWN}
    )
