"""Write what is made of requests: the types of the studio's page."""

from pathlib import Path
from typing import Any

from motionloom.server.job_request import TASKS
from motionloom.server.limits import Limits
from motionloom.server.openapi import components, request_of

PLACE = Path(__file__).parents[1] / "studio" / "src" / "server" / "types.ts"
HEAD = "/** What a job may be asked. Written by tools/write_types.py; do not change it here. */\n"
PLAIN = {"string": "string", "boolean": "boolean", "number": "number", "integer": "number"}


def of(schema: dict[str, Any]) -> str:
    """The type of a schema."""
    if "$ref" in schema:
        return schema["$ref"].rsplit("/", 1)[-1]
    if "const" in schema:
        return f'"{schema["const"]}"'
    if "enum" in schema:
        return " | ".join(f'"{word}"' for word in schema["enum"])
    for kind in ("anyOf", "oneOf"):
        if kind in schema:
            return " | ".join(of(one) for one in schema[kind])
    if schema.get("type") != "array":
        return PLAIN.get(schema.get("type", ""), "unknown")
    if (size := schema.get("minItems", 0)) > 1:
        return f"readonly [{', '.join([of(schema['items'])] * size)}]"
    inner = of(schema["items"])
    return f"readonly ({inner})[]" if " " in inner else f"readonly {inner}[]"


def interface(name: str, schema: dict[str, Any]) -> str:
    """A type by its name."""
    if schema.get("type") != "object":
        text = f"export type {name} = {of(schema)};\n"
        return text if len(text) <= 121 else text.replace(" = ", " =\n  ")
    if "properties" not in schema:
        return f"/** {schema['description']} */\nexport type {name} = {{ readonly [key: string]: unknown }};\n"
    lines = [f"export interface {name} {{"]
    for key, value in schema["properties"].items():
        lines += [f"  /** {value['description']} */"] if "description" in value else []
        lines.append(f"  readonly {key}{'' if key in schema.get('required', ()) else '?'}: {of(value)};")
    lines += [] if schema.get("additionalProperties") is False else ["  readonly [key: string]: unknown;"]
    return "\n".join([*lines, "}\n"])


def types() -> str:
    """The whole file."""
    found = components(Limits())
    names = ["JobRequest", *map(request_of, TASKS), "Timeline", "Segment", "Goals"]
    names += [
        name for name, schema in found.items() if "enum" in schema and name not in ("Task", "MotionFormat", "JobState")
    ]
    return "\n".join([HEAD, *(interface(name, found[name]) for name in names)])


if __name__ == "__main__":
    PLACE.write_text(types(), encoding="utf-8")
    print(PLACE)
