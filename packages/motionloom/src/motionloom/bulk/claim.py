"""Who works in a batch's folder: one driver for each share of its shards, on whatever machine.

A driver holds ``.work/driver-I-of-N.json``: its host, process, when it began, and a name of its own. It touches that
file every `BEAT` seconds. One that ended without a word is found out by its process, where that would be on this very
machine, and else by a file that nobody has touched for `STALE` seconds. Times are those of the file system, which both
sides see, and not of two machines' clocks.
"""

import json
import math
import os
import re
import secrets
import socket
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from motionloom.bulk.folder import WORK
from motionloom.core.errors import MotionloomError

try:
    import fcntl
except ImportError:  # no such locks on this system
    fcntl = None

BEAT = 10.0
"""Seconds between two heartbeats."""
STALE = 120.0
"""Seconds without one after which a driver of another machine counts as gone."""
LOOK = 1.0
"""Seconds between two looks at a driver of another machine that may be gone."""
_NAME = re.compile(r"driver-(\d{1,9})-of-(\d{1,9})\.json")

Share = tuple[int, int]
"""(i, n): every n-th shard from the i-th on."""


@dataclass(frozen=True)
class Driver:
    """The process that generates a share of a batch."""

    name: str
    """Of its own: nobody else has it."""
    host: str
    machine: str
    """What distinguishes machines of one name, and two starts of one; processes of one machine see each other."""
    pid: int
    begun: str
    """When the process began, as its machine counts: another one may get the number of one that ended."""
    start: str
    """Day and time, for people."""

    @staticmethod
    def here() -> "Driver":
        """This process."""
        start = time.strftime("%Y-%m-%d %H:%M:%S")
        return Driver(
            secrets.token_hex(8), socket.gethostname(), _machine(), os.getpid(), _start_of(os.getpid()), start
        )

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host}, begun {self.start}"


class Claim:
    """A share of a folder that this process has; created by `claim`."""

    def __init__(self, place: Path, driver: Driver) -> None:
        self.place, self.driver = place, driver
        self._over, self._lost = threading.Event(), False
        threading.Thread(target=self._beat, daemon=True).start()

    def check(self) -> None:
        """Raise `MotionloomError` where somebody has taken this process for dead, and works in its place."""
        if self._lost:
            raise MotionloomError(
                f"another driver took over {self.place.parents[1]} while this one gave no sign of life; let it work, "
                "and run the same command when it ended"
            )

    def end(self) -> None:
        """Give the share back."""
        self._over.set()
        with suppress(OSError):
            owner = _read(self.place.read_bytes())
            if owner is not None and owner.name == self.driver.name:
                self.place.unlink()
        with suppress(OSError):  # others work there, or left something behind
            self.place.parent.rmdir()

    def _beat(self) -> None:
        while not self._over.wait(BEAT):
            try:
                owner = _read(self.place.read_bytes())
                if owner is not None and owner.name == self.driver.name:
                    os.utime(self.place)
                    continue
            except FileNotFoundError:
                pass
            except OSError:  # such as a file server that is away: the next one may come through
                continue
            self._lost = not self._over.is_set()
            return


@contextmanager
def claim(out: Path, share: Share) -> Iterator[Claim]:
    """Hold a share of the folder, which is created if it is missing, during the block.

    Raises `MotionloomError` where a living driver has one of its shards, and names it; warns where a dead one had.
    """
    work = out / WORK
    try:
        place, driver = _claimed(work, share)
    except OSError as error:
        with suppress(OSError):  # both only where they are empty
            work.rmdir()
            out.rmdir()
        raise MotionloomError(f"cannot write to {out}: {error.strerror or error}") from None
    held = Claim(place, driver)
    try:
        yield held
    finally:
        held.end()


def refuse_beside(out: Path, share: Share) -> None:
    """Raise `MotionloomError` where a living driver has one of the share's shards; nothing is claimed."""
    _gone(out / WORK, share)


def living(out: Path, share: Share = (0, 1)) -> Driver | None:
    """A driver that works in the folder, on one of the shards of a share; None: nobody does, as far as is known."""
    others = _others(out / WORK, share)
    return next((one for place, one in others if one is not None and not _is_gone(place, one)), None)


def names(work: Path) -> set[str]:
    """Names of the drivers whose claims lie in the folder ``work``."""
    return {driver.name for _, driver in _others(work, (0, 1)) if driver is not None}


def _claimed(work: Path, share: Share) -> tuple[Path, Driver]:
    place, driver = work / f"driver-{share[0]}-of-{share[1]}.json", Driver.here()
    while True:
        work.mkdir(parents=True, exist_ok=True)
        gone = _gone(work, share)
        with suppress(FileNotFoundError, FileExistsError):  # somebody came first, or cleared up behind himself
            with _alone(work):
                if dict(_others(work, share)) != gone:
                    continue
                for one in gone:
                    one.unlink()
                _write(place, driver)
            for one in filter(None, gone.values()):
                warnings.warn(f"{one}, is gone without having ended its work; this one goes on with it", stacklevel=4)
            return place, driver


def _write(place: Path, driver: Driver) -> None:
    """Raises FileExistsError where somebody has it."""
    with place.open("x", encoding="utf-8") as file:
        try:
            json.dump(asdict(driver), file)
            file.flush()
        except OSError:  # a full disk: half a claim would keep others away
            place.unlink()
            raise


def _gone(work: Path, share: Share) -> dict[Path, Driver | None]:
    """Claims on shards of the share whose drivers are gone; raises `MotionloomError` where one lives."""
    claims = dict(_others(work, share))
    for place, driver in claims.items():
        if not _is_gone(place, driver):
            raise MotionloomError(
                f"{work.parent} is being made by {driver or 'somebody else'}; wait for it or end it, or give every "
                "driver a share of its own with --shard i/n"
            )
    return claims


def _others(work: Path, share: Share) -> Iterator[tuple[Path, Driver | None]]:
    """Claims on shards of the share, and whose they are; None: it cannot be read."""
    for place in sorted(work.glob("driver-*.json")):
        match = _NAME.fullmatch(place.name)
        if match is None:
            continue
        first, count = int(match[1]), max(int(match[2]), 1)
        if (first - share[0]) % math.gcd(count, share[1]) == 0:
            with suppress(FileNotFoundError):
                yield place, _read(place.read_bytes())


def _read(data: bytes) -> Driver | None:
    try:
        values = json.loads(data)
        return Driver(**{**{name: str(value) for name, value in values.items()}, "pid": int(values["pid"])})
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError):
        return None


def _is_gone(place: Path, driver: Driver | None) -> bool:
    """Whether a driver lives no more; of another machine's it takes until its file is touched, or has long not been."""
    if driver is not None and driver.begun and driver.machine == _machine():
        return _start_of(driver.pid) != driver.begun
    first = None
    while True:
        beats = _beats(place)
        if beats is None or beats[1] - beats[0] > STALE:
            return True
        if first is not None and beats[0] > first:
            return False
        first = beats[0]
        time.sleep(LOOK)


def _beats(place: Path) -> tuple[float, float] | None:
    """When a claim was last touched, and now, both by the file system's clock; None: it is not there."""
    probe = place.with_name(f"{secrets.token_hex(8)}.now")
    try:
        with place.open("rb") as file:  # opened, so that a network's file system looks anew
            beat = os.fstat(file.fileno()).st_mtime
        probe.touch()
        return beat, probe.stat().st_mtime
    except FileNotFoundError:
        return None
    finally:
        probe.unlink(missing_ok=True)


def _machine() -> str:
    """What processes have in common that see each other; of a system without these files the host's name alone."""
    known = [socket.gethostname()]
    with suppress(OSError):
        known.append(Path("/proc/sys/kernel/random/boot_id").read_text().strip())
    with suppress(OSError):
        known.append(os.readlink("/proc/self/ns/pid"))
    return " ".join(known)


def _start_of(pid: int) -> str:
    """When a process of this machine began, as text to be compared; empty where there is none."""
    with suppress(OSError, IndexError):
        state, *fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
        return "" if state in "ZX" else fields[18]
    if os.name == "nt" or Path("/proc/self/stat").exists():
        return ""
    with suppress(ProcessLookupError):
        with suppress(PermissionError):
            os.kill(pid, 0)
        return "there"
    return ""


@contextmanager
def _alone(work: Path) -> Iterator[None]:
    """Nobody else of those who share a kernel, or a file system with locks, is within such a block."""
    file = os.open(work, os.O_RDONLY) if os.name != "nt" else None
    try:
        if fcntl is not None and file is not None:
            with suppress(OSError):  # a file system without locks: `_write` is exclusive by itself
                fcntl.flock(file, fcntl.LOCK_EX)
            if not work.is_dir() or os.fstat(file).st_ino != work.stat().st_ino:
                raise FileNotFoundError(str(work))
        yield
    finally:
        if file is not None:
            os.close(file)
