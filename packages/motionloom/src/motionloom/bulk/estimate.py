"""How long a batch will take and how large it will be, from a few of its rows."""

import random
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from motionloom.bulk.jobs import Jobs
from motionloom.bulk.maker import Made, Maker, Options
from motionloom.bulk.measures import Filter
from motionloom.bulk.row import Order, parse
from motionloom.bulk.shard import entry_of
from motionloom.bulk.writers import sizes, writer
from motionloom.core.errors import MotionloomError

SAMPLE = 16
"""Rows that are looked at."""


@dataclass(frozen=True)
class Estimate:
    """What a batch will be, judged by a sample of its rows."""

    rows: int
    sampled: int
    usable: float
    """Share of the sampled rows that can be generated and pass the filter."""
    seconds_each: float
    """Of one core for one row."""
    bytes_each: float
    """Of the folder for one row that is kept."""
    workers: int

    @property
    def hours(self) -> float:
        """With all workers at work."""
        return self.rows * self.seconds_each / self.workers / 3600

    @property
    def gigabytes(self) -> float:
        """Of the folder, rows without a motion not counted."""
        return self.rows * self.usable * self.bytes_each / 1e9


def estimate(jobs: Jobs, options: Options, *, workers: int) -> Estimate:
    """Generate a random sample of the rows once in this process; nothing is kept of it.

    One pass through the job counts its rows and draws the sample. The first call of a network is not counted.
    """
    rows, chosen = _sampled(jobs, SAMPLE)
    maker = Maker(options, folder=jobs.folder)
    orders: list[Order] = []
    problems: list[MotionloomError] = []
    for raw in chosen:
        try:
            orders.append(maker.sources.ask(parse(raw)))
        except MotionloomError as error:
            problems.append(error)
    if not orders:
        raise MotionloomError(f"none of {len(chosen)} rows looked at can be made; see: {problems[0]}")
    list(maker.make(orders[:1]))
    passes = Filter(options.filter) if options.filter else None
    with tempfile.TemporaryDirectory(prefix="motionloom-") as folder:
        began, count = time.perf_counter(), 0
        file = writer(options.format, Path(folder) / "data")
        unique = {one.id: one for one in orders}
        for one, take in maker.make(list(unique.values())):
            if isinstance(take, Made) and take.passes(passes):
                file.add(take, entry_of(one, take))
                count += 1
        file.close()
        seconds, size = time.perf_counter() - began, sizes(Path(folder) / "data")["bytes"]
    usable = count / len(unique) * len(orders) / len(chosen)
    return Estimate(rows, len(chosen), usable, seconds / len(unique), size / max(count, 1), workers)


def _sampled(jobs: Jobs, count: int) -> tuple[int, Sequence[bytes]]:
    """How many rows there are, and a uniform sample of them (Vitter 1985, algorithm R), the same every time."""
    dice, chosen, rows = random.Random(0), [], 0
    for raw in jobs.read():
        rows += 1
        if len(chosen) < count:
            chosen.append(raw)
        elif (place := dice.randrange(rows)) < count:
            chosen[place] = raw
    return rows, chosen
