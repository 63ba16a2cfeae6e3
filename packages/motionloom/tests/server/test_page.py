"""The page's files: those that were built, by their own names, and nothing else."""

from pathlib import Path

import pytest

pytest.importorskip("starlette", reason="needs the extra 'studio'")

from starlette.routing import Route

from motionloom.server import page
from motionloom.server.guard import Door, door, is_loopback


def test_the_files_of_a_built_page_are_found_by_their_paths(tmp_path: Path) -> None:
    (tmp_path / "assets").mkdir()
    for name in ("index.html", "assets/index-1a2b.js", "favicon.svg"):
        (tmp_path / name).write_text("x")
    paths = page.files(tmp_path)
    assert set(paths) == {"/", "/index.html", "/assets/index-1a2b.js", "/favicon.svg"}
    assert paths["/"] == tmp_path / "index.html"


def test_without_a_page_one_route_says_so(tmp_path: Path) -> None:
    assert page.files(tmp_path) == {}
    assert "make studio" in page.MISSING
    assert all(isinstance(route, Route) for route in page.routes())


def scope(path: str, **headers: str) -> dict[str, object]:
    listed = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]
    return {"type": "http", "method": "GET", "path": path, "headers": listed, "query_string": b""}


def test_the_pages_files_need_no_token_and_all_else_does() -> None:
    guarded = door("0.0.0.0", "secret-token", hosts=(), origins=(), page=["/", "/assets/x.js"])
    assert guarded.problem(scope("/assets/x.js", host="10.0.0.7:8020")) is None
    assert guarded.problem(scope("/", host="10.0.0.7:8020")) is None
    for path in ("/assets/y.js", "/project", "/motions/0123456789abcdef.bvh", "/docs"):
        problem = guarded.problem(scope(path, host="10.0.0.7:8020"))
        assert problem is not None
        assert problem[0] == 401
    assert guarded.problem(scope("/project", host="10.0.0.7", authorization="Bearer secret-token")) is None


def test_a_page_may_not_be_written_to_without_a_token() -> None:
    guarded = door("0.0.0.0", "secret-token", hosts=(), origins=(), page=["/"])
    assert guarded.problem({**scope("/", host="10.0.0.7"), "method": "POST"}) is not None


def test_a_named_host_and_a_named_origin_are_let_in() -> None:
    guarded = door("127.0.0.1", None, hosts=["Studio.local"], origins=["http://localhost:5173"], page=())
    assert guarded.problem(scope("/jobs", host="studio.local:8020")) is None
    assert guarded.problem(scope("/jobs", host="localhost:8020", origin="http://localhost:5173")) is None
    assert guarded.problem(scope("/jobs", host="localhost:8020", origin="http://localhost:5174")) is not None


@pytest.mark.parametrize(
    ("host", "here"), [("127.0.0.1", True), ("localhost", True), ("::1", True), ("0.0.0.0", False), ("10.1.2.3", False)]
)
def test_the_loopback_is_known(host: str, here: bool) -> None:
    assert is_loopback(host) is here
    assert isinstance(door(host, None, hosts=(), origins=(), page=()), Door)
