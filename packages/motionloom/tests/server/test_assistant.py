"""MCP through the SDK's own client: a process of its own, spoken to over its standard input and output."""

import asyncio
import base64
import json
import os
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from motionloom import load
from motionloom.requests.tasks import REQUESTS

mcp = pytest.importorskip("mcp", reason="needs the extra 'mcp': pip install 'motionloom[mcp]'", exc_type=ImportError)


Call = tuple[str, dict[str, Any]]


def talk(project: Path, *calls: Call | Callable[[list[Any]], Call]) -> tuple[list[str], list[Any]]:
    """Names of the tools, and what each call answers; a call may be made of the answers before it.

    A call of a resource has its address for a name.
    """

    async def session() -> tuple[list[str], list[Any]]:
        from mcp.client.stdio import StdioServerParameters

        command = ["-m", "motionloom", "mcp", "--project", str(project), "--threads", "1"]
        inherited = {k: v for k, v in os.environ.items() if k in ("PYTHONPATH", "OMP_NUM_THREADS", "PATH")}
        async with mcp.Client(StdioServerParameters(command=sys.executable, args=command, env=inherited)) as client:
            listed = await client.list_tools()
            answers: list[Any] = []
            for call in calls:
                name, arguments = call(answers) if callable(call) else call
                resource = name.startswith("motionloom://")
                answers.append(await (client.read_resource(name) if resource else client.call_tool(name, arguments)))
            return [tool.name for tool in listed.tools], answers

    with ThreadPoolExecutor(1) as thread:  # a browser's tests may have a loop running in this one
        return thread.submit(asyncio.run, session()).result()


def plain(answer: Any) -> Any:
    """The JSON of an answer."""
    assert not answer.is_error, answer.content
    content = answer.structured_content
    return content["result"] if isinstance(content, dict) and set(content) == {"result"} else content


def test_an_assistant_makes_motion_and_exports_it(tmp_path: Path) -> None:
    def long_one(answers: list[Any]) -> str:
        return plain(answers[1])[0]["id"]

    names, (one, long, export, refused, escaped, wrong, actions, goals) = talk(
        tmp_path,
        ("generate_motion", {"prompt": "a person jumps", "seconds": 1.0, "seed": 3, "count": 2}),
        (
            "compose",
            {
                "timeline": {
                    "segments": [
                        {"text": "a person walks", "seconds": 1},
                        {"text": "a person waves", "seconds": 1, "goal": {"path": {"points": [[0, 0], [0, 0.5]]}}},
                    ]
                }
            },
        ),
        lambda results: ("export", {"motion": long_one(results), "format": "bvh", "name": "walk-and-wave"}),
        ("export", {"motion": "0" * 16}),
        lambda results: ("export", {"motion": long_one(results), "name": "../evil"}),
        ("generate_motion", {"prompt": "a person jumps", "best_of": 99}),
        ("motionloom://actions", {}),
        ("motionloom://schemas/goal", {}),
    )
    text, *_, picture = one.content
    (did,) = json.loads(text.text)["happened"]
    assert did == plain(one)[0]["happened"][0]
    assert set(did) >= {"sentence", "way", "turn", "steps", "counts", "pelvis", "contacts"}
    assert picture.mime_type == "image/png"
    assert base64.b64decode(picture.data).startswith(b"\x89PNG")
    assert not list(tmp_path.rglob("*.png"))
    assert plain(long)[0]["remarks"] == []
    assert json.loads(actions.contents[0].text)["sentences"]
    assert json.loads(goals.contents[0].text)["title"] == "motionloom goal"
    assert set(names) == {"generate_motion", *REQUESTS, "export"} - {"generate"}
    assert [take["seed"] for take in plain(one)] == [3, 4]
    file = Path(plain(export)["file"])
    assert file == (tmp_path / "exports" / "walk-and-wave.bvh").resolve()
    assert load(file).seconds == pytest.approx(2.0)
    assert "'best_of' must be a whole number from 1 to 16; got 99" in wrong.content[0].text
    assert refused.is_error
    assert "there is no motion" in json.dumps(refused.model_dump(mode="json"))
    assert escaped.is_error
    assert not (tmp_path / "evil.bvh").exists()


def test_unknown_arguments_are_refused_with_the_name_that_was_meant(tmp_path: Path) -> None:
    _, (length, misspelt, file, text, inner) = talk(
        tmp_path,
        ("generate_motion", {"prompt": "a person jumps", "duration": 2}),
        ("control", {"prompt": "a person jumps", "gaols": {}}),
        ("export", {"motion": "0" * 16, "nmae": "walk"}),
        ("generate_motion", {"prompt": "a person \u0007 jumps"}),
        ("compose", {"timeline": {"segments": [{"text": "a person walks", "secnds": 1}]}}),
    )
    assert all(one.is_error for one in (length, misspelt, file, text, inner))
    assert "generate_motion has no 'duration' (did you mean 'seconds'?); it has prompt, " in length.content[0].text
    assert "control has no 'gaols' (did you mean 'goals'?)" in misspelt.content[0].text
    assert "export has no 'nmae' (did you mean 'name'?)" in file.content[0].text
    assert "'prompt' holds the control character U+0007" in text.content[0].text
    assert "unknown key 'secnds' (did you mean 'seconds'?)" in inner.content[0].text


def test_the_schemas_of_tools_allow_nothing_else(tmp_path: Path) -> None:
    from motionloom.server.assistant import Assistant, strict
    from motionloom.server.job_request import TASKS
    from motionloom.server.limits import Limits
    from motionloom.server.project import Project
    from motionloom.server.worker import Worker

    tools = Assistant(project := Project(tmp_path, Limits()), Worker(project, Limits()))
    for tool in map(strict, (*map(tools.tool, TASKS), tools.export)):
        objects = [tool.parameters]
        for one in objects:
            objects += [inner for inner in _values(one) if isinstance(inner, dict)]
        described = [one for one in objects if one.get("type") == "object" and "properties" in one]
        assert described
        assert all(one["additionalProperties"] is False for one in described), tool.name


def _values(value: Any) -> list[Any]:
    return [*value.values()] + [one for each in value.values() if isinstance(each, list) for one in each]
