"""One shard: what is made, what is kept, what is told, and that it is whole or not there."""

import errno
import json
import shutil
import tarfile
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom.bulk import maker as maker_module
from motionloom.bulk import row as row_module
from motionloom.bulk import shard as shard_module
from motionloom.bulk import writers as writers_module
from motionloom.bulk.batch import _items
from motionloom.bulk.folder import Store, open_folder
from motionloom.bulk.jobs import Jobs
from motionloom.bulk.maker import Made, Maker, Options
from motionloom.bulk.metadata import Result, read_batch
from motionloom.bulk.shard import CAREFUL, FATAL, Batch, Report, Task, make_shard
from motionloom.core.errors import MotionloomError
from motionloom.io import load
from tests.bulk.rows import apart, options, positions, rows, write_jobs

OUT = Path("out")
TIMELINE = "segments: [{text: a person walks, seconds: 1}, {text: a person sits, seconds: 1}]\n"


@pytest.fixture(scope="module")
def ready(weights: str) -> Maker:
    """A maker that knows no folder but the one that a test is in."""
    return Maker(options(weights), folder=Path())


def make(maker: Maker, job: list[dict[str, Any]], settings: Options | None = None, first: int = 0) -> Report:
    """The rows as shard 0 of the folder ``out``."""
    settings = settings or maker.options
    maker.sources._files.clear()
    manifest = open_folder(OUT, settings, rows=len(job), shard_rows=max(len(job), 1))
    batch = Batch(str(OUT), ".", manifest["weights"]["sha256"], manifest["duets"], settings)
    return make_shard(Task(0, first, [json.dumps(row).encode() for row in job]), batch, maker)


def results() -> list[Result]:
    return list(read_batch(OUT))


def everything() -> dict[str, bytes]:
    return {str(path.relative_to(OUT)): path.read_bytes() for path in OUT.rglob("*") if path.is_file()}


@pytest.mark.parametrize("kind", ["npz", "bvh", "glb", "webdataset", "parquet"])
def test_what_is_written_is_read_back(ready: Maker, kind: str) -> None:
    if kind == "parquet":
        pytest.importorskip("pyarrow")
    make(ready, rows(5))
    exact = positions(OUT)
    OUT.rename("npz")
    assert make(ready, rows(5), replace(ready.options, format=kind)).counts == {"made": 5}
    assert [one.row for one in results()] == [0, 1, 2, 3, 4]
    assert apart(positions(OUT), exact) < 2e-3  # BVH rounds


def test_a_tar_is_as_webdataset_reads_it_and_the_same_bytes_again(ready: Maker) -> None:
    settings = replace(ready.options, format="webdataset")
    make(ready, [*rows(3), {"prompt": "a person sits", "id": "mine"}], settings)
    first = everything()
    with tarfile.open(OUT / "shard-000000.tar") as tar:
        names = tar.getnames()
        about = json.loads(tar.extractfile("mine.json").read())  # type: ignore[union-attr]
    assert names[::2] == [name.replace(".json", ".npz") for name in names[1::2]]
    assert (about["text"], about["seed"], about["id"]) == ("a person sits", 0, "mine")
    assert about["key"] != "mine"
    OUT.rename("before")
    make(ready, [*rows(3), {"prompt": "a person sits", "id": "mine"}], settings)
    assert everything() == first


def test_a_shard_that_is_there_is_not_made_again(ready: Maker, monkeypatch: pytest.MonkeyPatch) -> None:
    make(ready, rows(4))
    before = everything()
    monkeypatch.setattr(Maker, "_make_all", lambda *_: pytest.fail("a motion was made"))
    assert make(ready, rows(4)) == Report(0, 4, {"made": 4}, 0)
    assert everything() == before


@pytest.mark.parametrize("kind", ["npz", "webdataset", "parquet"])
def test_only_what_is_missing_is_made_in_whatever_order_rows_come(ready: Maker, kind: str) -> None:
    if kind == "parquet":
        pytest.importorskip("pyarrow")
    settings = replace(ready.options, format=kind)
    make(ready, rows(4), settings)
    four = positions(OUT)
    report = make(ready, rows(6)[::-1], settings)
    assert (report.counts, report.new_rows) == ({"made": 6}, 2)
    six = positions(OUT)
    assert apart({key: six[key] for key in four}, four) == 0
    assert [one.about["seed"] for one in results()] == [5, 4, 3, 2, 1, 0]
    report = make(ready, rows(2), settings)  # and what is no longer asked for goes
    assert (report.counts, report.new_rows, len(positions(OUT))) == ({"made": 2}, 0, 2)


def test_rows_that_cannot_be_are_listed_with_a_sentence_and_the_others_made(ready: Maker) -> None:
    job = [{"prompt": ""}, *rows(3), {"prompt": "a", "seconds": 1e9}, {"prompt": "a", "goal": "absent.json"}]
    report = make(ready, job)
    assert report.counts == {"made": 3, "failed": 3}
    failed = [one for one in results() if one.state == "failed"]
    assert [one.row for one in failed] == [0, 4, 5]
    assert [word in one.why for one, word in zip(failed, ("prompt", "1e+09", "absent.json"), strict=True)] == [True] * 3
    assert len(report.problems) == 3


def test_rows_that_nobody_can_make_as_they_are_written_are_not_tried_again(ready: Maker, folder: Path) -> None:
    """But those are that name files, which may come, and those that may go well another time."""
    for number, (row, again) in enumerate(
        [
            ({"prompt": ""}, False),
            ({"prompt": "a", "seconds": 99}, False),
            ({"prompt": "a", "goal": "absent.json"}, True),
        ]
    ):
        job = [*rows(2), row]
        make(ready, job)
        OUT.rename(f"out{number}")
        jobs = Jobs.of(write_jobs(folder / "jobs.jsonl", job))
        (item,) = _items(jobs, 3, Store(folder / f"out{number}", "npz"), (0, 1))
        assert isinstance(item, Task) == again
        if isinstance(item, Report):
            assert (item.counts, item.new_rows, len(item.problems)) == ({"made": 2, "failed": 1}, 0, 1)


def test_a_row_that_breaks_the_program_breaks_itself_alone(ready: Maker, monkeypatch: pytest.MonkeyPatch) -> None:
    """And is tried again, when it may go well; what is there already stays as it is."""
    finished = Maker._finished

    def poisoned(self: Maker, orders: Any, *more: Any) -> Any:
        if orders.seed == 2:
            raise ZeroDivisionError("poison")
        return finished(self, orders, *more)

    with monkeypatch.context() as patch:
        patch.setattr(Maker, "_finished", poisoned)
        assert make(ready, rows(5)).counts == {"made": 4, "failed": 1}
    bad = results()[2]
    assert (bad.state, bad.motion) == ("failed", None)
    assert "ZeroDivisionError: poison" in bad.why
    before = everything()
    assert make(ready, rows(5)) == Report(0, 5, {"made": 5}, 1)
    after = everything()
    assert all(after[name] == data for name, data in before.items() if name.endswith(".npz"))


@pytest.mark.parametrize("seconds", ["1" + "0" * 400, "-1" + "0" * 400, "1e999", "1" + "0" * 4400])
def test_a_number_of_very_many_digits_is_the_error_of_its_row(ready: Maker, seconds: str) -> None:
    lines = [json.dumps(row).encode() for row in rows(3)]
    lines[1] = b'{"prompt": "a person walks", "seconds": %s}' % seconds.encode()
    open_folder(OUT, ready.options, rows=3, shard_rows=3)
    report = make_shard(Task(0, 0, lines), Batch(str(OUT), ".", "", {}, ready.options), ready)
    assert report.counts == {"made": 2, "failed": 1}
    assert results()[1].state == "failed"
    assert "OverflowError" not in results()[1].why


@pytest.mark.parametrize("at", ["parse", "ask", "passes", "add", "run"])
def test_whatever_goes_wrong_with_a_row_is_its_error_once(
    ready: Maker, at: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Wherever it happens, the others are made; where it is not known whose fault it was, each is made by itself."""
    times: Counter[bool] = Counter()

    def poisoned(value: Any) -> None:
        if "99" in str(value):
            times[True] += 1
            raise ZeroDivisionError("poison")

    def before(place: Any, name: str, what: Any) -> None:
        old = getattr(place, name)
        monkeypatch.setattr(
            place, name, lambda *arguments, **more: (poisoned(what(*arguments)), old(*arguments, **more))[1]
        )

    before(
        *{
            "parse": (row_module, "_columns", lambda raw: raw),
            "ask": (row_module.Sources, "_robot", lambda self, row: row.seed),
            "passes": (Made, "passes", lambda self, _: "99" if len(self.motion) == 19 else ""),
            "add": (writers_module.Files, "add", lambda self, take, about: about["seed"]),
            "run": (maker_module, "run_each", lambda plans, *_: "99" if any(p.seconds == 0.95 for p in plans) else ""),
        }[at]
    )
    job = [*rows(2), {"prompt": "a person walks", "seconds": 0.95, "seed": 99}, *rows(5)[3:]]
    assert make(ready, job).counts == {"made": 4, "failed": 1}
    assert [(one.row, "ZeroDivisionError: poison" in one.why) for one in results() if one.state == "failed"] == [
        (2, True)
    ]
    assert times[True] == (2 if at == "run" else 1)
    assert not list((OUT / ".work").iterdir())


def test_a_shard_that_cannot_be_put_together_says_so_once(ready: Maker, monkeypatch: pytest.MonkeyPatch) -> None:
    """No process dies of it, and nobody asks for more memory."""
    monkeypatch.setattr(Store, "commit", lambda *_, **__: {}["nothing"])
    with pytest.raises(MotionloomError, match=r"shard 0 cannot be put together.*KeyError") as raised:
        make(ready, rows(3))
    assert "memory" not in str(raised.value)
    assert not list((OUT / ".work").iterdir())


def test_a_row_that_ends_its_process_every_time_is_found_out(ready: Maker, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that dies leaves notes behind; here it dies by an exception that nobody catches."""

    class Killed(BaseException):
        pass

    finished = Maker._finished
    tried: Counter[int] = Counter()

    def deadly(self: Maker, orders: Any, *more: Any) -> Any:
        tried[orders.seed] += 1
        if orders.seed == 1:
            raise Killed
        return finished(self, orders, *more)

    with monkeypatch.context() as patch:
        patch.setattr(Maker, "_finished", deadly)
        for _ in range(CAREFUL + FATAL):
            with pytest.raises(Killed):
                make(ready, rows(3))
            assert not (OUT / "records/000000.jsonl").exists()
        assert make(ready, rows(3)).counts == {"made": 2, "failed": 1}
    assert "ended the process" in results()[1].why
    assert tried[1] == CAREFUL + FATAL
    assert make(ready, rows(3)) == Report(0, 3, {"made": 3}, 1)


def test_rows_that_were_made_before_the_one_that_ends_its_process_are_not_blamed(
    ready: Maker, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Killed(BaseException):
        pass

    finished = Maker._finished

    def deadly(self: Maker, orders: Any, *more: Any) -> Any:
        if orders.seed == 3:
            raise Killed
        return finished(self, orders, *more)

    job = [{"prompt": "a person walks", "seconds": 1.0, "seed": seed} for seed in range(6)]
    monkeypatch.setattr(Maker, "_finished", deadly)
    for _ in range(CAREFUL + FATAL):
        with pytest.raises(Killed):
            make(ready, job)
    assert make(ready, job).counts == {"made": 5, "failed": 1}
    assert [one.row for one in results() if one.state == "failed"] == [3]


def test_the_same_row_twice_is_one_motion_and_an_id_names_one_row(ready: Maker) -> None:
    same = rows(1)[0]
    job = [same, same, same | {"id": "a"}, rows(2)[1] | {"id": "a"}]
    assert make(ready, job).counts == {"made": 2, "repeated": 1, "failed": 1}
    states = [(one.state, one.why) for one in results()]
    assert states[1] == ("repeated", "row 0 of the job is the same")
    assert states[3] == ("failed", "row 2 has this id")
    assert len(list((OUT / "shard-000000").iterdir())) == 2


def test_a_filter_drops_what_does_not_pass_and_says_what_it_measured(ready: Maker) -> None:
    make(ready, rows(6))
    travel = sorted(one.about["travel"] for one in results())
    OUT.rename("all")
    condition = f"travel > {travel[2]}"
    assert make(ready, rows(6), replace(ready.options, filter=condition)).counts == {"made": 3, "dropped": 3}
    for one in results():
        assert (one.about["travel"] > travel[2]) == (one.state == "made") == (one.motion is not None)
    assert make(ready, rows(6), replace(ready.options, filter=condition)).new_rows == 0


@pytest.mark.parametrize("kind", ["npz", "webdataset"])
def test_two_who_make_the_same_shard_keep_apart(ready: Maker, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """An actor whose driver died may go on for a while beside the one that took its place."""
    settings = replace(ready.options, format=kind)
    make(ready, rows(3), settings)
    exact = everything()
    shutil.rmtree(OUT)
    commit, others = shard_module._Shard._commit, []

    def late(self: Any, data: Path | None, **more: Any) -> Report:
        if not others:
            others.append("begun")
            others.append(make(ready, rows(3), settings))
        return commit(self, data, **more)

    monkeypatch.setattr(shard_module._Shard, "_commit", late)
    with pytest.raises(MotionloomError, match="cannot write to out"):
        make(ready, rows(3), settings)
    assert others[1] == Report(0, 3, {"made": 3}, 3)
    assert everything() == exact


def test_a_full_disk_leaves_the_folder_as_it_was(ready: Maker, monkeypatch: pytest.MonkeyPatch) -> None:
    make(ready, rows(3))
    before = everything()
    add = shard_module.writer

    def full(*arguments: Any, **options: Any) -> Any:
        result = add(*arguments, **options)
        monkeypatch.setattr(result, "add", lambda *_: (_ for _ in ()).throw(OSError(errno.ENOSPC, "No space left")))
        return result

    with monkeypatch.context() as patch:
        patch.setattr(shard_module, "writer", full)
        with pytest.raises(MotionloomError, match=r"cannot write to out: No space left"):
            make(ready, rows(5))
    del before["manifest.json"]  # it says five rows now
    after = everything()
    del after["manifest.json"]
    assert after == before
    assert make(ready, rows(5)).new_rows == 2


def flipped(data: bytes) -> bytes:
    """The same but for one bit in the middle."""
    at = len(data) // 2
    return data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]


DAMAGES = {
    "cut": lambda data: data[:-10],
    "flipped": flipped,
    "gone": lambda data: None,
    "record gone": lambda data: None,
    "record empty": lambda data: b"{}\n",
    "record flipped": flipped,
    "record cut after its first line": lambda data: data[: data.index(b"\n") + 1],
    "record cut after its last line": lambda data: data[: data.rindex(b"\n", 0, -1) + 1],
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("kind", ["npz", "webdataset"])
def test_what_is_damaged_is_found_and_made_anew(ready: Maker, kind: str, damage: str, folder: Path) -> None:
    """Of a folder of single files the one motion, of one large file, or where the record is at fault, all of them."""
    settings, job = replace(ready.options, format=kind), rows(3)
    make(ready, job, settings)
    before = everything()
    data, record = Store(OUT, kind).data(0), OUT / "records/000000.jsonl"
    file = record if damage.startswith("record") else data if data.is_file() else next(data.iterdir())
    left = DAMAGES[damage](file.read_bytes())
    file.unlink() if left is None else file.write_bytes(left)

    jobs = Jobs.of(write_jobs(folder / "jobs.jsonl", job))
    assert [type(item) for item in _items(jobs, 3, Store(OUT, kind), (0, 1))] == [Task]
    assert Store(OUT, kind).damage(0) == [file]
    assert make(ready, job, settings).new_rows == (1 if file.parent == data else 3)
    assert everything() == before
    assert [type(item) for item in _items(jobs, 3, Store(OUT, kind), (0, 1))] == [Report]


def test_a_folder_of_before_there_were_hashes_goes_on(ready: Maker, folder: Path) -> None:
    make(ready, rows(3))
    record = OUT / "records/000000.jsonl"
    head, *lines = record.read_text().splitlines(keepends=True)
    old = {key: value for key, value in json.loads(head).items() if key not in ("sha256", "record")}
    record.write_text("".join([json.dumps(old) + "\n", *lines]))
    jobs = Jobs.of(write_jobs(folder / "jobs.jsonl", rows(3)))
    assert [type(item) for item in _items(jobs, 3, Store(OUT, "npz"), (0, 1))] == [Report]
    next(Store(OUT, "npz").data(0).iterdir()).unlink()
    assert [type(item) for item in _items(jobs, 3, Store(OUT, "npz"), (0, 1))] == [Task]
    assert make(ready, rows(3)).new_rows == 3


def test_goals_timelines_and_skeletons_are_made_and_measured(ready: Maker, folder: Path) -> None:
    (folder / "a.yaml").write_text(TIMELINE)
    goal = {"path": {"points": [[0, 0], [0, 0.5]]}}
    (folder / "goal.json").write_text(json.dumps(goal))
    taller = load(_someone_taller(folder))
    job = [
        {"prompt": "a person walks", "seconds": 1, "goal": "goal.json"},
        {"prompt": "a person walks", "seconds": 1, "seed": 1, "goal": goal},
        {"timeline": "a.yaml", "seed": 4},
        {"prompt": "a person walks", "seconds": 1, "skeleton": "rig.npz"},
    ]
    report = make(ready, job)
    assert report.counts == {"made": 4}
    control, _, long, rig = results()
    assert control.about["error"] is not None
    assert (long.about["frames"], long.about["text"], long.about["error"]) == (
        40,
        "a person walks; a person sits",
        None,
    )
    assert rig.motion is not None
    assert np.allclose(rig.motion.skeleton.offsets, taller.skeleton.offsets)
    (folder / "goal.json").write_text(json.dumps({"path": {"points": [[0, 0], [0, 0.4]]}}))
    assert make(ready, job).new_rows == 1  # only that of the goal that changed


def _someone_taller(folder: Path) -> Path:
    from motionloom.core.motion import Motion
    from motionloom.core.skeleton import SMPL22
    from motionloom.io import save

    skeleton = replace(SMPL22, offsets=1.2 * SMPL22.offsets)
    return save(Motion(skeleton, 20.0, np.zeros((2, 3)), np.tile([1.0, 0, 0, 0], (2, 22, 1))), folder / "rig.npz")


def test_single_motions_are_those_of_the_single_commands(ready: Maker, folder: Path) -> None:
    """The same as `generate`, `control` and `compose` of the same seeds make."""
    from motionloom import Segment, compose, control, generate
    from motionloom.goals.goal_file import read_goal

    goal = {"path": {"points": [[0, 0], [0, 0.5]]}}
    (folder / "a.yaml").write_text(TIMELINE)
    job = [
        {"prompt": "a person walks", "seconds": 1, "seed": 3},
        {"prompt": "a person walks", "seconds": 1, "seed": 3, "goal": goal},
        {"timeline": "a.yaml", "seed": 3},
        {"prompt": "turn left 90 degrees", "seed": 3},
    ]
    make(ready, job)
    prior, read = ready.prior, read_goal(goal, frames=20, folder=folder)
    segments = [Segment("a person walks", 1.0, transition=0.5), Segment("a person sits", 1.0, transition=0.5)]
    single = [
        generate(prior, "a person walks", seconds=1.0, seed=3, steps=2, literal=True)[0],
        control(prior, "a person walks", read, seed=3, steps=2)[0].motion,
        compose(prior, segments, seed=3, steps=2),
        generate(prior, "turn left 90 degrees", seed=3, steps=2)[0],
    ]
    assert [one.about["keeps"] is None for one in results()] == [True, True, True, False]
    for one, motion in zip(results(), single, strict=True):
        assert one.motion is not None
        assert np.abs(one.motion.positions() - motion.positions()).max() < 2e-5


@pytest.mark.parametrize(
    "change", [{"steps": 3}, {"guidance": 1.0}, {"format": "bvh"}, {"filter": "skate < 1"}, {"seed": 1}]
)
def test_a_folder_of_other_settings_is_refused(ready: Maker, change: dict[str, Any]) -> None:
    make(ready, rows(2))
    with pytest.raises(MotionloomError, match="other settings"):
        make(ready, rows(2), replace(ready.options, **change))


def test_a_folder_of_something_else_is_refused(ready: Maker) -> None:
    OUT.mkdir()
    (OUT / "holiday.jpg").write_text("a picture")
    with pytest.raises(MotionloomError, match=r"holds other files"):
        make(ready, rows(2))
    (OUT / "manifest.json").write_text('{"kind": "train"}')
    with pytest.raises(MotionloomError, match="does not describe a batch"):
        make(ready, rows(2))


def test_a_damaged_tar_is_one_sentence(ready: Maker) -> None:
    make(ready, rows(2), replace(ready.options, format="webdataset"))
    place = OUT / "shard-000000.tar"
    data = place.read_bytes()
    place.write_bytes(b"\xff" * 600 + data[600:])
    with pytest.raises(MotionloomError, match=r"shard-000000\.tar is damaged") as caught:
        results()
    assert "\n" not in str(caught.value)
