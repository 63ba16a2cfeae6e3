"""Every suite the project has, in one place, and the run over all of them that goes on after a kill.

A suite is a name and a function from a job to a report; a further one is one more line in `SUITES`.
"""

import hashlib
import json
import shlex
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from motionloom.checkpoint import find_weights, shipped
from motionloom.errors import MotionloomError
from motionloom.evaluation import obey, physical, realism
from motionloom.evaluation import report as reports
from motionloom.evaluation.report import Report

QUICK = "Quick run: few seeds and clips, to see that everything works; these are no numbers to quote."


def _silent(line: str) -> None:
    """Say nothing."""


@dataclass(frozen=True)
class Tools:
    """What a suite cannot make itself: the command line hands it in, a test hands in fakes."""

    generator: Callable[[bool], obey.Generate]
    """Motions of the weights under test, as drawn (False) or as exported (True)."""
    speed: Callable[[bool], Mapping[str, Any]]
    """`motionloom.bench.bench` as plain data, quick or not."""
    progress: Callable[[str], None] = _silent


@dataclass(frozen=True)
class Job:
    """What to measure."""

    weights: str
    tools: Tools
    data: Path | None = None
    quick: bool = False
    device: str = "cpu"
    folder: Path = Path()
    """Where a suite may keep what it has done so far; made by whoever writes there."""


@dataclass(frozen=True)
class Suite:
    """One kind of measurement."""

    name: str
    measures: str
    run: Callable[[Job, Mapping[str, Any]], Report]
    """Called with the job and the settings of its kind of run; resumes from what stands in ``job.folder``."""
    full: Mapping[str, Any]
    """Settings of a run whose numbers are kept."""
    quick: Mapping[str, Any]
    """Settings of a run that only shows that everything works."""
    needs_data: bool = False
    uses_data: bool = True

    def settings(self, quick: bool) -> Mapping[str, Any]:
        """Those of a quick or of a full run."""
        return self.quick if quick else self.full


def command(name: str, job: Job) -> str:
    """The command line that measures a suite again; a set is called SET, since its place differs between machines."""
    weights = job.weights if job.weights in shipped() else Path(job.weights).name
    words = ["motionloom", "evaluate", "all", "--only", name, "--weights", shlex.quote(weights)]
    return " ".join([*words, *(["--data", "SET"] if job.data else []), *(["--quick"] if job.quick else [])])


def _obedience(job: Job, settings: Mapping[str, Any]) -> Report:
    results = obey.run(
        job.tools.generator(False), seeds=settings["seeds"], paraphrases=settings["paraphrases"],
        folder=job.folder, progress=job.tools.progress,
    )  # fmt: skip
    return physical.obedience_report(results, command=command("obedience", job), settings=settings)


def _realism(job: Job, settings: Mapping[str, Any]) -> Report:
    wanted, real, about = physical.realism_orders(job.data, settings["count"])
    if not wanted:
        raise MotionloomError(f"{job.data} has no held-out captioned clips of 2 to 10 s; leave --data out")
    made, fps = {}, 0.0
    for name, finished in ((physical.AS_DRAWN, False), (physical.AS_EXPORTED, True)):
        made[name], fps = realism.run(job.tools.generator(finished), wanted, progress=job.tools.progress)
    said = command("realism", job)
    return physical.realism_report(made, fps, real, command=said, protocol={**settings, **about})


def _speed(job: Job, settings: Mapping[str, Any]) -> Report:
    return physical.speed_report(job.tools.speed(settings["quick"]), command=command("speed", job))


SUITES: tuple[Suite, ...] = (
    Suite("obedience", "20 everyday prompts, each with a physical check", _obedience,
          {"seeds": 10, "paraphrases": True}, {"seeds": 2, "paraphrases": False}, uses_data=False),
    Suite("realism", "skate, penetration, jerk, bones and speeds beside real clips", _realism,
          {"count": 64}, {"count": 16}),
    Suite("speed", "time and memory as ratios within one run", _speed,
          {"quick": False}, {"quick": True}, uses_data=False),
)  # fmt: skip


def chosen(names: Sequence[str], suites: Sequence[Suite] = SUITES) -> list[Suite]:
    """The suites of those names in their own order; all where none is named."""
    known = {suite.name for suite in suites}
    for name in names:
        if name not in known:
            raise MotionloomError(f"there is no suite {name!r}; the suites are {', '.join(sorted(known))}")
    return [suite for suite in suites if not names or suite.name in names]


@dataclass(frozen=True)
class Outcome:
    """What became of one suite."""

    suite: Suite
    report: Report | None
    said: str
    """measured, kept, skipped or failed, and why."""
    failed: bool = field(default=False)


def run_all(
    job: Job, out: Path, suites: Sequence[Suite] = SUITES, *, keep: Path | None = None, again: bool = False
) -> list[Outcome]:
    """Run every suite into ``out/NAME``; one that was finished there with the same settings is not run again.

    ``keep``: also write each report as ``keep/NAME.json``, the form of a release. ``again``: forget what stands there.
    A suite that cannot run is told in its outcome and stops no other. Raises `MotionloomError` if a quick run would
    replace a full one.
    """
    find_weights(job.weights)
    for suite in suites:
        obey.check_report(out / suite.name / "report.json")
        for path in (out / suite.name / "report.json", *([keep / f"{suite.name}.json"] if keep else [])):
            if job.quick and not again and _is_full(path):
                raise MotionloomError(f"{path} holds a full run; name another --out or say --again to replace it")
    outcomes = []
    for suite in suites:
        outcome = _one(suite, job, out / suite.name, again=again)
        if keep and outcome.report:
            obey.write_json(keep / f"{suite.name}.json", reports.encode(outcome.report))
        job.tools.progress(f"{suite.name}: {outcome.said}")
        outcomes.append(outcome)
    return outcomes


def _one(suite: Suite, job: Job, folder: Path, *, again: bool) -> Outcome:
    if suite.needs_data and job.data is None:
        return Outcome(suite, None, "skipped: it needs --data SET, made by 'motionloom data build'")
    settings = suite.settings(job.quick)
    try:
        mark = fingerprint(suite, job)
        if not again and (found := _finished(folder, mark)):
            return Outcome(suite, found, "kept: it was finished before with the same settings")
        parts = folder / f"parts-{mark[:12]}"  # other settings never meet in one folder
        if again and parts.is_dir():
            shutil.rmtree(parts)
        job.tools.progress(f"{suite.name}: {suite.measures}")
        made = suite.run(replace(job, folder=parts), settings)
        if job.quick:
            made = replace(made, protocol={**made.protocol, "quick": True}, notes=(QUICK, *made.notes))
        (folder / "done.json").unlink(missing_ok=True)  # a kill before the next line must not pair it with this report
        reports.write(made, folder)
        obey.write_json(folder / "done.json", {"fingerprint": mark, "settings": dict(settings), "quick": job.quick})
    except MotionloomError as error:
        return Outcome(suite, None, f"failed: {error}", failed=True)
    return Outcome(suite, made, "measured")


def fingerprint(suite: Suite, job: Job) -> str:
    """Changes with the weights, the settings, and the files of the data, where a suite reads data."""
    weights = hashlib.sha256(find_weights(job.weights).read_bytes()).hexdigest()
    said: dict[str, Any] = {"suite": suite.name, "weights": weights, "settings": dict(suite.settings(job.quick))}
    if suite.uses_data and job.data is not None:
        said["data"] = _files(job.data)
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()


def _files(folder: Path) -> str:
    """Names and sizes of the files of a set: a changed set changes it, moving it does not."""
    if not folder.is_dir():
        raise MotionloomError(f"{folder} is no folder of clips; make a set with 'motionloom data build'")
    listed = sorted((str(p.relative_to(folder)), p.stat().st_size) for p in folder.rglob("*") if p.is_file())
    return hashlib.sha256(json.dumps(listed).encode()).hexdigest()


def _finished(folder: Path, mark: str) -> Report | None:
    """The report of a finished run of these settings; anything else, damaged files too, is measured anew."""
    try:
        done = json.loads((folder / "done.json").read_text(encoding="utf-8"))
        if isinstance(done, dict) and done.get("fingerprint") == mark:
            return reports.read(folder / "report.json")
    except (OSError, ValueError, RecursionError):
        pass
    return None


def _is_full(path: Path) -> bool:
    """Whether a report of a run that was not quick stands there."""
    try:
        return path.is_file() and not reports.read(path).protocol.get("quick", False)
    except MotionloomError:
        return False
