"""The driver's part of a batch of very many rows, without making any: what it keeps in memory, and how long it takes.

    python benchmarks/batch_scale.py --rows 10000000

Writes a job of so many rows (JSON lines), and then, in processes of their own:

1. a driver that starts afresh gives every shard to nobody, who makes nothing of it;
2. the folder gets the records that a whole batch leaves (their first lines; one shard of them whole), and a driver
   resumes: all is done;
3. the last shard's record is taken away, and a driver resumes again: one shard is given out;
4. the table of all rows is written from whole records of a part of the shards, to be multiplied.

Prints seconds and the largest resident memory of each. No network is loaded, so any machine will do; a busy one only
takes longer.
"""

import argparse
import multiprocessing
import resource
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from motionloom.bulk.batch import _items
from motionloom.bulk.folder import Head, Store, digest, open_folder
from motionloom.bulk.jobs import Jobs, shard_size
from motionloom.bulk.maker import Options
from motionloom.bulk.metadata import write_table
from motionloom.bulk.shard import Task

FORMAT = "webdataset"


def write_job(path: Path, rows: int) -> None:
    """Rows as a program writes them."""
    with path.open("w") as file:
        for i in range(rows):
            file.write(f'{{"prompt": "a person walks forward and waves", "seconds": 4, "seed": {i}}}\n')


def entry(row: int) -> dict[str, Any]:
    """What the record of a motion that was made says, in its full length."""
    measures = dict.fromkeys(("skate", "skate_speed", "penetration", "floating", "jerk", "peak_jerk"), 12.3456)
    key = f"{row:032x}"
    return {
        "row": row,
        "state": "made",
        "id": key,
        "key": key,
        "task": "generate",
        "text": "a person walks forward and waves",
        "seed": row,
        "people": 1,
        "frames": 80,
        "fps": 20.0,
        "seconds": 4.0,
        **measures,
        "travel": 4.1234,
        "speed": 1.0234,
        "turn": 12.3456,
        "error": None,
        "worst": None,
        "apart": None,
        "nearest": None,
        "obeys": None,
    }


def fill(jobs: Path, out: Path, size: int, whole: int) -> None:
    """Records and data as a whole batch leaves them; of the first shards with a line for every row."""
    store = Store(out, FORMAT)
    for shard, rows in enumerate(Jobs(jobs).shards(size)):
        store.data(shard).write_bytes(b"a shard")
        head = Head(digest(rows), False, {"files": 1, "bytes": 7}, {"made": len(rows)})
        lines = (entry(shard * size + i) for i in range(len(rows))) if shard < whole else ()
        store.write_record(shard, list(lines), head)


def drive(jobs: Path, out: Path) -> str:
    """What the driver does but for its workers: count, open, look at every shard, give out what is missing."""
    job = Jobs(jobs)
    rows = job.count()
    size = int(open_folder(out, Options(format=FORMAT), rows=rows, shard_rows=shard_size(rows))["shard_rows"])
    given = done = 0
    for item in _items(job, size, Store(out, FORMAT), (0, 1)):
        given, done = given + isinstance(item, Task), done + (not isinstance(item, Task))
    return f"{rows:,} rows, {done:,} shards are there, {given:,} given out"


def table(out: Path, shards: int) -> str:
    """The table of a part of the shards."""
    size = write_table(Store(out, FORMAT), shards).stat().st_size
    return f"{shards:,} shards, {size / 1e6:.1f} MB"


def _child(send: Any, what: Callable[..., str], given: tuple[Any, ...]) -> None:
    began = time.perf_counter()
    said = what(*given)
    send.send((said, time.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024))


def alone(name: str, what: Callable[..., str], *given: Any) -> None:
    """Run it in a process of its own, and print what it took."""
    context = multiprocessing.get_context("spawn")
    receive, send = context.Pipe(duplex=False)
    process = context.Process(target=_child, args=(send, what, given))
    process.start()
    said, seconds, memory = receive.recv()
    process.join()
    print(f"{name:<14} {seconds:8.1f} s {memory:6.0f} MB   {said}", flush=True)


def nothing() -> str:
    """What a process has in memory before it does anything."""
    return "the imports alone"


def main() -> None:
    """Write a job, look at drivers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=10_000_000)
    parser.add_argument("--whole", type=int, default=100, help="shards whose records are whole (default 100)")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="motionloom-") as name:
        jobs, out = Path(name) / "jobs.jsonl", Path(name) / "out"
        write_job(jobs, arguments.rows)
        size = shard_size(arguments.rows)
        shards = -(-arguments.rows // size)
        print(f"{arguments.rows:,} rows, {jobs.stat().st_size / 1e6:.0f} MB, {shards:,} shards of {size:,}", flush=True)
        alone("nothing", nothing)
        alone("afresh", drive, jobs, out)
        fill(jobs, out, size, arguments.whole)
        alone("resumed", drive, jobs, out)
        Store(out, FORMAT).record(shards - 1).unlink()
        alone("one is missing", drive, jobs, out)
        whole = min(arguments.whole, shards - 1)
        alone("table", table, out, whole)
        each = sum(Store(out, FORMAT).record(shard).stat().st_size for shard in range(whole)) / (whole * size)
        manifest = (out / "manifest.json").stat().st_size
        print(f"manifest.json has {manifest:,} bytes; records {each:.0f} bytes a row")
        print(f"{each * arguments.rows / 1e9:.1f} GB of records in all, and {shards / whole:.0f} tables as large")
        shutil.rmtree(out)


if __name__ == "__main__":
    main()
