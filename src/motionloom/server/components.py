"""Every schema of the OpenAPI document by its name: programs that make clients call their classes by these.

No object is described inside of another, so that no two classes of a client get one name.
"""

from typing import Any

from motionloom.server.asking import COMMON, KEYS, TASKS
from motionloom.server.jobs import FINAL
from motionloom.server.limits import Limits

Schema = dict[str, Any]

TEXT: Schema = {"type": "string"}
FLAG: Schema = {"type": "boolean"}
WHOLE: Schema = {"type": "integer"}
ID: Schema = {"type": "string", "pattern": "^[0-9a-f]{16}$"}
FILE: Schema = {"type": "string", "format": "binary"}
ANYTHING: Schema = {}
_NULL: Schema = {"type": "null"}
FORMATS = ("bvh", "glb", "npz", "mp4", "png")
"""Files that motions are given as."""
_FLOATS = TEXT | {"description": "base64 of little-endian float32", "contentEncoding": "base64"}


def ref(name: str) -> Schema:
    """A schema by its name."""
    return {"$ref": f"#/components/schemas/{name}"}


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


def request_of(task: str) -> str:
    """The name of a task's request, such as GenerateRequest."""
    return f"{task.title()}Request"


def components(limits: Limits) -> dict[str, Schema]:
    """Name to schema, of a server with these limits."""
    return _requests(limits) | _timelines() | _jobs() | _stored() | _server()


def _requests(limits: Limits) -> dict[str, Schema]:
    known = _properties(limits)
    tasks = {
        request_of(task): _object(
            {key: {"const": task} if key == "task" else known[key] for key in (*COMMON, *keys)}, "task", more=False
        )
        for task, keys in KEYS.items()
    }
    mapping = {task: ref(request_of(task))["$ref"] for task in TASKS}
    one = {
        "oneOf": [ref(request_of(task)) for task in TASKS],
        "discriminator": {"propertyName": "task", "mapping": mapping},
    }
    return {"JobRequest": one, **tasks}


def _properties(limits: Limits) -> dict[str, Schema]:
    """Every key that a job may have."""
    whole = WHOLE | {"minimum": 0}
    every = WHOLE | {"minimum": 1, "maximum": limits.steps}
    return {
        "seed": whole | {"default": 0, "description": "motion i is drawn from seed + i (predict, duet: from both)"},
        "count": WHOLE | {"minimum": 1, "maximum": limits.count, "default": 1},
        "steps": every | {"description": "network calls a motion"},
        "guidance": _number(minimum=-100, maximum=100, description="strength of the text"),
        "levels": {
            "oneOf": [FLAG, every],
            "default": True,
            "description": "send the poses as events after every network call, or after every so many",
        },
        "prompt": TEXT | {"maxLength": limits.prompt, "description": "what the person does; two people: 'A :: B'"},
        "seconds": _number(exclusiveMinimum=0, description="length; of predict and switch what is drawn"),
        "as_one": FLAG | {"description": "do not part 'A, then B' into actions that follow each other"},
        "literal": FLAG | {"description": "leave numbers in the words to the network: '3 meters', 'jumps twice'"},
        "timeline": ref("Timeline"),
        "goals": ref("Goals"),
        "motion": ID,
        "to": ID | {"description": "the motion that is switched to"},
        "person": whole | {"maximum": limits.people - 1, "description": "who is edited, or has the goals"},
        "redraw": _list(_list(_number(), minItems=2, maxItems=2), description="stretches, in seconds, drawn anew"),
        "keep": _list(TEXT, description="joints and groups that stay"),
        "loop": FLAG,
        "blend": _number(),
        "extend": _number(),
        "strength": _number(exclusiveMinimum=0, maximum=1),
        "start": _number(description="use the motion from this second on"),
        "end": _number(),
        "temperature": _number(minimum=0, maximum=2),
        "facing": ref("Facing"),
        "past": ID | {"description": "a motion of two people that both go on from"},
        "react_to": ID | {"description": "a motion of the first person, whom the second answers"},
        "together": _number(minimum=0, maximum=1),
    }


def _timelines() -> dict[str, Schema]:
    goal = {"anyOf": [ref("Goals"), TEXT], "description": "goals, or the name of a file in the project that holds them"}
    segment = _object(
        {
            "text": TEXT | {"description": "what the person does"},
            "seconds": _number(minimum=0.2, maximum=60),
            "guidance": _number(minimum=-100, maximum=100),
            "transition": _number(minimum=0.05, maximum=30, description="seconds shared with the next segment"),
            "goal": goal,
            "goals": _list(goal),
        },
        "text",
    )
    timeline = _object(
        {
            "segments": _list({"anyOf": [TEXT, ref("Segment")]}, minItems=1),
            "seed": WHOLE | {"minimum": 0},
            "guidance": _number(minimum=-100, maximum=100),
            "transition": _number(minimum=0.05, maximum=30),
            "start": TEXT | {"description": "a motion of the project that is gone on from, such as ID.npz"},
            "path": goal,
        },
        "segments",
        about="what a timeline's YAML file holds (docs/compose.md)",
    )
    goals = {"type": "object", "description": "what a goal file holds (docs/control.md)"}
    return {"Timeline": timeline, "Segment": segment, "Goals": goals, "Facing": {"enum": ["turned", "kept"]}}


def _jobs() -> dict[str, Schema]:
    result = _object(
        {
            "id": ID,
            "number": WHOLE,
            "seed": WHOLE,
            "seconds": _number(),
            "frames": WHOLE,
            "people": WHOLE,
            "measures": ref("Measures"),
        },
        "id",
        "number",
        "seed",
        "seconds",
        "frames",
        "people",
        "measures",
    )
    job = _object(
        {
            "id": ID,
            "task": ref("Task"),
            "state": ref("JobState"),
            "progress": _number(minimum=0, maximum=1),
            "error": {"anyOf": [TEXT, _NULL]},
            "results": _list(ref("Result")),
        },
        "id",
        "task",
        "state",
        "progress",
        "error",
        "results",
    )
    return {
        "Task": {"enum": list(TASKS)},
        "JobState": {"enum": ["queued", "running", *FINAL]},
        "Measures": {"type": "object", "description": "how far a motion is from its goals, by their names"},
        "Result": result,
        "Job": job,
        "NewJob": _object({"id": ID}, "id"),
    }


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
    lists = {key: _list(TEXT) for key in ("joints", "tasks", "formats", "skeletons")}
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
