"""Reports: intervals, tables, files, and what comes from outside."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom_lab.report.report import Column, Report, Row, Value, decode, encode, markdown, plain, read, write

FID = Column("fid", "FID", "down", "distance to real")
DIVERSITY = Column("diversity", "Diversity", "real", "spread")
OBEYED = Column("obeyed", "obeyed", "up", "share of seeds", 2, share=True)


def report(*rows: Row, columns: tuple[Column, ...] = (FID, DIVERSITY)) -> Report:
    return Report("text", "Text | motion", "motionloom evaluate text --weights default", {"batch": 32}, columns, rows)


REAL = Row("real", {"fid": Value(0.01), "diversity": Value(9.0, 0.1, 10)})
OURS = Row("ours, 20 steps", {"fid": Value(1.0, 0.05, 10), "diversity": Value(8.5, 0.1, 10)})
FEW = Row("ours, 5 steps", {"fid": Value(2.0, 0.05, 10), "diversity": Value(8.9, 0.1, 10)})
THEIRS = Row("MDM", {"fid": Value(0.5, 0.04)}, "HumanML3D")
WHOLE = report(REAL, OURS, FEW, THEIRS)


def test_the_interval_is_the_textbooks() -> None:
    """1, 2, 3, 4, 5: mean 3, variance 2.5, so 1.96 sqrt(2.5 / 5) = 1.96 sqrt(0.5)."""
    value = Value.of([1, 2, 3, 4, 5])
    assert (value.mean, value.count) == (3.0, 5)
    assert value.interval == pytest.approx(1.96 * math.sqrt(0.5))


def test_one_replication_has_no_interval_and_none_no_value() -> None:
    assert math.isnan(Value.of([2.0]).interval)
    with pytest.raises(ValueError, match="one sample"):
        Value.of([])


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (Value(0.1234, 0.0044, 10), "0.123 ± 0.004"),
        (Value(0.5), "0.500"),
        (Value(math.nan), "-"),
        (Value(math.inf, 0.1), "-"),
    ],
)
def test_numbers_are_written_with_their_interval(value: Value, said: str) -> None:
    assert value.text() == said


def test_the_table_sets_the_best_and_the_published_rows_apart() -> None:
    """Least FID of ours is bold; Diversity nearest to real is bold; the published row stands in a table of its own."""
    here, elsewhere = markdown(WHOLE).split("Published, measured on HumanML3D")
    assert "| ours, 20 steps | **1.000 ± 0.050** | 8.500 ± 0.100 | 10 |" in here
    assert "| ours, 5 steps | 2.000 ± 0.050 | **8.900 ± 0.100** | 10 |" in here
    assert "| real | 0.010 | 9.000 ± 0.100 | 1 to 10 |" in here
    assert "| MDM | 0.500 ± 0.040 |" in elsewhere
    assert "MDM" not in here
    assert "motionloom evaluate text --weights default" in elsewhere
    assert "- batch: 32" in elsewhere


def test_one_row_of_many_numbers_is_turned() -> None:
    columns = tuple(Column(f"c{k}", f"metric {k}", "up", f"meaning {k}") for k in range(5))
    page = markdown(report(Row("machine", {c.name: Value(1.0) for c in columns}), columns=columns))
    assert "| metric 3 ↑ | 1.000 | meaning 3 |" in page


def test_a_share_shows_what_was_counted() -> None:
    page = markdown(report(Row("walk", {"obeyed": Value(0.9, count=10)}), columns=(OBEYED,)))
    assert "| walk | 0.90 (9/10) |" in page
    assert "count" not in page


def test_a_terminal_gets_no_control_characters() -> None:
    assert "\x1b" not in plain(report(Row("\x1b[31mred", {"fid": Value(1.0)})))


def test_a_report_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = write(WHOLE, tmp_path / "new" / "folder")
    assert encode(read(path)) == encode(read(path.parent)) == encode(WHOLE)
    names = sorted(p.name for p in path.parent.iterdir())
    assert names == ["published.png", "report.json", "report.md", "report.png", "steps.png"]
    assert "](report.png)" in (path.parent / "report.md").read_text()


def test_an_interval_that_is_none_is_null_and_comes_back(tmp_path: Path) -> None:
    path = write(report(Row("a", {"fid": Value(1.0)})), tmp_path)
    assert json.loads(path.read_text())["rows"][0]["values"]["fid"]["interval"] is None
    assert math.isnan(read(path).rows[0].values["fid"].interval)


_NAMES = st.text(min_size=1, max_size=8)
_NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
_VALUES = st.builds(Value, _NUMBERS, st.floats(min_value=0, allow_infinity=False), st.integers(0, 1 << 30))
_PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers(-9, 9) | _NUMBERS | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=6,
)


@given(
    rows=st.lists(
        st.builds(Row, _NAMES, st.dictionaries(st.sampled_from(["fid", "diversity"]), _VALUES), st.text(max_size=3)),
        max_size=4,
        unique_by=lambda row: (row.name, row.measured_on),
    ),
    protocol=st.dictionaries(st.text(max_size=4), _PLAIN, max_size=3),
)
@settings(max_examples=60, deadline=None)
def test_any_report_survives_json_and_can_be_shown(rows: list[Row], protocol: dict[str, object]) -> None:
    one = replace(report(*rows), protocol=protocol)
    copy = decode(json.loads(json.dumps(encode(one), allow_nan=False)))
    assert copy == one
    assert markdown(copy).startswith("# Text")
    assert plain(copy)


GOOD = encode(WHOLE)


def _damaged(path: tuple[str | int, ...], value: object) -> dict[str, object]:
    data = json.loads(json.dumps(GOOD))
    inner = data
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    return data


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("format",), 2),
        (("suite",), "../up"),
        (("title",), 3),
        (("title",), "x" * 30_000),
        (("title",), "\ud800"),
        (("protocol",), []),
        (("protocol", "deep"), [[[[[[[[[[1]]]]]]]]]]),
        (("columns",), {}),
        (("columns", 0, "better"), "left"),
        (("columns", 0, "digits"), 99),
        (("columns", 1, "name"), "fid"),
        (("rows",), [{}] * 20_000),
        (("rows", 0, "name"), "ours, 20 steps"),
        (("rows", 0, "values", "other"), {"mean": 1, "interval": None, "count": 1}),
        (("rows", 0, "values", "fid", "mean"), "1"),
        (("rows", 0, "values", "fid", "mean"), True),
        (("rows", 0, "values", "fid", "interval"), -1.0),
        (("rows", 0, "values", "fid", "count"), 1.5),
        (("rows", 0, "values", "fid", "count"), -1),
        (("notes",), "one"),
    ],
)
def test_a_damaged_report_is_one_sentence_that_names_the_file(
    tmp_path: Path, path: tuple[str | int, ...], value: object
) -> None:
    file = tmp_path / "report.json"
    file.write_text(json.dumps(_damaged(path, value)))
    with pytest.raises(MotionloomError, match="is not a report") as error:
        read(file)
    assert str(file) in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("text", ["", "null", "[]", '{"format": 1', '{"format": NaN}', "[" * 100_000, '"\ud800"'])
def test_what_is_no_report_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "report.json"
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    with pytest.raises(MotionloomError, match=r"report\.json"):
        read(file)


def test_a_missing_report_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="cannot read"):
        read(tmp_path / "nothing")


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from([*GOOD, "mean"]), inner, max_size=4),
    max_leaves=8,
)


@given(key=st.sampled_from(sorted(GOOD)), value=_JSON)
@settings(max_examples=150, deadline=None)
def test_any_json_in_place_of_a_part_is_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, key: str, value: object
) -> None:
    file = tmp_path_factory.mktemp("found") / "report.json"
    file.write_text(json.dumps({**GOOD, key: value}))
    try:
        message = str(file) if isinstance(read(file), Report) else ""
    except MotionloomError as error:
        message = str(error)
    assert str(file) in message
