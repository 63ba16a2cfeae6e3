"""JSON Schemas of goal, mask and timeline files for editors and assistants, from the fields of their readers."""

import json
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from motionloom.core.skeleton import SMPL22
from motionloom.goals.adapters import MOST_ADAPTERS
from motionloom.io.lined_yaml import MAX_ITEMS
from motionloom.requests import goal, mask
from motionloom.requests.fields import Spec, specs
from motionloom.requests.schema import Schema, schema
from motionloom.requests.timeline import SegmentKeys, TimelineKeys

GOAL_JOINTS = (*SMPL22.names, *SMPL22.groups)
MASK_JOINTS = ("root", *SMPL22.groups, *SMPL22.names)
"""What can be held: the root's way through the world, groups and joints of the 22."""
_WORD: Schema = {"type": "string", "pattern": r"\S"}
_NULL: Schema = {"type": "null"}


def goal_schema() -> Schema:
    """Of goal files."""
    metres: Schema = {"type": "number", "minimum": -goal.FARTHEST, "maximum": goal.FARTHEST}
    directions = schema(goal.DIRECTIONS, {})
    free = ([metres] * 3, [_NULL, metres, _NULL], [metres, _NULL, metres])
    place = {"type": "array", "minItems": 3, "maxItems": 3, "anyOf": [{"prefixItems": one} for one in free]}
    kinds: dict[str, Schema] = {
        "file": _WORD,
        "joint": {"$ref": "#/$defs/joint"},
        "place": {"$ref": "#/$defs/place"},
        "place or null": {"anyOf": [{"$ref": "#/$defs/place"}, _NULL]},
        "facing": {"$ref": "#/$defs/facing"},
        "point": {"$ref": "#/$defs/point"},
    }
    follow = _object(goal.FOLLOW, kinds)
    either = {"oneOf": [{"required": ["points"]}, {"required": ["every_frame"]}]}
    kinds |= {
        "start": _object(goal.START, kinds) | {"minProperties": 1},
        "path": {"oneOf": [_object(keys, kinds) for keys in goal.PATHS.values()]},
        "joint goal": _object(goal.JOINT, kinds) | either,
        "pose": _object(goal.POSE, kinds),
        "follow": {
            "anyOf": [follow, {"type": "array", "minItems": 1, "maxItems": goal.MOST_FOLLOWED, "items": follow}]
        },
    }
    about = (
        "What a motion keeps to. Metres, +Y up; seconds; degrees about +Y, 0 faces +Z and 90 faces +X, which is the "
        "left of somebody who faces +Z. Read by motionloom control. Times lie within the motion and rise, and goals "
        "are within a person's reach."
    )
    result: Any = _file("goal", about, goal.GOAL, kinds) | {"minProperties": 1}
    result["properties"]["$schema"] = {"type": "string", "description": "for editors"}
    facing = [{"enum": ["along", "free"]}, directions["items"], directions]
    defs = {"joint": {"enum": list(GOAL_JOINTS)}, "place": place, "facing": {"anyOf": facing}}
    return result | {"$defs": defs | {"point": _object(goal.POINT, kinds)}}


def mask_schema() -> Schema:
    """Of mask files."""
    part = _object(mask.PART, {"joint": {"enum": list(MASK_JOINTS)}})
    part["not"] = {"anyOf": [{"required": ["frames", other]} for other in ("from", "to")]}
    about = (
        "Which parts of a predicted person move as in another motion, and when. Times count from the end of the past: "
        "0 is the first predicted moment. Read by motionloom predict. Stretches end after they begin, and not all "
        "joints are held all of the time."
    )
    return _file("mask", about, mask.MASK, {"part": part})


def timeline_schema() -> Schema:
    """Of timeline files; what goals hold is in their own schema."""
    adapters = {"type": "array", "minItems": 1, "maxItems": MOST_ADAPTERS, "items": _WORD}
    kinds: dict[str, Schema] = {
        "segments": {"type": "array", "minItems": 1, "maxItems": MAX_ITEMS, "items": {"$ref": "#/$defs/segment"}},
        "goal": {"anyOf": [{"type": "object"}, _WORD]},
        "motion file": _WORD,
        "adapters": {"anyOf": [_WORD, adapters]},
    }
    segment = _object(specs(SegmentKeys), kinds) | {"not": {"required": ["goal", "goals"]}}
    about = "What a person does, one segment after the other. Read by motionloom compose."
    result = _file("timeline", about, specs(TimelineKeys), kinds)
    return result | {"$defs": {"segment": {"anyOf": [segment["properties"]["text"], segment]}}}


def _object(keys: Mapping[str, Spec], kinds: Mapping[str, Schema]) -> Schema:
    """A mapping of these keys and no others."""
    needed = [name for name, spec in keys.items() if spec.needed]
    result: dict[str, Any] = {"type": "object", "additionalProperties": False}
    result |= {"required": needed} if needed else {}
    return result | {"properties": {name: schema(spec, kinds) for name, spec in keys.items()}}


def _file(name: str, about: str, keys: Mapping[str, Spec], kinds: Mapping[str, Schema]) -> Schema:
    head = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:motionloom:{name}:1",
        "title": f"motionloom {name}",
        "description": about,
    }
    return head | _object(keys, kinds)


def _printed(of: Callable[[], Schema]) -> str:
    return json.dumps(of(), indent=2) + "\n"


SCHEMAS: Mapping[str, Callable[[], str]] = {
    "goal": partial(_printed, goal_schema),
    "mask": partial(_printed, mask_schema),
    "timeline": partial(_printed, timeline_schema),
}
"""As text, by kind of file."""
