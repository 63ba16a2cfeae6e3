"""One function a suite: from a job and the options that were given to its report.

`motionloom evaluate NAME` and `motionloom evaluate all` call the same. What one suite needs is imported there.
"""

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

from motionloom.errors import MotionloomError
from motionloom_lab.report.report import Report
from motionloom_lab.suites.items import NoData

if TYPE_CHECKING:
    from motionloom_lab.suites.protocol import Selection
    from motionloom_lab.suites.registry import Job

Settings = TypeVar("Settings")
Asked = Mapping[str, Any]


def with_asked(settings: Settings, asked: Asked) -> Settings:
    """Settings with the options that are fields of theirs."""
    names = {field.name for field in fields(settings)}  # type: ignore[arg-type]
    return replace(settings, **{name: value for name, value in asked.items() if name in names})  # type: ignore[type-var]


def selection(asked: Asked) -> "Selection | None":
    """None where nothing was said: the defaults, or those of the shipped numbers."""
    from motionloom_lab.suites.protocol import Selection

    if asked.get("split") is None and asked.get("sources") is None:
        return None
    sources = asked.get("sources", Selection.sources)
    return Selection(asked.get("split", Selection.splits), () if sources == ("all",) else sources)


def text(job: "Job", asked: Asked) -> Report:
    """The field's text-to-motion metrics."""
    from motionloom_lab.suites import text
    from motionloom_lab.suites.protocol import Protocol, quick

    whole = {"batch": None} if asked.get("batch") == "all" else {}
    how = with_asked(Protocol(), {**asked, **whole})
    how = quick(how) if asked.get("quick") else how
    return text.run(job.run("text"), selection=selection(asked), protocol=how, memory=job.tools.memory)


def transitions(job: "Job", asked: Asked) -> Report:
    """Long motion and its seams."""
    from motionloom_lab.suites import transitions
    from motionloom_lab.suites.protocol import Transitions, quick_transitions

    how = with_asked(Transitions(), asked)
    how = quick_transitions(how) if asked.get("quick") else how
    return transitions.run(job.run("transitions"), selection=selection(asked), how=how, names=asked.get("methods"))


def control(job: "Job", asked: Asked) -> Report:
    """Goals out of real motions."""
    from motionloom_lab.suites import control, control_kinds

    usual = {"count": 8, "replications": 1, "kinds": control_kinds.QUICK} if asked.get("quick") else {}
    said = usual | dict(asked)
    names = ("count", "replications", "steps", "guidance", "seed")
    return control.run(
        job.run("control"),
        kinds=said.get("kinds", control_kinds.DEFAULT),
        methods=said.get("method", control.METHODS),
        selection=selection(asked),
        protocol=control.settings(**{name: said[name] for name in names if name in said}),
    )


def prediction(job: "Job", asked: Asked) -> Report:
    """Futures of held-out pasts."""
    from motionloom_lab.suites import prediction

    singles = asked.get("singles", "all").replace("-", "_")
    usual = prediction.QUICK if asked.get("quick") else prediction.PredictionSettings()
    return prediction.run(
        job.run("prediction", asked.get("weights", "predictor")),
        name=asked.get("protocol"),
        how=with_asked(usual, {**asked, "singles": singles}),
        kinds=asked.get("row", prediction.KINDS),
        with_published=not asked.get("rows_without_published"),
    )


def duet_completion(job: "Job", asked: Asked) -> Report:
    """Prefix completion of two people."""
    from motionloom_lab.suites import duet

    return duet.run(
        job.run("duet-completion"),
        block=asked.get("block"),
        communication=asked.get("communication_only"),
        mrt=_mrt(job, asked),
        beside=asked.get("beside", ()),
        how=with_asked(duet.QUICK if asked.get("quick") else duet.CompletionSettings(), asked),
        with_published=not asked.get("rows_without_published"),
    )


def _mrt(job: "Job", asked: Asked) -> Path | None:
    """The transformer's file, trained now if that was asked for; None where there is none."""
    own = asked["out"] / "mrt" / "mrt.safetensors" if asked.get("out") else None
    steps = asked.get("train_mrt")
    if asked.get("mrt") or steps is None:
        return asked.get("mrt") or (own if own and own.is_file() else None)
    if own is None or steps < 1:
        raise MotionloomError("--train-mrt needs one step or more, and --out FOLDER for its weights")
    if not own.is_file():
        from motionloom_lab.papers.mrt import RECIPE, train_mrt
        from motionloom_lab.papers.readers import find_pairs
        from motionloom_train.loop import Training

        assert job.data is not None  # --data is required
        say = job.tools.progress
        pairs = find_pairs(job.data, captions=False, say=say)
        recipe = replace(RECIPE, steps=steps, seed=asked.get("seed", 0))
        train_mrt(Training(recipe, own.parent, job.device, say=say), pairs)
    return own


def _duets(name: str) -> Callable[["Job", Asked], Report]:
    """The suite of duets that are held against real ones in ``duet_NAME``."""

    def measure(job: "Job", asked: Asked) -> Report:
        from importlib import import_module

        from motionloom_lab.suites import duet_text

        module: ModuleType = import_module(f"motionloom_lab.suites.duet_{name}")
        how = with_asked(module.QUICK if asked.get("quick") else module.FULL, asked)
        return duet_text.run(job.run(f"duet-{name}"), module.parts, block=asked.get("block"), how=how)

    return measure


duet_text, duet_answers, duet_long = (_duets(name) for name in ("text", "answers", "long"))


def obedience(job: "Job", asked: Asked) -> Report:
    """The basic prompts on several seeds."""
    from motionloom_lab.suites import obey, physical

    run, seeds = job.run("obedience"), asked["seeds"]
    generate = job.tools.generator(True)
    results = obey.run(run, generate=generate, seeds=seeds, paraphrases=asked["paraphrases"])
    return physical.obedience_report(results, run=run, settings={"seeds": seeds})


def realism(job: "Job", asked: Asked) -> Report:
    """Motions as they are drawn and as they are exported, beside real clips and recorded people."""
    from motionloom_lab.suites import physical, realism

    wanted, real, about = physical.realism_orders(job.data, asked["count"])
    if not wanted:
        raise NoData(f"{job.data} has no held-out captioned clips of 2 to 10 s; leave --data out")
    run, made, fps = job.run("realism"), {}, 0.0
    for name, finished in ((physical.AS_DRAWN, False), (physical.AS_EXPORTED, True)):
        made[name], fps = realism.run(run, wanted, generate=job.tools.generator(finished))
    return physical.realism_report(made, fps, real, run=run, protocol={**asked, **about})


def evaluator(job: "Job", asked: Asked) -> Report:
    """What the evaluator notices on held-out real motions."""
    from motionloom_lab.evaluator import evaluators, own

    assert job.data is not None  # the suite needs data
    sources = {"sources": asked["source"]} if asked.get("source") else {}
    judge = evaluators.load_evaluator(job.evaluator)
    found = own.validate(judge, job.data, repeats=asked["repeats"], progress=job.tools.progress, **sources)
    return replace(found, command=job.run("evaluator").command)


def agreement(job: "Job", asked: Asked) -> Report:
    """Whether the evaluator ranks motions as physics does."""
    from motionloom_lab.evaluator import agreement, evaluators

    judge, prior = evaluators.load_evaluator(job.evaluator), job.tools.prior()
    found = agreement.agreement(judge, prior, seeds=asked["seeds"], progress=job.tools.progress)
    return replace(found, command=job.run("agreement").command)


def speed(job: "Job", asked: Asked) -> Report:
    """Time and memory."""
    from motionloom_lab.suites import physical

    return physical.speed_report(job.tools.speed(asked["quick"]), run=job.run("speed"))
