"""Random blows to a batch on a local Ray cluster of several processes: is every row there exactly once?

    python benchmarks/batch_faults.py --blows 20 --seed 0
    python benchmarks/batch_faults.py --blows 20 --seed 0 --without-ray      # the processes of one machine

A head and two more raylets are started on this machine, and `motionloom batch --ray` on them. Then, at random times, a
worker, a raylet or the driver is killed (SIGKILL); raylets and drivers are started again, as a cluster manager and a
user would. Twice the disk is full: the folder lies on a tmpfs of its own, which is made so small that nothing more
fits into it, until the driver has ended over it (only for root on Linux; else it is said and left out). Among the rows
is one that cannot be made, and one that ends every process that makes it. In the end the same command is run until it
comes to its end, and every row is looked at; then both rows are mended, and the command is run twice more: once to make
them, once when nothing is left.
"""

import argparse
import json
import os
import random
import secrets
import signal
import socket
import subprocess
import sys
import tarfile
import tempfile
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Any

from motionloom.bulk.folder import Store
from motionloom.bulk.metadata import read_batch

PORT = 26379
RAY = [sys.executable, "-m", "ray.scripts.scripts", "start", "--block", "--disable-usage-stats"]
POISON = "a person swallows poison"
ROOM = "256m"
FULL_AT = (0.3, 0.7)
"""After these shares of the blows the disk is full."""


def deadly(prompt: str, _positions: Any, _fps: float) -> bool | None:
    """A judge that ends its process over one prompt, and knows nothing of the others."""
    if prompt == POISON:
        os._exit(9)
    return None


def driver(words: list[str]) -> int:
    """`motionloom batch` with that judge."""
    import motionloom.cli.batch
    from motionloom.cli import main as motionloom_main

    motionloom.cli.batch.JUDGE = "batch_faults:deadly"
    return motionloom_main(["batch", *words])


def family(process: "subprocess.Popen[bytes]") -> list[int]:
    """A process that was started here and everything below it."""
    above = {}
    for place in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            above[int(place.name)] = int((place / "stat").read_text().rsplit(")", 1)[1].split()[1])
    below = [process.pid]
    for pid in below:
        below += [other for other, parent in above.items() if parent == pid]
    return below


def _called(word: bytes, pids: list[int]) -> list[int]:
    """Those whose command line has this word."""
    found = []
    for pid in pids:
        with suppress(OSError):
            found += [pid] if word in Path(f"/proc/{pid}/cmdline").read_bytes() else []
    return found


def kill_all(process: "subprocess.Popen[bytes]") -> None:
    """End a process that was started here and everything below it."""
    for pid in family(process):
        with suppress(OSError):
            os.kill(pid, signal.SIGKILL)
    process.wait()


class Alone:
    """No cluster: the driver's own processes are the workers."""

    kinds = ("worker", "worker", "driver")

    def workers(self, driver: "subprocess.Popen[bytes]") -> list[int]:
        """Processes that hold a prior."""
        return _called(b"motionloom.bulk.worker", family(driver))

    def kill_raylet(self, dice: random.Random) -> None:
        """There is none."""
        raise AssertionError(dice)

    def check(self) -> None:
        """Nothing can be wrong."""

    def end(self) -> None:
        """The driver's own processes end with it."""


class Cluster(Alone):
    """A head without processors, and two raylets with one each."""

    kinds = ("worker", "worker", "raylet", "driver")

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.ports = iter(range(PORT + 1000, PORT + 9000))
        self.raylets: list[subprocess.Popen[bytes]] = []
        self.head = self._start("--head", f"--port={PORT}", "--num-cpus=0", "--include-dashboard=false")
        self._wait()
        self.add()
        self.add()

    def _wait(self) -> None:
        """Until the head takes calls."""
        while True:
            self.check()
            with suppress(OSError), socket.create_connection(("127.0.0.1", PORT), timeout=1):
                break
            time.sleep(0.5)
        time.sleep(8)
        self.check()

    def check(self) -> None:
        """Start raylets again that gave up, as Ray's do on a machine that is too busy; without a head all is over."""
        if self.head.poll() is not None:
            self.end()
            sys.exit(f"the head ended by itself: {(self.folder / 'ray.log').read_text()[-500:]}")
        ended = [raylet for raylet in self.raylets if raylet.poll() is not None]
        for raylet in ended:
            self.raylets.remove(raylet)
            self.add()

    def add(self) -> None:
        """Another raylet."""
        self.raylets.append(self._start(f"--address=127.0.0.1:{PORT}", "--num-cpus=1"))

    def workers(self, driver: "subprocess.Popen[bytes]") -> list[int]:
        """Processes that hold a prior."""
        return _called(b"ray::Hand", [pid for raylet in self.raylets for pid in family(raylet)])

    def kill_raylet(self, dice: random.Random) -> None:
        """One raylet and what it runs, gone at once; a new one takes its place."""
        gone = self.raylets.pop(dice.randrange(len(self.raylets)))
        kill_all(gone)
        self.add()

    def end(self) -> None:
        """Everything that was started here."""
        for one in (*self.raylets, self.head):
            kill_all(one)

    def _start(self, *words: str) -> "subprocess.Popen[bytes]":
        agents = ("dashboard-agent-grpc", "dashboard-agent-listen", "runtime-env-agent", "metrics-export")
        known = [f"--{agent}-port={next(self.ports)}" for agent in agents]  # else a raylet gives up on a busy machine
        command = [*RAY, "--object-store-memory=100000000", *known, *words]
        with (self.folder / "ray.log").open("ab") as log:
            return subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True)


class Disk:
    """A folder on a file system of its own, whose size can be changed."""

    def __init__(self, place: Path) -> None:
        self.place = place
        place.mkdir()
        self.mounted = (
            subprocess.run(
                ["mount", "-t", "tmpfs", "-o", f"size={ROOM}", "tmpfs", str(place)], check=False, capture_output=True
            ).returncode
            == 0
        )

    def resize(self, size: str) -> None:
        """Make it larger, or smaller than it is but not than what it holds."""
        subprocess.run(["mount", "-o", f"remount,size={size}", str(self.place)], check=True)

    def fill(self) -> None:
        """No room for anything more."""
        about = os.statvfs(self.place)
        self.resize(str((about.f_blocks - about.f_bfree) * about.f_frsize))

    def end(self) -> None:
        """As it was before."""
        if self.mounted:
            subprocess.run(["umount", str(self.place)], check=True)


class Driver:
    """The command, started again whenever it ended."""

    def __init__(self, command: list[str], folder: Path) -> None:
        self.command, self.folder, self.starts = command, folder, 0
        self.start()

    def start(self) -> None:
        """Once more."""
        self.starts += 1
        with self.output.open("wb") as out, self.errors.open("wb") as errors:
            self.popen = subprocess.Popen(self.command, stdout=out, stderr=errors)

    @property
    def output(self) -> Path:
        """Of the last start."""
        return self.folder / "driver.json"

    @property
    def errors(self) -> Path:
        """Of the last start."""
        return self.folder / "driver.txt"

    def report(self) -> dict[str, Any] | None:
        """What it said at its end; None while it runs, and where it came to none."""
        if self.popen.poll() not in (0, 1):
            return None
        try:
            return json.loads(self.output.read_text())
        except ValueError:
            return None

    def wait(self, cluster: Alone) -> None:
        """Until it ends, and the cluster is looked after meanwhile."""
        while self.popen.poll() is None:
            cluster.check()
            time.sleep(0.5)

    def finish(self, most: int, cluster: Alone) -> tuple[dict[str, Any], float]:
        """Start it until it comes to its end; what it said, and the seconds of the last start."""
        for _ in range(most):
            self.start()
            began = time.monotonic()
            self.wait(cluster)
            if found := self.report():
                return found, time.monotonic() - began
        sys.exit(f"{most} drivers came to no end: {self.errors.read_text()[-500:]}")


def job(path: Path, count: int, *, poisoned: bool) -> None:
    """Rows of 1 to 3 s."""
    rows = [{"prompt": "a person walks", "seconds": 1 + i % 3, "seed": i} for i in range(count)]
    if poisoned:
        rows[count // 2]["seconds"] = 1000
        rows[count // 3]["prompt"] = POISON
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))


def beat(cluster: Alone, one: Driver, disk: Disk, *, blows: int, pause: float, dice: random.Random) -> Counter[str]:
    """All the blows, unless the batch is ready before; how many of which kind."""
    while one.popen.poll() is None and not any(disk.place.glob("out/records/*.jsonl")):
        cluster.check()
        time.sleep(0.5)
    struck, full = Counter[str](), [round(blows * share) for share in FULL_AT] if disk.mounted else []
    while struck.total() - struck["full disk"] < blows and one.report() is None:
        time.sleep(pause * dice.random())
        cluster.check()
        if one.popen.poll() is not None:
            if one.report() is not None:
                break
            print(f"{time.strftime('%X')}   the driver ended ({one.popen.poll()}): {said(one)}", flush=True)
            one.start()
        if full and struck.total() - struck["full disk"] >= full[0]:
            full.pop(0)
            fill(one, disk, cluster)
            struck["full disk"] += 1
            continue
        kind = dice.choice(cluster.kinds)
        victims = cluster.workers(one.popen)
        if kind == "worker" and not victims:
            continue
        if kind == "worker":
            with suppress(ProcessLookupError):
                os.kill(dice.choice(victims), signal.SIGKILL)
        elif kind == "raylet":
            cluster.kill_raylet(dice)
        else:
            one.popen.kill()
            one.popen.wait()
        struck[kind] += 1
        print(f"{time.strftime('%X')} {kind}", flush=True)
    return struck


def fill(one: Driver, disk: Disk, cluster: Alone) -> None:
    """The disk is full until the driver has ended over it."""
    disk.fill()
    print(f"{time.strftime('%X')} full disk", flush=True)
    while True:
        one.wait(cluster)
        print(f"{time.strftime('%X')}   the driver ended ({one.popen.poll()}): {said(one)}", flush=True)
        if one.popen.poll() == 2 and "No space left" in said(one):
            break
        one.start()
    disk.resize(ROOM)


def said(one: Driver) -> str:
    """The last line of its complaints."""
    return (one.errors.read_text(errors="replace").strip().splitlines() or [""])[-1][:150]


def look(out: Path, rows: int) -> tuple[Counter[str], list[str]]:
    """Rows by what became of them, and everything that should not be."""
    found = list(read_batch(out))
    wrong = [] if [one.row for one in found] == list(range(rows)) else ["rows are missing or there twice"]
    made = [one.id for one in found if one.state == "made"]
    if len(set(made)) != len(made) or sum(one.motion is not None for one in found) != len(made):
        wrong.append("motions are missing or there twice")
    in_tars: list[str] = []
    for shard in out.glob("shard-*.tar"):
        with tarfile.open(shard) as tar:
            in_tars += tar.getnames()
    if sorted(in_tars) != sorted(f"{name}.{kind}" for name in made for kind in ("npz", "json")):
        wrong.append("tars hold other things than the records say")
    store = Store(out, "webdataset")
    known = {f"shard-{number:06d}.tar" for number in range(len(list(store.record(0).parent.glob("*.jsonl"))))}
    left = {path.name for path in out.iterdir()} - known - {"manifest.json", "records", "metadata.parquet"}
    left |= {path.name for path in (out / "records").iterdir()} - {name[6:12] + ".jsonl" for name in known}
    wrong += [f"left over: {name}" for name in sorted(left)]
    return Counter(one.state for one in found), wrong


def main() -> None:
    """Beat a batch and look at what is left of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--blows", type=int, default=20)
    parser.add_argument("--rows", type=int, default=600)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--pause", type=float, default=20.0, help="seconds between blows, at most (default 20)")
    parser.add_argument("--without-ray", action="store_true", help="only the processes of one machine")
    parser.add_argument("--weights", default="default")
    parser.add_argument("--steps", type=int, default=24)
    arguments = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # and so end what was started
    here = str(Path(__file__).resolve().parent)
    os.environ["PYTHONPATH"] = os.pathsep.join([here, *filter(None, [os.environ.get("PYTHONPATH")])])
    os.environ |= {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": secrets.token_hex(16)}  # this cluster's own
    os.environ |= {"RAY_raylet_start_wait_time_s": "120"}  # on a busy machine
    with tempfile.TemporaryDirectory(prefix="motionloom-") as name:
        folder = Path(name)
        disk = Disk(folder / "disk")
        if not disk.mounted:
            print("no file system of its own can be mounted here: the disk will not be full")
        try:
            sys.exit(1 if strike(folder, disk, arguments) else 0)
        finally:
            disk.end()


def strike(folder: Path, disk: Disk, arguments: argparse.Namespace) -> list[str]:
    """The whole story; what went wrong in it."""
    out = disk.place / "out"
    job(folder / "jobs.jsonl", arguments.rows, poisoned=True)
    command = [
        sys.executable,
        __file__,
        "--driver",
        str(folder / "jobs.jsonl"),
        "--out",
        str(out),
        "--format",
        "webdataset",
        "--workers",
        "2",
        "--weights",
        arguments.weights,
        "--steps",
        str(arguments.steps),
        "--filter",
        "obeys",
        "--json",
    ]
    command += [] if arguments.without_ray else ["--ray", f"127.0.0.1:{PORT}"]
    cluster = Alone() if arguments.without_ray else Cluster(folder)
    one = None
    try:
        one = Driver(command, folder)
        dice = random.Random(arguments.seed)
        struck = beat(cluster, one, disk, blows=arguments.blows, pause=arguments.pause, dice=dice)
        one.wait(cluster)
        if one.report() is None:
            one.finish(10, cluster)
        counts, wrong = look(out, arguments.rows)
        print(f"{dict(struck)}, {one.starts} drivers; {dict(counts)}")
        reasons = [f"row {row.row}: {row.why}" for row in read_batch(out, motions=False) if row.state == "failed"]
        print("\n".join(reasons))
        if struck.total() - struck["full disk"] < arguments.blows:
            wrong.append("the batch was ready before the last blow; ask for more rows")
        if counts != {"made": arguments.rows - 2, "failed": 2}:
            wrong.append("not exactly the two poisoned rows failed")
        job(folder / "jobs.jsonl", arguments.rows, poisoned=False)
        mended, seconds = one.finish(5, cluster)
        print(f"both rows mended: {mended}, {seconds:.0f} s")
        again, seconds = one.finish(1, cluster)
        print(f"once more: {again}, {seconds:.1f} s")
        counts, more = look(out, arguments.rows)
        wrong += more
        if counts != {"made": arguments.rows} or mended["tried"] != 2 or again["tried"]:
            wrong.append("the mended rows were not made exactly once")
        print("\n".join(wrong) or "every row is there exactly once")
        return wrong
    finally:
        if one is not None and one.popen.poll() is None:
            kill_all(one.popen)
        cluster.end()


if __name__ == "__main__":
    if sys.argv[1:2] == ["--driver"]:
        sys.exit(driver(sys.argv[2:]))
    main()
