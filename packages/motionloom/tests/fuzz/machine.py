"""Runs mutated files through the readers, in a process that is watched and begun again when it dies.

A file has `ALARM` seconds of the processor; the alarm is the system's own, which also ends what hangs outside of
Python, and a busy machine does not set it off. Its process may
have a gigabyte more of addresses than it began with, so that what takes more is a MemoryError, which no reader may
hide. What a reader answers with anything but a value or one sentence is a failure, and the file is kept.
"""

import contextlib
import gc
import io
import multiprocessing
import multiprocessing.connection
import os
import random
import resource
import shutil
import signal
import tempfile
import time
import traceback
import warnings
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from motionloom.core.errors import MotionloomError
from tests.fuzz.container_mutations import prepare
from tests.fuzz.mutations import mutated

if TYPE_CHECKING:
    from tests.fuzz.readers import Reader

ALARM = 5.0
"""Seconds for one file."""
MEMORY = 1 << 30
"""Bytes that one file may take."""
LONGEST = 900
"""Characters of a message."""
EACH = 4000
"""Files that one process tries."""
WAIT = 120
"""Seconds after which a process that says nothing is taken to wait for something that never comes."""
HIDDEN = ("MemoryError", "Unable to allocate", "RecursionError", "can't allocate", "not enough memory")
"""What a message says that was made of such an error."""


@dataclass
class Result:
    """What a run tried, and what failed."""

    tried: Counter[str] = field(default_factory=Counter)
    read: Counter[str] = field(default_factory=Counter)
    """Files that were read in spite of the damage."""
    failures: list[tuple[str, int, str]] = field(default_factory=list)
    """Reader, number of the file, what happened."""

    def report(self) -> str:
        """Lines to print: failures, then files by reader, then the sums."""
        rows = [f"FAILED {name} {number}: {what}" for name, number, what in self.failures[:200]]
        rows += [f"{name:24} {count:8} files, {self.read[name]:8} read" for name, count in sorted(self.tried.items())]
        return "\n".join([*rows, f"{sum(self.tried.values())} files tried, {len(self.failures)} failures"])


def fuzz(
    *, seconds: float, files: int = 10**9, first: int = 0, seed: int = 0, only: str = "", keep: Path | None = None
) -> Result:
    """Try mutated files, all readers in turn, until the time or the number of files is over.

    A file is made of the seed and its number alone (and of `only`, which says whose turn it is): ``files=1`` and
    ``first`` try one again.
    """
    from tests.fuzz.readers import READERS

    chosen = [reader for reader in READERS if reader.name.startswith(only)]
    turns = [reader for turn in range(20) for reader in chosen if turn < reader.weight]
    result, number = Result(), first
    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(dir=memory) as place, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for reader in chosen:  # all that is imported and cached is there before the limit is set
            folder = Path(place) / "good" / reader.name
            folder.mkdir(parents=True)
            reader.make(folder)
            reader.read(folder)
        prepare()
        gc.collect()
        gc.freeze()  # a session of ONNX Runtime that the child collects waits for threads that a fork leaves behind
        end = time.monotonic() + seconds
        job = _Job(Path(place), turns, end, seed, keep)
        while number < first + files and time.monotonic() < end:
            number = _one_process(job, result, number, min(first + files, number + EACH))
    gc.unfreeze()
    return result


@dataclass(frozen=True)
class _Job:
    place: Path
    """Folder with good files of every reader."""
    turns: "list[Reader]"
    """Whose turn it is, again and again."""
    end: float
    seed: int
    keep: Path | None


def _one_process(job: _Job, result: Result, number: int, last: int) -> int:
    """Files from ``number`` on in a process of their own; the number to go on with."""
    context = multiprocessing.get_context("fork")
    hear, tell = context.Pipe(duplex=False)
    child = context.Process(target=_work, args=(job, tell, number, last), daemon=True)
    child.start()
    tell.close()
    name = "?"
    with contextlib.suppress(EOFError):
        while True:
            if not hear.poll(WAIT):
                child.kill()
            said = hear.recv()
            if said[0] == "end":
                child.join()
                return said[1]
            if said[0] == "begin":
                name, number = said[1:]
                continue
            _, what, read = said
            result.tried[name] += 1
            result.read[name] += read
            if what:
                result.failures.append((name, number, what))
    child.join()
    result.tried[name] += 1
    died = -(child.exitcode or 0)
    said = f"no answer within {ALARM:g} s" if died == signal.SIGPROF else f"the process died ({child.exitcode})"
    result.failures.append((name, number, said))
    if job.keep:
        _keep(job, child.pid, name, number, said)
    return number + 1


def _keep(job: _Job, process: int | None, name: str, number: int, said: str) -> None:
    """Copy the folder that a process tried into the folder of failures, with a line on what happened."""
    assert job.keep
    kept = job.keep / f"{name}-{number}"
    shutil.copytree(job.place / f"spoiled {process}", kept, dirs_exist_ok=True)
    (kept / "what.txt").write_text(f"{said}\n")


def _work(job: _Job, tell: multiprocessing.connection.Connection, first: int, last: int) -> None:
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    spoiled = job.place / f"spoiled {os.getpid()}"
    os.chdir(job.place)
    _limit()
    number = first
    while number < last and (time.monotonic() < job.end or number == first):
        reader = job.turns[number % len(job.turns)]
        tell.send(("begin", reader.name, number))
        rng = random.Random(f"{job.seed} {number}")
        name = _spoil(job.place / "good" / reader.name, spoiled, reader.kinds, rng)
        with contextlib.redirect_stderr(io.StringIO()):
            what, read = _try(reader.read, spoiled)
        if what and job.keep:
            _keep(job, os.getpid(), reader.name, number, f"{name}\n{what}")
        shutil.rmtree(spoiled)
        tell.send(("done", what.strip().splitlines()[-1][:300] if what else "", read))
        number += 1
    tell.send(("end", number))


def _limit() -> None:
    with open("/proc/self/statm") as said:
        now = int(said.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (now + MEMORY, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _spoil(good: Path, spoiled: Path, kinds: dict[str, str], rng: random.Random) -> str:
    """A copy of the folder with one file mutated."""
    shutil.copytree(good, spoiled, symlinks=True)
    name = rng.choice(list(kinds))
    path = spoiled / name
    path.write_bytes(mutated(path.read_bytes(), kinds[name], rng))
    return name


def _try(read, folder: Path) -> tuple[str, bool]:
    """What was wrong with the answer ('' if nothing), and whether it was a value."""
    signal.setitimer(signal.ITIMER_PROF, ALARM)
    try:
        read(folder)
        return "", True
    except MotionloomError as error:
        said = str(error)
        whole = error.args[0] if error.args else ""
        if not said or "\n" in said or len(said) > LONGEST or not said.isprintable():
            return f"a message that is no sentence: {said[:200]!r}", False
        hidden = next((word for word in HIDDEN if word in str(whole)), None)
        return (f"{hidden} behind a sentence: {said[:200]}" if hidden else ""), False
    except BaseException:  # whatever comes is the finding
        return traceback.format_exc(limit=-12), False
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
