"""Two reports held against each other: which differences exceed their intervals, and in which direction.

Means: |a - b| > sqrt(ia^2 + ib^2) with the 95 % intervals of the two means, which is Welch's test (Welch 1947) in the
normal limit. Shares of tries: the interval of the difference of two proportions from Wilson's score intervals (Newcombe
1998, method 10). For a metric that should be near the real row, the distances to the real rows are compared.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from motionloom.core.errors import MotionloomError
from motionloom.core.files.atomic import finished
from motionloom_lab.report import report as reports
from motionloom_lab.report.report import REAL, Column, Report, Row, Value

Verdict = Literal["worse", "better", "other", "same", "unknown"]
Z = 1.96
CONTROLS = (REAL, "shuffled", "chance")
CLOCKED = ("ms", "per_second", "memory")
"""Columns of suites about quality that a busier or another machine changes; the suite of speed is for these."""
SUBJECT = ("weights", "files")
"""Keys of a protocol that name what was measured rather than how; in the suite of the evaluator, itself as well."""


@dataclass(frozen=True)
class Difference:
    """One number in two reports."""

    suite: str
    row: str
    column: Column
    before: Value
    after: Value
    verdict: Verdict
    """other: it differs where neither direction is better; unknown: one of the two was measured only once."""


def compare(before: Report, after: Report, *, anyway: bool = False) -> list[Difference]:
    """Every number that both reports have, published rows aside.

    Raises `MotionloomError` if suite or protocol differ, unless ``anyway``.
    """
    if not anyway and (differing := differences_of_protocol(before, after)):
        raise MotionloomError(
            f"the two {after.suite} reports were not measured alike: {'; '.join(differing)}; "
            "measure again alike, or compare --anyway"
        )
    changes = []
    columns = {column.name: column for column in before.columns}
    for row in after.rows:
        old = None if row.measured_on else counterpart(row, before, after)
        if old is None:
            continue
        for column in after.columns:
            if column.name in columns and column.name in row.values and column.name in old.values:
                a, b = old.values[column.name], row.values[column.name]
                judged = column if is_judged(after.suite, row.name, column) else replace(column, better="")
                verdict = judge(judged, a, b, reals=(_real(before, column), _real(after, column)))
                changes.append(Difference(after.suite, row.name, column, a, b, verdict))
    return changes


def counterpart(row: Row, before: Report, after: Report) -> Row | None:
    """The row of the same name, or but for the weights' name: ``mine, 20 steps`` for ``default, 20 steps``."""
    if (same := before.row(row.name)) or is_control(row.name):
        return same

    def tail(name: str) -> str:
        return name.partition(", ")[2]

    old, new = (
        [r for r in report.rows if not r.measured_on and not is_control(r.name) and tail(r.name) == tail(row.name)]
        for report in (before, after)
    )
    return old[0] if tail(row.name) and len(old) == len(new) == 1 else None


def is_judged(suite: str, row: str, column: Column) -> bool:
    """Whether more or less of it can be worse: not of a control, nor of a damage that an evaluator should notice."""
    return column.name not in CLOCKED and (row == REAL if suite == "evaluator" else not is_control(row))


def is_control(name: str) -> bool:
    """Whether a row is of real motion or of shuffled captions: if it changes, the measure changed, not the model."""
    return name.split(",")[0].split(" ")[0] in CONTROLS


def _real(report: Report, column: Column) -> Value | None:
    real = report.row(REAL)
    return real.values.get(column.name) if real else None


def differences_of_protocol(before: Report, after: Report) -> list[str]:
    """What differs in how two reports were measured, as ``name before -> after``."""
    lines = [] if before.suite == after.suite else [f"suite {before.suite} -> {after.suite}"]
    subject = (*SUBJECT, "evaluator") if before.suite == "evaluator" else SUBJECT
    settings = [{k: v for k, v in report.protocol.items() if k not in subject} for report in (before, after)]
    return lines + _differing(settings[0], settings[1], "")


def _differing(a: Mapping[str, Any], b: Mapping[str, Any], where: str) -> list[str]:
    lines = []
    for name in dict.fromkeys([*a, *b]):
        path = f"{where}{name}"
        x, y = a.get(name), b.get(name)
        if x == y:
            continue
        if isinstance(x, Mapping) and isinstance(y, Mapping):
            lines += _differing(x, y, f"{path}.")
        else:
            lines.append(f"{path} {_short(a, name)} -> {_short(b, name)}")
    return lines


def _short(protocol: Mapping[str, Any], name: str) -> str:
    text = " ".join(str(protocol[name]).split()) if name in protocol else "absent"
    return text if len(text) <= 60 else text[:59] + "…"


def judge(column: Column, before: Value, after: Value, *, reals: tuple[Value | None, Value | None]) -> Verdict:
    """The verdict on one number; ``reals``: the real row's number in both reports."""
    if not (math.isfinite(before.mean) and math.isfinite(after.mean)):
        return "unknown"
    if column.share:
        if min(before.count, after.count) < 1 or not all(0 <= v.mean <= 1 for v in (before, after)):
            return "unknown"
        low, high = newcombe(after, before)
        change, clear = after.mean - before.mean, low > 0 or high < 0
    else:
        a, b, better = before, after, column.better
        if better == "real":
            if reals[0] is None or reals[1] is None:
                better = ""
            else:
                a, b = distance(before, reals[0]), distance(after, reals[1])
        if a.mean != b.mean and not (math.isfinite(a.interval) and math.isfinite(b.interval)):
            return "unknown"
        column = replace(column, better="down" if better == "real" else better)
        change = b.mean - a.mean
        clear = change != 0 and abs(change) > math.hypot(a.interval, b.interval)
    if not clear:
        return "same"
    if not column.better:
        return "other"
    return "better" if (change > 0) == (column.better == "up") else "worse"


def distance(value: Value, real: Value) -> Value:
    """How far a number is from the real one, with both intervals in it; a real number of one replication is exact."""
    spread = real.interval if math.isfinite(real.interval) else 0.0
    return Value(abs(value.mean - real.mean), math.hypot(value.interval, spread), value.count)


def wilson(share: float, count: int) -> tuple[float, float]:
    """Wilson's 95 % score interval (1927) of a share of ``count`` tries."""
    centre = share + Z * Z / (2 * count)
    spread = Z * math.sqrt(share * (1 - share) / count + Z * Z / (4 * count * count))
    return (centre - spread) / (1 + Z * Z / count), (centre + spread) / (1 + Z * Z / count)


def newcombe(a: Value, b: Value) -> tuple[float, float]:
    """95 % interval of ``a - b``, two independent shares (Newcombe 1998, method 10)."""
    (la, ua), (lb, ub) = wilson(a.mean, a.count), wilson(b.mean, b.count)
    change = a.mean - b.mean
    return change - math.hypot(a.mean - la, ub - b.mean), change + math.hypot(ua - a.mean, b.mean - lb)


def load(path: Path | str) -> dict[str, Report]:
    """Reports by suite: of a file, of a folder with ``report.json``, of a release's or a run's folder."""
    path = Path(path)
    if path.is_dir() and not (path / "report.json").is_file():
        inside = finished(path, "*.json", "*/report.json")
        if not inside:
            raise MotionloomError(f"{path} holds no reports; name a report.json or a folder of SUITE.json files")
        every = [reports.read(one) for one in inside]
    else:
        every = [reports.read(path)]
    by_suite = {report.suite: report for report in every}
    if len(by_suite) < len(every):
        raise MotionloomError(f"{path} holds two reports of one suite; name one of them")
    return by_suite


def compare_all(before: Path | str, after: Path | str, *, anyway: bool = False) -> tuple[list[Difference], list[str]]:
    """`compare` for every suite that both places have; the suites that only one of them has."""
    a, b = load(before), load(after)
    if len(a) == len(b) == 1:  # two files: other suites are refused, not passed over
        ((old,), (new,)) = a.values(), b.values()
        return compare(old, new, anyway=anyway), []
    shared = [suite for suite in b if suite in a]
    if not shared:
        raise MotionloomError(
            f"{before} and {after} have no suite in common: {', '.join(sorted(a))} there, {', '.join(sorted(b))} here"
        )
    differences = [one for suite in shared for one in compare(a[suite], b[suite], anyway=anyway)]
    return differences, sorted(set(a) ^ set(b))


def table(differences: Sequence[Difference]) -> list[list[str]]:
    """Rows of text, the heading first."""
    rows = [["", "suite", "row", "number", "before", "after"]]
    for one in differences:
        values = [reports.cell(one.column, value) for value in (one.before, one.after)]
        rows.append([one.verdict, one.suite, one.row, one.column.title, *values])
    return rows


def encode(differences: Sequence[Difference]) -> list[dict[str, Any]]:
    """Plain data for JSON; an interval or number that is not finite is null."""
    return [
        {
            "suite": one.suite,
            "row": one.row,
            "column": one.column.name,
            "verdict": one.verdict,
            **{
                name: {"mean": _or_none(v.mean), "interval": _or_none(v.interval), "count": v.count}
                for name, v in (("before", one.before), ("after", one.after))
            },
        }
        for one in differences
    ]


def _or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None


def tally(differences: Sequence[Difference]) -> str:
    """How many numbers got which verdict, in a sentence, and how many would by chance."""
    counts = {name: sum(one.verdict == name for one in differences) for name in ("worse", "better", "other", "same")}
    unknown = len(differences) - sum(counts.values())
    sentence = f"{counts['worse']} worse and {counts['better']} better than the intervals explain"
    sentence += f", {counts['same']} within them"
    sentence += f", {counts['other']} changed where neither way is better" if counts["other"] else ""
    sentence += f", {unknown} measured only once and not judged" if unknown else ""
    judged = len(differences) - unknown
    return f"{sentence}; of {judged} numbers about {judged / 20:.1f} leave a 95 % interval by chance"
