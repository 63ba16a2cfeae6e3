"""The folder of a batch: what it is (``manifest.json``), its shards, and one record of each shard's rows.

    manifest.json            version, weights, settings, its own hash; under 2 kB however many rows there are
    shard-000000.tar         or .parquet, or a folder of single files
    records/000000.jsonl     a line about the shard, then one per row: made, dropped, failed or repeated, and why
    records/table.json       hash of the table, and of how many shards it is
    metadata.parquet         all rows of all records, at the end; .jsonl without pyarrow

A shard is in the folder when its record is: its data comes first, under its own name in one step, then the record,
in one step too, which has the hash of every file and of itself. So a shard is whole or it is not there, whoever is
killed when; and what was damaged since is found.
"""

import hashlib
import json
import os
import shutil
from collections.abc import Collection, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from motionloom.bulk.maker import Options, hash_weights
from motionloom.bulk.measures import MEANING, ROBOT
from motionloom.bulk.row import FORMAT, hash_file
from motionloom.bulk.writers import hashes, json_line, leads_out, sizes, suffix, sync
from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path
from motionloom.core.models.prior import find_weights, read_card
from motionloom.io.folder import check_folder

MANIFEST, RECORDS, WORK = "manifest.json", "records", ".work"
KIND = "motionloom batch"
CHECK = "sha256"
"""Of all other keys of the manifest."""
STATES = ("made", "dropped", "failed", "repeated")

Entry = dict[str, Any]
"""The record of one row."""


@dataclass(frozen=True)
class Head:
    """The first line of a record."""

    digest: str
    """Of the rows as they are written in the job."""
    names_files: bool
    """Whether a row names other files, which the digest does not cover."""
    data: dict[str, int]
    """Files and bytes of the shard's data; no files where no row was kept."""
    counts: dict[str, int]
    """Rows by what became of them, one of `STATES`."""
    refused: int = 0
    """How many of the failed ones cannot be generated as they are written."""
    sha256: dict[str, str] = field(default_factory=dict)
    """Of every file of the shard's data, by its name; nothing in a folder of before there were hashes."""
    record: str = ""
    """Hash of the record itself: of all lines but for this one value."""


@dataclass(frozen=True)
class Store:
    """The folder of one batch."""

    out: Path
    kind: str
    """The format of its shards."""

    def data(self, shard: int) -> Path:
        """Where a shard's motions are."""
        return self.out / f"shard-{shard:06d}{suffix(self.kind)}"

    def record(self, shard: int) -> Path:
        """Where it is written what became of a shard's rows."""
        return self.out / RECORDS / f"{shard:06d}.jsonl"

    def shards(self) -> Iterator[int]:
        """Numbers of the shards that have records, in no order."""
        names = (path.stem for path in (self.out / RECORDS).glob("[0-9]*.jsonl"))
        return (int(name) for name in names if name.isdecimal())

    @property
    def work(self) -> Path:
        """Where shards are written first; nobody reads there."""
        return self.out / WORK

    def new_work(self, shard: int, driver: str) -> Path:
        """A folder to write a shard in, of its own for each call: two that write the same shard keep apart."""
        place = self.work / f"{shard:06d}.{driver or 'nobody'}.{os.urandom(4).hex()}"
        place.mkdir(parents=True)
        return place

    def clear_work(self, shard: int, *, but: Collection[str] = ()) -> None:
        """Remove what killed processes wrote of a shard; ``but``: drivers whose work stays, since they live."""
        for place in self.work.glob(f"{shard:06d}.*/"):
            if place.name.split(".")[1] not in but:
                shutil.rmtree(place, ignore_errors=True)

    def attempts(self, shard: int) -> Path:
        """Where it is noted what was begun and not ended: of a finished shard, nothing."""
        return self.work / f"{shard:06d}.attempts"

    def head(self, shard: int) -> Head | None:
        """The head of a shard's record, if it is whole and fits the number and size of the data."""
        record = self._record(shard)
        if record is None or (record[0].data["files"] and sizes(self.data(shard)) != record[0].data):
            return None
        return record[0]

    def entries(self, shard: int) -> Iterator[Entry]:
        """What became of each row of a shard, in their order; `MotionloomError` where its record is not whole."""
        record = self._record(shard)
        if record is None:
            raise damaged_shard(self, shard)
        yield from record[1]

    def damage(self, shard: int) -> list[Path]:
        """Files of a shard that are not as they were written, missing ones and foreign ones too; the record first."""
        record = self._record(shard)
        if record is None:
            return [self.record(shard)]
        head, data = record[0], self.data(shard)
        if not head.data["files"]:
            return []
        if not data.exists():
            return [data]
        if not head.sha256:  # of before there were hashes
            return [] if sizes(data) == head.data else [data]
        there = hashes(data)
        wrong = sorted(name for name in head.sha256.keys() | there.keys() if head.sha256.get(name) != there.get(name))
        return [data / name if data.is_dir() else data for name in wrong]

    def is_recorded(self, shard: int, entries: Sequence[Entry], head: Head) -> bool:
        """Whether the record of a shard is this one already."""
        record = self._record(shard)
        return record is not None and record == (replace(head, record=record[0].record), list(entries))

    def _record(self, shard: int) -> tuple[Head, list[Entry]] | None:
        """The record of a shard, if it is whole."""
        if leads_out(self.record(shard), self.out):
            return None
        try:
            first, *lines = self.record(shard).read_bytes().splitlines()
            head, entries = Head(**json.loads(first)), [json.loads(line) for line in lines]
            if head.record:
                whole = head.record == _hash_record(head, lines)
            else:  # of before there were hashes
                whole = sum(head.counts.values()) == len(entries) and head.data.keys() == {"files", "bytes"}
            return (head, entries) if whole else None
        except (OSError, ValueError, TypeError, AttributeError, RecursionError):
            return None

    def commit(self, shard: int, data: Path | None, entries: Sequence[Entry], head: Head, *, old: Path) -> None:
        """Put a shard into the folder: ``data`` (None: nothing was kept) and the record of all of its rows.

        old: where to move a folder that was there before.
        """
        target = self.data(shard)
        if data is not None:
            sync(data)
        if target.is_dir():
            target.rename(old)
        elif data is None:
            target.unlink(missing_ok=True)
        if data is not None:
            os.replace(data, target)
        self.write_record(shard, entries, head)

    def write_record(self, shard: int, entries: Sequence[Entry], head: Head) -> None:
        """Write the record with its own hash, whole or not at all."""
        lines = [json_line(entry) for entry in entries]
        first = json_line(asdict(head) | {"record": _hash_record(head, lines)})
        with atomic_path(self.record(shard)) as temporary, temporary.open("wb") as file:
            file.writelines(line + b"\n" for line in (first, *lines))
            file.flush()
            os.fsync(file.fileno())


def damaged_shard(store: Store, shard: int) -> MotionloomError:
    """The error of whoever wants to read a shard that is not as it was written."""
    return MotionloomError(
        f"shard {shard} of {store.out} is damaged; 'motionloom batch --verify {store.out}' says what, and the command "
        "that made the batch makes it anew"
    )


def _hash_record(head: Head, lines: Sequence[bytes]) -> str:
    first = json_line(dict(sorted((asdict(head) | {"record": ""}).items())))
    return hashlib.sha256(b"\n".join((first, *lines))).hexdigest()


def digest(rows: Sequence[bytes]) -> str:
    """Hash of rows as they are written in the job."""
    sha256 = hashlib.sha256()
    for row in rows:
        sha256.update(len(row).to_bytes(8, "little"))
        sha256.update(row)
    return sha256.hexdigest()


def about(options: Options, *, rows: int, shard_rows: int) -> dict[str, Any]:
    """The manifest of a batch."""
    card, weights = read_card(find_weights(options.weights)), hash_weights(options)
    manifest = {
        "kind": KIND,
        "format": FORMAT,
        "version": version("motionloom"),
        "weights": {"name": card.name, "sha256": weights, "licence": card.licence},
        "motions": options.of_motions(weights),
        "duets": options.of_duets(),
        "defaults": {
            "seconds": options.seconds,
            "seed": options.seed,
            "skeleton": _hash(options.skeleton),
            **_of_robot(options),
        },
        "files": options.format,
        "filter": options.filter,
        "judge": options.judge,
        "rows": rows,
        "shard_rows": shard_rows,
        "measures": MEANING | ROBOT,
    }
    return manifest | {CHECK: _hash_manifest(manifest)}


def _hash_manifest(manifest: dict[str, Any]) -> str:
    others = {key: value for key, value in manifest.items() if key != CHECK}
    return hashlib.sha256(json.dumps(others, sort_keys=True).encode()).hexdigest()


def _of_robot(options: Options) -> dict[str, Any]:
    """The settings of robots; nothing where there are none, so that older folders hold."""
    values = {"robot": _hash(options.robot), "robot_map": _hash(options.robot_map), **options.of_robots()}
    return {name: value for name, value in values.items() if value}


def _hash(name: str | None) -> str | None:
    """Of the file of this name, where there is one."""
    return None if name is None or not Path(name).is_file() else hash_file(Path(name))


def read_manifest(out: Path, *, anew: bool = False) -> dict[str, Any] | None:
    """The manifest of a folder; None where it has none.

    anew: also where its manifest is lost or damaged, and is to be written again. Raises `MotionloomError` if that is no
    batch.
    """
    place = out / MANIFEST
    batch = (out / RECORDS).is_dir()
    if not place.exists():
        if not out.is_dir() or (batch and anew) or not any(one.name != WORK for one in out.iterdir()):
            return None
        if batch:
            raise _damaged(f"{place} is lost")
        raise MotionloomError(f"{out} holds other files and no {MANIFEST}; name a folder of its own for the batch")
    try:
        if leads_out(place, out):
            raise ValueError("a link")
        manifest = json.loads(place.read_text(encoding="utf-8"))
        whole = CHECK not in manifest or manifest[CHECK] == _hash_manifest(manifest)
    except (OSError, ValueError, TypeError, RecursionError):
        manifest, whole = {}, False
    if batch and not whole:
        if anew:
            return None
        raise _damaged(f"{place} is damaged")
    try:
        good = (
            manifest["kind"] == KIND
            and int(manifest["shard_rows"]) >= 1
            and manifest["files"]
            and int(manifest["rows"]) >= 1
        )
    except (ValueError, KeyError, TypeError, OverflowError):
        good = False
    if not good:
        raise MotionloomError(f"{place} does not describe a batch; name another folder or delete it")
    if manifest.get("format") != FORMAT:
        raise MotionloomError(
            f"{place} has the format {manifest.get('format')}; this motionloom makes {FORMAT}: use another folder"
        )
    return manifest


def find_batch(folder: Path) -> tuple[Store, int]:
    """A batch that is there, and of how many shards it is; raises `MotionloomError` where there is none."""
    manifest = read_manifest(folder)
    if manifest is None:
        raise MotionloomError(f"{folder} holds no batch; name a folder that 'motionloom batch' made")
    return Store(folder, manifest["files"]), -(-int(manifest["rows"]) // int(manifest["shard_rows"]))


def _damaged(what: str) -> MotionloomError:
    return MotionloomError(
        f"{what}: run the command that made the batch with --force, which writes it anew and keeps the motions that "
        "are asked for"
    )


def check_settings(
    out: Path, options: Options, *, rows: int, shard_rows: int, force: bool = False
) -> tuple[dict[str, Any] | None, dict[str, Any]]:
    """The manifest that is there, and the one that is to be; nothing is written.

    force: write a damaged one anew. Raises `MotionloomError` for a folder of something else or of other settings.
    """
    manifest = read_manifest(check_folder(out), anew=force)
    expected = about(options, rows=rows, shard_rows=shard_rows if manifest is None else int(manifest["shard_rows"]))
    if manifest is None:
        return None, expected
    for part in ("weights", "motions", "duets", "defaults", "files", "filter", "judge"):
        if manifest.get(part) != expected[part]:
            was, now = _difference(manifest.get(part), expected[part])
            raise MotionloomError(f"{out} was made with other settings: {part} {was}, not {now}; name another folder")
    if options.shard_rows not in (None, expected["shard_rows"]):
        raise MotionloomError(
            f"{out} has shards of {expected['shard_rows']:,} rows, not {options.shard_rows:,}; name another folder"
        )
    return manifest, expected


def open_folder(out: Path, options: Options, *, rows: int, shard_rows: int, force: bool = False) -> dict[str, Any]:
    """Create the folder, or check that it has the same settings; its manifest, whose ``shard_rows`` counts.

    Raises `MotionloomError` as `check_settings` does.
    """
    manifest, expected = check_settings(out, options, rows=rows, shard_rows=shard_rows, force=force)
    try:
        for place in (out, out / RECORDS, out / WORK):
            place.mkdir(exist_ok=True)
    except OSError as error:
        raise MotionloomError(f"cannot write to {out}: {error.strerror or error}") from None
    if manifest != expected:
        with atomic_path(out / MANIFEST) as temporary:
            temporary.write_text(json.dumps(expected, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return expected


def _difference(was: Any, now: Any) -> tuple[str, str]:
    """What differs, in short."""
    if isinstance(was, dict) and isinstance(now, dict):
        keys = [key for key in now if was.get(key) != now[key]]
        return tuple(", ".join(f"{key} {side.get(key)}" for key in keys) for side in (was, now))  # type: ignore[return-value]
    return str(was), str(now)
