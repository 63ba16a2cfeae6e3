"""A JSON Schema validator for the words that the project's schemas use, and no other."""

import re
from typing import Any

TYPES: dict[str, Any] = {
    "object": dict,
    "array": list,
    "string": str,
    "number": int | float,
    "integer": int,
    "boolean": bool,
    "null": type(None),
}
KNOWN = {
    "$schema",
    "$id",
    "$defs",
    "$ref",
    "title",
    "description",
    "default",
    "type",
    "enum",
    "anyOf",
    "oneOf",
    "not",
    "minimum",
    "maximum",
    "minLength",
    "maxLength",
    "pattern",
    "minItems",
    "maxItems",
    "items",
    "prefixItems",
    "properties",
    "additionalProperties",
    "required",
    "minProperties",
}


def valid(schema: dict[str, Any], value: Any) -> bool:
    """By the jsonschema library where it is installed, else by the little validator."""
    mine = fits(value, schema, schema)
    try:
        import jsonschema
    except ImportError:
        return mine
    jsonschema.Draft202012Validator.check_schema(schema)
    assert mine == jsonschema.Draft202012Validator(schema).is_valid(value)
    return mine


def fits(value: Any, rule: dict, whole: dict) -> bool:
    """Whether ``value`` is what ``rule``, a part of the schema ``whole``, describes."""
    assert set(rule) <= KNOWN
    if "type" in rule:
        right = isinstance(value, TYPES[rule["type"]])
        if not right or (isinstance(value, bool) and rule["type"] != "boolean"):
            return False
    inner = [whole["$defs"][rule["$ref"].removeprefix("#/$defs/")]] if "$ref" in rule else []
    if not all(fits(value, other, whole) for other in inner) or ("enum" in rule and value not in rule["enum"]):
        return False
    for word, right in (("anyOf", range(1, 99)), ("oneOf", (1,)), ("not", (0,))):
        others = rule.get(word, [])
        if others and sum(fits(value, o, whole) for o in (others if word != "not" else [others])) not in right:
            return False
    return _inside(value, rule, whole)


def _inside(value: Any, rule: dict, whole: dict) -> bool:
    if isinstance(value, dict):
        properties = rule.get("properties", {})
        if (rule.get("additionalProperties") is False and set(value) - set(properties)) or (
            set(rule.get("required", ())) - set(value) or len(value) < rule.get("minProperties", 0)
        ):
            return False
        return all(fits(value[key], properties[key], whole) for key in value if key in properties)
    if isinstance(value, list):
        rules = rule.get("prefixItems", [])
        rules = [*rules, *[rule.get("items", {})] * (len(value) - len(rules))][: len(value)]
        right = rule.get("minItems", 0) <= len(value) <= rule.get("maxItems", 10**9)
        return right and all(fits(item, other, whole) for item, other in zip(value, rules, strict=True))
    if isinstance(value, str):
        right = rule.get("minLength", 0) <= len(value) <= rule.get("maxLength", 10**9)
        return right and re.search(rule.get("pattern", ""), value) is not None
    if isinstance(value, int | float) and not isinstance(value, bool):
        return rule.get("minimum", -float("inf")) <= value <= rule.get("maximum", float("inf"))
    return True
