"""Every door opens on the same fields: the command line, the server, the page's types, the tools of assistants."""

import argparse
import inspect
import json
import runpy
from pathlib import Path

import pytest

from motionloom.cli import main, parser
from motionloom.cli.options import option
from motionloom.requests.export import Export
from motionloom.requests.fields import specs
from motionloom.requests.tasks import REQUESTS

ROOT = Path(__file__).parents[4]
READ_ELSEWHERE = {
    "generate": set(),
    "compose": {"count"},
    "control": set(),
    "edit": {"person", "look_at"},
    "predict": {"person", "start", "end"},
    "switch": {"start", "end"},
    "duet": {"person"},
}
"""Fields that a command has an option of its own for, or none: it reads files, where people are one each."""


@pytest.mark.parametrize("task", REQUESTS)
def test_a_command_has_an_option_for_every_field_that_can_be_typed(task: str) -> None:
    commands = next(one.choices for one in parser()._actions if isinstance(one, argparse._SubParsersAction))
    options = {name: action for action in commands[task]._actions for name in action.option_strings}
    for name, spec in specs(REQUESTS[task]).items():
        typed = spec.kind in ("number", "whole", "flag", "word", "text") and name != "prompt"
        if not typed or name in READ_ELSEWHERE[task]:
            continue
        action = options[option(name, spec)]
        if spec.kind != "flag":
            assert action.spec == spec  # type: ignore[attr-defined]
            assert action.default == spec.default


@pytest.mark.parametrize("task", REQUESTS)
def test_the_server_describes_the_fields(task: str) -> None:
    pytest.importorskip("starlette", reason="needs the extra 'studio'")
    from motionloom.server.limits import Limits
    from motionloom.server.openapi import components, request_of

    limits = Limits()
    keys = components(limits)[request_of(task)]["properties"]
    for name, spec in specs(REQUESTS[task]).items():
        schema = keys[name]
        if "$ref" in schema and spec.kind != "word":
            continue
        if spec.kind == "word":
            assert components(limits)[schema["$ref"].rsplit("/", 1)[-1]]["enum"] == list(spec.words)
            continue
        assert spec.help in schema["description"]
        if spec.kind in ("number", "whole") and not spec.many:
            bounds = schema["items"] if spec.size else schema
            assert bounds.get("minimum", bounds.get("exclusiveMinimum")) == spec.low
            assert bounds["maximum"] <= spec.high


def test_the_page_has_the_types_that_the_server_says() -> None:
    pytest.importorskip("starlette", reason="needs the extra 'studio'")
    tool = runpy.run_path(str(ROOT / "tools" / "write_types.py"))
    assert tool["PLACE"].read_text(encoding="utf-8") == tool["types"](), "run tools/write_types.py"


def test_assistants_have_a_tool_for_every_task(tmp_path: Path) -> None:
    pytest.importorskip("mcp", reason="needs the extra 'mcp'", exc_type=ImportError)
    from motionloom.server.assistant import Assistant
    from motionloom.server.limits import Limits
    from motionloom.server.project import Project
    from motionloom.server.worker import Worker

    limits = Limits()
    project = Project(tmp_path, limits)
    tools = Assistant(project, Worker(project, limits))
    for task, request in REQUESTS.items():
        assert set(inspect.signature(tools.tool(task)).parameters) == set(specs(request))
    assert set(inspect.signature(tools.export).parameters) == set(specs(Export))


def test_a_file_of_a_motion_is_asked_alike_everywhere(tmp_path: Path) -> None:
    pytest.importorskip("starlette", reason="needs the extra 'studio'")
    from motionloom.server.limits import Limits
    from motionloom.server.openapi import document

    commands = next(one.choices for one in parser()._actions if isinstance(one, argparse._SubParsersAction))
    known, options = specs(Export), commands["export"]._option_string_actions
    by_name = {"motion", "format", "person", "name"}  # which files say
    for name in known.keys() - by_name - {"skeleton"}:
        assert known[name].help in options[option(name, known[name])].help
    parameters = document(Limits())["paths"]["/motions/{id}.{format}"]["get"]["parameters"]
    assert {one["name"] for one in parameters} == known.keys() - {"motion", "name"} | {"id"}
    assert {one["name"]: one["description"] for one in parameters}["mirror"] == known["mirror"].help


def test_the_picture_of_the_architecture_is_that_of_the_code() -> None:
    tool = runpy.run_path(str(ROOT / "tools" / "draw_architecture.py"))
    assert tool["PLACE"].read_text(encoding="utf-8") == tool["picture"](), "run tools/draw_architecture.py"
    rooms = {place.split("/")[0] for _, place in tool["DOORS"] if "/" in place}
    rooms |= {one.strip().split("/")[0] for _, places, _ in tool["STEPS"] for one in places.split(",")}
    package = ROOT / "packages" / "motionloom" / "src" / "motionloom"
    assert [room for room in rooms if not (package / room).is_dir()] == []


@pytest.mark.parametrize(("command", "kind"), [("control", "goal"), ("predict", "mask"), ("compose", "timeline")])
def test_the_schema_of_a_kind_of_file_is_printed(command: str, kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    from motionloom.goals.schemas import SCHEMAS

    with pytest.raises(SystemExit) as ended:
        main([command, "--schema"])
    assert ended.value.code == 0
    assert capsys.readouterr().out == SCHEMAS[kind]()
    assert json.loads(SCHEMAS[kind]())["title"] == f"motionloom {kind}"


def test_goals_that_assistants_are_shown_are_goals(tmp_path: Path) -> None:
    from motionloom.goals.goal_file import read_goal
    from motionloom.server.assistant import KINDS

    assert KINDS["goals"]["examples"]
    for one in KINDS["goals"]["examples"]:
        assert not read_goal(one, frames=100, folder=tmp_path).empty
