"""The OpenAPI document: it tells of every route, of every key of a job, and of nothing else."""

import re

import pytest

pytest.importorskip("starlette", reason="needs the extra 'studio'")

from starlette.routing import Route

from motionloom.server.app import routes
from motionloom.server.asking import KEYS
from motionloom.server.limits import Limits
from motionloom.server.openapi import as_page, document

UNTOLD = {"/openapi.json", "/docs", "/"}


def test_every_route_is_told_of_and_nothing_else() -> None:
    told = {(path, method) for path, methods in document(Limits())["paths"].items() for method in methods}
    there = {
        (route.path.replace("{name}", "{id}"), method.lower())
        for route in routes(page=False)
        if isinstance(route, Route) and route.path not in UNTOLD
        for method in (route.methods or ()) - {"HEAD"}
    }
    assert told == there | {("/motions/{id}.{format}", "get")}


def test_every_task_has_its_keys() -> None:
    variants = document(Limits())["components"]["schemas"]["request"]["oneOf"]
    assert {variant["title"] for variant in variants} == set(KEYS)
    for variant in variants:
        assert set(KEYS[variant["title"]]) <= set(variant["properties"])


def test_references_lead_somewhere() -> None:
    found = document(Limits())
    names = re.findall(r"#/components/schemas/(\w+)", str(found))
    assert set(names) == set(found["components"]["schemas"])


def test_the_page_shows_every_path_and_loads_nothing() -> None:
    found = document(Limits())
    page = as_page(found)
    assert all(path in page for path in found["paths"])
    assert not re.search(r"(src|href)=[\"']?(https?:)?//", page)
