"""Which differences count: hand-made numbers, a published interval, and reports that may not be compared."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom_lab.report import compare as cmp
from motionloom_lab.report.report import Better, Column, Report, Row, Value, encode

NONE = (None, None)


def column(better: Better = "down", *, name: str = "fid", share: bool = False) -> Column:
    return Column(name, name, better, "", 3, share)


def report(
    value: Value, *, row: str = "ours", better: Better = "down", suite: str = "text", **protocol: object
) -> Report:
    one = column(better)
    return Report(suite, "T", "", {"batch": 32, **protocol}, (one,), (Row(row, {"fid": value}),))


@pytest.mark.parametrize(
    ("before", "after", "better", "verdict"),
    [
        (Value(1.0, 0.3, 10), Value(1.49, 0.4, 10), "down", "same"),  # sqrt(0.3^2 + 0.4^2) = 0.5
        (Value(1.0, 0.3, 10), Value(1.51, 0.4, 10), "down", "worse"),
        (Value(1.0, 0.3, 10), Value(1.51, 0.4, 10), "up", "better"),
        (Value(1.0, 0.3, 10), Value(0.49, 0.4, 10), "down", "better"),
        (Value(1.0, 0.3, 10), Value(0.49, 0.4, 10), "up", "worse"),
        (Value(1.0, 0.3, 10), Value(1.51, 0.4, 10), "", "other"),
        (Value(1.0, 0.0, 10), Value(1.0, 0.0, 10), "up", "same"),
        (Value(1.0), Value(9.0, 0.1, 10), "up", "unknown"),
        (Value(1.0), Value(1.0), "up", "same"),
        (Value(math.nan), Value(1.0, 0.1, 2), "up", "unknown"),
    ],
)
def test_a_difference_counts_beyond_the_root_of_the_squared_intervals(
    before: Value, after: Value, better: Better, verdict: str
) -> None:
    assert cmp.judge(column(better), before, after, reals=NONE) == verdict


@pytest.mark.parametrize(
    ("before", "after", "verdict"),
    [(8.0, 8.5, "better"), (9.5, 10.2, "worse"), (8.5, 9.5, "same"), (9.5, 8.0, "worse")],
)
def test_towards_the_real_row_is_better_from_either_side(before: float, after: float, verdict: str) -> None:
    """Real is 9: 8 to 8.5 halves the distance, 8.5 to 9.5 keeps it."""
    real = Value(9.0, 0.1, 10)
    differences = cmp.judge(column("real"), Value(before, 0.1, 10), Value(after, 0.1, 10), reals=(real, real))
    assert differences == verdict


def test_the_spread_of_the_real_row_counts_too() -> None:
    """Distances 1.0 and 0.5; without the real row's spread the interval is 0.14, with it sqrt(0.02 + 0.5) = 0.72."""
    before, after = Value(8.0, 0.1, 10), Value(8.5, 0.1, 10)
    exact, vague = Value(9.0), Value(9.0, 0.5, 10)
    assert cmp.judge(column("real"), before, after, reals=(exact, exact)) == "better"
    assert cmp.judge(column("real"), before, after, reals=(vague, vague)) == "same"


def test_without_a_real_row_neither_way_is_better() -> None:
    assert cmp.judge(column("real"), Value(1.0, 0.1, 9), Value(2.0, 0.1, 9), reals=NONE) == "other"


def test_newcombes_own_example() -> None:
    """Newcombe 1998, table II, method 10: 56/70 against 48/80 gives 0.0524 to 0.3339; 9/10 against 3/10, 0.1705 to
    0.8090; 10/10 against 0/10, 0.6075 to 1."""
    for (a, m), (b, n), interval in [
        ((56, 70), (48, 80), (0.0524, 0.3339)),
        ((9, 10), (3, 10), (0.1705, 0.8090)),
        ((10, 10), (0, 10), (0.6075, 1.0)),
    ]:
        bounds = cmp.newcombe(Value(a / m, count=m), Value(b / n, count=n))
        assert bounds == pytest.approx(interval, abs=6e-5)


@given(count=st.integers(1, 500), data=st.data())
def test_wilsons_limits_are_where_the_score_test_turns(count: int, data: st.DataObject) -> None:
    """At a limit the share is exactly 1.96 standard errors of that limit away: the definition of the score interval."""
    share = data.draw(st.integers(0, count)) / count
    for limit in cmp.wilson(share, count):
        assert -1e-9 <= limit <= 1 + 1e-9
        assert abs(share - limit) == pytest.approx(1.96 * math.sqrt(max(0.0, limit * (1 - limit)) / count), abs=1e-6)


@pytest.mark.parametrize(
    ("before", "after", "verdict"),
    [(9, 7, "same"), (10, 5, "worse"), (2, 10, "better"), (10, 10, "same"), (0, 0, "same")],
)
def test_counts_of_ten_seeds_are_compared_as_counts(before: int, after: int, verdict: str) -> None:
    values = [Value(k / 10, count=10) for k in (before, after)]
    assert cmp.judge(column("up", share=True), *values, reals=NONE) == verdict


def test_equal_models_rarely_differ() -> None:
    """Ten replications of the same thing, two thousand times: about one in twenty differs (a little more, since sigma
    is estimated from ten); the planted faults of adding the intervals or of forgetting one leave this range."""
    rng = np.random.default_rng(0)
    draws = rng.normal(size=(2000, 2, 10))
    verdicts = [cmp.judge(column(), *(Value.of(list(d)) for d in pair), reals=NONE) for pair in draws]
    assert 0.035 < np.mean([verdict != "same" for verdict in verdicts]) < 0.085


def test_rows_are_matched_by_name_and_published_ones_left_out() -> None:
    before, after = report(Value(1.0, 0.1, 5)), report(Value(2.0, 0.1, 5))
    theirs = Row("MDM", {"fid": Value(0.5, 0.1, 5)}, "HumanML3D")
    new = Row("new", {"fid": Value(0.5, 0.1, 5)})
    differences = cmp.compare(
        replace(before, rows=(*before.rows, theirs)), replace(after, rows=(new, *after.rows, theirs))
    )
    assert [(one.row, one.verdict) for one in differences] == [("ours", "worse")]


def test_rows_of_other_weights_are_matched_by_what_follows_their_name() -> None:
    before = report(Value(1.0, 0.1, 5), row="default, 20 steps")
    after = report(Value(2.0, 0.1, 5), row="mine, 20 steps")
    assert [one.verdict for one in cmp.compare(before, after)] == ["worse"]
    assert cmp.compare(before, report(Value(2.0, 0.1, 5), row="mine, 50 steps")) == []


def test_a_published_row_is_never_taken_for_ours() -> None:
    """Its name ends as ours does, but it was measured on other data."""
    before = report(Value(1.0, 0.1, 5), row="default, 20 steps")
    theirs = Row("MDM, 20 steps", {"fid": Value(9.0, 0.1, 5)}, "HumanML3D")
    after = replace(report(Value(1.0, 0.1, 5), row="mine, 20 steps"), rows=(*before.rows, theirs))
    assert [one.row for one in cmp.compare(before, after)] == ["default, 20 steps"]


@pytest.mark.parametrize("row", ["real", "real, captions shuffled", "shuffled captions", "chance"])
def test_controls_change_but_get_neither_better_nor_worse(row: str) -> None:
    (one,) = cmp.compare(report(Value(1.0, 0.1, 5), row=row), report(Value(2.0, 0.1, 5), row=row))
    assert one.verdict == "other"


def test_of_an_evaluators_suite_only_the_real_row_is_judged() -> None:
    """What an evaluator finds in damaged motion should be bad."""
    for row, verdict in (("real", "worse"), ("noise 5 cm", "other")):
        pair = [report(Value(mean, 0.1, 5), row=row, suite="evaluator") for mean in (1.0, 2.0)]
        assert [one.verdict for one in cmp.compare(*pair)] == [verdict]


@pytest.mark.parametrize(
    ("after", "said"),
    [
        ({"suite": "realism"}, "suite text -> realism"),
        ({"batch": 64}, "batch 32 -> 64"),
        ({"evaluator": "guo"}, "evaluator absent -> guo"),
        ({"judge": {"about": 2}}, "judge.about 1 -> 2"),
    ],
)
def test_reports_measured_otherwise_are_refused_unless_anyway(after: dict[str, object], said: str) -> None:
    value = Value(1.0, 0.1, 5)
    a = replace(report(value), protocol={"batch": 32, **({"judge": {"about": 1}} if "judge" in after else {})})
    suite = str(after.get("suite", "text"))
    b = replace(a, suite=suite, protocol={**a.protocol, **{k: v for k, v in after.items() if k != "suite"}})
    with pytest.raises(MotionloomError, match="not measured alike") as error:
        cmp.compare(a, b)
    assert said in str(error.value)
    assert [one.verdict for one in cmp.compare(a, b, anyway=True)] == ["same"]


def test_other_weights_are_what_is_compared() -> None:
    assert cmp.compare(report(Value(1.0, 0.1, 2), weights="a"), report(Value(1.0, 0.1, 2), weights="b"))


def test_two_evaluators_are_compared_in_their_own_suite_and_nowhere_else() -> None:
    for suite, fine in (("evaluator", True), ("text", False)):
        a, b = (report(Value(1.0, 0.1, 2), row="real", suite=suite, evaluator=name) for name in ("one", "two"))
        assert (cmp.differences_of_protocol(a, b) == []) == fine


def test_folders_of_releases_and_of_runs_are_read_alike(tmp_path: Path) -> None:
    (tmp_path / "0.1.0").mkdir()
    (tmp_path / "run" / "text").mkdir(parents=True)
    (tmp_path / "0.1.0" / "text.json").write_text(json.dumps(encode(report(Value(1.0, 0.1, 5)))))
    (tmp_path / "0.1.0" / "realism.json").write_text(json.dumps(encode(report(Value(1.0), suite="realism"))))
    (tmp_path / "run" / "text" / "report.json").write_text(json.dumps(encode(report(Value(2.0, 0.1, 5)))))
    differences, alone = cmp.compare_all(tmp_path / "0.1.0", tmp_path / "run")
    assert [one.verdict for one in differences] == ["worse"]
    assert alone == ["realism"]


def test_an_empty_folder_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="holds no reports"):
        cmp.load(tmp_path)


def test_the_tally_says_how_many_would_leave_by_chance() -> None:
    differences = cmp.compare(report(Value(1.0, 0.1, 5)), report(Value(2.0, 0.1, 5)))
    sentence = cmp.tally(differences * 20)
    assert "20 worse and 0 better" in sentence
    assert "about 1.0 leave" in sentence
