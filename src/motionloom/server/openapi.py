"""What the server answers, as an OpenAPI document and as a plain page made from it; both work without a network.

`tests/server/test_documents.py` holds it to the routes that there are.
"""

import html
import json
from importlib.metadata import version
from typing import Any

from motionloom.server.asking import COMMON, KEYS, TASKS
from motionloom.server.limits import Limits

_TEXT, _FLAG = {"type": "string"}, {"type": "boolean"}
_ID = {"type": "string", "pattern": "^[0-9a-f]{16}$"}


def _number(**more: Any) -> dict[str, Any]:
    return {"type": "number", **more}


def _list(items: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"type": "array", "items": items, **more}


def _properties(limits: Limits) -> dict[str, dict[str, Any]]:
    """Every key that a job may have."""
    whole = {"type": "integer", "minimum": 0}
    return {
        "task": {"enum": list(TASKS)},
        "seed": whole | {"default": 0, "description": "motion i is drawn from seed + i (predict, duet: from both)"},
        "count": {"type": "integer", "minimum": 1, "maximum": limits.count, "default": 1},
        "steps": {"type": "integer", "minimum": 1, "maximum": limits.steps, "description": "network calls a motion"},
        "guidance": _number(minimum=-100, maximum=100, description="strength of the text"),
        "levels": {
            "oneOf": [_FLAG, {"type": "integer", "minimum": 1, "maximum": limits.steps}], "default": True,
            "description": "send the poses as events after every network call, or after every so many",
        },
        "prompt": _TEXT | {"maxLength": limits.prompt, "description": "what the person does; two people: 'A :: B'"},
        "seconds": _number(exclusiveMinimum=0, description="length; of predict and switch what is drawn"),
        "as_one": _FLAG | {"description": "do not part 'A, then B' into actions that follow each other"},
        "timeline": {"type": "object", "description": "what a timeline's YAML file holds (docs/compose.md)"},
        "goals": {"type": "object", "description": "what a goal file holds (docs/control.md)"},
        "motion": _ID, "to": _ID | {"description": "the motion that is switched to"},
        "person": whole | {"maximum": limits.people - 1, "description": "who is edited, or has the goals"},
        "redraw": _list(_list(_number(), minItems=2, maxItems=2), description="stretches, in seconds, drawn anew"),
        "keep": _list(_TEXT, description="joints and groups that stay"),
        "loop": _FLAG, "blend": _number(), "extend": _number(),
        "strength": _number(exclusiveMinimum=0, maximum=1),
        "start": _number(description="use the motion from this second on"), "end": _number(),
        "temperature": _number(minimum=0, maximum=2), "facing": {"enum": ["turned", "kept"]},
        "past": _ID | {"description": "a motion of two people that both go on from"},
        "react_to": _ID | {"description": "a motion of the first person, whom the second answers"},
        "together": _number(minimum=0, maximum=1),
    }  # fmt: skip


def _job_schema(limits: Limits) -> dict[str, Any]:
    known = _properties(limits)
    return {
        "oneOf": [
            {
                "title": task, "type": "object", "required": ["task"], "additionalProperties": False,
                "properties": {key: known[key] for key in (*COMMON, *keys)} | {"task": {"const": task}},
            }
            for task, keys in KEYS.items()
        ]
    }  # fmt: skip


_RESULT = {
    "type": "object",
    "properties": {
        "id": _ID, "number": {"type": "integer"}, "seed": {"type": "integer"}, "seconds": _number(),
        "frames": {"type": "integer"}, "people": {"type": "integer"}, "measures": {"type": "object"},
    },
}  # fmt: skip
_JOB = {
    "type": "object",
    "properties": {
        "id": _ID, "task": {"enum": list(TASKS)}, "error": {"type": ["string", "null"]},
        "state": {"enum": ["queued", "running", "done", "failed", "cancelled"]},
        "progress": _number(minimum=0, maximum=1), "results": _list(_RESULT),
    },
}  # fmt: skip
_OBJECT: dict[str, Any] = {"type": "object"}
_FILE = {"type": "string", "format": "binary"}


def _asked(schema: dict[str, Any], kind: str = "application/json") -> dict[str, Any]:
    return {"requestBody": {"required": True, "content": {kind: {"schema": schema}}}}


def _answered(
    text: str, schema: dict[str, Any], *, status: int = 200, kind: str = "application/json"
) -> dict[str, Any]:
    wrong = {
        "description": "one sentence",
        "content": {"application/json": {"schema": {"$ref": "#/components/schemas/error"}}},
    }
    return {"responses": {str(status): {"description": text, "content": {kind: {"schema": schema}}}, "default": wrong}}


def _query(name: str, text: str) -> dict[str, Any]:
    return {"name": name, "in": "query", "description": text, "schema": _TEXT}


def _paths() -> dict[str, Any]:
    """Path to method to operation: (summary, what more)."""
    name, asf = _query("name", "the file's name; only its ending counts"), _query("asf", "id of the ASF of an AMC")
    upload = _asked(_FILE, "application/octet-stream")
    options = [
        _query("skeleton", "smpl22, mixamo, unreal, vrm, rigify or a character's id"),
        _query("person", "0, 1, ..."),
    ]
    after = {"name": "Last-Event-ID", "in": "header", "schema": _TEXT, "description": "go on behind this event"}
    events = _answered("progress, level, then done, failed or cancelled", _TEXT, kind="text/event-stream")
    timeline = _asked({"type": "object"})
    found: dict[str, dict[str, tuple[str, dict[str, Any]]]] = {
        "/health": {"get": ("Whether the server is there, and warm", _answered("ok, version, warm", _OBJECT))},
        "/capabilities": {"get": ("Joints, tasks, limits, formats", _answered("what there is", _OBJECT))},
        "/jobs": {"post": ("Ask for motion", _asked({"$ref": "#/components/schemas/request"})
                           | _answered("the job's id", {"type": "object", "properties": {"id": _ID}}, status=202))},
        "/jobs/{id}": {
            "get": ("How far a job is", _answered("the job", {"$ref": "#/components/schemas/job"})),
            "delete": ("Cancel a job", _answered("the job", {"$ref": "#/components/schemas/job"})),
        },
        "/jobs/{id}/events": {"get": ("What happens to a job, and every pose on the way",
                                      {"parameters": [after, _query("after", "the same")]} | events)},
        "/motions": {"post": ("Send a BVH, AMC, ASF, GLB, VRM or NPZ file",
                              {"parameters": [name, asf]} | upload | _answered("its id", _OBJECT, status=201))},
        "/motions/{id}": {"get": ("Places, rotations and root, as base64 of little-endian float32",
                                  _answered("the motion", _OBJECT))},
        "/motions/{id}.{format}": {"get": ("A motion as bvh, glb, npz, mp4 or png",
                                           {"parameters": options} | _answered("the file", _FILE, kind="*/*"))},
        "/characters": {"post": ("Send a GLB, VRM, glTF or BVH character",
                                 {"parameters": [name]} | upload | _answered("id, joints", _OBJECT, status=201))},
        "/characters/{id}": {"get": ("The character's file", _answered("the file", _FILE, kind="*/*"))},
        "/generate": {"post": ("What an MMCP request asks, with the extra mmcp; /mmcp/docs describes it",
                               _asked(_OBJECT) | _answered("glTF", _OBJECT, kind="model/gltf+json"))},
        "/project": {
            "get": ("The project as it was saved last", _answered("any JSON; null before the first", {})),
            "put": ("Save the project; 409 where its id and revision are not those of what is there",
                    {"parameters": [_query("over", "ID.REVISION of what it may replace all the same")]}
                    | _asked({}) | _answered("saved, id, revision", _OBJECT)),
        },
        "/project/stamp": {"get": ("Id and revision of what was saved last", _answered("null before the first", {}))},
        "/project/aside": {"post": ("Give what was saved another name in the folder", _answered("kept", _OBJECT))},
        "/timeline.yaml": {"post": ("A timeline's JSON to its YAML",
                                    timeline | _answered("YAML", _TEXT, kind="application/yaml"))},
        "/timeline.json": {"post": ("A timeline's YAML to its JSON",
                                    _asked(_TEXT, "application/yaml") | _answered("JSON", _OBJECT))},
    }  # fmt: skip
    return {path: _operations(path, methods) for path, methods in found.items()}


def _operations(path: str, methods: dict[str, tuple[str, dict[str, Any]]]) -> dict[str, Any]:
    named = [word[1:].split("}")[0] for word in path.replace(".", "/").split("/") if word.startswith("{")]
    inside = [{"name": word, "in": "path", "required": True, "schema": _TEXT} for word in named]
    return {
        method: {"summary": text, **more, "parameters": [*inside, *more.get("parameters", ())]}
        for method, (text, more) in methods.items()
    }


def document(limits: Limits) -> dict[str, Any]:
    """The OpenAPI document of a server with these limits."""
    error = {"type": "object", "properties": {"error": _TEXT}}
    return {
        "openapi": "3.1.0",
        "info": {"title": "motionloom", "version": version("motionloom"), "description": "See docs/server.md."},
        "paths": _paths(),
        "components": {"schemas": {"request": _job_schema(limits), "job": _JOB, "error": error}},
    }


def as_page(found: dict[str, Any]) -> str:
    """The document as one page of HTML that needs nothing else."""
    rows = [
        f"<h2><code>{method.upper()} {html.escape(path)}</code></h2><p>{html.escape(about['summary'])}</p>"
        f"<details><summary>in detail</summary><pre>{html.escape(json.dumps(about, indent=1))}</pre></details>"
        for path, methods in found["paths"].items()
        for method, about in methods.items()
    ]
    schemas = html.escape(json.dumps(found["components"]["schemas"], indent=1))
    style = "body{font:16px sans-serif;max-width:50em;margin:2em auto;padding:0 1em}pre{overflow:auto}h2{font-size:1em}"
    return (
        f"<!doctype html><html lang=en><meta charset=utf-8><title>motionloom: the server</title><style>{style}</style>"
        f"<h1>motionloom {html.escape(found['info']['version'])}</h1><p>The same as JSON: "
        f"<a href=openapi.json>openapi.json</a></p>{''.join(rows)}<h2>Schemas</h2><pre>{schemas}</pre></html>"
    )
