"""One shard of a batch, generated and written into its folder: the same work wherever that happens."""

import json
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

from motionloom.bulk import claim
from motionloom.bulk.folder import STATES, Entry, Head, Store, digest
from motionloom.bulk.maker import Made, Maker, Options
from motionloom.bulk.measures import Filter
from motionloom.bulk.row import Order, Unexpected, explained, parse, unexpected
from motionloom.bulk.writers import Writer, hashes, sizes, writer
from motionloom.core.errors import MotionloomError

CAREFUL = 2
"""So often must a shard have been begun and not ended until its rows are sampled one by one."""
FATAL = 3
"""So often must a row have been begun alone and not ended until it is not tried again."""


@dataclass(frozen=True)
class Batch:
    """What a process must know to generate shards; all of it plain values."""

    out: str
    folder: str
    """Where the files that rows name lie."""
    weights: str
    """Hash of the weights' file."""
    pair: dict[str, Any]
    """`Options.of_duets`."""
    options: Options
    driver: str = ""
    """Name of the driver that shares the work out; see `motionloom.bulk.claim`."""

    def to_json(self) -> str:
        """As one line."""
        return json.dumps(asdict(self))

    @staticmethod
    def from_json(line: str) -> "Batch":
        """What `to_json` gave."""
        values = json.loads(line)
        return Batch(**{**values, "options": Options(**values["options"])})

    def maker(self) -> Maker:
        """The maker of its rows; raises `MotionloomError` where that cannot be."""
        return Maker(self.options, folder=Path(self.folder), weights=self.weights, pair=self.pair)


@dataclass(frozen=True)
class Task:
    """A shard to generate."""

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
    new_rows: int
    """Rows that were generated now, not before."""
    problems: list[str] = field(default_factory=list)
    """A few of its failed rows, with their reasons."""


class _Attempts:
    """Notes of what was begun, so that a row that kills its process is found out."""

    def __init__(self, place: Path) -> None:
        self.place = place
        lines = place.read_text().split("\n") if place.exists() else []
        self.counts = Counter(lines)

    @property
    def careful(self) -> bool:
        return self.counts["begin"] >= CAREFUL

    def unended(self, key: str) -> int:
        """How often a row was begun alone and not ended."""
        return self.counts[f"row {key}"] - self.counts[f"end {key}"]

    def note(self, line: str) -> None:
        with self.place.open("a") as file:
            file.write(line + "\n")


def make_shard(task: Task, batch: Batch, maker: Maker, moved: Callable[[int], None] = lambda rows: None) -> Report:
    """Generate what is missing of a shard, rows of it that were damaged too, and write it into the folder.

    moved: called with how many more rows are finished. What goes wrong with a row is in its entry, whatever it is.
    Raises `MotionloomError` where the folder cannot be written (a full disk), or the shard cannot be put together even
    with its rows one by one; the folder stays as it was.
    """
    with explained(f"shard {task.shard} cannot be put together, a fault of the program"):
        try:
            try:
                return _attempt(task, batch, maker, moved)
            except (OSError, MotionloomError):
                raise
            except Exception:  # of no row that is known: each is sampled by itself, so that only the one at fault fails
                return _attempt(task, batch, maker, moved, careful=True)
        except OSError as error:
            raise MotionloomError(f"cannot write to {batch.out}: {error.strerror or error}") from error


def _attempt(task: Task, batch: Batch, maker: Maker, moved: Callable[[int], None], *, careful: bool = False) -> Report:
    store = Store(Path(batch.out), batch.options.format)
    clear_work(store, task.shard, batch.driver)
    work, notes = store.new_work(task.shard, batch.driver), _Attempts(store.attempts(task.shard))
    notes.note("begin")
    try:
        return _Shard(task, batch, maker, store, work, notes, moved, careful=careful or notes.careful).make()
    except (Exception, KeyboardInterrupt):
        notes.place.unlink(missing_ok=True)  # it ended, if not well
        raise
    finally:
        shutil.rmtree(work, ignore_errors=True)


def clear_work(store: Store, shard: int, driver: str) -> None:
    """Remove what processes left of a shard that were killed; what another driver has, who lives, stays."""
    store.clear_work(shard, but=claim.names(store.work) - {driver})


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
    careful: bool
    """Rows are sampled one by one."""
    entries: dict[int, Entry] = field(default_factory=dict)
    """By the row's number within the shard."""
    names_files: bool = False
    refused: int = 0

    def make(self) -> Report:
        old, whole = self._old()
        orders = dict(self._requests())
        reused, todo = {}, {}
        for number, one in orders.items():
            was = old.get(one.id)
            if was is not None and was["key"] == one.key and was["state"] in ("made", "dropped"):
                reused[number] = {**was, "row": self.task.first + number}
            else:
                todo[number] = one
        self.entries |= reused
        carried = [entry["id"] for entry in reused.values() if entry["state"] == "made"]
        same = whole and not todo and len(carried) == sum(entry["state"] == "made" for entry in old.values())
        data = self.store.data(self.task.shard) if same and carried else self._write(todo, carried)
        if len(self.entries) != len(self.task.rows):
            raise AssertionError("a row was lost")  # rather stop than have a hole in the folder
        return self._commit(data, same=same, new_rows=len(todo))

    def _old(self) -> tuple[dict[str, Entry], bool]:
        """By id, what is already in the folder as it was written; and whether that is all that was written there."""
        shard, data = self.task.shard, self.store.data(self.task.shard)
        damaged = self.store.damage(shard)
        if damaged and (data in damaged or self.store.record(shard) in damaged):  # nothing of it is sure
            return {}, False
        lost = {place.name.partition(".")[0] for place in damaged}
        known = (e for e in self.store.entries(shard) if e["state"] in ("made", "dropped"))
        return {e["id"]: e for e in known if e["state"] == "dropped" or e["id"] not in lost}, not damaged

    def _requests(self) -> Iterator[tuple[int, Order]]:
        """The rows that can be generated; the others get an entry with the reason."""
        numbers: dict[str, int] = {}
        for number, raw in enumerate(self.task.rows):
            row = None
            try:
                row = parse(raw)
                self.names_files |= row.names_files
                one = self.maker.sources.ask(row)
            except MotionloomError as error:
                again = isinstance(error, Unexpected) or (row is not None and row.names_files)
                self.refused += not again
                self.entries[number] = self._entry(number, "failed", id=None, error=str(error))
                continue
            if one.id in numbers:
                before = self.task.first + numbers[one.id]
                why = f"row {before} of the job is the same" if one.row.id is None else f"row {before} has this id"
                state = "repeated" if one.row.id is None else "failed"
                self.refused += state == "failed"
                self.entries[number] = self._entry(number, state, one, error=why)
                continue
            numbers[one.id] = number
            if self.notes.unended(one.key) >= FATAL:
                why = f"it ended the process that made it, {FATAL} times; its length or its goal may be too much"
                self.entries[number] = self._entry(number, "failed", one, error=why)
                continue
            yield number, one

    def _write(self, todo: dict[int, Order], carried: Sequence[str]) -> Path | None:
        numbers = {id(one): number for number, one in todo.items()}
        passes = Filter(self.batch.options.filter) if self.batch.options.filter else None
        place = self.work / "data"
        file: Writer | None = None
        try:
            if carried:
                file = self._writer(place)
                file.carry(self.store.data(self.task.shard), set(carried))
            for one, take in self._made_rows(list(todo.values())):
                number = numbers[id(one)]
                self.moved(1)
                if self.careful:
                    self.notes.note(f"end {one.key}")
                if isinstance(take, str):
                    self.entries[number] = self._entry(number, "failed", one, error=take)
                    continue
                try:
                    about = entry_of(one, take)
                    passed = take.passes(passes)
                    if passed:
                        file = file or self._writer(place)
                        file.add(take, about)
                    self.entries[number] = self._entry(number, "made" if passed else "dropped", one, **about)
                except Exception as error:
                    if _of_disk(error):
                        raise
                    why = unexpected(error, "it could not be kept")
                    self.entries[number] = self._entry(number, "failed", one, error=str(why))
        finally:
            if file is not None:
                file.close()
        return place if file is not None else None

    def _writer(self, place: Path) -> Writer:
        return writer(self.batch.options.format, place, unit=self.batch.options.unit)

    def _made_rows(self, orders: list[Order]) -> Iterator[tuple[Order, Made | str]]:
        """What comes of each row; of careful work each row by itself, with whatever goes wrong as its error."""
        if not self.careful:
            yield from self.maker.make(orders)
            return
        for one in orders:
            try:
                results = list(self.maker.make([one], begin=lambda row: self.notes.note(f"row {row.key}")))
            except Exception as error:
                if _of_disk(error):
                    raise
                results = [(one, str(unexpected(error, "it could not be made")))]
            yield from results

    def _commit(self, data: Path | None, *, same: bool, new_rows: int) -> Report:
        shard, rows = self.task.shard, self.task.rows
        entries = [self.entries[number] for number in range(len(rows))]
        states = Counter(entry["state"] for entry in entries)
        counts = {state: states[state] for state in STATES if states[state]}
        size = sizes(data) if data is not None else {"files": 0, "bytes": 0}
        head = Head(digest(rows), self.names_files, size, counts, self.refused, hashes(data) if data else {})
        if not same:
            self.store.commit(shard, data, entries, head, old=self.work / "old")
        elif not self.store.is_recorded(shard, entries, head):
            self.store.write_record(shard, entries, head)
        self.notes.place.unlink(missing_ok=True)
        return Report(shard, len(rows), counts, new_rows, problems(entries))

    def _entry(self, number: int, state: str, one: Order | None = None, **more: Any) -> Entry:
        known = {} if one is None else {"id": one.id, "key": one.key, "task": one.row.task, "text": one.text}
        return {"row": self.task.first + number, "state": state, **known, **more}


def _of_disk(error: BaseException | None) -> bool:
    """Whether an error, or what it came of, is one of the system's: a full disk is no fault of a row."""
    return error is not None and (isinstance(error, OSError) or _of_disk(error.__cause__))


def problems(entries: Iterable[Entry]) -> list[str]:
    """A few of the failed rows, with their reasons."""
    failed = (entry for entry in entries if entry["state"] == "failed")
    return [f"row {entry['row']}: {entry['error']}" for entry in islice(failed, 5)]


def entry_of(one: Order, take: Made) -> dict[str, Any]:
    """What goes with a motion wherever it is kept; nothing of it depends on where the row is in the job."""
    return {
        "id": one.id,
        "key": one.key,
        "task": one.row.task,
        "text": one.text,
        "seed": one.seed,
        "people": len(take.people),
        "frames": len(take.motion),
        "fps": take.motion.fps,
        **take.measures,
    }
