"""What a motion costs in a batch: alone, two shares beside each other, Ray on this machine; for jobs of many sizes.

    python benchmarks/batch.py --rows 10 100 1000 10000 --json benchmarks/batch.json > benchmarks/batch.txt

Every way runs as its command does, in processes of their own. The clock of a way begins when the first motion is made
(loading takes the same few seconds however many rows there are, and is given beside it), and its motions are counted
from there. `--profile` says where the time of one process goes: sampling, body, measures, files. Run it on a machine
that does nothing else; figures from a busy one mean nothing.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

PROMPTS = ("a person walks forward", "a person jumps", "a person waves with the right hand", "a person sits down")
LENGTHS = (3.0, 4.0, 5.0, 6.0)
WAYS = {
    "one process": [["--workers", "1"]],
    "alone": [["--workers", "2"]],
    "two shares": [["--workers", "1", "--shard", "0/2"], ["--workers", "1", "--shard", "1/2"]],
    "ray": [["--ray", "--workers", "2"]],
}


def job(path: Path, rows: int) -> Path:
    """A job of so many rows, of 4.5 s on average."""
    lines = (
        {"prompt": PROMPTS[i % 4], "seconds": LENGTHS[i // 4 % 4], "seed": i}  # every pair as often
        for i in range(rows)
    )
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return path


def count(out: Path) -> int:
    """Rows whose motions are in the folder or being put there."""
    return sum(1 for _ in out.rglob("*.npz"))


def measure(way: list[list[str]], rows: int, steps: int) -> dict[str, float]:
    """Seconds until the first motion, seconds per motion from there, and the largest process' memory in MB."""
    with tempfile.TemporaryDirectory(prefix="motionloom-") as folder:
        jobs, out = job(Path(folder) / "jobs.jsonl", rows), Path(folder) / "out"
        command = [sys.executable, "-m", "motionloom", "batch", str(jobs), "--out", str(out), "--steps", str(steps)]
        began = time.monotonic()
        running = [subprocess.Popen([*command, *more], stdout=subprocess.DEVNULL) for more in way]
        first, there, peaks = 0.0, 0, [0.0]
        watcher = threading.Thread(target=_watch, args=(running, peaks), daemon=True)
        watcher.start()
        while any(process.poll() is None for process in running):
            time.sleep(0.05)
            if not first and (there := count(out)):
                first = time.monotonic()
        ended = time.monotonic()
        if any(process.returncode for process in running) or count(out) != rows:
            sys.exit(f"{' '.join(way[0])}: {count(out)} of {rows} motions")
        each = (ended - first) / max(rows - there, 1)
        return {"start": first - began, "each": each, "whole": (ended - began) / rows, "memory": max(peaks)}


def _watch(running: "list[subprocess.Popen[bytes]]", peaks: list[float]) -> None:
    """Note the largest resident memory of any process below these."""
    while any(process.poll() is None for process in running):
        for place in Path("/proc").glob("[0-9]*"):
            try:
                if b"motionloom" in (place / "cmdline").read_bytes():
                    peak = re.search(r"VmHWM:\s+(\d+)", (place / "status").read_text())
                    peaks.append(int(peak[1]) / 1024 if peak else 0.0)
            except OSError:
                continue
        time.sleep(1)


def profile(rows: int) -> dict[str, float]:
    """Processor seconds per motion of one process, by what it does."""
    import torch

    from motionloom.bulk import maker as module
    from motionloom.bulk.maker import Maker, Options
    from motionloom.bulk.row import parse
    from motionloom.bulk.shard import told_of
    from motionloom.bulk.writers import Files

    torch.set_num_threads(1)
    spent: dict[str, float] = {}

    def timed(name: str, function):
        def run(*given, **named):
            began = time.process_time()
            try:
                return function(*given, **named)
            finally:
                spent[name] = spent.get(name, 0.0) + time.process_time() - began

        return run

    maker = Maker(Options(), folder=Path())
    with tempfile.TemporaryDirectory(prefix="motionloom-") as folder:
        lines = job(Path(folder) / "jobs.jsonl", rows).read_bytes().splitlines()
        asked = [maker.sources.ask(parse(line)) for line in lines]
        list(maker.make(asked[:1]))  # the first call of a network is slower
        for name, what in (("sampling", "draw_group"), ("body", "finish"), ("measures", "measure")):
            setattr(module, what, timed(name, getattr(module, what)))
        files = Files(Path(folder) / "data", ".npz")
        add = timed("files", files.add)
        began = time.process_time()
        for one, made in maker.make(asked):
            assert not isinstance(made, str), made
            add(made.motion, told_of(one, made))
        whole = time.process_time() - began
    return {**{name: seconds / rows for name, seconds in spent.items()}, "all": whole / rows}


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, nargs="+", default=[10, 100, 1000, 10_000])
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=list(WAYS))
    parser.add_argument("--steps", type=int, default=24)
    parser.add_argument("--profile", type=int, metavar="ROWS", help="only say where the time of one process goes")
    parser.add_argument("--json", type=Path, metavar="FILE", help="keep the numbers")
    arguments = parser.parse_args()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} at the start")
    if arguments.profile:
        found = profile(arguments.profile)
        for name, seconds in found.items():
            print(f"{name:<10} {seconds:8.4f} s a motion {100 * seconds / found['all']:6.1f} %")
        return
    table: dict[str, dict[str, dict[str, float]]] = {}
    print(f"{'way':<12} {'rows':>6} {'start s':>8} {'s each':>8} {'a minute':>9} {'s each, whole':>14} {'MB':>6}")
    for way in arguments.ways:
        for rows in arguments.rows:
            found = measure(WAYS[way], rows, arguments.steps)
            table.setdefault(way, {})[str(rows)] = found
            rate = 60 / found["each"]
            print(
                f"{way:<12} {rows:>6} {found['start']:8.1f} {found['each']:8.3f} {rate:9.1f} {found['whole']:14.3f} "
                f"{found['memory']:6.0f}",
                flush=True,
            )
    if arguments.json:
        arguments.json.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
