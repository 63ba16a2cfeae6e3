"""JSON Schema (2020-12) of requests."""

from collections.abc import Mapping
from typing import Any

from motionloom.requests.fields import Spec

Schema = dict[str, Any]
TYPES = {"number": "number", "whole": "integer", "flag": "boolean", "text": "string", "word": "string"}


def schema(spec: Spec, others: Mapping[str, Schema]) -> Schema:
    """What a field may hold. others: the schemas of kinds that are read elsewhere, such as goals, by kind."""
    one: Schema = dict(others[spec.kind]) if spec.kind in others else {"type": TYPES[spec.kind]}
    if spec.kind in ("number", "whole"):
        one |= {"exclusiveMinimum" if spec.above else "minimum": spec.low, "maximum": spec.high}
    elif spec.kind == "text":
        one |= {"maxLength": int(spec.high)} | ({"pattern": r"\S"} if spec.hint else {})
    elif spec.kind == "word":
        one |= {"enum": list(spec.words)}
    if spec.size:
        one = {"type": "array", "items": one, "minItems": spec.size, "maxItems": spec.size}
    if spec.many:
        one = {"type": "array", "items": one, "minItems": 0 if spec.default == () else 1, "maxItems": spec.many}
    unit = f", in {spec.unit}" if spec.unit and spec.unit not in spec.help else ""
    one["description"] = f"{spec.help}{unit}"
    if spec.default not in (None, ()) and "$ref" not in one:
        one["default"] = spec.default
    return one
