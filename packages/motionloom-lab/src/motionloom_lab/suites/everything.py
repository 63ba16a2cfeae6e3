"""The run over all suites: one after the other, each kept when it is done, so that a run that was killed goes on."""

import hashlib
import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import plain_json
from motionloom.core.models.container import weights_digest
from motionloom.core.models.prior import find_weights
from motionloom.core.reading import read_bytes
from motionloom_lab.report import files
from motionloom_lab.report import report as reports
from motionloom_lab.report.report import Report
from motionloom_lab.report.results import FILES
from motionloom_lab.suites.harness import digest, evaluator_file, weight_marks
from motionloom_lab.suites.items import NoData
from motionloom_lab.suites.registry import SUITES, Job, Suite

QUICK = "Quick run: few seeds and clips, to see that everything works; these are no numbers to quote."

State = Literal["measured", "kept", "skipped", "failed"]
"""Measured now or before with the same settings; nothing there to measure; or something went wrong."""


@dataclass(frozen=True)
class Outcome:
    """What became of one suite."""

    suite: Suite
    report: Report | None
    state: State
    why: str = ""

    @property
    def summary(self) -> str:
        """The state, and why."""
        return f"{self.state}: {self.why}" if self.why else self.state

    @property
    def failed(self) -> bool:
        """Whether something went wrong; nothing did where there was nothing to measure."""
        return self.state == "failed"


def run_all(
    job: Job, out: Path, suites: Sequence[Suite] = SUITES, *, keep: Path | None = None, again: bool = False
) -> list[Outcome]:
    """Run every suite into ``out/NAME``; one that was finished there with the same settings is not run again.

    ``keep``: also write each report as ``keep/NAME.json``, the form of a release. ``again``: forget what is there.
    A suite whose kind of data is not there is skipped, and one that cannot run has failed; both are reported in their
    outcomes and stop no other. Raises `MotionloomError` if a quick run would
    replace a full one.
    """
    find_weights(job.weights)
    for suite in suites:
        files.check_report(out / suite.name / "report.json")
        for path in (out / suite.name / "report.json", *([keep / f"{suite.name}.json"] if keep else [])):
            if job.quick and not again and _is_full(path):
                raise MotionloomError(f"{path} holds a full run; name another --out or say --again to replace it")
    outcomes = []
    for suite in suites:
        outcome = _one(suite, job, out / suite.name, again=again)
        if keep and outcome.report:
            files.write_json(keep / f"{suite.name}.json", reports.encode(outcome.report))
        job.tools.progress(f"{suite.name}: {outcome.summary}")
        outcomes.append(outcome)
    return outcomes


def _one(suite: Suite, job: Job, folder: Path, *, again: bool) -> Outcome:
    if suite.data == "needed" and job.data is None:
        return Outcome(suite, None, "skipped", "it needs --data SET, made by 'motionloom data build'")
    settings = suite.settings(job.quick)
    try:
        mark = fingerprint(suite, job)
        if not again and (report := _finished(folder, mark)):
            return Outcome(suite, report, "kept", "it was finished before with the same settings")
        if job.data is not None:
            suite.needs(job.data)
        parts = folder / f"parts-{mark[:12]}"  # other settings never meet in one folder
        if again and parts.is_dir():
            shutil.rmtree(parts)
        job.tools.progress(f"{suite.name}: {suite.measures}")
        report = suite.run(replace(job, folder=parts), settings)
        extra: dict[str, Any] = {}
        if suite.judged:
            judge = evaluator_file(job.evaluator)  # trained anew under the same name it is another measure
            extra["evaluator file"] = digest(judge)[:12] if judge else "unknown"
        if job.quick:
            extra["quick"] = True
            report = replace(report, notes=(QUICK, *report.notes))
        extra[FILES] = weight_marks(suite.weights(job))
        report = replace(report, protocol={**report.protocol, **extra})
        (folder / "done.json").unlink(missing_ok=True)  # a kill before the next line must not pair it with this report
        reports.write(report, folder)
        files.write_json(folder / "done.json", {"fingerprint": mark, "settings": dict(settings), "quick": job.quick})
    except NoData as nothing:
        return Outcome(suite, None, "skipped", str(nothing))
    except MotionloomError as error:
        return Outcome(suite, None, "failed", str(error))
    return Outcome(suite, report, "measured")


def fingerprint(suite: Suite, job: Job) -> str:
    """Changes with the version, the weights, the settings, and the files that a suite reads."""
    weights = weights_digest(find_weights(job.weights))
    about: dict[str, Any] = {
        "version": version("motionloom"),
        "suite": suite.name,
        "weights": weights,
        "settings": dict(suite.settings(job.quick)),
    }
    about["files"] = [weights_digest(path) for path in suite.files(job)]
    if suite.data and job.data is not None:
        about["data"] = _files(job.data)
    return hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()


def _files(folder: Path) -> str:
    """Names and sizes of the files of a set: a changed set changes it, moving it does not."""
    if not folder.is_dir():
        raise MotionloomError(f"{folder} is no folder of clips; make a set with 'motionloom data build'")
    sizes = sorted((str(p.relative_to(folder)), p.stat().st_size) for p in folder.rglob("*") if p.is_file())
    return hashlib.sha256(json.dumps(sizes).encode()).hexdigest()


def _finished(folder: Path, mark: str) -> Report | None:
    """The report of a finished run of these settings; anything else, damaged files too, is measured anew."""
    try:
        record = plain_json(read_bytes(folder / "done.json", max_bytes=1 << 20))
        if isinstance(record, dict) and record.get("fingerprint") == mark:
            return reports.read(folder / "report.json")
    except (OSError, ValueError, RecursionError):
        pass
    return None


def _is_full(path: Path) -> bool:
    """Whether a report of a run that was not quick is there."""
    try:
        return path.is_file() and not reports.read(path).protocol.get("quick", False)
    except MotionloomError:
        return False
