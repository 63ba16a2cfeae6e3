"""Every schema of the OpenAPI document by its name: programs that make clients call their classes by these.

Those of jobs, motions and the server are in ``openapi.yaml``; those of requests are made from their fields. No object
is described inside of another, so that no two classes of a client get one name.
"""

from copy import deepcopy
from dataclasses import replace
from functools import cache
from importlib import resources
from typing import Any

import yaml

from motionloom.requests.export import FORMATS, OnSkeleton
from motionloom.requests.fields import specs
from motionloom.requests.reading import narrow_fields
from motionloom.requests.schema import Schema, schema
from motionloom.requests.tasks import REQUESTS
from motionloom.requests.timeline import SegmentKeys, TimelineKeys
from motionloom.server.job_request import LEVELS, TASKS, most
from motionloom.server.jobs import FINAL
from motionloom.server.limits import Limits


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
    found = yaml.safe_load((resources.files("motionloom.server") / "openapi.yaml").read_text(encoding="utf-8"))
    found.pop("x-error")  # a part that others refer to
    return found


def _object(properties: dict[str, Schema], *required: str, more: bool = True, about: str = "") -> Schema:
    """An object; ``more``: it may have other keys too."""
    found: Schema = {"type": "object", "properties": properties, "additionalProperties": more}
    return found | {"required": list(required)} | ({"description": about} if about else {})


def request_of(task: str) -> str:
    """The name of a task's request, such as GenerateRequest."""
    return f"{task.title()}Request"


def components(limits: Limits) -> dict[str, Schema]:
    """Name to schema, of a server with these limits."""
    found = fixed_document()["components"]["schemas"]
    for name, words in (("Task", TASKS), ("JobState", ("queued", "running", *FINAL)), ("MotionFormat", FORMATS)):
        found[name]["enum"] = list(words)
    return _requests(limits) | _timelines() | found


def _requests(limits: Limits) -> dict[str, Schema]:
    """Of every task, and of the words that fields of them may be, which are named after these fields."""
    found: dict[str, Schema] = {}
    for request in (*REQUESTS.values(), OnSkeleton):
        found |= {name.title(): {"enum": list(spec.words)} for name, spec in specs(request).items() if spec.words}
    for task, request in REQUESTS.items():
        fields = narrow_fields(request, most(task, limits))
        keys = {"task": {"const": task}, "levels": _levels(limits)}
        keys |= {name: ref(name.title()) if spec.words else schema(spec, KINDS) for name, spec in fields.items()}
        needed = [name for name, spec in fields.items() if spec.needed]
        found[request_of(task)] = _object(keys, "task", *needed, more=False)
    mapping = {task: ref(request_of(task))["$ref"] for task in TASKS}
    one = {
        "oneOf": [ref(request_of(task)) for task in TASKS],
        "discriminator": {"propertyName": "task", "mapping": mapping},
    }
    return {"JobRequest": one, **found}


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
