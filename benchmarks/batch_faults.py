"""Twenty random blows to a batch on a local Ray cluster of several processes: is every row there exactly once?

    python benchmarks/batch_faults.py --blows 20 --seed 0

A head and two more raylets are started on this machine, and `motionloom batch --ray auto` on them. Then, at random
times, a worker, a raylet or the driver is killed (SIGKILL); raylets and drivers are started again, as a cluster manager
and a user would. Among the rows is one that cannot be made. At the end the same command is run until it says that
nothing is left, and every row is looked at.
"""

import argparse
import json
import os
import random
import secrets
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

from motionloom.bulk.metadata import read_batch

PORT = 26379
RAY = [sys.executable, "-m", "ray.scripts.scripts", "start", "--block", "--disable-usage-stats"]


def processes(word: str) -> list[int]:
    """Processes of this machine whose command line has this word, but not this one."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            if word.encode() in (place / "cmdline").read_bytes() and int(place.name) != os.getpid():
                found.append(int(place.name))
        except OSError:
            continue
    return found


def kill_all(process: "subprocess.Popen[bytes]") -> None:
    """End a process that was started here and everything below it."""
    above = {}
    for place in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            above[int(place.name)] = int((place / "stat").read_text().rsplit(")", 1)[1].split()[1])
    below = [process.pid]
    for pid in below:
        below += [other for other, parent in above.items() if parent == pid]
    for pid in below:
        with suppress(OSError):
            os.kill(pid, signal.SIGKILL)
    process.wait()


class Cluster:
    """A head without processors, and raylets with one each."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.raylets: list[subprocess.Popen[bytes]] = []
        self.head = self._start("--head", f"--port={PORT}", "--num-cpus=0", "--include-dashboard=false")
        time.sleep(8)

    def add(self) -> None:
        """Another raylet."""
        self.raylets.append(self._start(f"--address=127.0.0.1:{PORT}", "--num-cpus=1"))

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
        log = (self.folder / "ray.log").open("ab")
        command = [*RAY, "--object-store-memory=100000000", *words]
        return subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True)


def main() -> None:
    """Beat a batch and look at what is left of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--blows", type=int, default=20)
    parser.add_argument("--rows", type=int, default=600)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--pause", type=float, default=20.0, help="seconds between blows, at most (default 20)")
    parser.add_argument("--weights", default="default")
    parser.add_argument("--steps", type=int, default=24)
    arguments = parser.parse_args()
    os.environ |= {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": secrets.token_hex(16)}  # this cluster's own
    dice, blows, drivers = random.Random(arguments.seed), Counter[str](), 1
    with tempfile.TemporaryDirectory(prefix="motionloom-") as name:
        folder = Path(name)
        rows = [{"prompt": "a person walks", "seconds": 1 + i % 3, "seed": i} for i in range(arguments.rows)]
        rows[arguments.rows // 2]["seconds"] = 1000  # the poisoned one
        (folder / "jobs.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
        command = [
            sys.executable, "-m", "motionloom", "batch", str(folder / "jobs.jsonl"), "--out", str(folder / "out"),
            "--format", "webdataset", "--ray", f"127.0.0.1:{PORT}", "--workers", "2", "--weights", arguments.weights,
            "--steps", str(arguments.steps),
        ]  # fmt: skip
        cluster = Cluster(folder)
        try:
            cluster.add()
            cluster.add()
            driver = subprocess.Popen(command)
            while blows.total() < arguments.blows and driver.poll() in (None, -9, 2):
                time.sleep(arguments.pause * dice.random())
                if driver.poll() is not None:
                    driver, drivers = subprocess.Popen(command), drivers + 1
                kind = dice.choice(["worker", "worker", "raylet", "driver"])
                victims = processes("ray::Hand")
                if kind == "worker" and not victims:
                    continue
                if kind == "worker":
                    os.kill(dice.choice(victims), signal.SIGKILL)
                elif kind == "raylet":
                    cluster.kill_raylet(dice)
                else:
                    driver.kill()
                    driver.wait()
                blows[kind] += 1
                print(f"{time.strftime('%X')} {kind}", flush=True)
            code = driver.wait() if driver.poll() is None else driver.poll()
            while code not in (0, 1) and drivers < 2 * arguments.blows + 10:
                code, drivers = subprocess.run(command, check=False).returncode, drivers + 1
            again = subprocess.run(command, capture_output=True, text=True, check=False)
        finally:
            cluster.end()
        found = list(read_batch(folder / "out"))
        states = Counter(one.state for one in found)
        whole = [one.row for one in found] == list(range(arguments.rows)) and states["failed"] == 1
        motions = sum(one.motion is not None for one in found)
        left = [str(path) for path in (folder / "out").rglob("*") if ".part" in path.name or ".work" in path.parts]
        print(f"{dict(blows)}, {drivers} drivers; {dict(states)}, {motions} motions read; left over: {left}")
        print(again.stdout.strip(), again.stderr.strip())
        sys.exit(0 if whole and motions == states["made"] == arguments.rows - 1 and not left else 1)


if __name__ == "__main__":
    main()
