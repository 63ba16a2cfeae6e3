"""One shard's motions as files: a folder of single files, a tar as webdataset reads it, or a Parquet file.

Each writer creates one new thing at the path it is given, and takes over motions from an older one of its kind.
"""

import io
import json
import os
import shutil
import tarfile
from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.bulk.jobs import arrow, parquet
from motionloom.bulk.maker import Made
from motionloom.bulk.measures import MEANING, SECOND, SHARED
from motionloom.bulk.row import hash_file
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.files.npz_writer import save_npz
from motionloom.core.motion import Motion
from motionloom.core.reading import mended
from motionloom.io import save, save_scene

ROWS = 64
"""Motions of a row group of a Parquet file: how many are in memory at once."""
PEOPLE = ("first", "second")
"""Files of two people, where a file holds one: ``ID.first.npz``, ``ID.second.npz``."""


class Writer(ABC):
    """Motions into one place."""

    suffix = ""

    def __init__(self, path: Path) -> None:
        self.path = path

    @abstractmethod
    def add(self, take: Made, about: dict[str, Any]) -> None:
        """One motion; ``about`` has its ``id`` and what is to be known of it. Of a robot its joint angles are kept."""

    @abstractmethod
    def carry(self, old: Path, ids: Collection[str]) -> None:
        """Take over the motions of these ids from an older place of this kind."""

    @abstractmethod
    def close(self) -> None:
        """Finish what is on the disk."""


class Files(Writer):
    """A folder with a file for each motion."""

    def __init__(self, path: Path, suffix: str, unit: float) -> None:
        super().__init__(path)
        self.kind, self.unit = suffix, unit
        path.mkdir()

    def add(self, take: Made, about: dict[str, Any]) -> None:
        places = [self.path / name for name in file_names(about["id"], self.kind, len(take.people))]
        try:
            self._save(take, places)
        except BaseException:
            for place in places:  # all that there is of a motion, or none
                place.unlink(missing_ok=True)
            raise

    def _save(self, take: Made, places: Sequence[Path]) -> None:
        for write, place in zip(take.angles, places):
            write(place)
        if take.angles:
            return
        if len(places) < len(take.people):
            save_scene(take.people, places[0], names=PEOPLE)
            return
        for motion, place in zip(take.people, places, strict=True):
            if self.kind == ".bvh":
                save_bvh(motion, place, unit=self.unit)
            else:
                save(motion, place)

    def carry(self, old: Path, ids: Collection[str]) -> None:
        for place in old.iterdir():
            if place.name.partition(".")[0] in ids:
                shutil.copyfile(place, self.path / place.name)

    def close(self) -> None:
        """Nothing is left to do: each file is whole."""


class Tar(Writer):
    """``id.npz`` (of two people ``id.first.npz``, ``id.second.npz``) and ``id.json``, one after the other: webdataset's
    layout. The same motions make the same bytes."""

    suffix = ".tar"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._tar = tarfile.open(path, "w", format=tarfile.USTAR_FORMAT)  # noqa: SIM115
        self._part = path.with_name(f"{path.name}.npz")

    def add(self, take: Made, about: dict[str, Any]) -> None:
        files = {}
        writes = take.angles or [partial(save_npz, motion) for motion in take.people]
        for write, name in zip(writes, file_names(about["id"], ".npz", len(take.people)), strict=True):
            write(self._part)
            files[name] = self._part.read_bytes()
        files[f"{about['id']}.json"] = json_line(dict(sorted(about.items())))
        for name, data in files.items():  # all that there is of a motion, or none
            self._add_file(name, data)

    def carry(self, old: Path, ids: Collection[str]) -> None:
        with tarfile.open(old) as tar:
            for member in tar:
                data = tar.extractfile(member)
                if data is not None and member.name.partition(".")[0] in ids:
                    self._add_file(member.name, data.read())

    def close(self) -> None:
        self._tar.close()
        self._part.unlink(missing_ok=True)

    def _add_file(self, name: str, data: bytes) -> None:
        member = tarfile.TarInfo(name)
        member.size = len(data)
        self._tar.addfile(member, io.BytesIO(data))


class Parquet(Writer):
    """One row per motion: words, measures, positions and rotations as flat lists of float32."""

    suffix = ".parquet"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._rows: list[dict[str, Any]] = []
        self._file = parquet().ParquetWriter(path, parquet_schema(), compression="zstd")

    def add(self, take: Made, about: dict[str, Any]) -> None:
        self._rows.append(parquet_row(take.people, about))
        if len(self._rows) == ROWS:
            self._flush()

    def carry(self, old: Path, ids: Collection[str]) -> None:
        within = arrow("pyarrow.compute").is_in
        chosen = arrow().array(sorted(ids))
        with parquet().ParquetFile(old) as file:
            for part in file.iter_batches(batch_size=ROWS):
                rows = part.filter(within(part["id"], value_set=chosen))
                if len(rows):
                    self._file.write_batch(rows)

    def close(self) -> None:
        self._flush()
        self._file.close()

    def _flush(self) -> None:
        if self._rows:
            self._file.write_table(arrow().Table.from_pylist(self._rows, schema=parquet_schema()))
        self._rows = []


def parquet_schema(more: Collection[str] = ()) -> Any:
    """Columns of a Parquet shard, arrays flat: positions (people, frames, joints, 3), rotations (people, frames,
    joints, 4), root (people, frames, 3); more: names of further measures."""
    pa = arrow()
    floats, names = pa.list_(pa.float32()), (*MEANING, *more)
    measures = [*names, *(f"{SECOND}{name}" for name in names if name not in SHARED)]
    return pa.schema(
        [
            *((name, pa.string()) for name in ("id", "key", "task", "text")),
            ("seed", pa.int64()),
            ("fps", pa.float64()),
            ("people", pa.int32()),
            ("frames", pa.int32()),
            ("joints", pa.int32()),
            ("positions", floats),
            ("rotations", floats),
            ("root", floats),
            ("names", pa.list_(pa.string())),
            ("parents", pa.list_(pa.int32())),
            ("offsets", floats),
            *((name, pa.bool_() if name.endswith(("obeys", "keeps")) else pa.float64()) for name in measures),
        ]
    )


def parquet_row(people: Sequence[Motion], about: dict[str, Any]) -> dict[str, Any]:
    """A motion as a row of `parquet_schema`."""

    def flat(*values: np.ndarray) -> np.ndarray:
        return np.concatenate([np.asarray(one, dtype=np.float32).reshape(-1) for one in values])

    skeleton = people[0].skeleton  # both are on the same one
    return {
        **about,
        "text": mended(about["text"]),
        "joints": len(skeleton),
        "positions": flat(*(motion.positions() for motion in people)),
        "rotations": flat(*(motion.rotations for motion in people)),
        "root": flat(*(motion.root for motion in people)),
        "names": list(skeleton.names),
        "parents": list(skeleton.parents),
        "offsets": flat(skeleton.offsets),
    }


def json_line(value: dict[str, Any]) -> bytes:
    """A mapping as JSON in UTF-8; half of a surrogate pair, which has no UTF-8, stays written out."""
    return json.dumps(value, ensure_ascii=False).encode("utf-8", "backslashreplace")


def file_names(name: str, kind: str, people: int) -> list[str]:
    """The files of a motion: one, or one for each of two people where a file of that kind holds one person."""
    if people == 1 or kind == ".glb":
        return [f"{name}{kind}"]
    return [f"{name}.{person}{kind}" for person in PEOPLE]


def writer(kind: str, path: Path, *, unit: float = 1.0) -> Writer:
    """A writer of one of `motionloom.bulk.maker.FORMATS` at a path where nothing is; ``unit``: metres, of a BVH."""
    if kind == "webdataset":
        return Tar(path)
    return Parquet(path) if kind == "parquet" else Files(path, f".{kind}", unit)


def suffix(kind: str) -> str:
    """How the name of a shard ends: nothing for a folder."""
    return {"webdataset": Tar.suffix, "parquet": Parquet.suffix}.get(kind, "")


def sizes(path: Path) -> dict[str, int]:
    """What a shard's data must look like to be whole: files and bytes."""
    places = _files(path)
    return {"files": len(places), "bytes": sum(place.stat().st_size for place in places)}


def leads_out(place: Path, folder: Path) -> bool:
    """Whether a link on the way makes ``place`` a file outside of the folder."""
    try:
        return not place.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):  # links that lead to each other
        return True


def hashes(path: Path) -> dict[str, str]:
    """SHA-256 of a shard's files by their names; of a shard that is one file, that one's.

    Empty: it cannot be read, or is a link that leads out of the batch's folder.
    """
    digests = {}
    for place in sorted(_files(path)):
        name = place.name if place != path else ""
        try:
            digests[name] = "" if leads_out(place, path.parent) else hash_file(place)
        except OSError:
            digests[name] = ""
    return digests


def sync(path: Path) -> None:
    """Wait until a file or a folder's files are on the disk."""
    for place in _files(path):
        with place.open("rb") as file:
            os.fsync(file.fileno())


def _files(path: Path) -> list[Path]:
    """A file, or all that lie in a folder."""
    return [place for place in (path.iterdir() if path.is_dir() else [path]) if place.is_file()]
