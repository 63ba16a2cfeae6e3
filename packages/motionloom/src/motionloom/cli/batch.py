"""`motionloom batch`: a file of jobs to a folder of motions."""

import json
import sys
import time
from argparse import Namespace
from collections import Counter
from contextlib import ExitStack
from dataclasses import fields
from importlib import import_module
from pathlib import Path

from motionloom.bulk.batch import Where, array_task, check_jobs, check_options, processes, run
from motionloom.bulk.estimate import estimate
from motionloom.bulk.jobs import Jobs
from motionloom.bulk.maker import Options
from motionloom.bulk.measures import Filter
from motionloom.bulk.shard import Report
from motionloom.cli.terminal import escaping, note, say, unescaped
from motionloom.cli.writing import fail
from motionloom.core.models.networks import set_threads

JUDGE = "motionloom_lab.metrics.obedience:obeys"
LISTED = 10
"""Failed rows listed at the end; the records list all."""
PAUSE = 10.0
"""Seconds between two lines of progress where there is no terminal."""
SHORTEST = 3.0
"""Seconds over which a rate is measured at least: rows come several at a time."""


def run_batch(arguments: Namespace) -> int:
    """``motionloom batch JOBS --out FOLDER``; exit code 0 where every row was made or dropped, else 1.

    ``--verify FOLDER``: 2 where something is damaged.
    """
    if arguments.verify is not None:
        return _verify(arguments)
    if arguments.out is None:
        fail("name the folder of the batch with --out")
    options, where, jobs = _options(arguments), _where(arguments), _jobs(arguments)
    check_options(options)
    robot = options.on_robot()
    for remark in () if robot is None else robot.robot.remarks():
        note(remark)
    rows = jobs.count()
    check_jobs(jobs, rows)
    if arguments.dry_run:
        _estimate(arguments, jobs, options, where)
        return 0
    return _make(arguments, jobs, options, where=where, rows=rows)


def _verify(arguments: Namespace) -> int:
    from motionloom.bulk.verify import verify

    if any(one is not None for one in (arguments.jobs, arguments.prompts, arguments.recordings, arguments.out)):
        fail("--verify FOLDER looks at a batch and makes nothing; give it without jobs and --out")
    report = verify(arguments.verify)
    if arguments.json:
        print(json.dumps(vars(report) | {"damaged": [str(path) for path in report.damaged]}, indent=1))
    else:
        for path in report.damaged:
            print(f"{path} is {'not as it was written' if path.exists() else 'lost'}")
        if not report.damaged:
            print(f"{arguments.verify} is as it was written: {report.shards:,} of {report.of:,} shards")
        if report.sizes_only:
            print(f"of {report.sizes_only:,} older shards there are no hashes, and only sizes were compared")
    if report.damaged:
        count = len(report.damaged)
        fail(
            f"{count:,} {'file' if count == 1 else 'files'} of {arguments.verify} {'is' if count == 1 else 'are'} "
            "damaged; run the command that made the batch again: it generates the damaged files again, and no others"
        )
    return 0


def _jobs(arguments: Namespace) -> Jobs:
    sources = [one for one in (arguments.jobs, arguments.prompts, arguments.recordings) if one is not None]
    if len(sources) != 1:
        fail("give one of a file of jobs, --prompts with a file of prompts, and --recordings with a folder of motions")
    if arguments.recordings is not None:
        return Jobs.of_recordings(arguments.recordings)
    if arguments.prompts is not None:
        return Jobs.of_prompts(arguments.prompts, variants=arguments.variants or 1, seed=arguments.seed)
    if arguments.variants is not None:
        fail("--variants goes with --prompts; rows of a file of jobs have their own seeds")
    return Jobs.of(arguments.jobs)


def _options(arguments: Namespace) -> Options:
    obeys = arguments.filter is not None and "obeys" in Filter(arguments.filter).names
    if obeys:
        import_module(JUDGE.partition(":")[0])  # before any work: without the laboratory nobody judges
    named = {one.name for one in fields(Options)} - {"loop"}
    return Options(
        **{name: value for name, value in vars(arguments).items() if name in named},
        adapters=list(arguments.adapter),
        raw=not arguments.foot_lock,
        loop=arguments.blend if arguments.loop else None,
        unit=arguments.out_unit,
        judge=JUDGE if obeys else None,
    )


def _where(arguments: Namespace) -> Where:
    if arguments.workers is not None and not 1 <= arguments.workers <= 10_000:
        fail(f"--workers must be 1 to 10000; got {arguments.workers}")
    if arguments.ray is not None:
        if arguments.shard is not None:
            fail("--shard shares the work out without Ray; give one of --shard and --ray")
        return Where(arguments.workers, None, arguments.ray)
    if arguments.shard is None:
        return Where(arguments.workers, array_task())
    first, slash, count = arguments.shard.partition("/")
    if not (slash and first.isdecimal() and count.isdecimal() and int(first) < int(count)):
        fail(f"--shard must be i/n with i from 0 to n - 1, such as 0/4; got {arguments.shard!r}")
    return Where(arguments.workers, (int(first), int(count)))


def _estimate(arguments: Namespace, jobs: Jobs, options: Options, where: Where) -> None:
    set_threads(1)
    cost = estimate(jobs, options, workers=(where.workers or processes(options)) * (where.shard or (0, 1))[1])
    if arguments.json:
        about = vars(cost) | {"hours": cost.hours, "gigabytes": cost.gigabytes}
        print(json.dumps(about, indent=1))
        return
    on = "processes" if options.device == "cuda" else "cores"
    print(
        f"{cost.rows:,} motions: {_time(cost.hours * 3600)} on {cost.workers} {on}, {cost.gigabytes:.3g} GB "
        f"({cost.seconds_each:.2f} s and {cost.bytes_each / 1000:.0f} kB each, by {cost.sampled} of the rows)"
    )
    if cost.usable < 1:
        print(f"{cost.usable:.0%} of the rows looked at would be kept")


def _make(arguments: Namespace, jobs: Jobs, options: Options, *, where: Where, rows: int) -> int:
    counts: Counter[str] = Counter()
    problems: list[str] = []
    attempts = 0
    with _Progress(rows if where.shard is None else -(-rows // where.shard[1])) as progress:
        reports = run(
            jobs, arguments.out, options=options, where=where, moved=progress.moved, rows=rows, force=arguments.force
        )
        for report in reports:
            counts.update(report.counts)
            attempts += report.new_rows
            problems += report.problems[: LISTED - len(problems)]
            progress.finish_shard(report)
    for problem in problems:
        say(problem)
    if arguments.json:
        print(json.dumps({"folder": str(arguments.out), "tried": attempts, **counts}, indent=1))
    else:
        _say(arguments.out, counts, attempts)
    return 1 if counts["failed"] else 0


def _say(out: Path, counts: dict[str, int], attempts: int) -> None:
    phrases = [f"{counts['made']:,} motion{' is' if counts['made'] == 1 else 's are'} in {out}"]
    if counts["dropped"]:
        phrases.append(f"{counts['dropped']:,} were dropped by the filter")
    if counts["repeated"]:
        phrases.append(f"{counts['repeated']:,} {'row repeats' if counts['repeated'] == 1 else 'rows repeat'} another")
    if counts["failed"]:
        phrases.append(
            f"{counts['failed']:,} failed (rows are counted from 0; correct them and run the same command again)"
        )
    print(("nothing was left to make: " if counts["made"] and not attempts else "") + ", ".join(phrases))


class _Progress:
    """How far a batch is, at which rate, and how long it will take: a bar on a terminal, else a line now and then."""

    def __init__(self, rows: int) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        self.rows, self.there, self.count, self.clock = rows, 0, 0, time.monotonic
        self.began = self.reported = self.clock()
        self.since = 0  # rows of before the clock of the rate began: a worker first loads its weights
        screen = Console(file=unescaped(sys.stderr))
        columns = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"), TimeRemainingColumn())
        self.bar = Progress(*columns, console=screen, transient=True, disable=not screen.is_terminal)
        self.quiet = not screen.is_terminal
        self.task = self.bar.add_task("batch", total=rows, rate="")
        self.stack = ExitStack()

    def __enter__(self) -> "_Progress":
        self.stack.enter_context(self.bar)
        self.stack.enter_context(escaping())  # the bar has streams of its own in between
        return self

    def __exit__(self, *_: object) -> None:
        self.stack.close()

    def moved(self, rows: int) -> None:
        """Count so many rows more."""
        if not self.count:
            self.began, self.since = self.clock(), rows
        self.count += rows
        self._show()

    def finish_shard(self, report: Report) -> None:
        """A shard is whole; its rows that are not new were there before."""
        self.there += report.rows - report.new_rows
        self._show()

    def _show(self) -> None:
        now = self.clock()
        known = now - self.began > SHORTEST and self.count > self.since
        rate = (self.count - self.since) / (now - self.began) if known else 0.0
        rows = min(self.there + self.count, self.rows)
        self.bar.update(self.task, completed=rows, rate=f"{60 * rate:.0f} a minute" if known else "")
        if self.quiet and now - self.reported > PAUSE and known:
            self.reported = now
            left = _time((self.rows - rows) / rate)
            print(f"{rows:,} of {self.rows:,} rows, {60 * rate:.0f} a minute, {left} left", file=sys.stderr)


def _time(seconds: float) -> str:
    """A duration in the unit that suits it."""
    for size, unit in ((86_400, "days"), (3600, "hours"), (60, "minutes")):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.0f} seconds"
