"""All records of a batch as one table, and a batch's motions read back."""

import json
import tarfile
import tempfile
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.bulk.folder import RECORDS, Entry, Store, damaged_shard, find_batch
from motionloom.bulk.jobs import arrow, parquet
from motionloom.bulk.measures import ROBOT
from motionloom.bulk.row import hash_file
from motionloom.bulk.writers import file_names, json_line, leads_out, parquet_schema
from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import atomic_path
from motionloom.core.motion import Motion
from motionloom.core.reading import mended, read_bytes
from motionloom.core.skeleton import Skeleton
from motionloom.io import load, load_scene

TABLE, ABOUT_TABLE = "metadata", "table.json"
_BLOCK = 10_000
"""Rows of the table in memory at once."""
_ABOUT = {"row": "int64", "state": "string", "shard": "int32", "error_text": "string", "robot": "string"}


def write_table(store: Store, shards: int) -> Path:
    """Write ``metadata.parquet``, or ``metadata.jsonl`` where pyarrow is not installed; give its path.

    A row for each row of the job, in its order: where it went, what is known of it, or why it is not there.
    """
    place = store.out / f"{TABLE}.{'parquet' if find_spec('pyarrow') else 'jsonl'}"
    with atomic_path(place) as temporary:
        if place.suffix == ".parquet":
            _write_parquet(temporary, _all(store, shards))
        else:
            with temporary.open("wb") as file:
                file.writelines(json_line(entry) + b"\n" for entry in _all(store, shards))
    about = {"file": place.name, "sha256": hash_file(place), "shards": shards}
    with atomic_path(store.out / RECORDS / ABOUT_TABLE) as temporary:
        temporary.write_text(json.dumps(about) + "\n", encoding="utf-8")
    return place


def damaged_table(store: Store) -> Path | None:
    """The table where it is lost or not as it was written; None: it is well, as far as is known."""
    places = [store.out / f"{TABLE}.{kind}" for kind in ("parquet", "jsonl")]
    place = next((one for one in places if one.exists()), places[0])
    if leads_out(place, store.out):
        return place
    try:
        known = _about_table(store).get(place.name, hash_file(place))
        return None if hash_file(place) == known else place
    except OSError:
        return place


def table_shards(store: Store) -> int:
    """Of how many shards the table is; 0 where there was none."""
    return _about_table(store).get("shards", 0)


def _about_table(store: Store) -> dict[str, Any]:
    """The table's hash by its name, and of how many shards it is; what is not known is left out."""
    try:
        about = json.loads(read_bytes(store.out / RECORDS / ABOUT_TABLE, max_bytes=1 << 20))
        return {str(about["file"]): str(about["sha256"]), "shards": int(about["shards"])}
    except (OSError, ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return {}


def _write_parquet(path: Path, entries: Iterator[Entry]) -> None:
    pa = arrow()
    known = [field for field in parquet_schema(ROBOT) if not pa.types.is_list(field.type) and field.name != "joints"]
    schema = pa.schema([*((name, getattr(pa, kind)()) for name, kind in _ABOUT.items()), *known])
    with parquet().ParquetWriter(path, schema, compression="zstd") as file:
        while part := list(islice(entries, _BLOCK)):
            rows = [mended(entry) for entry in part]
            file.write_table(pa.Table.from_pylist(rows, schema=schema))


def _all(store: Store, shards: int) -> Iterator[Entry]:
    for shard in range(shards):
        for entry in store.entries(shard):
            row = {**entry, "shard": shard}
            if isinstance(row.get("error"), str):  # of a failed row; else it is a measure
                row["error_text"] = row.pop("error")
            yield row


@dataclass(frozen=True, eq=False)
class Result:
    """One row of a batch, and what became of it."""

    row: int
    """Number of the row in the job."""
    state: str
    """made, dropped (by the filter), failed, or repeated (the same as an earlier row of its shard)."""
    id: str | None
    """None where the row could not be read."""
    why: str
    """Of a failed or repeated row, in a sentence; else empty."""
    about: dict[str, Any]
    """Words, seed, frames, measures."""
    people: tuple[Motion, ...] = ()
    """Everybody in a row that was made, where motions are read: one person, or two in one world. Files of joint angles
    are not read (`motionloom.robots.files.load_clip`)."""

    @property
    def motion(self) -> Motion | None:
        """Of the first person; None where there is none."""
        return self.people[0] if self.people else None


def result(entry: Entry, people: tuple[Motion, ...] = ()) -> Result:
    """A row from its record."""
    own = ("row", "state", "id")
    failed = entry["state"] in ("failed", "repeated")
    about = {key: value for key, value in entry.items() if key not in own and not (failed and key == "error")}
    return Result(entry["row"], entry["state"], entry.get("id"), entry["error"] if failed else "", about, people)


def read_batch(out: Path | str, *, motions: bool = True) -> Iterator[Result]:
    """Every row of a batch that is in its folder, in the job's order, with its motion unless ``motions`` is False.

    Memory holds one shard. Raises `MotionloomError` for a folder that is no batch, and at a shard that is damaged as
    far as its record and the sizes of its files show; `motionloom.bulk.verify` looks at every byte.
    """
    store, shards = find_batch(Path(out))
    for shard in sorted(set(store.shards())):  # not those that the manifest counts, which may be any number
        if shard >= shards or not store.record(shard).exists():
            continue
        if store.head(shard) is None:
            raise damaged_shard(store, shard)
        entries = list(store.entries(shard))
        counts = {e["id"]: e.get("people", 1) for e in entries if e["state"] == "made" and "robot" not in e}
        loaded = _motions(store, shard, counts) if motions else {}
        yield from (result(entry, loaded.get(entry.get("id"), ())) for entry in entries)


People = tuple[Motion, ...]


def _motions(store: Store, shard: int, counts: dict[str, int]) -> dict[Any, People]:
    """The motions of these ids, of which each has so many people."""
    place = store.data(shard)
    if store.kind == "webdataset":
        return _from_tar(place, counts) if place.exists() else {}
    if store.kind == "parquet":
        if not place.exists():
            return {}
        with parquet().ParquetFile(place) as file:
            return {row["id"]: _people(row) for part in file.iter_batches(batch_size=64) for row in part.to_pylist()}
    if store.kind == "glb":
        return {name: tuple(load_scene(place / f"{name}.glb")) for name in counts}
    return {
        name: tuple(load(place / file, up="y") for file in file_names(name, f".{store.kind}", people))
        for name, people in counts.items()
    }


def _from_tar(place: Path, ids: Collection[str]) -> dict[Any, People]:
    motions: dict[str, People] = {}
    try:
        with tarfile.open(place, "r:") as tar, tempfile.TemporaryDirectory(prefix="motionloom-") as folder:
            for member in tar:
                data, name = tar.extractfile(member), member.name.partition(".")[0]
                if member.name.endswith(".npz") and data is not None and name in ids:
                    part = Path(folder) / "motion.npz"
                    part.write_bytes(data.read())
                    motions[name] = (*motions.get(name, ()), load(part, up="y"))
    except (tarfile.TarError, KeyError, OSError) as error:
        reason = " ".join(str(error).split())[:120]
        raise MotionloomError(f"{place} is damaged ({reason}); delete it and run the batch again") from None
    return motions


def _people(row: dict[str, Any]) -> People:
    people, frames, joints = row["people"], row["frames"], row["joints"]
    offsets = np.array(row["offsets"], dtype=np.float64).reshape(joints, 3)
    skeleton = Skeleton(tuple(row["names"]), tuple(row["parents"]), offsets)
    turns = np.array(row["rotations"], dtype=np.float64).reshape(people, frames, joints, 4)
    roots = np.array(row["root"]).reshape(people, frames, 3)
    return tuple(Motion(skeleton, row["fps"], root, turn) for root, turn in zip(roots, turns, strict=True))
