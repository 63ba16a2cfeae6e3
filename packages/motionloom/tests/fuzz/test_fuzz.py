"""A short run of the fuzzer over every reader, and that it notices what it is there to notice."""

import os
import random
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from motionloom.core.errors import MotionloomError
from tests.fuzz import machine, readers
from tests.fuzz.machine import fuzz
from tests.fuzz.mutations import mutated
from tests.fuzz.readers import READERS, Reader


def test_every_reader_answers_damaged_files_with_a_value_or_one_sentence() -> None:
    """A few files of each; `make fuzz` is for longer runs.

    In a process of its own: the fuzzer forks, and a fork of a test process that has other threads may never go on.
    """
    own = [reader for reader in READERS if reader.read.__module__.startswith("tests.")]  # not the laboratory's
    files = 6 * len(own)
    command = [sys.executable, "-m", "tests.fuzz", "--seconds", "900", "--files", str(files), "--seed", "20"]
    run = subprocess.run(command, cwd=Path(__file__).parents[2], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    assert f"{files} files tried, 0 failures" in run.stdout
    tried = {line[:24].strip() for line in run.stdout.splitlines()[:-1]}
    assert tried == {reader.name for reader in own}


@pytest.fixture
def one(monkeypatch: pytest.MonkeyPatch):
    """The fuzzer with one reader, whose way of reading is given."""

    def run(read, files: int = 3, first: int = 0, keep: Path | None = None) -> machine.Result:
        made = Reader(
            "x", lambda folder: (folder / "a").write_bytes(b"one 2 three\n"), {"a": "text"}, _good_first(read)
        )
        monkeypatch.setattr(readers, "READERS", [made])
        return fuzz(seconds=600.0, files=files, first=first, seed=1, keep=keep)

    return run


def _good_first(read):
    """The good file is read before anything is damaged, in the process that watches: the fault must not be there."""
    home = os.getpid()
    return lambda folder: None if os.getpid() == home else read(folder)


def fail(error: BaseException):
    def read(folder: Path) -> None:
        raise error

    return read


def test_what_is_right_is_counted_and_no_failure(one) -> None:
    result = one(lambda folder: (folder / "a").read_bytes())
    assert (result.tried["x"], result.read["x"], result.failures) == (3, 3, [])
    assert one(fail(MotionloomError("a is damaged"))).read["x"] == 0
    assert "3 files tried, 0 failures" in result.report()


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (ValueError("x"), "ValueError: x"),
        (RecursionError("x"), "RecursionError"),
        (MotionloomError(""), "no sentence"),
        (MotionloomError("a file is damaged (MemoryError)"), "MemoryError behind a sentence"),
        (SystemExit(2), "SystemExit"),
    ],
    ids=["another error", "depth", "no words", "memory behind a sentence", "exit"],
)
def test_other_answers_are_failures(one, error: BaseException, said: str) -> None:
    result = one(fail(error))
    assert len(result.failures) == 3
    assert all(said in what for _, _, what in result.failures)


def endless(folder: Path) -> None:
    """Outside of Python: no handler of Python's would be heard."""
    re.match(r"(a*)*b", "a" * 40)


def test_what_hangs_is_ended_and_the_run_goes_on(one, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine, "ALARM", 0.2)
    result = one(endless, files=2)
    assert [what for _, _, what in result.failures] == ["no answer within 0.2 s"] * 2


def test_a_process_that_dies_is_a_failure(one) -> None:
    result = one(lambda folder: os.kill(os.getpid(), signal.SIGKILL), files=2)
    assert [what for _, _, what in result.failures] == [f"the process died ({-signal.SIGKILL})"] * 2


def test_more_than_a_gigabyte_is_a_failure(one) -> None:
    result = one(lambda folder: bytearray(machine.MEMORY + (64 << 20)), files=1)
    assert "MemoryError" in result.failures[0][2]
    assert not one(lambda folder: bytearray(machine.MEMORY // 2), files=1).failures


def test_a_file_does_not_depend_on_those_that_were_damaged_before() -> None:
    """What is put into a file is a copy: it is changed later, and grew from file to file until the memory was full."""
    whole = b'{"a": [1, {"b": []}], "c": {"d": 2.5}}'
    first = [mutated(whole, "json", random.Random(number)) for number in range(300)]
    assert [mutated(whole, "json", random.Random(number)) for number in range(300)] == first


def show(folder: Path) -> None:
    raise ValueError(repr((folder / "a").read_bytes()[:200]))


def test_the_same_seed_and_number_make_the_same_file(one) -> None:
    """So a file that failed is tried again alone."""
    seen = one(show, files=5).failures
    assert seen == one(show, files=5).failures
    assert one(show, files=1, first=3).failures == seen[3:4]
    assert len({what for _, _, what in seen}) > 1


@pytest.mark.parametrize("read", [endless, show], ids=["hangs", "raises"])
def test_what_fails_is_kept(one, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, read) -> None:
    monkeypatch.setattr(machine, "ALARM", 0.2)
    (failure,) = one(read, files=1, first=4, keep=tmp_path / "kept").failures
    assert (tmp_path / "kept" / "x-4" / "a").is_file()
    assert failure[2] in (tmp_path / "kept" / "x-4" / "what.txt").read_text()
