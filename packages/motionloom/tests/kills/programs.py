"""Commands that run in a process of their own, and send themselves a signal at one of the moments that they pass.

A moment is a *mark*: a call of one of the project's functions, or something that is done to files (opening one to
write, half of its bytes, renaming, removing, making a folder). Marks are counted and not timed, so a busy machine ends
a command at the same moments as any other. Half of the moments that are drawn are those around files.
"""

import contextlib
import importlib
import multiprocessing
import os
import random
import signal
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

import pytest

from motionloom.core.interruption import interruptible

needs_signals = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs forks and signals")
SEED = 7
"""Of the moments that are drawn."""
SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGKILL]
PRELOADED = [
    "tests.kills.programs",
    "motionloom.cli.generate",
    "motionloom.cli.control",
    "motionloom.cli.edit",
    "motionloom.cli.futures",
    "motionloom.cli.duet",
    "motionloom.tasks.long",
    "motionloom.tasks.text",
]


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    code: int
    """Its exit code; minus the signal's number if it was killed."""
    out: str
    said: str
    """On stderr."""
    marks: int
    """Marks that it passed; 0 if it was killed."""
    files: tuple[int, ...]
    """Those of them that are about files."""


def run(words: Sequence[str], folder: Path, *, at: int = 0, number: int = 0) -> Ended:
    """Run a command that gets a signal at mark ``at``; 0: never.

    words: of a command of `motionloom`'s, or ``MODULE:FUNCTION`` and what that function is called with.
    """
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # of the server, which is started by the first of these calls
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))  # for what it imports before it is sent a path
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    folder.mkdir(parents=True, exist_ok=True)
    log = folder.with_name(f"{folder.name}.log")
    log.mkdir(exist_ok=True)
    running = context.Process(target=_work, args=(list(words), str(folder), str(log), at, int(number)))
    running.start()
    running.join()
    assert running.pid is not None
    _wait_for_group(running.pid)
    marks = [int(n) for n in (log / "marks").read_text().split()] if (log / "marks").is_file() else [0]
    (log / "marks").unlink(missing_ok=True)
    code = running.exitcode if running.exitcode is not None else 1
    return Ended(code, (log / "out").read_text(), (log / "err").read_text(), marks[0], tuple(marks[1:]))


def kills(usual: int) -> int:
    """How many moments of each are tried: ``KILLS`` of the environment, else ``usual``."""
    return int(os.environ.get("KILLS", usual))


def ended_by(number: int, ended: Ended) -> bool:
    """Whether the command ended as this signal ends commands, with one sentence."""
    if number == signal.SIGKILL:
        return ended.code == -signal.SIGKILL
    sentences = [line for line in ended.said.splitlines() if not line.startswith("note:")]
    return ended.code == 130 and len(sentences) <= 1 and "Traceback" not in ended.said


def uninterrupted(words: Sequence[str], folder: Path) -> Ended:
    """The command as it ends when nobody ends it."""
    whole = run(words, folder)
    assert whole.code == 0, whole.said
    return whole


def moments(whole: Ended, count: int, *, seed: int) -> list[int]:
    """Some of the marks that an uninterrupted command passes, at random, half of them about files."""
    rng = random.Random(seed)
    around = rng.choices(whole.files, k=count // 2)
    return sorted({*around, *rng.sample(range(1, whole.marks + 1), count - len(around))})


def parts(folder: Path) -> list[str]:
    """Hidden files and folders below a folder."""
    return [path.name for path in folder.rglob("*") if path.name.startswith(".")]


def _wait_for_group(group: int) -> None:
    """Workers of a command that was killed must end by themselves."""
    for _ in range(600):
        try:
            os.killpg(group, 0)
        except (ProcessLookupError, PermissionError):
            return
        time.sleep(0.1)
    os.killpg(group, signal.SIGKILL)
    raise AssertionError("a worker outlived the command that started it")


class _Marks:
    def __init__(self, at: int, number: int) -> None:
        self.at, self.number, self.passed = at, number, 0
        self.home, self.process = os.getcwd(), os.getpid()
        self.files: list[int] = []
        self.on = False

    def mark(self, *, file: bool = False) -> None:
        if not self.on or os.getpid() != self.process or threading.current_thread() is not threading.main_thread():
            return
        self.passed += 1
        if file:
            self.files.append(self.passed)
        if self.passed == self.at:
            os.kill(self.process, self.number)

    def _here(self, path: str | bytes) -> bool:
        return isinstance(path, str) and (not os.path.isabs(path) or path.startswith(self.home))

    def audit(self, event: str, given: tuple) -> None:
        if event == "open":
            path, _, flags = given
            writes = isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR)
            if isinstance(path, str | os.PathLike) and writes and self._here(os.fspath(path)):
                self.mark(file=True)
        elif event in ("os.rename", "os.remove", "os.mkdir") and self._here(str(given[0])):
            self.mark(file=True)

    def called(self, frame: FrameType, event: str, given: object) -> None:
        if event == "call" and "motionloom" in frame.f_code.co_filename:
            self.mark()

    @contextlib.contextmanager
    def watching(self) -> Iterator[None]:
        """Marks are passed within this block: where signals interrupt, and not before or behind."""
        self.on = True
        sys.setprofile(self.called)
        try:
            yield
        finally:
            sys.setprofile(None)
            self.on = False

    def install(self) -> None:
        def write_bytes(path: Path, data: bytes) -> int:
            with path.open("wb") as file:
                done = file.write(data[: len(data) // 2])
                file.flush()
                self.mark(file=True)
                return done + file.write(data[len(data) // 2 :])

        Path.write_bytes = write_bytes  # type: ignore[assignment, method-assign]
        sys.addaudithook(self.audit)


def _work(words: list[str], folder: str, log: str, at: int, number: int) -> None:
    os.setsid()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.chdir(folder)
    for name, stream in (("out", 1), ("err", 2)):
        os.dup2(os.open(os.path.join(log, name), os.O_CREAT | os.O_TRUNC | os.O_WRONLY), stream)
    sys.stdout = open(1, "w", buffering=1, closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", buffering=1, closefd=False)  # noqa: SIM115
    marks = _Marks(at, number)
    marks.install()
    code = _function(words, marks) if ":" in words[0] else _command(words, marks)
    with open(os.path.join(log, "marks"), "w") as file:
        file.write(" ".join(map(str, [marks.passed, *marks.files])))
    os._exit(code)


def _command(words: list[str], marks: _Marks) -> int:
    from motionloom import cli

    report = cli._run_and_report

    def watched(argv: Sequence[str] | None) -> int:
        with marks.watching():
            return report(argv)

    cli._run_and_report = watched
    try:
        return cli.main(words)
    except SystemExit as error:
        return int(error.code or 0)


def _function(words: list[str], marks: _Marks) -> int:
    """Call a function, which ends as commands do where it is interrupted."""
    module, _, name = words[0].partition(":")
    work = getattr(importlib.import_module(module), name)
    with contextlib.suppress(KeyboardInterrupt), interruptible(), marks.watching():
        work(*words[1:])
        return 0
    return 130
