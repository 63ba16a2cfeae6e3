"""Every suite the project has, as ``suites.toml`` lists them: a name, and a function from a job to a report.

A further suite is one more table there and a function in `lab.suites.measures`.
"""

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from motionloom.core.errors import MotionloomError
from motionloom.core.models.prior import Prior, find_weights, shipped
from motionloom.core.reading import read_table
from motionloom_lab.report.report import Report
from motionloom_lab.suites import items, measures
from motionloom_lab.suites.harness import Generate, Run, evaluator_file
from motionloom_train.data.progress import Say, silent

HERE = Path(__file__).parent
Options = Mapping[str, Any]
"""Options that were given, by name; those of a suite are in ``options.toml``."""


@dataclass(frozen=True)
class Tools:
    """What a suite cannot make itself: the command line hands it in, a test hands in fakes."""

    generator: Callable[[bool], Generate]
    """Motions of the weights under test, as sampled (False) or as exported (True)."""
    prior: Callable[[], Prior]
    """The weights under test, loaded once."""
    speed: Callable[[bool], Mapping[str, Any]]
    """`motionloom_lab.bench.bench` as plain data, quick or not."""
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
    folder: Path | None = None
    """Where a suite may keep its results so far; created on the first write."""
    command: str = ""
    """What was typed; empty for a suite of `motionloom evaluate all`."""

    def run(self, suite: str, weights: str | None = None) -> Run:
        """For a suite of that name; ``weights`` instead of the job's."""
        return Run(
            weights or self.weights,
            self.data,
            self.evaluator,
            self.folder,
            self.device,
            self.command or command(suite, self),
            self.tools.progress,
        )


@dataclass(frozen=True)
class Suite:
    """One kind of measurement."""

    name: str
    measures: str
    run: Callable[[Job, Options], Report]
    """Called with the job and the options of its kind of run; resumes from what is in ``job.folder``."""
    full: Options
    """Options of a run whose numbers are kept."""
    quick: Options
    """Options of a run that only shows that everything works."""
    data: Literal["needed", "used", ""] = ""
    """Whether it cannot do without a set, compares with one where there is one, or reads none."""
    files: Callable[[Job], Sequence[Path]] = lambda job: ()
    """Further files whose content changes the numbers, the weights under test aside."""
    needs: Callable[[Path], None] = lambda data: None
    """Raises `items.NoData` where the data have nothing of the kind it measures."""
    prior: bool = True
    """Whether the job's weights are measured; else only `files` are."""
    judged: bool = False
    """Whether the evaluator's file changes the numbers."""

    def weights(self, job: Job) -> list[Path]:
        """The weight files that the numbers are of; real motion that ships beside a suite is none."""
        files = [path for path in self.files(job) if path.suffix == ".safetensors" and path.parent != HERE]
        return [*([find_weights(job.weights)] if self.prior else []), *files]

    def settings(self, quick: bool) -> Options:
        """The options of a quick or of a full run."""
        return self.quick if quick else self.full


def command(name: str, job: Job) -> str:
    """The command line that measures a suite again; a set is called SET, since its place differs between machines."""
    weights = job.weights if job.weights in shipped() else Path(job.weights).name
    words = ["motionloom", "evaluate", "all", "--only", name, "--weights", weights]
    words += ["--data", "SET"] if job.data else []
    words += ["--evaluator", Path(job.evaluator).name] if job.evaluator != "own" else []
    return shlex.join([*words, *(["--quick"] if job.quick else [])])


def _files(kinds: Sequence[str]) -> Callable[[Job], Sequence[Path]]:
    """The files of some kinds, as far as they are there."""

    def find(job: Job) -> list[Path]:
        from motionloom.core.models.adapter import adapters
        from motionloom.core.models.pair import blocks
        from motionloom.core.models.predictor import shipped_predictors
        from motionloom_lab.suites import real_seams, text_reference

        every: dict[str, Callable[[], Sequence[Path | None]]] = {
            "judge": lambda: [evaluator_file(job.evaluator), text_reference.shipped()],
            "seams": lambda: [real_seams.shipped_file()],
            "adapters": lambda: [*adapters().values()],
            "predictors": lambda: [*shipped_predictors().values()],
            "blocks": lambda: [*blocks().values()],
        }
        return [path for kind in kinds for path in every[kind]() if path and path.is_file()]

    return find


def _suite(name: str, row: Options) -> Suite:
    files, kind = row.get("files", ()), row.get("needs")
    return Suite(
        name,
        row["measures"],
        getattr(measures, name.replace("-", "_")),
        row["full"],
        row["quick"],
        row.get("data", ""),
        _files(files),
        getattr(items, f"need_{kind}") if kind else lambda data: None,
        row.get("prior", True),
        "judge" in files and name != "evaluator",
    )


SUITES: tuple[Suite, ...] = tuple(
    _suite(name, row) for name, row in read_table("motionloom_lab.suites", "suites.toml").items()
)


def chosen(names: Sequence[str], suites: Sequence[Suite] = SUITES) -> list[Suite]:
    """The suites of those names in their own order; all where none is named."""
    known = {suite.name for suite in suites}
    for name in names:
        if name not in known:
            raise MotionloomError(f"there is no suite {name!r}; the suites are {', '.join(sorted(known))}")
    return [suite for suite in suites if not names or suite.name in names]
