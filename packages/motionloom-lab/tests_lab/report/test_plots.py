"""Plots: which are drawn, and that any name can be drawn."""

from pathlib import Path

import pytest
from PIL import Image

from motionloom_lab.report.plots import by_steps, draw
from motionloom_lab.report.report import Column, Report, Row, Value

FID = Column("fid", "FID", "down", "")


def report(*rows: Row, columns: tuple[Column, ...] = (FID,), title: str = "A title") -> Report:
    return Report("text", title, "", {}, columns, rows)


def rows(*names: str) -> list[Row]:
    return [Row(name, {"fid": Value(float(k), 0.1, 3)}) for k, name in enumerate(names)]


@pytest.mark.parametrize(
    ("names", "found"),
    [
        (["ours, 20 steps", "ours, 5 steps"], {"ours": [5, 20]}),
        (["default (5 steps)", "default (1000 steps)", "real"], {"default": [5, 1000]}),
        (["a, 5 steps", "b, 5 steps"], {}),
        (["20 steps", "50 steps"], {"": [20, 50]}),
        (["footsteps", "step by step 3"], {}),
    ],
)
def test_step_counts_are_read_from_names(names: list[str], found: dict[str, list[int]]) -> None:
    assert {k: [steps for steps, _ in points] for k, points in by_steps(rows(*names)).items()} == found


def test_published_rows_make_no_line() -> None:
    published = [Row(f"MDM, {k} steps", {"fid": Value(1.0)}, "HumanML3D") for k in (50, 1000)]
    assert by_steps(published) == {}


def test_published_rows_stand_in_a_picture_of_their_own(tmp_path: Path) -> None:
    """Their numbers may be of another scale and would flatten ours."""
    theirs = Row("MDM", {"fid": Value(100.0)}, "HumanML3D, " + "a long source " * 20)
    assert [path.name for path in draw(report(*rows("a", "b"), theirs), tmp_path)] == ["report.png", "published.png"]
    assert [path.name for path in draw(report(*rows("a"), theirs), tmp_path)] == ["published.png"]


def test_one_row_is_not_drawn(tmp_path: Path) -> None:
    assert draw(report(*rows("alone")), tmp_path) == []
    assert not list(tmp_path.iterdir())


def test_pictures_are_pictures_and_names_cannot_break_them(tmp_path: Path) -> None:
    odd = [
        *rows("$x^{", "\\frac{1}", "a\nb\x00", "名前 5 steps", "名前 9 steps"),
        Row("nan", {"fid": Value(float("nan"))}),
    ]
    paths = draw(report(*odd, title="100 % of $ and \\ \n" * 20), tmp_path)
    assert [path.name for path in paths] == ["report.png", "steps.png"]
    for path in paths:
        with Image.open(path) as picture:
            picture.load()
            assert 200 < picture.width < 4000


def test_many_metrics_go_on_further_pages(tmp_path: Path) -> None:
    columns = tuple(Column(f"c{k}", f"metric {k}", "up", "") for k in range(13))
    two = [Row(name, {c.name: Value(1.0) for c in columns}) for name in "ab"]
    assert [path.name for path in draw(report(*two, columns=columns), tmp_path)] == ["report.png", "report-2.png"]


def test_a_larger_number_is_drawn_further_right(tmp_path: Path) -> None:
    """The blue points of two rows: the upper row's number is smaller, so its point is further left."""
    (path,) = draw(report(*rows("small", "large")), tmp_path)
    with Image.open(path) as picture:
        pixels = picture.convert("RGB")
        blue = [
            (x, y)
            for x in range(pixels.width)
            for y in range(pixels.height)
            if (p := pixels.getpixel((x, y))) and p[2] > 180 and p[0] < 90  # type: ignore[index]
        ]
    upper, lower = min(blue, key=lambda p: p[1]), max(blue, key=lambda p: p[1])
    assert upper[1] < lower[1]
    assert upper[0] < lower[0] - 50
