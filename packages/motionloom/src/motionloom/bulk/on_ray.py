"""Shards shared out on a Ray cluster: each actor holds a prior; a lost one is replaced, and its shard begun again.

All machines see the same folder. The driver keeps one shard per actor and nothing else, and what is done lies in the
folder, so a driver that died is replaced by the same command.
"""

import importlib
import logging
import os
import re
import socket
import sys
import warnings
from collections.abc import Generator, Iterator
from contextlib import redirect_stdout
from dataclasses import asdict
from itertools import chain
from typing import Any

from motionloom.bulk.crew import ONE_THREAD, Again, Moved, search_path
from motionloom.bulk.shard import Batch, Report, Task
from motionloom.core.errors import MotionloomError

PATIENCE = 1.0
"""Seconds between two looks at what is done."""
LONELY = 120
"""Looks without anybody who works, after which there is a warning."""
ANSWERS = 10.0
"""Seconds in which a cluster's head must answer."""


class Hand:
    """What an actor does: shards, one after the other."""

    def __init__(self, line: str) -> None:
        from motionloom.core.models.networks import set_threads

        set_threads(1)
        self.batch, self.problem = Batch.from_json(line), ""
        try:
            self.maker = self.batch.maker()
        except MotionloomError as error:
            self.problem = str(error)
        except Exception as error:  # another actor would end alike
            self.problem = f"a worker failed ({type(error).__name__}: {error})"

    def ready(self) -> dict[str, Any]:
        """Nothing, or what keeps it from making anything."""
        return {"fatal": self.problem} if self.problem else {}

    def make(self, task: Task) -> dict[str, Any]:
        """A `Report` as plain values, or why none can be had."""
        from motionloom.bulk.shard import make_shard

        try:
            return asdict(make_shard(task, self.batch, self.maker))
        except MotionloomError as error:
            return {"fatal": str(error)}


def on_ray(
    items: Iterator[Task | Report], batch: Batch, *, address: str | None, workers: int | None, moved: Moved
) -> Iterator[Report]:
    """As `motionloom.bulk.crew.alone`, on the cluster at ``address``; None: RAY_ADDRESS, else one of this machine.

    workers: actors; None: one per processor of the cluster, with CUDA one per GPU.
    Raises `MotionloomError` where Ray is not installed or not there.
    """
    for item in items:
        if isinstance(item, Task):
            items = chain([item], items)
            break
        yield item
    else:
        return  # nothing is left to generate, and no cluster needed
    with redirect_stdout(sys.stderr):  # results go there, and Ray reports deaths there, whatever its settings
        ray = _start(address)
        try:
            yield from _Crew(ray, items, batch, workers, moved).run()
        finally:
            ray.shutdown()


def _start(address: str | None) -> Any:
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # nothing is sent to anybody
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    os.environ.setdefault("RAY_COLOR_PREFIX", "0")
    try:
        ray = importlib.import_module("ray")
    except ImportError:
        raise MotionloomError("--ray needs Ray: pip install 'motionloom[ray]'") from None
    address = address or os.environ.get("RAY_ADDRESS")
    if address is not None:
        _check_answers(address)
    variables = ONE_THREAD | ({"PYTHONPATH": search_path()} if address is None else {})
    options: dict[str, Any] = {
        "log_to_driver": False,
        "logging_level": logging.CRITICAL,
        "runtime_env": {"env_vars": variables},
    }
    try:
        if address is None:
            ray.init(address="local", include_dashboard=False, **options)
        else:
            ray.init(address=address, **options)
    except (ConnectionError, RuntimeError, ValueError, TimeoutError) as error:
        raise MotionloomError(f"there is no Ray cluster at {address or 'this machine'} ({_shortened(error)})") from None
    return ray


def _check_answers(address: str) -> None:
    """Raise `MotionloomError` where nobody listens at ``host:port``: Ray itself would try for minutes.

    Other addresses, such as ``auto``, are not looked at.
    """
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not host or not port.isdecimal():
        return
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=ANSWERS).close()
    except (OSError, OverflowError) as error:
        raise MotionloomError(f"there is no Ray cluster at {address} ({error}); see 'ray status' there") from None


def _shortened(error: Exception) -> str:
    """An error of Ray's in one line: how it begins, and how it ends, which is where a cause is named."""
    words = " ".join(re.sub(r"\x1b\[[0-9;]*m", "", str(error)).split())
    return words if len(words) <= 300 else f"{words[:100]} ... {words[-200:]}"


class _Crew:
    def __init__(
        self, ray: Any, items: Iterator[Task | Report], batch: Batch, workers: int | None, moved: Moved
    ) -> None:
        self.ray, self.items, self.batch, self.moved = ray, items, batch, moved
        gpu = batch.options.device == "cuda"
        units = ray.cluster_resources().get("GPU" if gpu else "CPU", 0)
        self.workers = workers or max(int(units), 1)
        share = 1 / max(-(-self.workers // max(int(units), 1)), 1) if gpu else 0  # several actors may share a GPU
        self.kind = ray.remote(num_cpus=1, num_gpus=share, max_restarts=0)(Hand)
        self.flight: dict[Any, tuple[Any, Task | None]] = {}
        """What is waited for: of which actor, and for which task (None: until it is ready)."""
        self.idle: list[Any] = []
        self.again = Again()
        self.stillborn = 0
        self.looks = 0
        """Since when nobody has worked or answered, in looks."""

    def run(self) -> Iterator[Report]:
        task = yield from self._next()
        while task is not None or any(begun for _, begun in self.flight.values()):
            if task is not None:
                self._hire()
            while task is not None and self.idle:
                actor = self.idle.pop()
                self.flight[actor.make.remote(task)] = actor, task
                task = yield from self._next()
            ready, _ = self.ray.wait(list(self.flight), num_returns=1, timeout=PATIENCE)
            self._waited(bool(ready))
            for reference in ready:
                if report := self._over(reference):
                    yield report
            if task is None:
                task = yield from self._next()

    def _next(self) -> Generator[Report, None, Task | None]:
        """The next task; reports on the way to it are passed on."""
        if self.again.tasks:
            return self.again.tasks.popleft()
        for item in self.items:
            if isinstance(item, Task):
                return item
            yield item
        return None

    def _hire(self) -> None:
        """As many actors as there may be, where nobody is free."""
        for _ in range(0 if self.idle else self.workers - len(self.flight)):
            actor = self.kind.remote(self.batch.to_json())
            self.flight[actor.ready.remote()] = actor, None

    def _waited(self, answered: bool) -> None:
        """Warn once that no worker comes, which would otherwise be waited for in silence: a cluster may still grow."""
        working = answered or any(task for _, task in self.flight.values())
        self.looks = 0 if working else self.looks + 1
        if self.looks == LONELY:
            warnings.warn(
                f"no worker has begun for {LONELY * PATIENCE:.0f} s; 'ray status' says what the cluster lacks",
                stacklevel=2,
            )

    def _over(self, reference: Any) -> Report | None:
        actor, task = self.flight.pop(reference)
        try:
            answer = self.ray.get(reference)
        except self.ray.exceptions.RayTaskError as error:
            raise MotionloomError(f"a worker failed: {_shortened(error)}") from None
        except self.ray.exceptions.RayError as error:
            self._lost(task, error)
            return None
        if "fatal" in answer:
            raise MotionloomError(answer["fatal"])
        self.idle.append(actor)
        self.stillborn = 0
        if task is None:
            return None
        self.moved(answer["new_rows"])
        return Report(**answer)

    def _lost(self, task: Task | None, error: Exception) -> None:
        if task is None:
            self.stillborn += 1
            if self.stillborn > 10 + 2 * self.workers:
                raise MotionloomError(f"the workers of the Ray cluster end before they begin ({_shortened(error)})")
            return
        self.again.add(task, "worker that makes it; is there enough memory?")
