"""What the server answers, as an OpenAPI document and as a plain page made from it; both work without a network.

``openapi.yaml`` is the document but for what depends on requests and limits. Every schema has a name, by which programs
that make clients call their classes: no object is described inside of another, so that no two classes get one name.
`tests/server/test_documents.py` holds the document to the routes that there are, `tests/server/test_client.py` makes a
client of it.
"""

import html
import json
from copy import deepcopy
from dataclasses import replace
from functools import cache
from importlib import resources
from importlib.metadata import version
from typing import Any

import yaml

from motionloom.requests.export import FORMATS, Export, OnSkeleton
from motionloom.requests.fields import specs
from motionloom.requests.reading import narrow_fields
from motionloom.requests.schema import Schema, schema
from motionloom.requests.tasks import REQUESTS
from motionloom.requests.timeline import SegmentKeys, TimelineKeys
from motionloom.server.job_request import LEVELS, TASKS, most
from motionloom.server.jobs import FINAL
from motionloom.server.limits import Limits

STYLE = "body{font:16px sans-serif;max-width:50em;margin:2em auto;padding:0 1em}pre{overflow:auto}h2{font-size:1em}"
"""Of the plain page; `policy` lets it in by its hash."""


def ref(name: str) -> Schema:
    """A schema by its name."""
    return {"$ref": f"#/components/schemas/{name}"}


_TEXT: Schema = {"type": "string"}
_ID: Schema = {"type": "string", "pattern": "^[0-9a-f]{16}$"}
KINDS: dict[str, Schema] = {
    "motion": _ID,
    "timeline": ref("Timeline"),
    "goals": ref("Goals"),
    "goal": {"anyOf": [ref("Goals"), _TEXT]},
    "motion file": _TEXT,
    "segments": {"type": "array", "items": {"anyOf": [_TEXT, ref("Segment")]}, "minItems": 1},
}
"""Fields that are read by their kind; a goal in a timeline may be the name of a file in the project."""


def fixed_document() -> dict[str, Any]:
    """What ``openapi.yaml`` has, for the caller to fill in the rest."""
    return deepcopy(_fixed())


@cache
def _fixed() -> dict[str, Any]:
    outline = yaml.safe_load((resources.files("motionloom.server") / "openapi.yaml").read_text(encoding="utf-8"))
    outline.pop("x-error")  # a part that others refer to
    return outline


def _object(properties: dict[str, Schema], *required: str, more: bool = True, about: str = "") -> Schema:
    """An object; ``more``: it may have other keys too."""
    base: Schema = {"type": "object", "properties": properties, "additionalProperties": more}
    return base | {"required": list(required)} | ({"description": about} if about else {})


def request_of(task: str) -> str:
    """The name of a task's request, such as GenerateRequest."""
    return f"{task.title()}Request"


def components(limits: Limits) -> dict[str, Schema]:
    """Name to schema, of a server with these limits."""
    schemas = fixed_document()["components"]["schemas"]
    for name, words in (("Task", TASKS), ("JobState", ("queued", "running", *FINAL)), ("MotionFormat", FORMATS)):
        schemas[name]["enum"] = list(words)
    return _requests(limits) | _timelines() | schemas


def _requests(limits: Limits) -> dict[str, Schema]:
    """Of every task, and of the words that fields of them may be, which are named after these fields."""
    schemas: dict[str, Schema] = {}
    for request in (*REQUESTS.values(), OnSkeleton):
        schemas |= {name.title(): {"enum": list(spec.words)} for name, spec in specs(request).items() if spec.words}
    for task, request in REQUESTS.items():
        fields = narrow_fields(request, most(task, limits))
        keys = {"task": {"const": task}, "levels": _levels(limits)}
        keys |= {name: ref(name.title()) if spec.words else schema(spec, KINDS) for name, spec in fields.items()}
        needed = [name for name, spec in fields.items() if spec.needed]
        schemas[request_of(task)] = _object(keys, "task", *needed, more=False)
    mapping = {task: ref(request_of(task))["$ref"] for task in TASKS}
    one = {
        "oneOf": [ref(request_of(task)) for task in TASKS],
        "discriminator": {"propertyName": "task", "mapping": mapping},
    }
    return {"JobRequest": one, **schemas}


def _levels(limits: Limits) -> Schema:
    every = schema(replace(LEVELS, high=limits.steps), {})
    return {"oneOf": [{"type": "boolean"}, every], "default": True, "description": every.pop("description")}


def _timelines() -> dict[str, Schema]:
    """What timelines hold in JSON: no files of adapters."""
    segment = {name: schema(spec, KINDS) for name, spec in specs(SegmentKeys).items() if spec.kind != "adapters"}
    timeline = {name: schema(spec, KINDS) for name, spec in specs(TimelineKeys).items()}
    return {
        "Timeline": _object(timeline, "segments", about="what a timeline's YAML file holds (docs/compose.md)"),
        "Segment": _object(segment, "text"),
    }


def document(limits: Limits) -> dict[str, Any]:
    """The OpenAPI document of a server with these limits."""
    api = fixed_document()
    api["info"]["version"] = version("motionloom")
    api["components"]["schemas"] = components(limits)
    exported = api["paths"]["/motions/{id}.{format}"]["get"]["parameters"]
    for name, spec in specs(Export).items():
        if name not in ("motion", "format", "name"):
            kind = ref(name.title()) if spec.words else schema(spec, {})
            about = {"name": name, "in": "query", "required": False, "description": spec.help, "schema": kind}
            exported.append(about)
    return api


def as_page(api: dict[str, Any]) -> str:
    """The document as one page of HTML that needs nothing else."""
    rows = [
        f"<h2><code>{method.upper()} {html.escape(path)}</code></h2><p>{html.escape(about['summary'])}</p>"
        f"<details><summary>in detail</summary><pre>{html.escape(json.dumps(about, indent=1))}</pre></details>"
        for path, methods in api["paths"].items()
        for method, about in methods.items()
    ]
    schemas = html.escape(json.dumps(api["components"]["schemas"], indent=1))
    return (
        f"<!doctype html><html lang=en><meta charset=utf-8><title>motionloom: the server</title><style>{STYLE}</style>"
        f"<h1>motionloom {html.escape(api['info']['version'])}</h1><p>The same as JSON: "
        f"<a href=openapi.json>openapi.json</a></p>{''.join(rows)}<h2>Schemas</h2><pre>{schemas}</pre></html>"
    )
