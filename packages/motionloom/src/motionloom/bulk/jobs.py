"""The rows of a job, one after the other: JSON lines, CSV, Parquet, prompts times variants, or Python mappings.

Every row is passed on as the bytes of one JSON object, whatever it came from; `row.parse` reads them. Nothing here
keeps more rows than one shard has.
"""

import csv
import importlib
import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from motionloom import formats
from motionloom.core.errors import MotionloomError
from motionloom.requests.batch import RowKeys
from motionloom.requests.fields import specs

READS = (".jsonl", ".ndjson", ".csv", ".parquet")
_FLAGS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
MAX_COLUMNS = 200
"""Columns of a table of jobs."""
MAX_LINE = 4_000_000
"""Bytes of one row."""
LARGEST = 1000
"""Rows of a shard by default."""
MOST = 10_000
"""Rows of a shard at most: a process has all of them in memory."""
SMALLEST, SHARDS = 8, 64
"""A small job is cut into about so many shards, so that every core has something to do until the end."""


@dataclass(frozen=True)
class Jobs:
    """Where rows come from; they can be read as often as needed."""

    path: Path | None = None
    """JSON lines, CSV or Parquet; or, with ``variants``, a text file with one prompt per line."""
    rows: tuple[Mapping[str, Any], ...] = ()
    """The rows themselves, where there is no file; ``path`` is the folder of the files that they name then."""
    variants: int | None = None
    """Motions per line of a file of prompts; variant i has the seed ``seed + i``."""
    seed: int = 0
    """The first variant's seed."""

    @staticmethod
    def of(source: "Jobs | Path | str | Mapping[str, Any] | Iterable[Mapping[str, Any]]") -> "Jobs":
        """A file by its path, or mappings (one is a job of one row).

        Raises `MotionloomError` for another suffix, a missing file, and for rows that are no mappings.
        """
        if isinstance(source, Jobs):
            return source
        if not isinstance(source, str | Path):
            rows: list[Any] = [source] if isinstance(source, Mapping) else list(source)
            if wrong := [row for row in rows if not isinstance(row, Mapping)]:
                raise MotionloomError(f"a row is a mapping such as {{'prompt': '...'}}; got {str(wrong[0])[:60]!r}")
            return Jobs(rows=tuple(rows))
        path = Path(source)
        if path.suffix.lower() not in READS:
            raise MotionloomError(
                f"{path} is no file of jobs: its name must end in {', '.join(READS)}; plain prompts go with --prompts"
            )
        return Jobs(_existing(path))

    @staticmethod
    def of_prompts(path: Path | str, *, variants: int = 1, seed: int = 0) -> "Jobs":
        """``variants`` motions for each line of a text file; variant i has the seed ``seed + i``."""
        if not 1 <= variants <= 10_000_000:
            raise MotionloomError(f"variants must be 1 to 10,000,000; got {variants}")
        if Path(path).suffix.lower() in READS:
            raise MotionloomError(f"{path} is a file of jobs by its name; give it without --prompts")
        return Jobs(_existing(Path(path)), variants=variants, seed=seed)

    @staticmethod
    def of_recordings(folder: Path | str) -> "Jobs":
        """A row for every motion file in a folder and below it, which goes onto the job's robot or skeleton as it is.

        Raises `MotionloomError` where there is none.
        """
        folder = Path(folder)
        kinds = formats.readable()
        files = sorted(one for one in folder.rglob("*") if one.suffix.lower() in kinds and one.is_file())
        if not files:
            raise MotionloomError(f"{folder} holds no motion files ({', '.join(kinds)}); name a folder that does")
        names = [one.relative_to(folder) for one in files]
        ids = [re.sub(r"[^A-Za-z0-9_-]", "_", "_".join(one.with_suffix("").parts))[:90] for one in names]
        counts: Counter[str] = Counter()
        rows = []
        for name, one in zip(names, ids):
            counts[one] += 1
            rows.append({"motion": name.as_posix(), "id": one if counts[one] == 1 else f"{one}-{counts[one]}"})
        return Jobs(folder, tuple(rows))

    @property
    def folder(self) -> Path:
        """Where the files that rows name lie, or below it."""
        if self.path is None or self.rows:
            return self.path or Path()
        return self.path.parent

    def read(self) -> Iterator[bytes]:
        """Rows in their order, each the bytes of a JSON object (a damaged line of JSON lines as it is)."""
        if self.path is None or self.rows:
            yield from (_json(dict(row)) for row in self.rows)
        elif self.variants is not None:
            for line in _lines(self.path):
                prompt = line.decode("utf-8", "replace").strip()
                yield from (_json({"prompt": prompt, "seed": self.seed + i}) for i in range(self.variants))
        elif self.path.suffix.lower() == ".csv":
            yield from _csv(self.path)
        elif self.path.suffix.lower() == ".parquet":
            yield from _parquet(self.path)
        else:
            yield from _lines(self.path)

    def count(self) -> int:
        """How many rows there are, in one pass through the file."""
        if self.rows:
            return len(self.rows)
        if self.path is not None and self.path.suffix.lower() == ".parquet" and self.variants is None:
            return parquet().ParquetFile(self.path).metadata.num_rows
        if self.path is not None and self.variants is not None:
            return self.variants * sum(1 for _ in _lines(self.path))
        return sum(1 for _ in self.read())

    def shards(self, size: int) -> Iterator[list[bytes]]:
        """All rows, ``size`` at a time."""
        rows = self.read()
        while part := list(islice(rows, size)):
            yield part


def shard_size(rows: int) -> int:
    """Rows of a shard of a job of so many rows: the same for every driver."""
    size = min(max(-(-rows // SHARDS), SMALLEST), LARGEST)
    shards = max(-(-rows // size), 1)
    return max(-(-rows // shards), 1)


def arrow(part: str = "pyarrow") -> Any:
    """The module `pyarrow` or a part of it; raises `MotionloomError` where it is not installed."""
    try:
        return importlib.import_module(part)
    except ImportError:
        raise MotionloomError("Parquet files need pyarrow: pip install 'motionloom[parquet]'") from None


def parquet() -> Any:
    """The module `pyarrow.parquet`; raises `MotionloomError` where it is not installed."""
    return arrow("pyarrow.parquet")


def _existing(path: Path) -> Path:
    if not path.is_file():
        raise MotionloomError(f"there is no file {path}; name a file of jobs")
    return path


def _json(row: dict[str, Any]) -> bytes:
    try:
        return json.dumps(row, ensure_ascii=False, sort_keys=True).encode("utf-8", "surrogatepass")
    except (TypeError, ValueError) as error:
        raise MotionloomError(f"a row of jobs cannot be written as JSON ({error}); give text and numbers") from None


def _lines(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        first = True
        while line := file.readline(MAX_LINE):
            if len(line) == MAX_LINE:
                raise MotionloomError(f"{path} has a line of more than {MAX_LINE:,} bytes; a row is one short line")
            line = (line.removeprefix(b"\xef\xbb\xbf") if first else line).strip()
            first = False
            if b"\0" in line:
                raise MotionloomError(f"{path} is not text in UTF-8: a line of it holds zero bytes")
            if line:
                yield line


def _csv(path: Path) -> Iterator[bytes]:
    csv.field_size_limit(MAX_LINE)
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            head = file.readline(MAX_LINE)
            file.seek(0)
            between = max(",;\t", key=head.count)  # a table of a country with decimal commas has semicolons
            table = csv.DictReader(file, strict=True, delimiter=between)
            names = [name.strip() for name in table.fieldnames or ()]
            if len(names) > MAX_COLUMNS:
                raise MotionloomError(f"{path} has {len(names):,} columns; at most {MAX_COLUMNS} are read")
            if twice := [name for name, count in Counter(names).items() if count > 1]:
                raise MotionloomError(f"{path} has the column {twice[0]!r} twice; name each once")
            for row in table:
                if None in row or None in row.values():
                    raise MotionloomError(
                        f"{path}, line {table.line_num}: {len(table.fieldnames or ())} fields are needed, as in the "
                        f"first line; put quotes around a prompt with a {between!r}"
                    )
                point = "," if between == ";" else "."
                yield _json(
                    {key.strip(): _value(key.strip(), text, point) for key, text in row.items() if text.strip()}
                )
    except (csv.Error, UnicodeDecodeError) as error:
        raise MotionloomError(f"{path} is not a CSV file in UTF-8 ({error})") from None


def _value(column: str, text: str, point: str) -> Any:
    """Numbers of the columns that hold numbers; what is none is reported by `row.parse`. point: the decimal one."""
    spec = specs(RowKeys).get(column)
    reader = {"number": float, "whole": int, "flag": _FLAGS.__getitem__}.get(spec.kind if spec else "", str)
    try:
        return reader(text.strip().lower().replace(point, ".") if reader is not str else text)
    except (ValueError, KeyError):
        return text


def _parquet(path: Path) -> Iterator[bytes]:
    try:
        with parquet().ParquetFile(path) as file:
            for part in file.iter_batches(batch_size=1024):
                for row in part.to_pylist():
                    yield _json({key: value for key, value in row.items() if value is not None and value == value})
    except arrow().ArrowException as error:
        raise MotionloomError(f"{path} is not a Parquet file that can be read ({error})") from None
