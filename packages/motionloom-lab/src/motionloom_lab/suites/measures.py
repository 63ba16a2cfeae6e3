"""One function a suite: from a job and the options that were given to its report.

`motionloom evaluate NAME` and `motionloom evaluate all` call the same. What one suite needs is imported there.
"""

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

from motionloom.core.errors import MotionloomError
from motionloom_lab.report.report import Report
from motionloom_lab.suites.items import NoData

if TYPE_CHECKING:
    from motionloom_lab.suites.protocol import Selection
    from motionloom_lab.suites.registry import Job

Settings = TypeVar("Settings")
Options = Mapping[str, Any]


def with_asked(settings: Settings, options: Options) -> Settings:
    """Settings with the options that are fields of theirs."""
    names = {field.name for field in fields(settings)}  # type: ignore[arg-type]
    return replace(settings, **{name: value for name, value in options.items() if name in names})  # type: ignore[type-var]


def selection(options: Options) -> "Selection | None":
    """None without such options: the defaults, or those of the shipped numbers."""
    from motionloom_lab.suites.protocol import Selection

    if options.get("split") is None and options.get("sources") is None:
        return None
    sources = options.get("sources", Selection.sources)
    return Selection(options.get("split", Selection.splits), () if sources == ("all",) else sources)


def text(job: "Job", options: Options) -> Report:
    """The field's text-to-motion metrics."""
    from motionloom_lab.suites import text
    from motionloom_lab.suites.protocol import Protocol, quick

    whole = {"batch": None} if options.get("batch") == "all" else {}
    how = with_asked(Protocol(), {**options, **whole})
    how = quick(how) if options.get("quick") else how
    return text.run(job.run("text"), selection=selection(options), protocol=how, memory=job.tools.memory)


def transitions(job: "Job", options: Options) -> Report:
    """Long motion and its seams."""
    from motionloom_lab.suites import transitions
    from motionloom_lab.suites.protocol import Transitions, quick_transitions

    run = job.run("transitions")
    how = with_asked(Transitions.of(run.judge(None).representation), options)
    how = quick_transitions(how) if options.get("quick") else how
    beside = options.get("beside", ())
    return transitions.run(run, selection=selection(options), how=how, names=options.get("methods"), beside=beside)


def control(job: "Job", options: Options) -> Report:
    """Goals out of real motions."""
    from motionloom_lab.suites import control, control_kinds

    usual = {"count": 8, "replications": 1, "kinds": control_kinds.QUICK} if options.get("quick") else {}
    settings = usual | dict(options)
    names = ("count", "replications", "steps", "guidance", "seed")
    return control.run(
        job.run("control"),
        kinds=settings.get("kinds", control_kinds.DEFAULT),
        methods=settings.get("method", control.METHODS),
        selection=selection(options),
        trained=options.get("adapters") or (),
        protocol=control.settings(**{name: settings[name] for name in names if name in settings}),
    )


def prediction(job: "Job", options: Options) -> Report:
    """Futures of held-out pasts."""
    from motionloom_lab.suites import prediction

    singles = options.get("singles", "all").replace("-", "_")
    base = prediction.QUICK if options.get("quick") else prediction.PredictionSettings()
    return prediction.run(
        job.run("prediction", options.get("weights", "predictor")),
        name=options.get("protocol"),
        how=with_asked(base, {**options, "singles": singles}),
        kinds=options.get("row", prediction.KINDS),
        with_published=not options.get("rows_without_published"),
    )


def duet_completion(job: "Job", options: Options) -> Report:
    """Prefix completion of two people."""
    from motionloom_lab.suites import duet

    return duet.run(
        job.run("duet-completion"),
        block=options.get("block"),
        communication=options.get("communication_only"),
        mrt=_mrt(job, options),
        beside=options.get("beside", ()),
        how=with_asked(duet.QUICK if options.get("quick") else duet.CompletionSettings(), options),
        with_published=not options.get("rows_without_published"),
    )


def _mrt(job: "Job", options: Options) -> Path | None:
    """The transformer's file, trained now with --train-mrt; None where there is none."""
    own = options["out"] / "mrt" / "mrt.safetensors" if options.get("out") else None
    steps = options.get("train_mrt")
    if options.get("mrt") or steps is None:
        return options.get("mrt") or (own if own and own.is_file() else None)
    if own is None or steps < 1:
        raise MotionloomError("--train-mrt needs one step or more, and --out FOLDER for its weights")
    if not own.is_file():
        from motionloom_lab.papers.mrt import RECIPE, train_mrt
        from motionloom_lab.papers.readers import find_pairs
        from motionloom_train.loop import Training

        assert job.data is not None  # --data is required
        say = job.tools.progress
        pairs = find_pairs(job.data, captions=False, say=say)
        recipe = replace(RECIPE, steps=steps, seed=options.get("seed", 0))
        train_mrt(Training(recipe, own.parent, job.device, say=say), pairs)
    return own


def _duets(name: str) -> Callable[["Job", Options], Report]:
    """The suite of duets that are compared with real ones in ``duet_NAME``."""

    def measure(job: "Job", options: Options) -> Report:
        from importlib import import_module

        from motionloom_lab.suites import duet_text

        module: ModuleType = import_module(f"motionloom_lab.suites.duet_{name}")
        how = with_asked(module.QUICK if options.get("quick") else module.FULL, options)
        return duet_text.run(job.run(f"duet-{name}"), module.parts, block=options.get("block"), how=how)

    return measure


duet_text, duet_answers, duet_long = (_duets(name) for name in ("text", "answers", "long"))


def obedience(job: "Job", options: Options) -> Report:
    """The basic prompts on several seeds."""
    from motionloom_lab.suites import obey, physical

    run, seeds = job.run("obedience"), options["seeds"]
    generate = job.tools.generator(True)
    results = obey.run(run, generate=generate, seeds=seeds, paraphrases=options["paraphrases"])
    return physical.obedience_report(results, run=run, settings={"seeds": seeds})


def realism(job: "Job", options: Options) -> Report:
    """Motions as they are sampled and as they are exported, beside real clips and recorded people."""
    from motionloom_lab.suites import physical, realism

    orders, real, about = physical.realism_orders(job.data, options["count"])
    if not orders:
        raise NoData(f"{job.data} has no held-out captioned clips of 2 to 10 s; leave --data out")
    run, motions, fps = job.run("realism"), {}, 0.0
    for name, finished in ((physical.AS_DRAWN, False), (physical.AS_EXPORTED, True)):
        motions[name], fps = realism.run(run, orders, generate=job.tools.generator(finished))
    return physical.realism_report(motions, fps, real, run=run, protocol={**options, **about})


def evaluator(job: "Job", options: Options) -> Report:
    """What the evaluator notices on held-out real motions."""
    from motionloom_lab.evaluator import evaluators, own

    assert job.data is not None  # the suite needs data
    sources = {"sources": options["source"]} if options.get("source") else {}
    judge = evaluators.load_evaluator(job.evaluator)
    report = own.validate(judge, job.data, repeats=options["repeats"], progress=job.tools.progress, **sources)
    return replace(report, command=job.run("evaluator").command)


def agreement(job: "Job", options: Options) -> Report:
    """Whether the evaluator ranks motions as physics does."""
    from motionloom_lab.evaluator import agreement, evaluators

    judge, prior = evaluators.load_evaluator(job.evaluator), job.tools.prior()
    report = agreement.agreement(judge, prior, seeds=options["seeds"], progress=job.tools.progress)
    return replace(report, command=job.run("agreement").command)


def speed(job: "Job", options: Options) -> Report:
    """Time and memory."""
    from motionloom_lab.suites.physical import speed_report

    return speed_report(job.tools.speed(options["quick"]), run=job.run("speed"))
