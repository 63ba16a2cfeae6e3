"""Numbers in words are read by the page as by Python (`studio/tests/words.test.ts` compares)."""

import ast
import json
import re
import runpy
from pathlib import Path

import pytest

from motionloom.goals.amounts import read_amount, read_seconds, seconds_for
from motionloom.goals.segment import Segment
from motionloom.goals.sequence import split_actions
from motionloom.goals.timeline import LONGEST, with_amount
from tests.tab import made

TABLES = ("packages/motionloom/tests/goals/amounts.toml", "packages/motionloom/tests/goals/parts.toml")


def sentences() -> list[str]:
    """Of the benchmark, and of the tables that the reader is tested with."""
    tree = ast.parse((made.ROOT / "benchmarks" / "read_words.py").read_text())
    [listed] = [
        one.value
        for one in tree.body
        if isinstance(one, ast.Assign) and isinstance(one.targets[0], ast.Name) and one.targets[0].id == "SENTENCES"
    ]
    text = "".join((made.ROOT / table).read_text() for table in TABLES)
    return list(dict.fromkeys([*ast.literal_eval(listed), *re.findall(r'"(\S+ [^"]+)"', text)]))


def row(text: str) -> dict[str, object]:
    amount, said = read_amount(text), read_seconds(text)
    if amount is not None and seconds_for(amount) > LONGEST:
        amount = None
    seconds = said or (amount and seconds_for(amount))
    parts = []
    if amount is not None and seconds is not None:
        for one in with_amount(Segment(text, seconds), amount):
            goal = one.goal
            places = [] if goal is None or not goal.mask.any() else goal.positions[:, 0, [0, 2]].tolist()
            facing = [] if goal is None or not goal.facing_mask.any() else goal.facing.tolist()
            parts.append(
                {
                    "text": one.text,
                    "seconds": one.seconds,
                    "transition": one.transition,
                    "places": places,
                    "facing": facing,
                }
            )
    several = len(split_actions(text)) > 1
    return {"text": text, "several": several, "read": amount and str(amount), "seconds": seconds, "parts": parts}


def test_the_tables_of_the_page_are_those_of_python() -> None:
    written = runpy.run_path(str(made.ROOT / "tools" / "write_words.py"))
    assert written["PLACE"].read_text(encoding="utf-8") == written["words"](), "run tools/write_words.py"


@pytest.mark.slow
def test_numbers_are_read_as_python_reads_them(tmp_path: Path) -> None:
    file = tmp_path / "words.json"
    file.write_text(json.dumps([row(text) for text in sentences()]))
    found = made.node("vitest/vitest.mjs", "run", "tests/words.test.ts", MOTIONLOOM_WORDS=str(file), NO_COLOR="1")
    assert found.returncode == 0, found.stdout + found.stderr
    assert "skipped" not in found.stdout
