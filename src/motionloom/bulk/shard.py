"""One shard of a batch, made and put into its folder: the same work wherever it is done."""

import json
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

from motionloom.bulk.folder import STATES, Entry, Head, Store, digest
from motionloom.bulk.maker import Made, Maker, Options
from motionloom.bulk.measures import Filter
from motionloom.bulk.row import Asked, parse
from motionloom.bulk.writers import Writer, sizes, writer
from motionloom.errors import MotionloomError

CAREFUL = 2
"""So often must a shard have been begun and not ended until its rows are made one by one."""
FATAL = 3
"""So often must a row have been begun alone and not ended until it is not tried again."""


@dataclass(frozen=True)
class Batch:
    """What a process must know to make shards; all of it plain values."""

    out: str
    folder: str
    """Where the files that rows name lie."""
    weights: str
    """Hash of the weights' file."""
    pair: dict[str, Any]
    """`Options.of_duets`."""
    options: Options

    def to_json(self) -> str:
        """As one line."""
        return json.dumps(asdict(self))

    @staticmethod
    def from_json(line: str) -> "Batch":
        """What `to_json` gave."""
        values = json.loads(line)
        return Batch(**{**values, "options": Options(**values["options"])})


@dataclass(frozen=True)
class Task:
    """A shard that is to be made."""

    shard: int
    first: int
    """Number of its first row in the job."""
    rows: list[bytes]
    """The rows as they are written."""


@dataclass(frozen=True)
class Report:
    """What became of a shard."""

    shard: int
    rows: int
    counts: dict[str, int]
    """Rows by what became of them, one of `STATES`."""
    made: int
    """Rows that were made now, not before."""
    problems: list[str] = field(default_factory=list)
    """A few of its failed rows, with their reasons."""


class _Attempts:
    """Notes of what was begun, so that a row that kills its process is found out."""

    def __init__(self, place: Path) -> None:
        self.place = place
        lines = place.read_text().split("\n") if place.exists() else []
        self.seen = Counter(lines)

    @property
    def careful(self) -> bool:
        return self.seen["begin"] >= CAREFUL

    def unended(self, key: str) -> int:
        """How often a row was begun alone and not ended."""
        return self.seen[f"row {key}"] - self.seen[f"end {key}"]

    def note(self, line: str) -> None:
        with self.place.open("a") as file:
            file.write(line + "\n")


def make_shard(task: Task, batch: Batch, maker: Maker, moved: Callable[[int], None] = lambda rows: None) -> Report:
    """Make what is missing of a shard and put it into the folder.

    moved: called with how many more rows were made. Raises `MotionloomError` where the folder cannot be written (a full
    disk), and then leaves the folder as it was.
    """
    store = Store(Path(batch.out), batch.options.format)
    try:
        store.clear_work(task.shard)
        work, notes = store.new_work(task.shard), _Attempts(store.attempts(task.shard))
        notes.note("begin")
        try:
            return _Shard(task, batch, maker, store, work, notes, moved).make()
        except (Exception, KeyboardInterrupt):
            notes.place.unlink(missing_ok=True)  # it ended, if not well
            raise
        finally:
            shutil.rmtree(work, ignore_errors=True)
    except OSError as error:
        raise MotionloomError(f"cannot write to {batch.out}: {error.strerror or error}") from error


@dataclass
class _Shard:
    task: Task
    batch: Batch
    maker: Maker
    store: Store
    work: Path
    """A folder of its own."""
    notes: _Attempts
    moved: Callable[[int], None]
    entries: dict[int, Entry] = field(default_factory=dict)
    """By the row's number within the shard."""
    names_files: bool = False
    refused: int = 0

    def make(self) -> Report:
        old = self._old()
        asked = dict(self._asked())
        kept, todo = {}, {}
        for number, one in asked.items():
            was = old.get(one.id)
            if was is not None and was["key"] == one.key and was["state"] in ("made", "dropped"):
                kept[number] = {**was, "row": self.task.first + number}
            else:
                todo[number] = one
        self.entries |= kept
        carried = [entry["id"] for entry in kept.values() if entry["state"] == "made"]
        same = not todo and len(carried) == sum(entry["state"] == "made" for entry in old.values())
        data = self.store.data(self.task.shard) if same and carried else self._write(todo, carried)
        if len(self.entries) != len(self.task.rows):
            raise AssertionError("a row was lost")  # rather stop than have a hole in the folder
        return self._commit(data, same=same, made=len(todo))

    def _old(self) -> dict[str, Entry]:
        """By id, what is already in the folder."""
        if self.store.head(self.task.shard) is None:
            return {}
        return {e["id"]: e for e in self.store.entries(self.task.shard) if e["state"] in ("made", "dropped")}

    def _asked(self) -> Iterator[tuple[int, Asked]]:
        """The rows that can be made; for the others an entry that says why not."""
        seen: dict[str, int] = {}
        for number, raw in enumerate(self.task.rows):
            row = None
            try:
                row = parse(raw)
                self.names_files |= row.names_files
                one = self.maker.sources.ask(row)
            except MotionloomError as error:
                self.refused += row is None or not row.names_files
                self.entries[number] = self._entry(number, "failed", id=None, error=str(error))
                continue
            except (OSError, RecursionError, MemoryError) as error:
                self.entries[number] = self._entry(number, "failed", id=None, error=f"it cannot be read ({error})")
                continue
            if one.id in seen:
                before = self.task.first + seen[one.id]
                why = f"row {before} of the job is the same" if one.row.name is None else f"row {before} has this id"
                state = "repeated" if one.row.name is None else "failed"
                self.refused += state == "failed"
                self.entries[number] = self._entry(number, state, one, error=why)
                continue
            seen[one.id] = number
            if self.notes.unended(one.key) >= FATAL:
                why = f"it ended the process that made it, {FATAL} times; its length or its goal may be too much"
                self.entries[number] = self._entry(number, "failed", one, error=why)
                continue
            yield number, one

    def _write(self, todo: dict[int, Asked], carried: Sequence[str]) -> Path | None:
        numbers = {id(one): number for number, one in todo.items()}
        passes = Filter(self.batch.options.filter) if self.batch.options.filter else None
        place = self.work / "data"
        file: Writer | None = None
        try:
            if carried:
                file = self._writer(place)
                file.carry(self.store.data(self.task.shard), set(carried))
            begin = self._begin if self.notes.careful else None
            for one, made in self.maker.make(list(todo.values()), begin=begin):
                number = numbers[id(one)]
                self.moved(1)
                if begin is not None:
                    self.notes.note(f"end {one.key}")
                if isinstance(made, str):
                    self.entries[number] = self._entry(number, "failed", one, error=made)
                    continue
                about = entry_of(one, made)
                if not made.passes(passes):
                    self.entries[number] = self._entry(number, "dropped", one, **about)
                    continue
                file = file or self._writer(place)
                file.add(made.people, about)
                self.entries[number] = self._entry(number, "made", one, **about)
        finally:
            if file is not None:
                file.close()
        return place if file is not None else None

    def _writer(self, place: Path) -> Writer:
        return writer(self.batch.options.format, place, unit=self.batch.options.unit)

    def _begin(self, one: Asked) -> None:
        self.notes.note(f"row {one.key}")

    def _commit(self, data: Path | None, *, same: bool, made: int) -> Report:
        shard, rows = self.task.shard, self.task.rows
        entries = [self.entries[number] for number in range(len(rows))]
        found = Counter(entry["state"] for entry in entries)
        counts = {state: found[state] for state in STATES if found[state]}
        size = sizes(data) if data is not None else {"files": 0, "bytes": 0}
        head = Head(digest(rows), self.names_files, size, counts, self.refused)
        if not same:
            self.store.commit(shard, data, entries, head, old=self.work / "old")
        elif self.store.head(shard) != head or list(self.store.entries(shard)) != entries:
            self.store.write_record(shard, entries, head)
        self.notes.place.unlink(missing_ok=True)
        return Report(shard, len(rows), counts, made, problems(entries))

    def _entry(self, number: int, state: str, one: Asked | None = None, **more: Any) -> Entry:
        known = {} if one is None else {"id": one.id, "key": one.key, "task": one.row.task, "text": one.text}
        return {"row": self.task.first + number, "state": state, **known, **more}


def problems(entries: Iterable[Entry]) -> list[str]:
    """A few of the failed rows, with their reasons."""
    failed = (entry for entry in entries if entry["state"] == "failed")
    return [f"row {entry['row']}: {entry['error']}" for entry in islice(failed, 5)]


def entry_of(one: Asked, made: Made) -> dict[str, Any]:
    """What goes with a motion wherever it is kept; nothing of it depends on where the row stood in the job."""
    return {
        "id": one.id, "key": one.key, "task": one.row.task, "text": one.text, "seed": one.seed,
        "people": len(made.people), "frames": len(made.motion), "fps": made.motion.fps, **made.measures,
    }  # fmt: skip
