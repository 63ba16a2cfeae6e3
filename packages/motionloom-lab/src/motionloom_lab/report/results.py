"""The page of results: each suite's report between its own pair of marker comments.

``<!-- suite NAME; of WEIGHTS HASH -->`` and ``<!-- end -->`` enclose what is replaced; all else stays as people wrote
it. The hashes are those of the weight files that were measured, so that a page can be held against the files that ship
(`tools/fill_readme.py`). Filling twice changes nothing.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from motionloom.core.errors import MotionloomError
from motionloom.core.reading import read_bytes
from motionloom_lab.report.files import write_text
from motionloom_lab.report.report import Report, markdown

PLACE = re.compile(r"(<!-- suite ([\w.-]+)(?:; of [^\n]*?)? -->\n)(.*?)(<!-- end -->)", re.DOTALL)
FILES = "files"
"""Key of a protocol: name and hash of each weight file that was measured."""
QUICK_MARK = "<!-- quick -->\n"
LARGEST = 8 << 20


def fill(text: str, reports: Sequence[Report], *, again: bool = False) -> tuple[str, list[str]]:
    """The page with each report at its place, and the suites left alone since a quick run may not replace a full one.

    A suite without a place gets one at the end; ``again`` lets a quick run replace a full one.
    """
    for report in reports:
        if not any(match[2] == report.suite for match in PLACE.finditer(text)):
            text = f"{text.rstrip()}\n\n## {report.title}\n\n<!-- suite {report.suite} -->\n<!-- end -->\n"
    by_suite = {report.suite: report for report in reports}
    skips: list[str] = []

    def one(match: re.Match[str]) -> str:
        report = by_suite.get(match[2])
        if report is None:
            return match[0]
        quick = bool(report.protocol.get("quick", False))
        full_before = "|" in match[3] and QUICK_MARK not in match[3]
        if quick and full_before and not again:
            skips.append(report.suite)
            return match[0]
        return f"{opening(report, 'suite')}{QUICK_MARK if quick else ''}{as_section(report)}{match[4]}"

    return PLACE.sub(one, text), skips


def opening(report: Report, kind: Literal["suite", "figures"]) -> str:
    """The first line of a place: a suite's on a page of all, or of figures on a page of their own."""
    measured = report.protocol.get(FILES)
    of = f"; of {', '.join(f'{name} {mark}' for name, mark in measured.items())}" if isinstance(measured, dict) else ""
    return f"<!-- {kind}{f' {report.suite}' if kind == 'suite' else ''}{of.replace('-->', '')} -->\n"


def as_section(report: Report) -> str:
    """The report as Markdown without its title and with no comment of its own that could end its place."""
    return re.sub(r"\A# .*\n+", "", markdown(report)).replace("<!--", "< !--")


def check_page(path: Path) -> str:
    """The text of a page of results: a check before long work. `MotionloomError` if there is none."""
    try:
        return read_bytes(path, max_bytes=LARGEST, empty=True).decode("utf-8")
    except ValueError as error:
        reason = error if isinstance(error, MotionloomError) else f"{path} is no text in UTF-8"
        raise MotionloomError(f"{reason}; name a page with marker comments") from None


def fill_page(path: Path, reports: Sequence[Report], *, again: bool = False) -> list[str]:
    """Fill the file; the suites left alone (`fill`). `MotionloomError` if there is no such page."""
    text = check_page(path)
    page, skips = fill(text, reports, again=again)
    if page != text:
        write_text(path, page)
    return skips
