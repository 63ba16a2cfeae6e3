"""Batches made by processes: the same motions however they are shared out, and whoever is killed."""

import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from motionloom import Prior, generate
from motionloom.bulk import batch as batch_module
from motionloom.bulk import on_ray
from motionloom.bulk.batch import Where, array_task, batch, run
from motionloom.bulk.crew import _Process, gpu_of
from motionloom.bulk.folder import Store
from motionloom.bulk.jobs import Jobs
from motionloom.bulk.maker import Options
from motionloom.bulk.metadata import Result, read_batch
from motionloom.bulk.shard import Batch, Task
from motionloom.core.errors import MotionloomError
from tests.bulk.rows import apart, options, positions, rows, write_jobs

ONE, TWO = Where(workers=1), Where(workers=2)
COUNT = 40


@pytest.fixture
def jobs(folder: Path) -> Path:
    return write_jobs(folder / "jobs.jsonl", rows(COUNT))


@pytest.fixture(scope="module")
def exact(weights: str) -> dict[Any, Any]:
    """Every motion made by this process alone."""
    results = batch(rows(COUNT), options=options(weights))
    return {(one.about["text"], one.about["seed"]): one.motion.positions() for one in results if one.motion}


def test_the_best_of_several_is_that_of_a_single_call(weights: str) -> None:
    """Whatever rows are beside: what `generate` keeps."""
    row = {"prompt": "a person bows", "seconds": 1.0, "seed": 2, "best_of": 4}
    (motion,) = [
        one.motion for one in batch([row, *rows(3)], options=options(weights)) if one.about["text"] == row["prompt"]
    ]
    (alone,) = generate(Prior.load(weights), "a person bows", seconds=1.0, seed=2, best_of=4, steps=2, literal=True)
    (first,) = generate(Prior.load(weights), "a person bows", seconds=1.0, seed=2, steps=2, literal=True)
    assert motion is not None
    assert np.abs(motion.positions() - alone.positions()).max() < 3e-6
    assert np.abs(motion.positions() - first.positions()).max() > 1e-3


def check_whole(out: Path, exact: dict[Any, Any]) -> None:
    """Every row is there exactly once, and nothing else is."""
    assert [(one.row, one.state) for one in read_batch(out, motions=False)] == [(i, "made") for i in range(len(exact))]
    assert apart(positions(out), exact) < 3e-6
    assert {path.name for path in out.iterdir() if not path.name.startswith("shard-")} == {
        "manifest.json",
        "records",
        _table(out),
    }
    assert not [path for path in out.rglob("*") if path.name.startswith(".") or ".part" in path.name]


def _table(out: Path) -> str:
    return next(path.name for path in out.glob("metadata.*"))


def test_processes_shares_and_another_order_make_the_same_motions(
    weights: str, jobs: Path, folder: Path, exact: dict[Any, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = options(weights)
    results = list(batch(jobs, folder / "alone", options=settings, where=TWO))
    assert [(one.row, one.state) for one in results] == [(i, "made") for i in range(COUNT)]
    check_whole(folder / "alone", exact)

    for number in (1, 0):
        list(run(Jobs.of(jobs), folder / "shares", options=settings, where=Where(1, (number, 2))))
    check_whole(folder / "shares", exact)

    other = random.Random(3).sample(rows(COUNT), COUNT)
    list(batch(other, folder / "shuffled", options=settings, where=ONE))
    assert apart(positions(folder / "shuffled"), exact) < 3e-6

    monkeypatch.setattr(batch_module, "alone", _nobody)  # all is done: nobody is started
    list(batch(jobs, folder / "alone", options=settings, where=TWO))


def _nobody(items: Iterator[Any], *_: Any, **__: Any) -> Iterator[Any]:
    for item in items:
        assert isinstance(item, batch_module.Report)
        yield item


def test_workers_that_are_killed_are_replaced(
    weights: str, jobs: Path, folder: Path, exact: dict[Any, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first three to get a shard, each a little later than the one before."""
    kills, give = [], _Process.give

    def deadly(self: _Process, task: Any) -> None:
        give(self, task)
        if len(kills) < 3:
            kills.append(self.popen.pid)
            time.sleep(2.0 * len(kills))
            self.popen.send_signal(signal.SIGKILL)

    monkeypatch.setattr(_Process, "give", deadly)
    monkeypatch.setattr("motionloom.bulk.crew.STILLBORN", 10)
    list(batch(jobs, folder / "out", options=options(weights), where=TWO))
    assert len(kills) == 3
    check_whole(folder / "out", exact)


def start(weights: str, jobs: Path, out: Path, *more: str, **settings: Any) -> "subprocess.Popen[str]":
    command = ["batch", str(jobs), "--out", str(out), "--weights", weights, "--steps", "2", *more]
    return subprocess.Popen(
        [sys.executable, "-m", "motionloom", *command],
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        **settings,
    )


def _not_deaf() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # jobs in the background are started deaf to Ctrl-C


def wait_for(what: Callable[[], bool], process: "subprocess.Popen[str]") -> None:
    for _ in range(1200):
        if what() or process.poll() is not None:
            return
        time.sleep(0.05)
    pytest.fail("it did not happen in a minute")


def workers_of(out: Path) -> list[int]:
    """Processes of this machine that make motions for that folder."""
    pids = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            if (
                b"motionloom.bulk.worker" in (place / "cmdline").read_bytes()
                and (place / "cwd").resolve() == out.parent
            ):
                pids.append(int(place.name))
        except OSError:
            continue
    return pids


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/cmdline").exists(), reason="looks at processes as Linux shows them")
@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGINT], ids=["killed", "interrupted"])
def test_the_same_command_goes_on_where_a_driver_ended(
    weights: str, jobs: Path, folder: Path, exact: dict[Any, Any], blow: signal.Signals
) -> None:
    out = folder / "out"
    first = start(weights, jobs, out, "--workers", "1", start_new_session=True, preexec_fn=_not_deaf)
    begun = "manifest.json" if blow is signal.SIGINT else "records/000000.jsonl"
    wait_for(lambda: (out / begun).exists(), first)
    first.send_signal(blow)
    _, errors = first.communicate(timeout=60)
    assert first.returncode == (130 if blow is signal.SIGINT else -9)
    assert errors.endswith("motionloom: interrupted\n") == (blow is signal.SIGINT)
    wait_for(lambda: not workers_of(out), first)
    assert not workers_of(out)  # nobody outlives the driver
    assert not (out / "metadata.jsonl").exists()
    before = {path: path.stat().st_mtime_ns for path in (out / "records").iterdir()}
    second = start(weights, jobs, out, "--workers", "1")
    assert second.communicate(timeout=120)[0] == f"{COUNT} motions are in {out}\n"
    assert all(path.stat().st_mtime_ns == when for path, when in before.items())  # nothing was made twice
    check_whole(out, exact)
    third = start(weights, jobs, out)
    assert third.communicate(timeout=60)[0].startswith("nothing was left to make: ")


@pytest.mark.parametrize(
    ("process", "visible", "count", "gpu"), [(1, "", 2, "1"), (3, "", 2, "1"), (0, "5,7", 2, "5"), (5, "5,7", 2, "7")]
)
def test_processes_share_out_the_gpus_that_may_be_used(process: int, visible: str, count: int, gpu: str) -> None:
    assert gpu_of(process, visible, count) == gpu


@pytest.mark.slow
def test_a_disk_that_is_full_ends_the_batch_in_a_sentence(weights: str, folder: Path) -> None:
    """Of a process that may write no file of more than 100 kB: a shard of all rows is larger, in the middle of one."""
    jobs, out = write_jobs(folder / "jobs.jsonl", rows(COUNT)), folder / "out"

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

    full = start(weights, jobs, out, "--format", "webdataset", "--workers", "1", preexec_fn=limit)
    outputs = full.communicate(timeout=120)
    assert (full.returncode, outputs[0]) == (2, "")
    assert outputs[1].splitlines()[-1] == f"motionloom: cannot write to {out}: File too large"
    assert not list(out.glob("shard-*"))
    assert not (out / ".work").exists()
    again = start(weights, jobs, out, "--format", "webdataset", "--workers", "1")
    assert again.communicate(timeout=120)[0] == f"{COUNT} motions are in {out}\n"


@pytest.mark.parametrize(("task", "times"), [(None, 1), (Task(0, 0, []), 0)], ids=["nobody works", "somebody works"])
def test_a_cluster_where_nobody_works_is_said_once(task: Task | None, times: int) -> None:
    ray = SimpleNamespace(cluster_resources=lambda: {"CPU": 1.0}, remote=lambda **_: lambda kind: kind)
    crew = on_ray._Crew(ray, iter(()), Batch("", "", "", {}, Options()), None, lambda rows: None)
    crew.flight = {"reference": ("actor", task)}
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        for _ in range(3 * on_ray.LONELY):
            crew._waited(False)
    assert [str(one.message)[:24] for one in warned] == ["no worker has begun for "] * times


def test_results_come_without_a_folder_as_they_are_made(weights: str) -> None:
    results: list[Result] = list(
        islice(batch([{"prompt": ""}, *rows(3)], options=options(weights, filter="travel < 0")), 4)
    )
    assert [(one.row, one.state) for one in results] == [(0, "failed"), (1, "dropped"), (2, "dropped"), (3, "dropped")]


@pytest.mark.parametrize(
    ("environment", "task"),
    [
        ({}, None),
        ({"SLURM_ARRAY_TASK_ID": "3", "SLURM_ARRAY_TASK_COUNT": "4"}, (3, 4)),
        ({"SLURM_ARRAY_TASK_ID": "4", "SLURM_ARRAY_TASK_COUNT": "4", "SLURM_ARRAY_TASK_MIN": "1"}, (3, 4)),
        (
            {
                "SLURM_ARRAY_TASK_ID": "20",
                "SLURM_ARRAY_TASK_COUNT": "3",
                "SLURM_ARRAY_TASK_MIN": "0",
                "SLURM_ARRAY_TASK_STEP": "10",
            },
            (2, 3),
        ),
    ],
)
def test_a_slurm_array_shares_the_shards_out(environment: dict[str, str], task: tuple[int, int] | None) -> None:
    assert array_task(environment) == task


def test_a_list_of_array_tasks_that_is_no_range_is_refused() -> None:
    with pytest.raises(MotionloomError, match="--shard"):
        array_task({"SLURM_ARRAY_TASK_ID": "9", "SLURM_ARRAY_TASK_COUNT": "2", "SLURM_ARRAY_TASK_MIN": "1"})


def test_a_job_that_grew_keeps_its_shards_and_one_that_shrank_is_refused(weights: str, folder: Path) -> None:
    settings, out = options(weights), folder / "out"
    list(batch(rows(16), out, options=settings, where=ONE))
    first = (out / "records/000000.jsonl").stat().st_mtime_ns
    assert [one.state for one in batch(rows(20), out, options=settings, where=ONE)] == ["made"] * 20
    assert (out / "records/000000.jsonl").stat().st_mtime_ns == first
    with pytest.raises(MotionloomError, match="more shards than the job"):
        list(batch(rows(8), out, options=settings, where=ONE))


def test_the_folder_of_another_job_is_refused_unless_it_is_to_go(weights: str, folder: Path) -> None:
    settings, out = options(weights, shard_rows=2), folder / "out"
    others = [{"prompt": "a dog", "seconds": 0.6, "seed": i} for i in range(4)]
    list(batch(rows(4), out, options=settings, where=ONE))
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    with pytest.raises(MotionloomError, match=r"another job: none of the first 4 .* --force"):
        list(batch(others, out, options=settings, where=ONE))
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before
    list(batch(others, out, options=settings, where=ONE, force=True))
    assert {text for text, _ in positions(out)} == {"a dog"}


@pytest.mark.parametrize(
    "change",
    [
        lambda job: [{**job[0], "prompt": "a dog"}, *job[1:]],
        lambda job: [{**row, "seconds": 0.5} for row in job],
        lambda job: [{"prompt": "a dog", "seconds": 0.6}, *job[:3]],
    ],
    ids=["one row", "all lengths", "one before"],
)
def test_a_job_that_was_mended_is_the_same_job(weights: str, folder: Path, change: Callable[..., Any]) -> None:
    settings, out = options(weights, shard_rows=1), folder / "out"
    list(batch(rows(4), out, options=settings, where=ONE))
    assert [one.state for one in batch(change(rows(4)), out, options=settings, where=ONE)] == ["made"] * 4


@pytest.mark.parametrize(
    "change", [{"format": "mp4"}, {"filter": "obeys"}, {"fps": 0}, {"skeleton": "absent.bvh"}], ids=str
)
def test_options_that_cannot_be_are_refused_before_anything_is_written(
    weights: str, folder: Path, change: dict[str, Any]
) -> None:
    with pytest.raises(MotionloomError):
        list(batch(rows(2), folder / "out", options=options(weights, **change)))
    assert not (folder / "out").exists()


@pytest.mark.parametrize("change", [{"steps": 0}, {"device": "toaster"}], ids=str)
def test_what_only_a_process_finds_out_is_reported_in_its_sentence(
    weights: str, folder: Path, change: dict[str, Any]
) -> None:
    settings = Options(**{"weights": weights, "steps": 2, **change})
    with pytest.raises(MotionloomError):
        list(batch(rows(2), folder / "out", options=settings, where=ONE))
    assert not list(folder.glob("out/shard-*"))


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("1 / 0", r"a process that makes motions failed \(ZeroDivisionError: division by zero\)$"),
        ("import os; os._exit(7)", r"end before they begin, by exit code 7: what they printed says more$"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", r"by signal 9: is there enough memory\?$"),
    ],
    ids=["an exception", "an end", "a kill"],
)
def test_what_ends_every_process_is_told_and_memory_is_asked_for_where_one_was_killed(
    weights: str, folder: Path, monkeypatch: pytest.MonkeyPatch, line: str, sentence: str
) -> None:
    (folder / "fatal_judge.py").write_text(line + "\n")
    monkeypatch.setenv("PYTHONPATH", str(folder))
    with pytest.raises(MotionloomError, match=sentence):
        list(batch(rows(2), folder / "out", options=options(weights, judge="fatal_judge:judge"), where=ONE))
    assert not list(folder.glob("out/shard-*"))


def test_a_judge_that_fails_at_one_row_is_that_rows_error(
    weights: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "row_judge.py").write_text("def judge(text, places, fps):\n    return 1 / ('jumps' not in text) > 0\n")
    monkeypatch.setenv("PYTHONPATH", str(folder))
    results = list(batch(rows(6), folder / "out", options=options(weights, judge="row_judge:judge"), where=ONE))
    assert [one.state for one in results] == ["made", "made", "failed"] * 2
    assert "ZeroDivisionError: division by zero" in results[2].why


def test_the_table_has_a_row_for_every_row(weights: str, folder: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    out = folder / "out"
    list(batch([*rows(9), {"prompt": ""}], out, options=options(weights), where=ONE))
    table = parquet.read_table(out / "metadata.parquet").to_pylist()
    assert [row["row"] for row in table] == list(range(10))
    assert [row["state"] for row in table] == ["made"] * 9 + ["failed"]
    assert "prompt" in table[9]["error_text"]
    for row in table[:9]:
        assert (Store(out, "npz").data(row["shard"]) / f"{row['id']}.npz").exists()


def test_a_row_with_what_is_no_text_fails_in_a_sentence_and_the_others_are_made(weights: str, folder: Path) -> None:
    """JSON allows half of a surrogate pair, UTF-8 does not; a key that stands twice says nothing."""
    (folder / "jobs.jsonl").write_text(
        '{"prompt": "a person walks \\ud800", "seconds": 0.6}\n{"prompt": "a", "seed": 1, "seed": 2}\n'
        '{"prompt": "a \\u0007"}\n{"prompt": "a person walks", "seconds": 0.6}\n'
    )
    made = list(batch(folder / "jobs.jsonl", folder / "out", options=options(weights), where=ONE))
    assert [one.state for one in made] == ["failed", "failed", "failed", "made"]
    errors = [one.why for one in made]
    assert "half a character" in errors[0]
    assert "stands in it twice" in errors[1]
    assert "control character U+0007" in errors[2]


def test_memory_of_the_driver_does_not_grow_with_the_job(folder: Path) -> None:
    """A million rows are looked at with no more memory than ten thousand."""
    code = (
        "import resource, sys\nfrom motionloom.bulk.jobs import Jobs\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "jobs = Jobs.of_prompts('prompts.txt', variants=int(sys.argv[1]))\n"
        "print(jobs.count(), sum(len(part) for part in jobs.shards(1000)))\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)\n"
    )
    (folder / "prompts.txt").write_text("a person walks\n" * 100)
    for variants in (100, 5000):
        process = subprocess.run(
            [sys.executable, "-c", code, str(variants)],
            capture_output=True,
            text=True,
            check=True,
            timeout=120,
            env={**os.environ},
        )
        counts, grown = process.stdout.splitlines()
        assert counts == f"{100 * variants} {100 * variants}"
        assert int(grown) < 8_000  # kB


def test_results_are_json_so_that_any_language_reads_them(weights: str, folder: Path) -> None:
    list(batch(rows(3), folder / "out", options=options(weights), where=ONE))
    head, *entries = (folder / "out/records/000000.jsonl").read_text().splitlines()
    assert json.loads(head)["counts"] == {"made": 3}
    assert [json.loads(entry)["seed"] for entry in entries] == [0, 1, 2]
