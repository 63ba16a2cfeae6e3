"""docs/evaluate.md says what the code does."""

from pathlib import Path

import pytest

from motionloom_lab.metrics.obedience import CHECKS
from motionloom_lab.report import files
from motionloom_lab.suites import reference

PAGE = Path(__file__).parents[4] / "docs" / "evaluate.md"


@pytest.mark.parametrize("make", [reference.rates, reference.confusion_table])
def test_the_tables_of_real_clips_are_the_shipped_numbers(make) -> None:
    assert files.markdown(make(reference.known())) in PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize("one", CHECKS, ids=lambda c: c.name)
def test_every_prompt_stands_there_with_its_bounds_and_reasons(one) -> None:
    bounds = "; ".join(f"`{b.text()}`: {b.why}" for b in one.limits)
    assert f"| {one.prompt} | {one.seconds:g} | {bounds} |" in PAGE.read_text(encoding="utf-8")
