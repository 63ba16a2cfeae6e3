"""A report: what one suite measured, under which protocol, and the command that measures it again.

Every suite ends in the same value, so that one writer, one table, one plot and one comparison serve all of them. On
disk a report is a folder: ``report.json`` (everything), ``report.md`` (to be read) and PNG plots.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, cast

from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import plain_json
from motionloom.core.reading import read_bytes
from motionloom_lab.report.files import check_report, write_json, write_text
from motionloom_lab.report.files import markdown as table
from motionloom_lab.report.files import plain as columns_of_text
from motionloom_train.data.paths import DAMAGED

Better = Literal["up", "down", "real", ""]
REAL = "real"
"""Name of the row of real motions that columns with ``better="real"`` are held against."""
SAME = "the same data and protocol: "
"""How ``Row.measured_on`` begins where a published row was measured on what was measured here."""
ARROWS: dict[str, str] = {"up": " ↑", "down": " ↓", "real": " →", "": ""}
WIDE = 4
FORMAT = 1
LARGEST_FILE = 16 << 20
MOST_ROWS, MOST_COLUMNS, MOST_TEXT, DEEPEST = 10_000, 1_000, 20_000, 8
SLUG = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")


@dataclass(frozen=True)
class Value:
    """A number measured over ``count`` replications."""

    mean: float
    interval: float = math.nan
    """Half the width of the 95 % interval of the mean, 1.96 sigma / sqrt(count); nan where there is one replication."""
    count: int = 1

    @staticmethod
    def of(samples: Sequence[float]) -> "Value":
        """Mean and interval of independent replications, sigma with count - 1 below; not empty."""
        numbers = [float(sample) for sample in samples]
        if not numbers:
            raise ValueError("a value needs one sample or more")
        count, mean = len(numbers), math.fsum(numbers) / len(numbers)
        if count == 1:
            return Value(mean)
        sigma = math.sqrt(math.fsum((n - mean) ** 2 for n in numbers) / (count - 1))
        return Value(mean, 1.96 * sigma / math.sqrt(count), count)

    def text(self, digits: int = 3) -> str:
        """``0.123 ± 0.004``; the interval is left out where there is none, ``-`` where there is no number."""
        if not math.isfinite(self.mean):
            return "-"
        return f"{self.mean:.{digits}f}" + (f" ± {self.interval:.{digits}f}" if math.isfinite(self.interval) else "")


@dataclass(frozen=True)
class Column:
    """One metric."""

    name: str
    title: str
    better: Better
    """Larger (up), smaller (down), or as near as possible to the row named `REAL` (real); empty: neither."""
    meaning: str
    digits: int = 3
    share: bool = False
    """Each value is a share of ``count`` tries: compared as a count, by Wilson's interval."""


@dataclass(frozen=True)
class Row:
    """One thing that was measured: a model, a setting, real motions."""

    name: str
    values: Mapping[str, Value]
    """By the name of the column; a column may be missing."""
    measured_on: str = ""
    """Of a published row, the data it was measured on, not the data here unless it begins with `SAME`; empty for what
    was measured here."""


@dataclass(frozen=True)
class Report:
    """What one suite measured."""

    suite: str
    """Letters, digits, ``_``, ``-`` and ``.`` only."""
    title: str
    command: str
    """The command line that measures it again."""
    protocol: Mapping[str, Any]
    """Plain JSON data. Reports whose protocols differ are not compared."""
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = field(default=())

    def row(self, name: str) -> Row | None:
        """The row of that name measured here, if any."""
        return next((row for row in self.rows if row.name == name and not row.measured_on), None)


def write(report: Report, folder: Path | str) -> Path:
    """Write ``report.json``, ``report.md`` and the plots into ``folder`` (missing or not); the path of the JSON."""
    from motionloom_lab.report import plots  # it uses these types

    folder = Path(folder)
    path = check_report(folder / "report.json")
    pictures = plots.draw(report, folder)
    images = "".join(f"\n![{report.title}]({picture.name})\n" for picture in pictures)
    write_text(folder / "report.md", markdown(report) + images)
    return write_json(path, encode(report))


def read(path: Path | str) -> Report:
    """The report in a JSON file, or in ``report.json`` of a folder; `MotionloomError` if it is none."""
    path = Path(path)
    try:
        path = path / "report.json" if path.is_dir() else path
        text = read_bytes(path, max_bytes=LARGEST_FILE)
    except MotionloomError as error:
        raise MotionloomError(f"{error}; name a report.json or its folder") from None
    try:
        return decode(plain_json(text, finite=True))
    except DAMAGED as error:
        reason = error if isinstance(error, MotionloomError) else repr(error)
        raise MotionloomError(f"{path} is not a report of motionloom evaluate ({reason}); measure again") from None


def encode(report: Report) -> dict[str, Any]:
    """Plain data for JSON; what is not finite becomes null."""
    return {
        "format": FORMAT,
        "suite": report.suite,
        "title": report.title,
        "command": report.command,
        "protocol": _finite(report.protocol),
        "columns": [dict(c.__dict__) for c in report.columns],
        "rows": [
            {
                "name": row.name,
                "measured_on": row.measured_on,
                "values": {k: _finite(dict(v.__dict__)) for k, v in row.values.items()},
            }
            for row in report.rows
        ],
        "notes": list(report.notes),
    }


def decode(data: Any) -> Report:
    """The report of `encode`'s data, every size, type and name checked."""
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise MotionloomError(f"it has no format {FORMAT}")
    suite = _text(data["suite"])
    if not SLUG.fullmatch(suite):
        raise MotionloomError("the name of its suite is no plain word")
    if not isinstance(data["protocol"], dict):
        raise MotionloomError("its protocol is no object")
    columns = tuple(_column(c) for c in _list(data["columns"], MOST_COLUMNS))
    names = {c.name for c in columns}
    rows = tuple(_row(r, names) for r in _list(data["rows"], MOST_ROWS))
    if len(names) != len(columns) or len({(r.name, r.measured_on) for r in rows}) != len(rows):
        raise MotionloomError("a column or a row is there twice")
    notes = tuple(_text(note) for note in _list(data["notes"], MOST_ROWS))
    protocol = _plain(data["protocol"])
    return Report(suite, _text(data["title"]), _text(data["command"]), protocol, columns, rows, notes)


def markdown(report: Report) -> str:
    """Tables (published rows apart, the best number of a column in bold), command, meanings, protocol and notes."""
    parts = [f"# {_line(report.title)}", tables(report), f"```\n{report.command.replace('`', '')}\n```"]
    meanings = [f"- **{_line(c.title)}**{ARROWS[c.better]}: {_line(c.meaning)}" for c in report.columns if c.meaning]
    parts.append("\n".join(meanings))
    if any(c.better for c in report.columns):
        parts.append("↑ more is better, ↓ less is better, → nearer to the real row is better.")
    if report.protocol:
        parts.append("Protocol:\n\n" + "\n".join(f"- {_line(k)}: {_in_words(v)}" for k, v in report.protocol.items()))
    parts += [_line(note) for note in report.notes]
    return "\n\n".join(part for part in parts if part) + "\n"


def tables(report: Report) -> str:
    """Only the tables: what was measured here, then what others published on other data."""
    here, elsewhere = _split(report)
    parts = [table(_cells(report, here, bold=True))] if here else []
    for data in dict.fromkeys(row.measured_on for row in elsewhere):
        rows = [row for row in elsewhere if row.measured_on == data]
        parts += [origin(data), table(_cells(report, rows))]
    return "\n\n".join(parts)


def origin(measured_on: str) -> str:
    """A sentence over published rows."""
    if measured_on.startswith(SAME):
        return f"Published, measured on {_line(measured_on)}."
    return f"Published, measured on {_line(measured_on)}: other data, so not to be compared number by number."


def plain(report: Report) -> str:
    """The same for a terminal."""
    here, elsewhere = _split(report)
    marked = [Row(f"{row.name} [{row.measured_on}]", row.values) for row in elsewhere]
    parts = [report.title, columns_of_text(_cells(report, (*here, *marked))), *report.notes]
    return "\n\n".join(_safe(part) for part in parts)


def by_place(report: Report) -> str:
    """For a terminal: what was measured here, then every block of published rows as a table of its own."""
    parts = [plain(replace(report, rows=tuple(_split(report)[0])))]
    for place in dict.fromkeys(row.measured_on for row in _split(report)[1]):
        rows = tuple(replace(row, measured_on="") for row in report.rows if row.measured_on == place)
        parts.append(plain(replace(report, title=origin(place), rows=rows, notes=())))
    return "\n\n".join(parts)


def _split(report: Report) -> tuple[list[Row], list[Row]]:
    return [r for r in report.rows if not r.measured_on], [r for r in report.rows if r.measured_on]


def _cells(report: Report, rows: Sequence[Row], *, bold: bool = False) -> list[list[str]]:
    """Rows of text, the heading first; a last column counts replications where any number has more than one."""
    columns = [c for c in report.columns if any(c.name in row.values for row in rows)]
    if len(rows) == 1 and len(columns) > WIDE:
        return _turned(rows[0], columns)
    best = {c.name: _best(report, c) for c in columns} if bold else {}
    table, counts = [["", *(_line(c.title) + ARROWS[c.better] for c in columns)]], []
    for row in rows:
        cells = {c.name: cell(c, row.values[c.name]) if c.name in row.values else "" for c in columns}
        table.append(
            [
                _line(row.name),
                *(f"**{text}**" if text and best.get(k) == row.name else text for k, text in cells.items()),
            ]
        )
        # a share shows its own count
        counts.append([row.values[c.name].count for c in columns if c.name in row.values and not c.share])
    if max((count for row in counts for count in row), default=0) <= 1:
        return table
    last = ["count", *(_counts(row) for row in counts)]
    return [[*line, count] for line, count in zip(table, last)]


def _turned(row: Row, columns: Sequence[Column]) -> list[list[str]]:
    """A line for each number: one long line would be read by nobody."""
    names = [[_line(c.title) + ARROWS[c.better], cell(c, row.values[c.name]), _line(c.meaning)] for c in columns]
    return [["", _line(row.name), ""], *names]


def cell(column: Column, value: Value) -> str:
    """A number as its table shows it; a share with what was counted: ``0.90 (9/10)``."""
    if not column.share or not math.isfinite(value.mean):
        return value.text(column.digits)
    return f"{value.mean:.{column.digits}f} ({round(value.mean * value.count)}/{value.count})"


def _best(report: Report, column: Column) -> str:
    """Name of the best of the rows measured here, the real row aside; empty where fewer than two compete."""
    rows = [r for r in report.rows if not r.measured_on and r.name != REAL and column.name in r.values]
    rows = [r for r in rows if math.isfinite(r.values[column.name].mean)]
    real = report.row(REAL)
    if len(rows) < 2 or not column.better or (column.better == "real" and (not real or column.name not in real.values)):
        return ""
    target = real.values[column.name].mean if real and column.name in real.values else 0.0
    keys = {
        "up": lambda r: -r.values[column.name].mean,
        "down": lambda r: r.values[column.name].mean,
        "real": lambda r: abs(r.values[column.name].mean - target),
    }
    return min(rows, key=keys[column.better]).name


def _counts(counts: Sequence[int]) -> str:
    least, most = min(counts, default=0), max(counts, default=0)
    return "" if not most else str(most) if least == most else f"{least} to {most}"


def _in_words(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{k} {_in_words(v)}" for k, v in value.items())
    if isinstance(value, (list, tuple)):
        return ", ".join(_in_words(v) for v in value)
    return _line("none" if value is None else f"{value:g}" if isinstance(value, float) else str(value))


def _line(text: str) -> str:
    return _safe(" ".join(text.split()))


def _safe(text: str) -> str:
    """Without control characters: a report may come from elsewhere and is shown on a terminal."""
    return "".join(c for c in text if c.isprintable() or c == "\n")


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(k): _finite(v) for k, v in value.items()}
    return [_finite(v) for v in value] if isinstance(value, (list, tuple)) else value


def _plain(value: Any, depth: int = 0) -> Any:
    """JSON data that is neither deep nor long, as it is."""
    if depth > DEEPEST:
        raise MotionloomError("its protocol is nested too deeply")
    if isinstance(value, dict):
        return {_text(k): _plain(v, depth + 1) for k, v in value.items()}
    if isinstance(value, list):
        return [_plain(v, depth + 1) for v in _list(value, MOST_ROWS)]
    if isinstance(value, str):
        return _text(value)
    return value if value is None or isinstance(value, bool) else _number(value)


def _list(value: Any, most: int) -> list[Any]:
    if not isinstance(value, list) or len(value) > most:
        raise MotionloomError(f"it has something else where a list of at most {most} belongs")
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str) or len(value) > MOST_TEXT:
        raise MotionloomError("it has something else where text belongs")
    value.encode()  # half of a pair of surrogates could be neither shown nor written: UnicodeEncodeError
    return value


def _number(value: Any) -> int | float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise MotionloomError("it has something else where a number belongs")
    return value


def _column(data: dict[str, Any]) -> Column:
    better, digits = data["better"], data["digits"]
    if better not in ARROWS or isinstance(digits, bool) or not isinstance(digits, int) or not 0 <= digits <= 12:
        raise MotionloomError("a column says what does not exist")
    name, title, meaning = (_text(data[key]) for key in ("name", "title", "meaning"))
    return Column(name, title, cast(Better, better), meaning, digits, bool(data.get("share", False)))


def _row(data: dict[str, Any], columns: set[str]) -> Row:
    values = {_text(k): _value(v) for k, v in data["values"].items()}
    if not values.keys() <= columns:
        raise MotionloomError("a row has numbers of a column that does not exist")
    return Row(_text(data["name"]), values, _text(data["measured_on"]))


def _value(data: dict[str, Any]) -> Value:
    mean, interval, count = data["mean"], data["interval"], data["count"]
    if isinstance(count, bool) or not isinstance(count, int) or not 0 <= count <= 1 << 40:
        raise MotionloomError("a number says an impossible count")
    mean = math.nan if mean is None else float(_number(mean))
    interval = math.nan if interval is None else float(_number(interval))
    if interval < 0:
        raise MotionloomError("a number says an interval below 0")
    return Value(mean, interval, count)
