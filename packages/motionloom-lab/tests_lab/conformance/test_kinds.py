"""Every recorded kind is compared by a test module, and every file that is not a group by one that names it."""

import ast
import json
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path

from tests.conformance import runner

FOLDERS = Path(__file__).parent, Path(runner.__file__).parent
Kind = tuple[str, str]


def recorded_kinds(folder: Path) -> set[Kind]:
    """(group, kind) of every recorded case; ("", file) of every file that holds no cases."""
    kinds: set[Kind] = set()
    for path in sorted(folder.glob("*.json")):
        content = json.loads(path.read_text())
        kinds |= {(path.stem, case["config"]["kind"]) for case in content.get("cases", [])} or {("", path.name)}
    return kinds


def asked_kinds(source: str) -> Iterator[tuple[str, str | None]]:
    """(group, kind or None for all) of every call of `cases` in a module; ("", file) of every call of `recorded`."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("cases", "recorded"):
            arguments = {None: node.args[0]} | {word.arg: word.value for word in node.keywords}
            values = {name: value.value for name, value in arguments.items() if isinstance(value, ast.Constant)}
            if node.func.id == "recorded" and None in values:
                yield "", str(values[None])
            elif None in values:
                yield str(values[None]), None if values.get("kind") is None else str(values["kind"])


def compared_by(sources: Mapping[str, str], kinds: set[Kind]) -> dict[Kind, list[str]]:
    """The modules that compare each kind."""
    files: dict[Kind, list[str]] = defaultdict(list)
    for module, source in sources.items():
        asked = set(asked_kinds(source))
        for group, kind in sorted(kinds):
            if (group, kind) in asked or (group and (group, None) in asked):
                files[group, kind].append(module)
    return files


def test_every_recorded_kind_is_compared_by_some_module() -> None:
    sources = {
        path.name: path.read_text()
        for folder in FOLDERS
        for path in folder.glob("test_*.py")
        if path.stem != "test_runner"
    }
    kinds = recorded_kinds(runner.FOLDER)
    modules = compared_by(sources, kinds)
    assert kinds, f"nothing is recorded in {runner.FOLDER}"
    alone = sorted(kinds - modules.keys())
    assert not alone, f"recorded in {runner.FOLDER} and compared by nobody: {alone}; others: {dict(modules)}"


def test_a_kind_that_nobody_compares_is_found(tmp_path: Path) -> None:
    """A group that is read whole, one of whose kinds is left aside, and a file beside the groups."""
    for group, kinds in {"all": ["a", "b"], "some": ["a", "b"]}.items():
        cases = [{"name": kind, "config": {"kind": kind}} for kind in kinds]
        (tmp_path / f"{group}.json").write_text(json.dumps({"cases": cases}))
    (tmp_path / "sums.json").write_text("{}")
    kinds = recorded_kinds(tmp_path)
    sources = {"one": 'cases("all")', "two": 'cases("some", kind="a"); case("some", "b")'}
    assert compared_by(sources, kinds) == {("all", "a"): ["one"], ("all", "b"): ["one"], ("some", "a"): ["two"]}
    assert kinds - compared_by(sources, kinds).keys() == {("some", "b"), ("", "sums.json")}
    assert ("", "sums.json") in compared_by({"three": 'recorded("sums.json")'}, kinds)
