"""Every schema of the OpenAPI document by its name: programs that make clients call their classes by these.

No object is described inside of another, so that no two classes of a client get one name.
"""

from dataclasses import replace
from typing import Any

from motionloom.requests.export import FORMATS, OnSkeleton
from motionloom.requests.fields import specs
from motionloom.requests.reading import narrowed
from motionloom.requests.schema import Schema, schema
from motionloom.requests.tasks import REQUESTS
from motionloom.requests.timeline import SegmentKeys, TimelineKeys
from motionloom.server.job_request import LEVELS, TASKS, most
from motionloom.server.jobs import FINAL
from motionloom.server.limits import Limits

TEXT: Schema = {"type": "string"}
FLAG: Schema = {"type": "boolean"}
WHOLE: Schema = {"type": "integer"}
ID: Schema = {"type": "string", "pattern": "^[0-9a-f]{16}$"}
FILE: Schema = {"type": "string", "format": "binary"}
ANYTHING: Schema = {}
_NULL: Schema = {"type": "null"}
_FLOATS = TEXT | {"description": "base64 of little-endian float32", "contentEncoding": "base64"}


def ref(name: str) -> Schema:
    """A schema by its name."""
    return {"$ref": f"#/components/schemas/{name}"}


_GOAL = {"anyOf": [ref("Goals"), TEXT]}
"""Goals, or in a timeline the name of a file in the project that holds them."""
KINDS: dict[str, Schema] = {
    "motion": ID,
    "timeline": ref("Timeline"),
    "goals": ref("Goals"),
    "goal": _GOAL,
    "motion file": TEXT,
    "segments": {"type": "array", "items": {"anyOf": [TEXT, ref("Segment")]}, "minItems": 1},
}
"""Fields that are read by their kind."""


def _number(**more: Any) -> Schema:
    return {"type": "number", **more}


def _list(items: Schema, **more: Any) -> Schema:
    return {"type": "array", "items": items, **more}


def _object(properties: dict[str, Schema], *required: str, more: bool = True, about: str = "") -> Schema:
    """An object; ``more``: it may have other keys too."""
    found: Schema = {"type": "object", "properties": properties, "additionalProperties": more}
    if required:
        found["required"] = list(required)
    return found | ({"description": about} if about else {})


def _whole(properties: dict[str, Schema], *, about: str = "") -> Schema:
    """An object that has all of these keys."""
    return _object(properties, *properties, about=about)


def request_of(task: str) -> str:
    """The name of a task's request, such as GenerateRequest."""
    return f"{task.title()}Request"


def components(limits: Limits) -> dict[str, Schema]:
    """Name to schema, of a server with these limits."""
    return _requests(limits) | _timelines() | _jobs() | _stored() | _server()


def _requests(limits: Limits) -> dict[str, Schema]:
    """Of every task, and of the words that fields of them may be, which are named after these fields."""
    found: dict[str, Schema] = {}
    for request in (*REQUESTS.values(), OnSkeleton):
        found |= {name.title(): {"enum": list(spec.words)} for name, spec in specs(request).items() if spec.words}
    for task, request in REQUESTS.items():
        fields = narrowed(request, most(task, limits))
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
    return {"oneOf": [FLAG, every], "default": True, "description": every.pop("description")}


def _timelines() -> dict[str, Schema]:
    """What timelines hold in JSON: no files of adapters."""
    segment = {name: schema(spec, KINDS) for name, spec in specs(SegmentKeys).items() if spec.kind != "adapters"}
    timeline = {name: schema(spec, KINDS) for name, spec in specs(TimelineKeys).items()}
    return {
        "Timeline": _object(timeline, "segments", about="what a timeline's YAML file holds (docs/compose.md)"),
        "Segment": _object(segment, "text"),
        "Goals": {"type": "object", "description": "what a goal file holds (docs/control.md)"},
    }


def _jobs() -> dict[str, Schema]:
    result = _whole(
        {
            "id": ID,
            "number": WHOLE,
            "seed": WHOLE,
            "seconds": _number(),
            "frames": WHOLE,
            "people": WHOLE,
            "measures": ref("Measures"),
            "happened": _list({"anyOf": [ref("Deeds"), _NULL]}, description="of each person"),
            "remarks": _list(TEXT, description="what was missed"),
        }
    )
    job = _whole(
        {
            "id": ID,
            "task": ref("Task"),
            "state": ref("JobState"),
            "progress": _number(minimum=0, maximum=1),
            "error": {"anyOf": [TEXT, _NULL]},
            "status": {"anyOf": [WHOLE, _NULL], "description": "of the error, as an answer would have it"},
            "remarks": _list(TEXT, description="how the words were read, and which of them nobody learned"),
            "notes": _list(ref("Note"), description="the same, each with the words that it is about"),
            "results": _list(ref("Result")),
        }
    )
    note = _object(
        {"text": TEXT, "line": TEXT, "instead": _list(TEXT, description="the nearest sentences that are known")},
        "text",
        "line",
        "instead",
    )
    return {
        "Task": {"enum": list(TASKS)},
        "JobState": {"enum": ["queued", "running", *FINAL]},
        "Measures": {"type": "object", "description": "how far a motion is from its goals, by their names"},
        "Deeds": _deeds(),
        "DeedCounts": {"type": "object", "additionalProperties": WHOLE, "description": "how often what was done"},
        "Contacts": {"type": "object", "additionalProperties": _number(), "description": "shares of the time"},
        "Result": result,
        "Job": job,
        "Note": note,
        "Happened": _object({"happened": _list({"anyOf": [ref("Deeds"), _NULL]})}, "happened"),
        "NewJob": _object({"id": ID}, "id"),
    }


def _deeds() -> Schema:
    """`motionloom.kinematics.deeds.Deeds`, as `public` gives it."""
    numbers = ("seconds", "way", "forward", "left", "up", "turn", "pace", "highest_hand", "highest_foot")
    keys = {"sentence": TEXT, **{name: _number() for name in numbers}}
    keys |= {"steps": _list(WHOLE), "pelvis": _list(_number()), "ends": TEXT}
    keys |= {"counts": ref("DeedCounts"), "contacts": ref("Contacts")}
    return _whole(keys, about="what a person did: metres, degrees (to the left), seconds (docs/files.md)")


def _stored() -> dict[str, Schema]:
    length = {"fps": _number(), "frames": WHOLE, "seconds": _number()}
    person = _object(
        {
            "positions": _FLOATS | {"description": "(frames, 22, 3) metres, base64 of little-endian float32"},
            "rotations": _FLOATS | {"description": "(frames, 22, 4) w, x, y, z, in the parent's frame; the same"},
            "root": _FLOATS | {"description": "(frames, 3) metres; the same"},
        },
        "root",
        "rotations",
    )
    motion = _object(
        {"id": ID, **length, "people": _list(ref("MotionPerson")), "about": ref("About")},
        "id",
        "fps",
        "frames",
        "people",
    )
    sent = _object({"id": ID, **length, "people": WHOLE, "name": TEXT, "skeleton": FLAG}, "id", "name")
    character = _object({"id": ID, "name": TEXT, "joints": ref("JointMap")}, "id", "name", "joints")
    return {
        "Motion": motion,
        "MotionPerson": person,
        "About": {"type": "object", "description": "task, prompt, seed, measures, or the name of what was sent"},
        "MotionFormat": {"enum": list(FORMATS)},
        "SentMotion": sent,
        "SentCharacter": character,
        "JointMap": {"type": "object", "additionalProperties": _list(TEXT), "description": "which joints are which"},
    }


def _server() -> dict[str, Schema]:
    lists = {key: _list(TEXT) for key in ("joints", "tasks", "formats", "skeletons", "adapters")}
    capabilities = _object(
        {
            "fps": _number(),
            **lists,
            "parents": _list(WHOLE),
            "offsets": _list(_list(_number())),
            "groups": ref("Groups"),
            "limits": ref("ServerLimits"),
        },
        "fps",
        "joints",
        "parents",
        "offsets",
        "tasks",
        "limits",
        "formats",
        "skeletons",
    )
    error = _object({"error": TEXT | {"description": "one sentence"}, "where": TEXT}, "error")
    return {
        "Health": _object({"ok": FLAG, "version": TEXT, "warm": FLAG, "error": TEXT}, "ok", "version", "warm"),
        "Capabilities": capabilities,
        "Groups": {"type": "object", "additionalProperties": _list(WHOLE), "description": "joints by name"},
        "ServerLimits": {"type": "object", "additionalProperties": _number()},
        "Saved": _object(
            {"saved": WHOLE | {"description": "bytes"}, "id": {"anyOf": [TEXT, _NULL]}, "revision": WHOLE}, "saved"
        ),
        "MmcpRequest": {"type": "object", "description": "what /mmcp/openapi.json describes"},
        "Gltf": {"type": "object", "description": "a glTF 2.0 document"},
        "Error": error,
    }
