"""Damage in a batch's folder, found and mended."""

import json
import os
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import pytest

from motionloom.bulk import writers
from motionloom.bulk.batch import Where, batch, run
from motionloom.bulk.claim import Driver
from motionloom.bulk.jobs import Jobs
from motionloom.bulk.metadata import read_batch
from motionloom.bulk.verify import Verified, verify
from motionloom.cli import main
from motionloom.core.errors import MotionloomError
from tests.bulk.rows import options, rows
from tests.bulk.test_shard import flipped

OUT = Path("out")


def make(weights: str, kind: str = "npz", *, count: int = 5, force: bool = False) -> None:
    settings = options(weights, shard_rows=2, format=kind)
    list(batch(rows(count), OUT, options=settings, where=Where(workers=1), force=force))


def everything() -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in OUT.rglob("*") if path.is_file()}


@pytest.mark.parametrize("kind", ["npz", "bvh", "webdataset"])
def test_a_bit_that_flips_in_any_file_is_found_told_and_mended(
    weights: str, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    make(weights, kind)
    before = everything()
    assert len(before) >= 3 + 3 + 2 + 1  # shards, records, table and its hash, manifest
    assert main(["batch", "--verify", "out"]) == 0
    assert "out is as it was written: 3 of 3 shards" in capsys.readouterr().out
    for path, data in before.items():
        if path.name == "table.json":
            continue
        path.write_bytes(flipped(data))
        assert main(["batch", "--verify", "out"]) == 2
        out, err = capsys.readouterr()
        if path.name == "manifest.json":
            assert "out/manifest.json is damaged" in err
        else:
            assert (out, "1 file of out is damaged" in err) == (f"{path} is not as it was written\n", True)
        path.write_bytes(data)
    for path, data in before.items():
        if path.name != "table.json":
            path.write_bytes(flipped(data))
    with pytest.raises(MotionloomError, match="--force"):
        make(weights, kind)
    make(weights, kind, force=True)
    assert everything() == before


def test_what_is_lost_or_foreign_is_damage_and_what_was_never_made_is_not(weights: str) -> None:
    make(weights)
    assert verify(OUT) == Verified(3, 3, 5 + 3, 0, ())
    lost, foreign = next((OUT / "shard-000000").iterdir()), OUT / "shard-000001" / "mine.npz"
    before = everything()
    lost.unlink()
    foreign.write_bytes(b"")
    record = OUT / "records" / "000002.jsonl"
    record.unlink()
    assert verify(OUT).damaged == (lost, foreign, record)
    make(weights)
    assert everything() == before
    record.unlink()
    (OUT / "records" / "table.json").unlink()
    (OUT / "metadata.jsonl").unlink(missing_ok=True)
    (OUT / "metadata.parquet").unlink(missing_ok=True)
    assert verify(OUT) == Verified(2, 3, 4 + 2, 0, ())  # as of a batch that is under way


@pytest.mark.parametrize("cut", [lambda data: data.split(b"\n")[0], flipped], ids=["cut", "flipped"])
def test_a_damaged_shard_is_read_by_nobody_and_left_out_of_no_table(
    weights: str, cut: Callable[[bytes], bytes]
) -> None:
    """Before, its rows were missing without a word."""
    make(weights)
    record = OUT / "records" / "000001.jsonl"
    record.write_bytes(cut(record.read_bytes()))
    with pytest.raises(MotionloomError, match=r"shard 1 of out is damaged; 'motionloom batch --verify out'"):
        list(read_batch(OUT, motions=False))
    (OUT / "records" / "000000.jsonl").unlink()
    settings = options(weights, shard_rows=2)
    with pytest.raises(MotionloomError, match="shard 1 of out is damaged"):  # which is another's to make
        list(run(Jobs.of(rows(5)), OUT, options=settings, where=Where(1, (0, 2))))
    list(run(Jobs.of(rows(5)), OUT, options=settings, where=Where(1, (1, 2))))
    assert [one.state for one in read_batch(OUT, motions=False)] == ["made"] * 5
    assert verify(OUT) == Verified(3, 3, 8, 0, ())


def test_a_manifest_that_is_lost_is_written_anew_where_that_is_asked_for(weights: str) -> None:
    make(weights)
    before = everything()
    (OUT / "manifest.json").unlink()
    with pytest.raises(MotionloomError, match=r"manifest.json is lost: .*--force"):
        make(weights)
    with pytest.raises(MotionloomError, match=r"manifest.json is lost"):
        verify(OUT)
    stamps = {path: path.stat().st_mtime_ns for path in OUT.rglob("*.npz")}
    make(weights, force=True)
    assert everything() == before
    assert {path: path.stat().st_mtime_ns for path in OUT.rglob("*.npz")} == stamps


def test_the_answer_can_be_json(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    make(weights)
    record = OUT / "records" / "000001.jsonl"
    record.write_bytes(record.read_bytes().split(b"\n")[0])
    assert main(["batch", "--verify", "out", "--json"]) == 2
    assert json.loads(capsys.readouterr().out)["damaged"] == [str(record)]


@pytest.mark.parametrize("more", [["jobs.jsonl"], ["--out", "out"]])
def test_verify_goes_with_nothing_that_makes(more: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["batch", "--verify", "out", *more]) == 2
    assert "makes nothing" in capsys.readouterr().err


def test_a_folder_that_is_no_batch_or_that_somebody_works_in_is_not_verified(weights: str, folder: Path) -> None:
    with pytest.raises(MotionloomError, match="holds no batch"):
        verify(OUT)
    make(weights)
    (OUT / ".work").mkdir()
    (OUT / ".work" / "driver-0-of-1.json").write_text(json.dumps(asdict(Driver.here())))
    with pytest.raises(MotionloomError, match=f"is being made by process {os.getpid()}"):
        verify(OUT)


def test_counts_in_a_damaged_folder_are_not_counted_to(weights: str) -> None:
    """A manifest of before there were hashes may say any number of rows, and so may the table's note."""
    make(weights)
    states = [(one.row, one.state) for one in read_batch(OUT)]
    manifest = json.loads((OUT / "manifest.json").read_text())
    del manifest["sha256"]
    (OUT / "manifest.json").write_text(json.dumps(manifest | {"rows": 2**64}))
    table = json.loads((OUT / "records" / "table.json").read_text())
    (OUT / "records" / "table.json").write_text(json.dumps(table | {"shards": 10**18}))
    assert [(one.row, one.state) for one in read_batch(OUT)] == states
    report = verify(OUT)
    assert (report.shards, report.of) == (3, 2**63)
    assert report.damaged[0] == OUT / "records" / "000003.jsonl"


def test_links_that_lead_out_of_the_folder_are_damage_and_are_not_followed(
    weights: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A copy of each file, outside, would verify; so would hours of somebody's disk be read."""
    make(weights)
    away = Path("away")
    away.mkdir()
    for path in sorted(one for one in OUT.rglob("*") if one.is_file() and one.name != "table.json"):
        path.rename(away / path.name)
        path.symlink_to((away / path.name).absolute())
        with monkeypatch.context() as patch:
            patch.setattr("motionloom.bulk.writers.hash_file", _inside(path, writers.hash_file))
            assert main(["batch", "--verify", "out"]) == 2, path
        assert str(path) in "".join(capsys.readouterr())
        path.unlink()
        (away / path.name).rename(path)
    assert main(["batch", "--verify", "out"]) == 0


def _inside(link: Path, hash_file: Callable[[Path], str]) -> Callable[[Path], str]:
    def hashed(path: Path) -> str:
        assert path != link
        return hash_file(path)

    return hashed
