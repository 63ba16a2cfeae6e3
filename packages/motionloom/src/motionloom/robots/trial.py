"""Models are compiled first by a process of their own: one that hangs, eats memory or crashes MuJoCo ends that alone.

The process lives on for the next model, and ends with the one that began it.
"""

import atexit
import json
import os
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

from motionloom.core.errors import MotionloomError
from motionloom.robots.engine import load_mujoco

SECONDS, PROCESSOR_SECONDS = 60.0, 10
"""For one model, by the clock and of one core; those of real robots take less than two of a core."""
MEMORY = 3 << 30
"""Bytes of address space of the process, of which MuJoCo itself takes 0.5 GB."""
_LOCK = threading.Lock()


class _Process:
    """One that tries models, and the process that began it."""

    def __init__(self) -> None:
        self.parent = os.getpid()
        search = os.pathsep.join(entry for entry in sys.path if entry)
        self.popen = subprocess.Popen(
            [sys.executable, "-P", "-m", "motionloom.robots.trial"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": search, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            start_new_session=True,  # Ctrl-C is for the one who waits, who then ends it
        )
        self.works: bool | None = None

    def is_ready(self) -> bool:
        """Whether it works at all: where no other process can be, models are read without."""
        if self.works is None:
            assert self.popen.stdout is not None
            self.works = self.popen.stdout.readline() == b"ready\n"
        return bool(self.works)

    def ask(self, path: Path, *, meshes: bool) -> dict[str, str | None] | None:
        """What it says of a model; None where it ended over it."""
        assert self.popen.stdin is not None
        assert self.popen.stdout is not None
        clock = threading.Timer(SECONDS, self.popen.kill)
        clock.start()
        try:
            with suppress(OSError):
                self.popen.stdin.write(json.dumps([str(path), meshes, PROCESSOR_SECONDS]).encode() + b"\n")
                self.popen.stdin.flush()
            line = self.popen.stdout.readline()
        finally:
            clock.cancel()
        return json.loads(line) if line.endswith(b"\n") else None

    def end(self) -> None:
        if self.parent != os.getpid():  # it is another's, of which this process is a copy
            return
        self.popen.kill()
        self.popen.wait()
        for stream in (self.popen.stdin, self.popen.stdout):
            with suppress(OSError):
                stream.close()  # type: ignore[union-attr]


_PROCESS: list[_Process] = []


def try_model(path: Path, *, meshes: bool) -> None:
    """Let a model be compiled by another process, within `SECONDS`, `PROCESSOR_SECONDS` and `MEMORY`.

    Raises `MotionloomError` for one that cannot be compiled, or not within these.
    """
    with _LOCK:
        if _PROCESS and _PROCESS[0].parent != os.getpid():
            _PROCESS.clear()
        if not _PROCESS:
            _PROCESS.append(_Process())
        said = None
        try:
            said = _PROCESS[0].ask(path.absolute(), meshes=meshes) if _PROCESS[0].is_ready() else {"error": None}
        finally:
            if said is None:
                end()
    if said is None:
        raise MotionloomError(
            f"{path} cannot be read as a robot's model within {PROCESSOR_SECONDS} s of one core and {MEMORY >> 30} GB "
            "of memory; give a model of one robot, without large numbers of repeated things, large grids or textures"
        )
    if said["error"] is not None:
        raise MotionloomError(said["error"].replace(str(path.absolute()), str(path)))


def end() -> None:
    """End the process, if there is one; the next model gets another."""
    while _PROCESS:
        _PROCESS.pop().end()


atexit.register(end)


def _serve() -> None:
    """Answer one line for each line of standard input."""
    from motionloom.robots.model import compiled

    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what MuJoCo prints is no answer
    _limit("RLIMIT_AS", MEMORY)
    load_mujoco()
    print("ready", file=answers, flush=True)
    for line in sys.stdin:
        path, meshes, seconds = json.loads(line)
        _limit("RLIMIT_CPU", int(time.process_time()) + seconds)
        error = None
        try:
            load_mujoco().MjData(compiled(Path(path), meshes=meshes)[1])
        except MotionloomError as refusal:
            if "unknown exception" in str(refusal) or "allocate" in str(refusal):  # MuJoCo's words for no memory left
                os._exit(1)
            error = str(refusal)
        except MemoryError:
            os._exit(1)
        print(json.dumps({"error": error}), file=answers, flush=True)


def _limit(name: str, most: int) -> None:
    """Let the system hold this process to a limit; Windows has none."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        hard = resource.getrlimit(getattr(resource, name))[1]
        resource.setrlimit(getattr(resource, name), (most if hard < 0 else min(most, hard), hard))


if __name__ == "__main__":
    _serve()
