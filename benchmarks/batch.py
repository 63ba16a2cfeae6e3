"""What a motion costs in a batch: alone, two shares beside each other, Ray on this machine; and for jobs of many sizes.

    python benchmarks/batch.py > benchmarks/batch.txt            # all of it, at most 20 minutes on two idle cores
    python benchmarks/batch.py --parts bits                      # only: does every way make the same motions?

1. Sampling and body solving alone, in one process and in two beside each other: the most that any way can reach.
2. Every way as its command does it, in processes of their own: motions of 4 s.
3. Cost and memory for jobs of 10 to 10,000 rows: short motions of few steps, so that what is not sampling shows.
4. Where the processor's time of one process goes.
5. The same bits: one row after the other, in shares, on Ray, in another order, with other rows beside them.

The clock of a way begins with its first shard (loading takes the same few seconds however many rows there are, and is
given beside it) and ends when the last one is in the folder. Run it on a machine that does nothing else; figures from
a busy one mean nothing.
"""

import argparse
import json
import os
import random
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

PROMPTS = ("a person walks forward", "a person jumps", "a person waves with the right hand", "a person sits down")
MIXED = (3.0, 4.0, 5.0, 6.0)
WAYS = {
    "one process": [["--workers", "1"]],
    "two processes": [["--workers", "2"]],
    "two shares": [["--workers", "1", "--shard", "0/2"], ["--workers", "1", "--shard", "1/2"]],
    "ray": [["--ray", "--workers", "2"]],
}
PARTS = ("ways", "sizes", "profile", "bits")
CALL = 8
"""Rows of a network call."""
SHORT = 0.5, 8
"""Seconds and steps of the motions of the third part."""
TOLERANCE = 3e-6
"""Metres within which motions are the same."""


@dataclass(frozen=True)
class Run:
    """How one way went."""

    start: float
    """Seconds until the first shard was begun."""
    each: float
    """Seconds per motion from there until the last shard was in the folder."""
    driver: float
    """MB of the process that was started, at most."""
    worker: float
    """MB of the largest process below it, at most."""

    @property
    def rate(self) -> float:
        """Motions a minute."""
        return 60 / self.each


def job(path: Path, rows: int, *lengths: float) -> Path:
    """A job of so many rows: every prompt and length as often as any other."""
    lines = ({"prompt": PROMPTS[i % 4], "seconds": lengths[i // 4 % len(lengths)], "seed": i} for i in range(rows))
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return path


def command(jobs: Path, out: Path, options: list[str]) -> list[str]:
    """`motionloom batch`."""
    return [sys.executable, "-m", "motionloom", "batch", str(jobs), "--out", str(out), *options]


def measure(way: list[list[str]], rows: int, lengths: tuple[float, ...], options: list[str]) -> Run:
    """Make a job one way, and look at its folder and its processes meanwhile."""
    with tempfile.TemporaryDirectory(prefix="motionloom-") as folder:
        jobs, out = job(Path(folder) / "jobs.jsonl", rows, *lengths), Path(folder) / "out"
        began = time.monotonic()
        running = [subprocess.Popen([*command(jobs, out, options), *more], stdout=subprocess.DEVNULL) for more in way]
        drivers, workers = [0.0], [0.0]
        threading.Thread(target=_watch, args=(running, drivers, workers), daemon=True).start()
        first, last, records = 0.0, 0.0, 0
        while any(process.poll() is None for process in running):
            time.sleep(0.02)
            if not first and any(out.glob(".work/*/")):
                first = time.monotonic()
            if first and (there := sum(1 for _ in out.glob("records/[0-9]*.jsonl"))) > records:
                records, last = there, time.monotonic()
        made = sum(1 for _ in out.rglob("*.npz"))
        if any(process.returncode for process in running) or made != rows:
            sys.exit(f"{' '.join(way[0])}: {made} of {rows} motions")
        return Run(first - began, (last - first) / rows, max(drivers), max(workers))


def _watch(running: "list[subprocess.Popen[bytes]]", drivers: list[float], workers: list[float]) -> None:
    """Note the largest resident memory of these processes and of those below them."""
    started = [process.pid for process in running]
    while any(process.poll() is None for process in running):
        for pid in _family(started):
            with suppress(OSError):
                peak = re.search(r"VmHWM:\s+(\d+)", Path(f"/proc/{pid}/status").read_text())
                (drivers if pid in started else workers).append(int(peak[1]) / 1024 if peak else 0.0)
        time.sleep(1)


def _family(pids: list[int]) -> list[int]:
    above = {}
    for place in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            above[int(place.name)] = int((place / "stat").read_text().rsplit(")", 1)[1].split()[1])
    below = list(pids)
    for pid in below:
        below += [other for other, parent in above.items() if parent == pid]
    return below


# Sampling and body solving alone


def pure(rows: int, steps: int, weights: str) -> None:
    """Draw and solve rows of 4 s in this process when a line comes in; say the seconds of it."""
    from motionloom.core.models.networks import set_threads
    from motionloom.core.models.prior import Prior
    from motionloom.tasks.text import finish, frames_in, sample_features

    set_threads(1)
    prior = Prior.load(weights)
    frames = frames_in(4.0, prior.fps)

    def make(seeds: range) -> None:
        prompts = [PROMPTS[seed % 4] for seed in seeds]
        for features in sample_features(prior, prompts, [frames] * len(seeds), seeds=list(seeds), steps=steps):
            finish(prior, features)

    make(range(CALL))
    print("ready", flush=True)
    sys.stdin.readline()
    began = time.perf_counter()
    for at in range(0, rows, CALL):
        make(range(at, min(at + CALL, rows)))
    print(time.perf_counter() - began, flush=True)


def pure_rate(processes: int, rows: int, steps: int, weights: str) -> float:
    """Motions a minute of so many processes beside each other, each with so many rows."""
    own = [sys.executable, __file__, "--pure", str(rows), "--steps", str(steps), "--weights", weights]
    running = [subprocess.Popen(own, stdin=subprocess.PIPE, stdout=subprocess.PIPE) for _ in range(processes)]
    for process in running:
        assert process.stdout is not None
        process.stdout.readline()
    for process in running:
        assert process.stdin is not None
        process.stdin.write(b"go\n")
        process.stdin.flush()
    seconds = [float(process.communicate()[0]) for process in running]
    return sum(60 * rows / one for one in seconds)


def profile(rows: int, steps: int, weights: str) -> None:
    """Print the processor seconds per motion of one process, by what it does."""
    from motionloom.bulk import maker as bulk
    from motionloom.bulk.maker import Maker, Options
    from motionloom.bulk.row import parse
    from motionloom.bulk.shard import entry_of
    from motionloom.bulk.writers import writer
    from motionloom.core.models.networks import set_threads
    from motionloom.tasks import text

    set_threads(1)
    spent: dict[str, float] = {}

    def timed(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def run(*given: Any, **named: Any) -> Any:
            began = time.process_time()
            try:
                return function(*given, **named)
            finally:
                spent[name] = spent.get(name, 0.0) + time.process_time() - began

        return run

    maker = Maker(Options(weights=weights, steps=steps), folder=Path())
    with tempfile.TemporaryDirectory(prefix="motionloom-") as folder:
        lines = job(Path(folder) / "jobs.jsonl", rows, 4.0).read_bytes().splitlines()
        list(maker.make([maker.sources.ask(parse(lines[0]))]))  # the first call of a network is slower
        parts = (("sampling", text, "sample_features"), ("body", text, "finish"), ("measures", bulk, "measure"))
        for name, module, what in parts:
            setattr(module, what, timed(name, getattr(module, what)))
        files = {kind: writer(kind, Path(folder) / kind) for kind in ("npz", "bvh", "glb", "webdataset")}
        ask = timed("rows", lambda line: maker.sources.ask(parse(line)))
        for one, made in maker.make([ask(line) for line in lines]):
            assert not isinstance(made, str), made
            for kind, file in files.items():
                timed(f"files, {kind}", file.add)(made, entry_of(one, made))
    whole = sum(seconds for name, seconds in spent.items() if not name.startswith("files")) + spent["files, npz"]
    print(f"\nprocessor time of one process, {rows} motions of 4 s, {steps} steps; shares with npz files")
    for name, seconds in spent.items():
        print(f"{name:<18} {1000 * seconds / rows:8.2f} ms a motion {100 * seconds / whole:6.1f} %")


# The same bits


def bits(rows: int, ways: list[str], options: list[str]) -> bool:
    """Print how far the motions of every way are apart from those made one by one; whether all are the same."""
    from motionloom import batch, read_batch
    from motionloom.bulk.maker import TOGETHER, Options

    known = dict(zip(options[::2], options[1::2], strict=True))
    print(
        f"\nthe same bits: {rows} rows of 1 to 2.5 s, every eighth of two people; metres from each row made alone "
        f"(at most {TOLERANCE:g})"
    )
    with tempfile.TemporaryDirectory(prefix="motionloom-") as name:
        folder = Path(name)
        lines = job(folder / "jobs.jsonl", rows, 1.0, 1.5, 2.0, 2.5).read_text().splitlines()
        if known["--weights"] == "default":  # others have no block for two people
            lines[3::8] = [json.dumps({**json.loads(line), "task": "duet"}) for line in lines[3::8]]
        (folder / "jobs.jsonl").write_text("\n".join(lines) + "\n")
        random.Random(0).shuffle(shuffled := list(lines))
        (folder / "shuffled.jsonl").write_text("\n".join(shuffled) + "\n")
        more = {key.lstrip("-"): value for key, value in known.items()}
        here = Options(weights=more["weights"], steps=int(more["steps"]))
        alone = {line: next(iter(batch([json.loads(line)], options=here))).people for line in lines}
        exact = {(row["prompt"], row["seed"]): people for line, people in alone.items() for row in [json.loads(line)]}
        kinds = [(way, "jobs.jsonl", WAYS[way]) for way in ways]
        kinds += [("shuffled", "shuffled.jsonl", WAYS["one process"])]
        good = True
        for number, (what, jobs, way) in enumerate(kinds):
            out = folder / f"out{number}"
            for words in way:
                subprocess.run([*command(folder / jobs, out, options), *words], check=True, stdout=subprocess.DEVNULL)
            found = {(one.about["text"], one.about["seed"]): one.people for one in read_batch(out)}
            assert found.keys() == exact.keys()
            apart = max(_apart(found[key], exact[key]) for key in exact)
            good &= apart <= TOLERANCE
            print(f"{what:<14} {apart:.1e}", flush=True)
        for together in (4, 5, 8, 16):
            with mock.patch.dict(TOGETHER, cpu=together):
                found = {
                    (one.about["text"], one.about["seed"]): one.people for one in batch(rows_of(lines), options=here)
                }
            apart = max(_apart(found[key], exact[key]) for key in exact)
            good &= apart <= TOLERANCE
            print(f"{f'calls of {together}':<14} {apart:.1e}", flush=True)
    return good


def rows_of(lines: list[str]) -> list[dict[str, Any]]:
    """Rows of JSON lines."""
    return [json.loads(line) for line in lines]


def _apart(a: Any, b: Any) -> float:
    return max(float(np.abs(one.positions() - other.positions()).max()) for one, other in zip(a, b, strict=True))


# All of it


def by_way(ways: list[str], rows: int, options: list[str], arguments: argparse.Namespace) -> None:
    """The first two parts."""
    most = {n: pure_rate(n, max(rows // n, CALL), arguments.steps, arguments.weights) for n in (1, 2)}
    print(
        f"\nmotions of 4 s, {arguments.steps} steps, {rows} of them; sampling and body solving alone: "
        f"{most[1]:.1f} a minute in one process, {most[2]:.1f} in two"
    )
    print(
        f"{'way':<16} {'start s':>8} {'s each':>8} {'a minute':>9} {'of alone':>9} {'driver MB':>10} {'worker MB':>10}"
    )
    rates = {}
    for way, lengths in [*((way, (4.0,)) for way in ways), ("one process", MIXED)]:
        found = measure(WAYS[way], rows, lengths, options)
        name = way if lengths == (4.0,) else "mixed lengths"
        rates[name] = found.rate
        share = f"{found.rate / most[1 if way == 'one process' else 2]:.0%}" if lengths == (4.0,) else "-"
        print(
            f"{name:<16} {found.start:8.1f} {found.each:8.3f} {found.rate:9.1f} {share:>9} {found.driver:10.0f} "
            f"{found.worker:10.0f}",
            flush=True,
        )
    for way in ways[1:]:
        print(f"{way}: {rates[way] / rates['one process']:.2f} times one process (the aim is 1.7)")


def by_size(sizes: list[int], weights: str, limit: float) -> None:
    """The third part."""
    seconds, steps = SHORT
    print(f"\ntwo processes, short motions: {seconds:g} s, {steps} steps")
    print(f"{'rows':>6} {'start s':>8} {'ms each':>8} {'of 1,000':>9} {'driver MB':>10} {'worker MB':>10}")
    options, found = ["--weights", weights, "--steps", str(steps)], {}
    for rows in sizes:
        if found and rows * list(found.values())[-1].each > limit:
            print(f"{rows:>6} rows would take more than {limit:.0f} s here, and are left out")
            continue
        found[rows] = measure(WAYS["two processes"], rows, (seconds,), options)
    for rows, one in found.items():
        share = one.each / found.get(1000, one).each
        print(f"{rows:>6} {one.start:8.1f} {1000 * one.each:8.1f} {share:9.0%} {one.driver:10.0f} {one.worker:10.0f}")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=192, help="motions of 4 s for every way (default 192)")
    parser.add_argument("--sizes", type=int, nargs="+", default=[10, 100, 1000, 10_000], help="rows of short motions")
    parser.add_argument("--limit", type=float, default=480, help="seconds that one job may take (default 480)")
    parser.add_argument("--ways", nargs="+", choices=WAYS, help="default: all, without Ray where it is not installed")
    parser.add_argument("--steps", type=int, default=24)
    parser.add_argument("--weights", default="default")
    parser.add_argument("--profile", type=int, default=100, metavar="ROWS", help="motions that are profiled")
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS, help="default: all of them")
    parser.add_argument("--pure", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.pure:
        pure(arguments.pure, arguments.steps, arguments.weights)
        return
    ways = arguments.ways or [way for way in WAYS if way != "ray" or find_spec("ray")]
    options = ["--weights", arguments.weights, "--steps", str(arguments.steps)]
    began = time.monotonic()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} at the start", flush=True)
    if "ways" in arguments.parts:
        by_way(ways, arguments.rows, options, arguments)
    if "sizes" in arguments.parts:
        by_size(arguments.sizes, arguments.weights, arguments.limit)
    if "profile" in arguments.parts:
        profile(arguments.profile, arguments.steps, arguments.weights)
    good = "bits" not in arguments.parts or bits(32, ways, options)
    print(f"\n{(time.monotonic() - began) / 60:.1f} minutes in all")
    sys.exit(0 if good else "motions differ between the ways of making them")


if __name__ == "__main__":
    main()
