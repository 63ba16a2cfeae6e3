"""Shards shared out to processes of this machine; one that dies is replaced, and its shard begun again."""

import json
import os
import queue
import subprocess
import sys
import threading
import warnings
from collections import Counter, deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import motionloom
from motionloom.bulk.folder import Store
from motionloom.bulk.shard import Batch, Report, Task, clear_work
from motionloom.core.errors import MotionloomError

STILLBORN = 3
"""Processes in a row that may die before they are ready."""

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
"""Environment of a process on one core."""
Moved = Callable[[int], None]
"""Called with how many more rows are finished."""


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def gpus() -> int:
    """GPUs of this machine, as NVIDIA's driver lists them; 1 where it does not, so that processes report it."""
    return max(len(list(Path("/proc/driver/nvidia/gpus").glob("*"))), 1)


def gpu_of(process: int, visible: str, count: int) -> str:
    """The GPU of a process by its number, of those that CUDA_VISIBLE_DEVICES names, or else of so many.

    Where there are more processes than GPUs, some share one.
    """
    devices = [place for place in visible.split(",") if place] or [str(number) for number in range(count)]
    return devices[process % len(devices)]


def search_path() -> str:
    """PYTHONPATH for processes that are to find this very package, wherever they are started."""
    source = str(Path(motionloom.__file__).resolve().parents[1])
    return os.pathsep.join([source, *filter(None, [os.environ.get("PYTHONPATH")])])


class Again:
    """Tasks whose makers died, to be begun again."""

    def __init__(self) -> None:
        self.tasks: deque[Task] = deque()
        self._deaths: Counter[int] = Counter()

    def add(self, task: Task, cause: str) -> None:
        """One task more; `MotionloomError` for so many deaths at it that its rows cannot be the reason alone."""
        self._deaths[task.shard] += 1
        if self._deaths[task.shard] > 3 * len(task.rows) + 10:
            raise MotionloomError(f"shard {task.shard} ends every {cause}")
        self.tasks.append(task)


def _cause(code: int | None) -> str:
    """How a process ended: one that was killed may have wanted too much memory."""
    if code is not None and code < 0:
        return f"signal {-code}: is there enough memory?"
    return f"exit code {code}: what they printed says more"


@dataclass(eq=False)
class _Process:
    """A worker and what it is at."""

    number: int
    batch: Batch
    received: "queue.Queue[tuple[_Process, dict[str, Any] | None]]"
    task: Task | None = None
    ready: bool = False
    popen: "subprocess.Popen[bytes]" = field(init=False)

    def __post_init__(self) -> None:
        environment = {**os.environ, "PYTHONPATH": search_path(), **ONE_THREAD}
        if self.batch.options.device == "cuda":
            environment["CUDA_VISIBLE_DEVICES"] = gpu_of(
                self.number, os.environ.get("CUDA_VISIBLE_DEVICES", ""), gpus()
            )
        command = [sys.executable, "-P", "-m", "motionloom.bulk.worker"]
        self.popen = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment)
        threading.Thread(target=self._listen, daemon=True).start()
        self._say(self.batch.to_json())

    def give(self, task: Task) -> None:
        self.task = task
        rows = [row.decode("latin-1") for row in task.rows]
        self._say(json.dumps({"shard": task.shard, "first": task.first, "rows": rows}))

    def end(self) -> None:
        """Stop it; what it was at stays unmade."""
        self.popen.kill()
        self.popen.wait()
        for stream in (self.popen.stdin, self.popen.stdout):
            with suppress(OSError):
                stream.close()  # type: ignore[union-attr]
        if self.task is not None:
            store = Store(Path(self.batch.out), self.batch.options.format)
            clear_work(store, self.task.shard, self.batch.driver)
            store.attempts(self.task.shard).unlink(missing_ok=True)

    def _say(self, line: str) -> None:
        with suppress(OSError):  # it has died: the other side notices
            self.popen.stdin.write(line.encode() + b"\n")  # type: ignore[union-attr]
            self.popen.stdin.flush()  # type: ignore[union-attr]

    def _listen(self) -> None:
        with suppress(OSError, ValueError):
            for line in self.popen.stdout:  # type: ignore[union-attr]
                self.received.put((self, json.loads(line)))
        self.received.put((self, None))


def alone(items: Iterator[Task | Report], batch: Batch, *, workers: int, moved: Moved) -> Iterator[Report]:
    """Reports of all shards, in the order in which they are done; ``items`` that are reports are passed on.

    items: read as they are needed, a shard ahead of each process at most.
    Raises `MotionloomError` where the folder cannot be written or no process can be kept alive.
    """
    crew = _Crew(items, batch, workers, moved)
    try:
        yield from crew.run()
    finally:
        for process in crew.processes:
            process.end()


class _Crew:
    def __init__(self, items: Iterator[Task | Report], batch: Batch, workers: int, moved: Moved) -> None:
        self.items, self.batch, self.workers, self.moved = items, batch, workers, moved
        self.received: queue.Queue[tuple[_Process, dict[str, Any] | None]] = queue.Queue()
        self.processes: list[_Process] = []
        self.again = Again()
        self.stillborn = 0
        self.warned: set[str] = set()

    def run(self) -> Iterator[Report]:
        yield from self._fill()
        while any(process.task for process in self.processes):
            process, message = self.received.get()
            if message is None:
                self._died(process)
            elif report := self._understood(process, message):
                yield report
            yield from self._fill()

    def _fill(self) -> Iterator[Report]:
        """A task for each process that has none, and processes for tasks as long as there may be more."""
        while True:
            idle = next((process for process in self.processes if process.task is None), None)
            if idle is None and len(self.processes) >= self.workers:
                return
            item = self.again.tasks.popleft() if self.again.tasks else next(self.items, None)
            if item is None:
                return
            if isinstance(item, Report):
                yield item
                continue
            if idle is None:
                numbers = {process.number for process in self.processes}
                number = next(n for n in range(self.workers) if n not in numbers)
                idle = _Process(number, self.batch, self.received)
                self.processes.append(idle)
            idle.give(item)

    def _understood(self, process: _Process, message: dict[str, Any]) -> Report | None:
        if "fatal" in message:
            raise MotionloomError(message["fatal"])
        if "ready" in message:
            process.ready, self.stillborn = True, 0
        elif "moved" in message:
            self.moved(message["moved"])
        elif "warning" in message:
            if message["warning"] not in self.warned and len(self.warned) < 100:
                self.warned.add(message["warning"])
                warnings.warn(message["warning"], stacklevel=2)
        elif "report" in message:
            process.task = None
            return Report(**message["report"])
        return None

    def _died(self, process: _Process) -> None:
        if process not in self.processes:
            return
        self.processes.remove(process)
        task, process.task = process.task, None
        process.end()
        self.stillborn += not process.ready
        if self.stillborn >= STILLBORN:
            raise MotionloomError(
                f"the processes that make motions end before they begin, by {_cause(process.popen.returncode)}"
            )
        if task is not None:
            self.again.add(task, f"process that makes it, by {_cause(process.popen.returncode)}")
