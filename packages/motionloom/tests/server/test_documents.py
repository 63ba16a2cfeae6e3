"""The OpenAPI document: it tells of every route, of every key of a job, and of nothing else."""

import re
from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("starlette", reason="needs the extra 'studio'")

from starlette.routing import Route

from motionloom.requests.fields import specs
from motionloom.requests.tasks import REQUESTS
from motionloom.server.app import routes
from motionloom.server.limits import Limits
from motionloom.server.openapi import as_page, document, request_of

UNTOLD = {"/openapi.json", "/docs", "/"}


def test_every_route_is_told_of_and_nothing_else() -> None:
    listed = {(path, method) for path, methods in document(Limits())["paths"].items() for method in methods}
    there = {
        (route.path.replace("{name}", "{id}"), method.lower())
        for route in routes(page=False)
        if isinstance(route, Route) and route.path not in UNTOLD
        for method in (route.methods or ()) - {"HEAD"}
    }
    assert listed == there | {("/motions/{id}.{format}", "get")}


def test_every_task_has_its_keys() -> None:
    schemas = document(Limits())["components"]["schemas"]
    assert set(schemas["JobRequest"]["discriminator"]["mapping"]) == set(REQUESTS)
    for task, request in REQUESTS.items():
        variant = schemas[request_of(task)]
        assert variant["properties"]["task"] == {"const": task}
        assert set(variant["properties"]) == {"task", "levels", *specs(request)}


def test_references_lead_somewhere() -> None:
    api = document(Limits())
    names = re.findall(r"#/components/schemas/(\w+)", str(api))
    assert set(names) == set(api["components"]["schemas"])


def _inside(schema: Any) -> Iterator[dict[str, Any]]:
    """The schemas that stand inside of another one."""
    if isinstance(schema, dict):
        for key, value in schema.items():
            parts = value.values() if key == "properties" else [value]
            for part in parts:
                if isinstance(part, dict):
                    yield part
                yield from _inside(part)
    elif isinstance(schema, list):
        for part in schema:
            if isinstance(part, dict):
                yield part
            yield from _inside(part)


def test_every_object_and_every_choice_has_a_name_of_its_own() -> None:
    """Programs that make clients call classes by these names; what has none gets one that may be another's."""
    api = document(Limits())
    assert all(re.fullmatch(r"[A-Z][A-Za-z]+", name) for name in api["components"]["schemas"])
    for schema in api["components"]["schemas"].values():
        assert not [part for part in _inside(schema) if part.get("type") == "object" or "enum" in part]
    operations = [one for methods in api["paths"].values() for one in methods.values()]
    assert not [part for one in operations for part in _inside(one) if part.get("type") == "object" or "enum" in part]
    names = [one["operationId"] for one in operations]
    assert len(names) == len(set(names))


def test_files_go_as_bytes() -> None:
    operations = {
        one["operationId"]: one for methods in document(Limits())["paths"].values() for one in methods.values()
    }
    for name in ("export_motion", "get_character"):
        assert list(operations[name]["responses"]["200"]["content"]) == ["application/octet-stream"]
    for name in ("upload_motion", "upload_character"):
        assert list(operations[name]["requestBody"]["content"]) == ["application/octet-stream"]


def test_the_page_shows_every_path_and_loads_nothing() -> None:
    api = document(Limits())
    page = as_page(api)
    assert all(path in page for path in api["paths"])
    assert not re.search(r"(src|href)=[\"']?(https?:)?//", page)
