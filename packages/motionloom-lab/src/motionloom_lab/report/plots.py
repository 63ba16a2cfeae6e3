"""PNG plots of a report: every metric a panel of points with intervals, and lines over sampler steps.

Drawn with matplotlib, which only this module imports, and only when a report is written: half a second and 78 MB on
disk with its parts, a tenth of torch. Axes, ticks, labels that fit and logarithmic scales by hand would be more code
than all the rest of a report.
"""

import math
import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from motionloom.core.files.atomic import atomic_path
from motionloom_lab.report.compare import is_control, wilson
from motionloom_lab.report.report import ARROWS, REAL, Column, Report, Row, Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK, OURS, REALITY, OTHERS, CONTROL = "#28303a", "#3474cd", "#18885a", "#9aa1ad", "#5a6270"
MOST_ROWS = 60
PANELS = 12
STEPS = re.compile(r"(?P<what>.*?)[\s,(]*\b(?P<steps>\d{1,5}) steps?\b\)?(?P<rest>.*)")


def draw(report: Report, folder: Path) -> list[Path]:
    """Write ``report.png`` (``report-2.png`` and so on for many metrics) with what was measured here, ``steps.png``
    where rows differ in steps, and ``published.png`` beside what others measured on other data, often of another scale.

    There is no picture of fewer than two rows. The folder must exist.
    """
    here = [row for row in report.rows if not row.measured_on][:MOST_ROWS]
    elsewhere = [row for row in report.rows if row.measured_on][:MOST_ROWS]
    paths, columns = [], _drawable(report, here)
    for page, first in enumerate(range(0, len(columns), PANELS), start=1):
        name = f"report-{page}.png" if page > 1 else "report.png"
        paths.append(_points(report, columns[first : first + PANELS], here, folder / name))
    lines = by_steps(here)
    if lines and (plots := _drawable(report, [row for points in lines.values() for _, row in points])):
        paths.append(_lines(report, plots[:PANELS], lines, folder / "steps.png"))
    beside = {name for row in elsewhere for name in row.values}
    if plots := [c for c in _drawable(report, [*here, *elsewhere]) if c.name in beside]:
        paths.append(_points(report, plots[:PANELS], [*here, *elsewhere], folder / "published.png"))
    return paths


def _drawable(report: Report, rows: Sequence[Row]) -> list[Column]:
    """Metrics that two rows or more have a number of."""
    return [c for c in report.columns if sum(c.name in row.values for row in rows) > 1]


def by_steps(rows: Sequence[Row]) -> dict[str, list[tuple[int, Row]]]:
    """Rows measured here whose names have a number of steps, by the rest of the name; two different numbers or more."""
    groups: dict[str, list[tuple[int, Row]]] = {}
    for row in rows:
        match = STEPS.fullmatch(row.name) if not row.measured_on else None
        if match:
            groups.setdefault((match["what"] + match["rest"]).strip(" ,"), []).append((int(match["steps"]), row))
    ordered = {name: sorted(points, key=lambda point: point[0]) for name, points in groups.items()}
    return {name: points for name, points in ordered.items() if len({steps for steps, _ in points}) > 1}


def _grid(count: int, *, width: float, height: float):
    """A figure of ``count`` panels that needs no display, and its axes."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    across = min(count, 4 if count % 4 == 0 or count % 3 else 3)
    down = math.ceil(count / across)
    with rc_context({"font.size": 9, "text.color": INK, "axes.labelcolor": INK, "hatch.linewidth": 0.6}):
        figure = Figure(figsize=(1.6 + width * across, 0.9 + height * down), dpi=110, layout="constrained")
        axes = figure.subplots(down, across, squeeze=False)
    flat = list(axes.flat)
    for unused in flat[count:]:
        unused.set_visible(False)
    for axis in flat[:count]:
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(colors=INK, labelsize=8)
    return figure, flat[:count], across


def _save(figure, report: Report, path: Path) -> Path:
    figure.suptitle(_plain(report.title, 110), fontsize=11, color=INK)
    with atomic_path(path, folders=True) as temp, warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a script that the font lacks is drawn as boxes
        figure.savefig(temp, format="png", metadata={"Software": None})
    return path


def _points(report: Report, columns: Sequence[Column], rows: Sequence[Row], path: Path) -> Path:
    """A panel per metric, a line per row, the first on top."""
    figure, axes, across = _grid(len(columns), width=2.5, height=0.55 + 0.24 * len(rows))
    places = range(len(rows), 0, -1)
    sources = list(dict.fromkeys(row.measured_on for row in rows if row.measured_on))
    names = [
        _plain(row.name, 48) + (f" [{sources.index(row.measured_on) + 1}]" if row.measured_on else "") for row in rows
    ]
    for k, (axis, column) in enumerate(zip(axes, columns, strict=True)):
        real = report.row(REAL)
        if real and column.name in real.values and math.isfinite(real.values[column.name].mean):
            axis.axvline(real.values[column.name].mean, color=REALITY, linewidth=0.8, linestyle="--", zorder=1)
        for place, row in zip(places, rows, strict=True):
            if row.measured_on:  # a hatched band: measured by others on other data
                axis.axhspan(
                    place - 0.42, place + 0.42, facecolor="#f1f2f4", edgecolor="#d9dce1", hatch="////", zorder=0
                )
            if column.name in row.values:
                _point(axis, place, row, row.values[column.name], share=column.share)
        axis.set_title(_plain(column.title, 34) + ARROWS[column.better], fontsize=9, color=INK)
        axis.set_ylim(0.4, len(rows) + 0.6)
        axis.set_yticks(list(places), names if k % across == 0 else [""] * len(names))
        axis.grid(axis="x", color="#e4e7ec", linewidth=0.6)
        axis.set_axisbelow(True)
        axis.margins(x=0.08)
        axis.locator_params(axis="x", nbins=4)
    if sources:
        lines = [f"[{k}] {_plain(source, 120)}" for k, source in enumerate(sources, start=1)]
        figure.supxlabel("\n".join(["hatched: published", *lines]), fontsize=8, color="#5a6270")
    return _save(figure, report, path)


def _point(axis: "Axes", place: float, row: Row, value: Value, *, share: bool = False) -> None:
    if not math.isfinite(value.mean):
        return
    colour, mark = (OTHERS, "D") if row.measured_on else (REALITY, "s") if row.name == REAL else (OURS, "o")
    colour = CONTROL if colour == OURS and is_control(row.name) else colour
    axis.errorbar(
        value.mean,
        place,
        xerr=_spread(value, share=share),
        fmt=mark,
        color=colour,
        markersize=5,
        capsize=3,
        elinewidth=1.2,
        zorder=3,
        markerfacecolor="white" if row.measured_on else colour,
    )
    if share:
        axis.set_xlim(-0.04, 1.04)


def _spread(value: Value, *, share: bool) -> list[list[float]] | float | None:
    """What matplotlib takes as an error: of a share Wilson's interval, which is wider on the side of a half."""
    if share and value.count > 0 and 0 <= value.mean <= 1:
        low, high = wilson(value.mean, value.count)
        return [[max(0.0, value.mean - low)], [max(0.0, high - value.mean)]]
    return value.interval if math.isfinite(value.interval) else None


def _lines(report: Report, columns: Sequence[Column], lines: dict[str, list[tuple[int, Row]]], path: Path) -> Path:
    """A panel per metric over the number of sampler steps, logarithmic; a line per kind of row."""
    figure, axes, _ = _grid(len(columns), width=2.7, height=2.1)
    colours = (OURS, "#e97440", "#965cbe", "#18b26b", "#b8912f", "#28303a")
    real = report.row(REAL)
    for axis, column in zip(axes, columns, strict=True):
        for colour, (name, points) in zip(colours, lines.items(), strict=False):
            series = [(steps, row.values[column.name]) for steps, row in points if column.name in row.values]
            series = [(steps, value) for steps, value in series if math.isfinite(value.mean)]
            if not series:
                continue
            spread = [value.interval if math.isfinite(value.interval) else 0.0 for _, value in series]
            axis.errorbar(
                [steps for steps, _ in series],
                [value.mean for _, value in series],
                yerr=spread,
                color=colour,
                marker="o",
                markersize=4,
                capsize=2,
                linewidth=1.2,
                label=_plain(name, 30) or "measured",
            )
        if real and column.name in real.values and math.isfinite(real.values[column.name].mean):
            axis.axhline(real.values[column.name].mean, color=REALITY, linewidth=0.8, linestyle="--", label=REAL)
        ticks = sorted({steps for points in lines.values() for steps, _ in points})
        axis.set_xscale("log")
        axis.set_xticks(ticks, [str(t) for t in ticks])
        axis.set_xticks([], minor=True)
        axis.set_title(_plain(column.title, 34) + ARROWS[column.better], fontsize=9, color=INK)
        axis.set_xlabel("sampler steps", fontsize=8)
        axis.grid(color="#e4e7ec", linewidth=0.6)
    axes[0].legend(fontsize=7, frameon=False)
    return _save(figure, report, path)


def study(report: Report, path: Path) -> Path:
    """A picture of a study: a panel per metric over its rows in order, lines over steps where rows differ in them."""
    here = [row for row in report.rows if not row.measured_on]
    columns, lines = _drawable(report, here)[:PANELS], by_steps(here)
    if not columns:
        return path
    if lines and all(row.name == REAL or any(row in dict(p).values() for p in lines.values()) for row in here):
        return _lines(report, columns, lines, path)
    rows = [row for row in here if row.name != REAL]
    figure, axes, _ = _grid(len(columns), width=2.9, height=2.3)
    for axis, column in zip(axes, columns, strict=True):
        series = [(k, row.values[column.name].mean) for k, row in enumerate(rows) if column.name in row.values]
        axis.plot([k for k, _ in series], [v for _, v in series], color=OURS, marker="o", markersize=4, linewidth=1.2)
        real = report.row(REAL)
        if real and column.name in real.values:
            axis.axhline(real.values[column.name].mean, color=REALITY, linewidth=0.8, linestyle="--")
        ticks = range(0, len(rows), max(1, len(rows) // 8))
        axis.set_xticks(list(ticks), [_plain(rows[k].name, 20) for k in ticks], rotation=40, ha="right", fontsize=7)
        axis.set_title(_plain(column.title, 34) + ARROWS[column.better], fontsize=9, color=INK)
        axis.grid(color="#e4e7ec", linewidth=0.6)
    return _save(figure, report, path)


def _plain(text: str, most: int) -> str:
    """One line of at most ``most`` characters that matplotlib takes as it is: no mathematics, no controls."""
    line = "".join(c for c in " ".join(text.split()) if c.isprintable())
    return (line if len(line) <= most else line[: most - 1] + "…").replace("\\", "/").replace("$", "\\$")
