"""Batches on a real local Ray cluster: the same motions, also when its workers are killed."""

import os
import signal
import time
from pathlib import Path
from threading import Thread

import pytest

from motionloom.bulk.batch import LOCAL, Where, batch
from motionloom.bulk.folder import Store
from tests.bulk.rows import apart, options, positions, rows

pytest.importorskip("ray")
pytestmark = pytest.mark.slow
COUNT = 24


def actors(parent: int) -> list[int]:
    """Ray's processes of this machine that hold a prior, below this one."""
    pids = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            if b"ray::Hand" in (place / "cmdline").read_bytes() and parent in _above(int(place.name)):
                pids.append(int(place.name))
        except (OSError, IndexError):
            continue
    return pids


def _above(pid: int) -> set[int]:
    parents = set()
    while pid > 1:
        parents.add(pid)
        pid = int((Path("/proc") / str(pid) / "stat").read_text().rsplit(")", 1)[1].split()[1])
    return parents


def test_ray_makes_the_same_motions_although_workers_are_killed(
    weights: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    exact = {
        (one.about["text"], one.about["seed"]): one.motion.positions()
        for one in batch(rows(COUNT), options=options(weights))
        if one.motion
    }
    out, kills = folder / "out", []

    def kill() -> None:
        store = Store(out, "npz")
        while len(kills) < 2 and not store.record(2).exists():
            time.sleep(0.2)
            if living := [pid for pid in actors(os.getpid()) if pid not in kills]:
                if not kills and not store.record(0).exists():
                    continue  # at first somebody is to have made something
                kills.append(living[0])
                os.kill(living[0], signal.SIGKILL)

    killer = Thread(target=kill, daemon=True)
    killer.start()
    results = list(batch(rows(COUNT), out, options=options(weights), where=Where(workers=1, ray=LOCAL)))
    killer.join()
    assert kills
    assert [(one.row, one.state) for one in results] == [(i, "made") for i in range(COUNT)]
    assert apart(positions(out), exact) < 3e-6
    assert not capsys.readouterr().out  # there are results only, which may be JSON
