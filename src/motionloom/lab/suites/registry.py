"""Every suite the project has, in one place.

A suite is a name and a function from a job to a report; a further one is one more entry in `SUITES`. What only one
suite needs is imported by its function.
"""

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from motionloom.errors import MotionloomError
from motionloom.lab.report.report import Report
from motionloom.lab.suites import needs, obey, physical, realism
from motionloom.lab.suites.control_kinds import QUICK, SUITE
from motionloom.lab.suites.harness import Generate, Run, Say, digest, evaluator_file, silent
from motionloom.weights.prior import Prior, find_weights, shipped

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Tools:
    """What a suite cannot make itself: the command line hands it in, a test hands in fakes."""

    generator: Callable[[bool], Generate]
    """Motions of the weights under test, as drawn (False) or as exported (True)."""
    prior: Callable[[], Prior]
    """The weights under test, loaded once."""
    speed: Callable[[bool], Mapping[str, Any]]
    """`motionloom.lab.bench.bench` as plain data, quick or not."""
    memory: Callable[[int], float]
    """Peak MB of a process that generates with so many steps."""
    progress: Say = silent


@dataclass(frozen=True)
class Job:
    """What to measure."""

    weights: str
    tools: Tools
    data: Path | None = None
    evaluator: str = "own"
    """Who judges text: the shipped evaluator or a file."""
    quick: bool = False
    device: str = "cpu"
    folder: Path = Path()
    """Where a suite may keep what it has done so far; made by whoever writes there."""

    def run(self, suite: str, weights: str | None = None) -> Run:
        """For a suite of that name; ``weights`` instead of the job's."""
        return Run(
            weights or self.weights,
            self.data,
            self.evaluator,
            self.folder,
            self.device,
            command(suite, self),
            self.tools.progress,
        )


@dataclass(frozen=True)
class Suite:
    """One kind of measurement."""

    name: str
    measures: str
    run: Callable[[Job, Mapping[str, Any]], Report]
    """Called with the job and the settings of its kind of run; resumes from what is in ``job.folder``."""
    full: Mapping[str, Any]
    """Settings of a run whose numbers are kept."""
    quick: Mapping[str, Any]
    """Settings of a run that only shows that everything works."""
    data: Literal["needed", "used", ""] = ""
    """Whether it cannot do without a set, compares with one where there is one, or reads none."""
    files: Callable[[Job], Sequence[Path]] = lambda job: ()
    """Further files whose content changes the numbers, the weights under test aside."""
    needs: Callable[[Path], None] = lambda data: None
    """Raises `needs.NoData` where the data have nothing of the kind it measures."""
    prior: bool = True
    """Whether the job's weights are measured; else only `files` are."""

    def weights(self, job: Job) -> list[Path]:
        """The weight files that the numbers are of; real motion that ships beside a suite is none."""
        files = [path for path in self.files(job) if path.suffix == ".safetensors" and path.parent != HERE]
        return [*([find_weights(job.weights)] if self.prior else []), *files]

    def settings(self, quick: bool) -> Mapping[str, Any]:
        """Those of a quick or of a full run."""
        return self.quick if quick else self.full


def command(name: str, job: Job) -> str:
    """The command line that measures a suite again; a set is called SET, since its place differs between machines."""
    weights = job.weights if job.weights in shipped() else Path(job.weights).name
    words = ["motionloom", "evaluate", "all", "--only", name, "--weights", weights]
    words += ["--data", "SET"] if job.data else []
    words += ["--evaluator", Path(job.evaluator).name] if job.evaluator != "own" else []
    return shlex.join([*words, *(["--quick"] if job.quick else [])])


def _judge(job: Job) -> list[Path]:
    """The evaluator and the real motions that are shipped with it, where they are."""
    from motionloom.lab.suites import text_reference

    return [path for path in (evaluator_file(job.evaluator), text_reference.shipped()) if path and path.is_file()]


def _obedience(job: Job, settings: Mapping[str, Any]) -> Report:
    run = job.run("obedience")
    results = obey.run(
        run, generate=job.tools.generator(False), seeds=settings["seeds"], paraphrases=settings["paraphrases"]
    )
    return physical.obedience_report(results, command=run.command, settings={"seeds": settings["seeds"]})


def _realism(job: Job, settings: Mapping[str, Any]) -> Report:
    wanted, real, about = physical.realism_orders(job.data, settings["count"])
    if not wanted:
        raise needs.NoData(f"{job.data} has no held-out captioned clips of 2 to 10 s; leave --data out")
    run, made, fps = job.run("realism"), {}, 0.0
    for name, finished in ((physical.AS_DRAWN, False), (physical.AS_EXPORTED, True)):
        made[name], fps = realism.run(run, wanted, generate=job.tools.generator(finished))
    return physical.realism_report(made, fps, real, command=run.command, protocol={**settings, **about})


def _speed(job: Job, settings: Mapping[str, Any]) -> Report:
    return physical.speed_report(job.tools.speed(settings["quick"]), command=command("speed", job))


def _sealed(report: Report, job: Job) -> Report:
    """With the evaluator's content in the protocol: one trained anew under the same name is another measure."""
    path = evaluator_file(job.evaluator)
    return replace(report, protocol={**report.protocol, "evaluator file": digest(path)[:12] if path else "unknown"})


def _text(job: Job, settings: Mapping[str, Any]) -> Report:
    from motionloom.lab.suites import protocol, text

    how = protocol.quick(protocol.Protocol()) if settings["quick"] else protocol.Protocol()
    found = text.run(job.run("text"), protocol=how, memory=job.tools.memory)
    return _sealed(found, job)


def _transitions(job: Job, settings: Mapping[str, Any]) -> Report:
    from motionloom.lab.suites import protocol, transitions

    how = protocol.quick_transitions(protocol.Transitions()) if settings["quick"] else protocol.Transitions()
    found = transitions.run(job.run("transitions"), how=how)
    return _sealed(found, job)


def _real_seams(job: Job) -> list[Path]:
    """What `_judge` names, and the shipped numbers of real transitions."""
    from motionloom.lab.suites.real_seams import shipped_file

    return [*_judge(job), *([shipped_file()] if shipped_file().is_file() else [])]


def _control(job: Job, settings: Mapping[str, Any]) -> Report:
    from motionloom.lab.suites import control

    protocol = control.settings(count=settings["count"], replications=settings["replications"])
    found = control.run(job.run("control"), kinds=settings["kinds"], protocol=protocol)
    return _sealed(found, job)


def _controls(job: Job) -> list[Path]:
    """What `_judge` names, and the adapters."""
    from motionloom.weights.adapter import adapters

    return [*_judge(job), *adapters().values()]


def _prediction(job: Job, settings: Mapping[str, Any]) -> Report:
    from motionloom.lab.suites import prediction

    return prediction.run(job.run("prediction", "predictor"), how=prediction.How(**settings))


def _predictors(job: Job) -> list[Path]:
    """The shipped predictor, where it is."""
    from motionloom.weights.predictor import shipped_predictors

    return list(shipped_predictors().values())


def _completion(job: Job, settings: Mapping[str, Any]) -> Report:
    from motionloom.lab.suites import duet

    return duet.run(job.run("duet-completion"), how=duet.How(**settings))


def _duets(job: Job, settings: Mapping[str, Any]) -> Report:
    from motionloom.lab.suites import duet_text

    return duet_text.run(job.run("duet-text"), how=duet_text.How(**settings))


def _answers(job: Job, settings: Mapping[str, Any]) -> Report:
    from motionloom.lab.suites import duet_answers

    return duet_answers.run(job.run("duet-answers"), how=duet_answers.How(**settings))


def _long_duets(job: Job, settings: Mapping[str, Any]) -> Report:
    from motionloom.lab.suites import duet_long

    return duet_long.run(job.run("duet-long"), how=duet_long.How(**settings))


def _blocks(job: Job) -> list[Path]:
    """The shipped two-person blocks."""
    from motionloom.weights.pair import blocks

    return list(blocks().values())


def _evaluator(job: Job, settings: Mapping[str, Any]) -> Report:
    from motionloom.lab.evaluator.evaluators import load_evaluator
    from motionloom.lab.evaluator.own import validate

    assert job.data is not None  # `data="needed"`
    found = validate(load_evaluator(job.evaluator), job.data, repeats=settings["repeats"], progress=job.tools.progress)
    return replace(found, command=command("evaluator", job))


def _agreement(job: Job, settings: Mapping[str, Any]) -> Report:
    from motionloom.lab.evaluator.agreement import agreement
    from motionloom.lab.evaluator.evaluators import load_evaluator

    judge, prior = load_evaluator(job.evaluator), job.tools.prior()
    found = agreement(judge, prior, seeds=settings["seeds"], progress=job.tools.progress)
    return _sealed(replace(found, command=command("agreement", job)), job)


SUITES: tuple[Suite, ...] = (
    Suite(
        "text",
        "R-precision, FID and the field's other metrics beside real motion and published rows",
        _text,
        {"quick": False},
        {"quick": True},
        "used",
        _judge,
        needs.need_captions,
    ),
    Suite(
        "transitions",
        "long motion: its segments, and jerk, skate and realism where they meet",
        _transitions,
        {"quick": False},
        {"quick": True},
        "used",
        _real_seams,
        needs.need_captions,
    ),
    Suite(
        "control",
        "goals out of real motions: error, skate and jerk beside published ways of control",
        _control,
        {"kinds": SUITE, "count": 16, "replications": 2},
        {"kinds": QUICK, "count": 8, "replications": 1},
        "needed",
        _controls,
        needs.need_captions,
    ),
    Suite(
        "prediction",
        "many futures of held-out pasts beside what came, baselines and the published sampler",
        _prediction,
        {"windows": 64, "samples": 50, "published_steps": 100},
        {"windows": 6, "samples": 6, "published_steps": 20},
        "needed",
        _predictors,
        needs.need_recordings,
        False,
    ),
    Suite(
        "duet-completion",
        "two people's next seconds beside what came, the prior alone and standing still",
        _completion,
        {"crops": 200, "samples": 5, "steps": 24},
        {"crops": 6, "samples": 2, "steps": 6},
        "needed",
        _blocks,
        needs.need_pairs,
    ),
    Suite(
        "duet-text",
        "duets from words: distance, facing, hands, penetration and synchrony beside real pairs",
        _duets,
        {"duets": 24, "steps": 24},
        {"duets": 4, "steps": 6},
        "needed",
        _blocks,
        needs.need_pairs,
    ),
    Suite(
        "duet-answers",
        "a partner for somebody of a held-out pair, judged as duets from words are",
        _answers,
        {"duets": 24, "steps": 24},
        {"duets": 4, "steps": 6},
        "needed",
        _blocks,
        needs.need_pairs,
    ),
    Suite(
        "duet-long",
        "the last seconds of long duets beside the first, judged as duets from words are",
        _long_duets,
        {"duets": 24, "steps": 24, "segments": 3},
        {"duets": 2, "steps": 6, "segments": 2},
        "needed",
        _blocks,
        needs.need_pairs,
    ),
    Suite(
        "obedience",
        "20 everyday prompts, each with a physical check",
        _obedience,
        {"seeds": 10, "paraphrases": True},
        {"seeds": 2, "paraphrases": False},
    ),
    Suite(
        "realism",
        "skate, penetration, jerk, bones and speeds beside real clips",
        _realism,
        {"count": 64},
        {"count": 16},
        "used",
    ),
    Suite(
        "evaluator",
        "what the shipped evaluator notices on held-out real motions",
        _evaluator,
        {"repeats": 20},
        {"repeats": 2},
        "needed",
        _judge,
        needs.need_captions,
        False,
    ),
    Suite(
        "agreement",
        "whether the evaluator's ranking agrees with physical obedience",
        _agreement,
        {"seeds": 4},
        {"seeds": 1},
        "",
        _judge,
    ),
    Suite("speed", "time and memory as ratios within one run", _speed, {"quick": False}, {"quick": True}),
)
"""In the order of the page of results; text first, which takes longest."""


def chosen(names: Sequence[str], suites: Sequence[Suite] = SUITES) -> list[Suite]:
    """The suites of those names in their own order; all where none is named."""
    known = {suite.name for suite in suites}
    for name in names:
        if name not in known:
            raise MotionloomError(f"there is no suite {name!r}; the suites are {', '.join(sorted(known))}")
    return [suite for suite in suites if not names or suite.name in names]
