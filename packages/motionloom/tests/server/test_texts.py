"""Half an emoji, control characters and doubled keys at every door of the server, and in what was stored before."""

import json
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest

pytest.importorskip("starlette", reason="needs the extra 'studio': pip install 'motionloom[studio]'")

from starlette.responses import JSONResponse

from motionloom.core.errors import MotionloomError
from motionloom.live.messages import hello
from motionloom.live.messages import read as read_message
from motionloom.server.app import QUERIES
from motionloom.server.films import read as read_film
from motionloom.server.limits import Limits
from motionloom.server.openapi import document
from motionloom.server.project import Project
from motionloom.server.saved import Saved
from tests.server.serving import Server

WRONG = ["a \\ud83d", "\\udc00 walks", "a \\u0007 bell", "\\u001b[31m", "\\u009b"]
"""As JSON writes them."""


def with_text(value: Any, text: str) -> bytes:
    """JSON in which WORDS stands for a text as JSON writes it."""
    return json.dumps(value).replace("WORDS", text).encode()


BODIES: list[tuple[str, str, Any]] = [
    ("POST", "/jobs", {"task": "generate", "prompt": "WORDS"}),
    ("POST", "/jobs", {"task": "compose", "timeline": {"segments": [{"text": "WORDS", "seconds": 2}]}}),
    ("POST", "/jobs", {"task": "duet", "prompt": "a walks :: WORDS"}),
    ("POST", "/jobs", {"task": "control", "prompt": "a", "goals": {"joints": [{"joint": "WORDS"}]}}),
    ("POST", "/jobs", {"task": "generate", "prompt": "a", "WORDS": 1}),
    ("PUT", "/project", {"version": 1, "id": "aaaa", "revision": 0, "name": "film WORDS"}),
    ("PUT", "/project", {"version": 1, "markers": [{"time": 1, "name": "WORDS"}]}),
    ("POST", "/timeline.yaml", {"segments": [{"text": "WORDS", "seconds": 2}]}),
    ("POST", "/generate", {"protocol_version": "1.0", "model": "motionloom", "segments": [{"prompt": "WORDS"}]}),
]


@pytest.mark.parametrize("text", WRONG)
@pytest.mark.parametrize(("method", "path", "body"), BODIES, ids=range(len(BODIES)))
def test_a_body_with_what_is_no_text_is_refused_and_nothing_of_it_is_kept(
    server: Server, method: str, path: str, body: Any, text: str
) -> None:
    status, answer = server.json(method, path, with_text(body, text))
    assert status == 400
    sentence = answer["error"]["message"] if path == "/generate" else answer["error"]
    assert "holds half a character" in sentence or "holds the control character" in sentence
    assert server.json("GET", "/projects") == (200, [])


@pytest.mark.parametrize("body", [b'{"task": "generate", "task": "duet"}', b'{"task": "edit", "seed": ' + b"9" * 5001])
def test_doubled_keys_and_endless_numbers_are_refused_in_a_sentence(server: Server, body: bytes) -> None:
    status, answer = server.json("POST", "/jobs", body)
    assert (status, "stands in it twice" in answer["error"] or "no number that fits" in answer["error"]) == (400, True)


@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("/sentence.json", b"a person walks \x07"),
        ("/timeline.json", b'segments: ["a person \x1b walks"]'),
        ("/timeline.json", b'segments: ["a person \\x07 walks"]'),
        (f"/motions?name={quote('a' + chr(7) + '.bvh')}", b"HIERARCHY"),
        (f"/characters?name=a.bvh&joints={quote(json.dumps({'left_knee': chr(0xD83D)}))}", b"HIERARCHY"),
    ],
)
def test_other_texts_of_requests_are_held_to_the_same(server: Server, path: str, body: bytes) -> None:
    status, answer = server.json("POST", path, body)
    assert status == 400
    # a control character that YAML itself refuses has its own sentence
    assert any(part in answer["error"] for part in ("half a character", "control character", "is not YAML"))


def test_a_session_has_a_name_that_is_text(server: Server) -> None:
    status, answer = server.json("PUT", "/project", {"version": 1}, headers={"X-Client": "a\x9b"})
    assert (status, "X-Client holds the control character" in answer["error"]) == (400, True)


@pytest.mark.parametrize("text", WRONG)
def test_messages_of_sockets_are_held_to_the_same(text: str) -> None:
    for message in ('{"type": "say", "text": "WORDS"}', '{"type": "hello", "session": "WORDS"}'):
        with pytest.raises(MotionloomError, match=r"holds (half a|the control) character"):
            hello(read_message(message.replace("WORDS", text)))
    with pytest.raises(MotionloomError, match=r"holds (half a|the control) character"):
        read_film(f'{{"format": "{text}"}}', 60.0)


@pytest.fixture
def project(tmp_path: Path) -> Project:
    """A folder that an earlier version left."""
    (tmp_path / "motions").mkdir()
    (tmp_path / "project.json").write_bytes(rb'{"version": 1, "id": "aaaa", "revision": 3, "name": "film \ud83d"}')
    return Project(tmp_path, Limits())


def test_what_was_stored_with_half_an_emoji_is_listed_and_read(project: Project) -> None:
    project.shelf.keep(
        "bbbb", b'{"id": "bbbb", "name": "\\ud83d", "segments": [{"text": "\\udc00", "seconds": 1e300}]}'
    )
    saved = Saved(project)
    rows = saved.rows()
    assert [one["name"] for one in rows] == ["film \ufffd", "\ufffd"]
    assert rows[1]["words"] == ["\ufffd"]
    assert json.loads(bytes(JSONResponse(rows).body)) == rows
    data = saved.read()
    assert data is not None
    assert json.loads(data)["name"] == "film \ufffd"
    assert saved.save(data, "page", None).revision == 4  # what a page read it may save again
    assert saved.open("bbbb").id == "bbbb"


def test_what_is_known_of_a_motion_is_read_with_half_an_emoji(project: Project) -> None:
    name = "0123456789abcdef"
    (project.motions / f"{name}.json").write_bytes(b'{"people": 1, "prompt": "a \\ud83d"}')
    about, count = project._about(name)
    assert (json.loads(bytes(JSONResponse(about).body)), count) == ({"prompt": "a \ufffd"}, 1)


def test_an_unknown_query_is_refused_with_the_one_that_is_like_it(server: Server, walk: str) -> None:
    status, answer = server.json("GET", f"/motions/{walk}?lookss=true")
    assert (status, "takes no 'lookss' (did you mean 'looks'?)" in answer["error"]) == (400, True)
    for path in ("/health?x=1", "/jobs/0123456789abcdef/events?afer=1", "/projects?id=a", f"/motions/{walk}.bvh?fp=30"):
        status, answer = server.json("GET", path)
        assert (status, " takes no " in answer["error"]) == (400, True), path
    assert server.ask("GET", f"/motions/{walk}.bvh?fps=30&token=any")[0] == 200


def test_the_document_tells_of_every_query() -> None:
    told: dict[str, set[str]] = {}
    for path, methods in document(Limits())["paths"].items():
        names = {one["name"] for about in methods.values() for one in about["parameters"] if one["in"] == "query"}
        place = "/motions/{name}" if path in ("/motions/{id}", "/motions/{id}.{format}") else path
        told.setdefault(place, set()).update(names)
    assert {path: names for path, names in told.items() if names} == {path: set(keys) for path, keys in QUERIES.items()}
