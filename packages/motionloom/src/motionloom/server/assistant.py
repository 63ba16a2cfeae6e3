"""MCP over standard input and output, so that an assistant generates motion: a tool for each task, and one for files.

The tools take the fields of the requests (`motionloom.requests`).
Needs the extra ``mcp``. Nothing but the protocol may be written to standard output.
"""

import base64
import inspect
import json
import os
import re
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

from motionloom.core.errors import MotionloomError, listed, meant, quoted
from motionloom.core.reading import check_texts
from motionloom.goals.adapters import Applied
from motionloom.requests.export import Export
from motionloom.requests.fields import Spec, specs
from motionloom.requests.reading import narrow_fields, read
from motionloom.requests.schema import Schema, schema
from motionloom.requests.tasks import REQUESTS
from motionloom.requests.timeline import SegmentKeys, TimelineKeys
from motionloom.server.job_request import TASKS, most, read_request
from motionloom.server.limits import Limits
from motionloom.server.project import Project
from motionloom.server.refusal import Refusal
from motionloom.server.worker import Worker

CLIENT = "assistant"
_NAME = re.compile(r"[A-Za-z0-9_-]{1,80}")
WHAT = (
    "Human motion from plain English, on a skeleton of 22 joints at 20 frames per second. Make motion with "
    "generate_motion (one action), compose (several, one after the other) or another task; write files with export. "
    "An answer says what happened in each motion, measured on its joints, and shows it: compare that with what was "
    "wanted, and try again with other words, goals or another seed. motionloom://actions lists what is known."
)


_GOALS: Schema = {
    "type": "object",
    "description": "paths, joints and poses that are kept to, in metres and seconds, +Y up: motionloom://schemas/goal",
    "examples": [
        {"path": {"points": [[0, 0], [1, 2], [0, 4]]}},
        {"joints": [{"joint": "right_wrist", "points": [{"time": 2.0, "position": [-0.3, 1.6, 0.4]}]}]},
    ],
}
_PARTS: Mapping[str, Schema] = {"goal": _GOALS, "adapters": {}, "motion file": {"type": "string"}}
_SEGMENT: Schema = {
    "type": "object",
    "properties": {name: schema(spec, _PARTS) for name, spec in specs(SegmentKeys).items()},
    "required": ["text"],
    "additionalProperties": False,
}
_TIMELINE: Schema = {
    "type": "object",
    "properties": {
        name: schema(
            spec, {**_PARTS, "segments": {"type": "array", "items": {"anyOf": [{"type": "string"}, _SEGMENT]}}}
        )
        for name, spec in specs(TimelineKeys).items()
    },
    "required": ["segments"],
    "additionalProperties": False,
}
KINDS: Mapping[str, Schema] = {"motion": {"type": "string"}, "goals": _GOALS, "timeline": _TIMELINE}
"""Fields that are read by their kind; no schema of a tool refers to another."""


class Assistant:
    """The tools, as plain functions; what goes wrong is raised as one sentence."""

    def __init__(self, project: Project, worker: Worker) -> None:
        self.project, self.worker = project, worker

    def tool(self, task: str) -> Callable[..., Any]:
        """A function that generates motion by a task's request, with its fields as arguments."""

        async def call(**fields: Any) -> Any:
            async def checked() -> Any:
                check_texts(fields, task)
                return await self._results({"task": task} | fields)

            return await _or_refusal(checked())

        known = narrow_fields(REQUESTS[task], most(task, self.worker.limits))
        call.__name__ = "generate_motion" if task == "generate" else task
        call.__doc__ = f"{inspect.getdoc(REQUESTS[task])} Answers what happened in each motion, and shows it."
        call.__signature__ = _signature(known, list[dict[str, Any]])  # type: ignore[attr-defined]
        return call

    @property
    def export(self) -> Callable[..., Any]:
        """What writes a motion to a file, with the fields of `Export` as arguments."""
        import anyio

        async def export(**fields: Any) -> Any:
            return await _or_refusal(anyio.to_thread.run_sync(self._write_file, fields))

        export.__doc__ = f"{inspect.getdoc(Export)} A motion is an id that another tool gave."
        export.__signature__ = _signature(specs(Export), dict[str, Any])  # type: ignore[attr-defined]
        return export

    def _write_file(self, fields: Mapping[str, Any]) -> dict[str, Any]:
        from motionloom.server import files

        options = read(Export, fields, "export")
        stem = options.name or options.motion
        if not isinstance(stem, str) or not _NAME.fullmatch(stem):
            raise MotionloomError(f"a file's name has letters, digits, - and _ only; got {str(stem)[:40]!r}")
        part = files.export(self.project, options)
        place = self.project.folder / "exports" / f"{stem}.{options.format}"
        place.parent.mkdir(exist_ok=True)
        os.replace(part, place)
        return {"file": str(place), "bytes": place.stat().st_size}

    async def actions(self) -> str:
        """What the prior has learned: seconds of recordings for each action, and sentences for them."""
        import anyio

        known = (await anyio.to_thread.run_sync(self.worker.prior)).known
        summary = {} if known is None else {"seconds": dict(known.seconds), "sentences": list(known.sentences)}
        return json.dumps(summary, ensure_ascii=False)

    def goal_schema(self) -> str:
        """The JSON Schema of goals."""
        from motionloom.goals.schemas import SCHEMAS

        return SCHEMAS["goal"]()

    async def _results(self, fields: dict[str, Any]) -> Any:
        """The results of a job, as values, as text, and as a picture."""
        import anyio

        def draw() -> tuple[list[dict[str, Any]], bytes]:
            request = read_request(fields | {"levels": False}, self.project, self.worker.limits)
            job = self.worker.submit(request, CLIENT)
            job.wait()
            if job.state != "done":
                raise MotionloomError(job.error or "the job was cancelled")
            report = job.public()
            results = [one | {"remarks": [*report["remarks"], *one["remarks"]]} for one in report["results"]]
            return results, self._picture(results)

        results, picture = await _or_refusal(anyio.to_thread.run_sync(draw))
        types = import_module("mcp.types")
        texts = [types.TextContent(type="text", text=json.dumps(one, ensure_ascii=False)) for one in results]
        image = types.ImageContent(type="image", data=base64.b64encode(picture).decode(), mime_type="image/png")
        return types.CallToolResult(content=[*texts, image], structured_content={"result": results})

    def _picture(self, results: Sequence[Mapping[str, Any]]) -> bytes:
        """A PNG with a row for every person of the motions."""
        from motionloom.viz.video import draw_sheet

        rows = [(one, motion) for one in results for motion in self.project.motion(one["id"]).people]
        part = self.project.part(".png")
        try:
            draw_sheet([motion for _, motion in rows], part, captions=[one["id"] for one, _ in rows], columns=6)
            return part.read_bytes()
        finally:
            part.unlink(missing_ok=True)


def _signature(known: Mapping[str, Spec], gives: Any) -> inspect.Signature:
    """That of a function which takes these fields by name."""
    from pydantic import WithJsonSchema

    arguments = [
        inspect.Parameter(
            name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if spec.needed else None,
            annotation=Annotated[Any, WithJsonSchema(schema(spec, KINDS))],
        )
        for name, spec in sorted(known.items(), key=lambda one: not one[1].needed)
    ]
    return inspect.Signature(arguments, return_annotation=gives)


def strict(function: Callable[..., Any]) -> Any:
    """The SDK's tool of a function; it refuses arguments that the function does not have, which the SDK leaves out."""
    sdk = import_module("mcp.server.mcpserver.tools")
    mistake = import_module("mcp.server.mcpserver.exceptions").ToolError

    class Strict(sdk.Tool):
        async def run(self, arguments: dict[str, Any], *others: Any, **more: Any) -> Any:
            known = self.parameters["properties"]
            if unknown := [name for name in arguments if name not in known]:
                near = meant(unknown[0], known)
                raise mistake(f"{self.name} has no {quoted(unknown[0])}{near}; it has {listed(tuple(known))}")
            return await super().run(arguments, *others, **more)

    tool = Strict.from_function(function)
    tool.parameters["additionalProperties"] = False
    return tool


async def _or_refusal(call: Any) -> Any:
    """What a call gives; a refusal as the sentence that it is."""
    try:
        return await call
    except (Refusal, MotionloomError) as error:
        raise import_module("mcp.server.mcpserver.exceptions").ToolError(str(error)) from None


def run(folder: Path, *, weights: str = "default", device: str = "cpu", adapters: Sequence[Applied] = ()) -> None:
    """Serve the tools until standard input ends; raises MotionloomError where the extra is not installed."""
    try:
        sdk = import_module("mcp.server.mcpserver")
    except ModuleNotFoundError as error:
        raise MotionloomError(f"MCP needs {error.name}: install it with pip install 'motionloom[mcp]'") from None
    limits = Limits()
    worker = Worker(Project(folder, limits), limits, weights=weights, device=device, adapters=adapters)
    tools = Assistant(worker.project, worker)
    made = [strict(tool) for tool in (*map(tools.tool, TASKS), tools.export)]
    server = sdk.MCPServer("motionloom", instructions=WHAT, version=version("motionloom"), tools=made)
    for name, resource in (("actions", tools.actions), ("schemas/goal", tools.goal_schema)):
        server.resource(f"motionloom://{name}", mime_type="application/json")(resource)
    worker.start()
    try:
        server.run("stdio")
    finally:
        worker.stop()
