"""The page of dependencies: every pin of every lock file, with the licence that is installed."""

import json
import re
import runpy
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def tool() -> dict[str, Any]:
    return runpy.run_path(str(ROOT / "tools" / "write_dependencies.py"))


def test_the_page_is_up_to_date(tool: dict[str, Any]) -> None:
    assert tool["PLACE"].read_text(encoding="utf-8") == tool["page"](), "run python tools/write_dependencies.py"


def test_every_pin_is_listed(tool: dict[str, Any]) -> None:
    """Read here in a way of its own: pip's lines, and the tree of npm's lock."""
    listed = {(one.name, one.version) for one in tool["written"]().values()}
    files = [*ROOT.glob("constraints*.txt"), ROOT / "studio" / "node.txt"]
    lines = [line.split() for file in files for line in file.read_text().splitlines() if "==" in line]
    pins = {tuple(words[0].split("==")) for words in lines if words[0] != "#"}
    packages = json.loads((ROOT / "studio" / "package-lock.json").read_text())["packages"]
    shipped = {
        (re.sub(r"^.*node_modules/", "", place), one["version"])
        for place, one in packages.items()
        if "node_modules/" in place and not one.get("link")
    }
    assert len(pins) > 100
    assert len(shipped) > 20
    assert pins | shipped <= listed


def test_what_users_run_has_a_licence(tool: dict[str, Any]) -> None:
    runs = tool["of_python"](tool["written"]())["What a user's installation runs"]
    assert [one.name for one in runs if not one.licence] == []


@pytest.mark.parametrize(
    ("version", "date"),
    [("2026.9.0", "2026-09"), ("2026.10", "2026-10"), ("25.12.19", ""), ("1.2", ""), ("2026.99", "")],
)
def test_a_date_is_told_by_a_version_that_is_one(tool: dict[str, Any], version: str, date: str) -> None:
    assert tool["date_of"](version) == date
