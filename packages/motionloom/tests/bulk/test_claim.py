"""Who works in a folder: one driver for each shard, and what becomes of the claims of those who died."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import pytest

from motionloom.bulk import claim as claim_module
from motionloom.bulk.batch import LOCAL, Where, batch
from motionloom.bulk.claim import STALE, Driver, Share, claim, living, names
from motionloom.bulk.folder import RECORDS, Store
from motionloom.bulk.metadata import read_batch
from motionloom.core.errors import MotionloomError
from tests.bulk.rows import options, rows, write_jobs
from tests.bulk.test_batch import start

OUT = Path("out")


def everything() -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in OUT.rglob("*") if path.is_file()}


def of_another(share: Share = (0, 1), **known: str | int) -> Path:
    """The claim of a driver that is like this process but for what is ``known`` of it."""
    place = OUT / ".work" / f"driver-{share[0]}-of-{share[1]}.json"
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text(json.dumps(asdict(Driver.here()) | known))
    return place


def eventually(what: Callable[[], bool]) -> None:
    for _ in range(1000):
        if what():
            return
        time.sleep(0.02)
    pytest.fail("it did not happen")


def older(place: Path, seconds: float) -> None:
    then = place.stat().st_mtime - seconds
    os.utime(place, (then, then))


@pytest.mark.parametrize(
    ("first", "second", "apart"),
    [
        ((0, 1), (0, 1), False),
        ((0, 1), (1, 2), False),
        ((0, 2), (2, 4), False),
        ((1, 6), (3, 4), False),
        ((0, 2), (1, 2), True),
        ((1, 4), (0, 2), True),
        ((0, 6), (3, 4), True),
    ],
)
def test_drivers_share_a_folder_where_they_share_no_shard(first: Share, second: Share, apart: bool) -> None:
    shards = [{shard for shard in range(24) if shard % of == number} for number, of in (first, second)]
    assert shards[0].isdisjoint(shards[1]) == apart
    with claim(OUT, first):
        if apart:
            with claim(OUT, second):
                pass
        else:
            with (
                pytest.raises(MotionloomError, match=rf"out is being made by process {os.getpid()} on .*--shard"),
                claim(OUT, second),
            ):
                pytest.fail("two make the same shards")
        assert living(OUT) is not None
    assert list(OUT.iterdir()) == []


def test_the_claim_of_a_killed_driver_is_taken_over_and_told() -> None:
    code = (
        "import time\nfrom pathlib import Path\nfrom motionloom.bulk.claim import claim\n"
        "with claim(Path('out'), (0, 1)):\n    print('has it', flush=True)\n    time.sleep(600)\n"
    )
    first = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert first.stdout is not None
    assert first.stdout.readline() == "has it\n"
    with pytest.raises(MotionloomError, match=f"process {first.pid} "), claim(OUT, (0, 1)):
        pass
    first.send_signal(signal.SIGKILL)  # a dead one that nobody has waited for yet is dead, too
    eventually(lambda: living(OUT) is None)
    with pytest.warns(UserWarning, match=f"process {first.pid} .*is gone"), claim(OUT, (0, 1)) as share:
        share.check()
    first.communicate()
    assert list(OUT.iterdir()) == []


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at processes as Linux shows them")
def test_another_process_with_the_number_of_a_dead_one_is_not_taken_for_it() -> None:
    of_another(begun="1")
    with pytest.warns(UserWarning, match="is gone"), claim(OUT, (0, 1)):
        pass


@pytest.mark.parametrize("beats", [True, False])
def test_a_driver_of_another_machine_lives_as_long_as_its_heart_beats(
    beats: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that stands still is waited for until it counts as gone; a moment of doubt decides nothing."""
    place, looks = of_another(machine="another", host="elsewhere", pid=1), []

    def look(seconds: float) -> None:
        looks.append(seconds)
        if beats and len(looks) == 3:
            older(place, -5.0)
        elif not beats:
            older(place, STALE / 4)

    monkeypatch.setattr(claim_module.time, "sleep", look)
    if beats:
        with pytest.raises(MotionloomError, match="process 1 on elsewhere"), claim(OUT, (0, 1)):
            pass
        assert place.exists()
    else:
        with pytest.warns(UserWarning, match="process 1 on elsewhere"), claim(OUT, (0, 1)):
            pass
        assert 3 < len(looks) < 6


@pytest.mark.parametrize("damage", [b"", b"[]", b"\xff", b'{"pid": "x"}', b'{"pid": 1e999}'])
def test_a_claim_that_cannot_be_read_holds_as_long_as_it_is_new(damage: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    place = of_another()
    place.write_bytes(damage)
    monkeypatch.setattr(claim_module.time, "sleep", lambda _: older(place, -1.0))
    with pytest.raises(MotionloomError, match="somebody else"), claim(OUT, (0, 1)):
        pass
    older(place, 2 * STALE)
    with claim(OUT, (0, 1)):
        pass


def test_a_driver_that_was_taken_for_dead_notices(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claim_module, "BEAT", 0.01)
    with claim(OUT, (0, 1)) as held:
        older(held.place, STALE)
        before = held.place.stat().st_mtime_ns
        eventually(lambda: held.place.stat().st_mtime_ns > before)
        held.check()
        other = of_another(name="another")
        eventually(lambda: held._lost)
        with pytest.raises(MotionloomError, match="took over out"):
            held.check()
    assert other.exists()  # which is not its own to remove


def test_a_claim_for_which_there_is_no_room_is_told_and_leaves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(value: object, file: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(claim_module.json, "dump", full)
    with pytest.raises(MotionloomError, match="cannot write to out: No space left"), claim(OUT, (0, 1)):
        pass
    assert not OUT.exists()


def test_work_of_a_driver_who_lives_is_not_cleared() -> None:
    store = Store(OUT, "npz")
    with claim(OUT, (0, 2)) as held:
        mine = store.new_work(4, held.driver.name)
        left = store.new_work(4, "somebody-dead")
        store.clear_work(4, but=names(store.work) - {"me"})
        assert mine.exists()
        assert not left.exists()


def test_a_batch_makes_nothing_in_a_folder_that_somebody_has(weights: str) -> None:
    settings = options(weights, shard_rows=2)
    list(batch(rows(4), OUT, options=settings, where=Where(workers=1)))
    place = of_another(name="first")
    before = everything()
    here = Where(workers=1)
    for job, where in ((rows(6), here), ([{"prompt": "a dog"}], here), (rows(6), Where(ray=LOCAL))):
        for force in (False, True):
            with pytest.raises(MotionloomError, match="is being made by process"):
                list(batch(job, OUT, options=settings, where=where, force=force))
    assert everything() == before
    place.unlink()
    assert [one.state for one in batch(rows(6), OUT, options=settings, where=Where(workers=1))] == ["made"] * 6
    assert not (OUT / ".work").exists()


@pytest.mark.slow
def test_of_two_drivers_that_begin_at_once_one_makes_everything(weights: str, folder: Path) -> None:
    jobs, out = write_jobs(folder / "jobs.jsonl", rows(60)), folder / "out"
    both = [start(weights, jobs, out, "--workers", "1", "--shard-rows", "6") for _ in range(2)]
    errors = {one.pid: one.communicate(timeout=200)[1] for one in both}
    winners = [one.pid for one in both if one.returncode == 0]
    assert {one.returncode for one in both} <= {0, 2}
    assert winners  # both, where one had ended before the other looked
    for one in both:
        assert one.returncode == 0 or f"is being made by process {winners[0]} on" in errors[one.pid]
    assert [one.state for one in read_batch(out, motions=False)] == ["made"] * 60


def test_who_has_only_just_begun_is_named_before_the_folder_is_called_damaged(weights: str, folder: Path) -> None:
    jobs, out = write_jobs(folder / "jobs.jsonl", rows(6)), folder / "out"
    with claim(out, (0, 1)):
        (out / RECORDS).mkdir()
        second = start(weights, jobs, out, "--workers", "1")
        assert f"is being made by process {os.getpid()} on" in second.communicate(timeout=100)[1]
    assert second.returncode == 2


@pytest.mark.slow
def test_a_second_driver_says_who_works_there_though_that_one_sleeps(weights: str, folder: Path) -> None:
    jobs, out = write_jobs(folder / "jobs.jsonl", rows(60)), folder / "out"
    first = start(weights, jobs, out, "--workers", "1", "--shard-rows", "6")
    eventually(lambda: living(out) is not None)
    first.send_signal(signal.SIGSTOP)
    second = start(weights, jobs, out, "--workers", "1", "--shard-rows", "6")
    assert f"is being made by process {first.pid} on" in second.communicate(timeout=100)[1]
    first.send_signal(signal.SIGCONT)
    first.communicate(timeout=200)
    assert (first.returncode, second.returncode) == (0, 2)
    assert [one.state for one in read_batch(out, motions=False)] == ["made"] * 60
