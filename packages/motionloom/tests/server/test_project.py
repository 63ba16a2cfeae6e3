"""The project and its timeline, bodies that are too large, doors that are closed, a server that is killed."""

import http.client
import json
import resource
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom import load
from tests.server.serving import Server, running

NO_LIMIT = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
TIMELINE = {
    "segments": [{"text": "a person walks", "seconds": 2.0}, {"text": "a person jumps", "seconds": 1.5}],
    "seed": 3,
}


def test_what_was_saved_is_given_back(server: Server) -> None:
    project = {"timeline": TIMELINE, "name": "ein Gang – été", "takes": [1, 2.5, None, True]}
    assert server.json("PUT", "/project", project)[0] == 200
    assert server.json("GET", "/project") == (200, project)


def segments(name: str, **more: Any) -> dict[str, Any]:
    return {"version": 2, "name": name, "segments": [{"text": "a person walks"}], **more}


@pytest.fixture
def folder(server: Server) -> Iterator[Path]:
    """The server's folder without a project, before the test and behind it."""
    emptied(server.project)
    yield server.project
    emptied(server.project)


def emptied(folder: Path) -> None:
    for old in (*folder.glob("project.*"), *folder.glob("projects/*.json")):
        old.unlink()


def put(server: Server, project: Any, client: str = "", over: dict[str, Any] | None = None) -> tuple[int, Any]:
    query = f"?over={over['id']}.{over['revision']}" if over else ""
    return server.json("PUT", f"/project{query}", project, headers={"X-Client": client} if client else {})


def test_a_save_that_has_not_seen_another_one_is_refused(server: Server, folder: Path) -> None:
    """Two pages load the same state; the second to save is told, and nothing of the first is lost."""
    status, answer = put(server, segments("first", id="film", revision=0), "a")
    assert (status, answer["id"], answer["revision"]) == (200, "film", 1)
    assert put(server, segments("second", id="film", revision=1), "a")[1]["revision"] == 2
    before = (folder / "project.json").read_bytes()
    status, answer = put(server, segments("stale", id="film", revision=1), "b")
    assert (status, answer["id"], answer["revision"]) == (409, "film", 2)
    assert "by somebody else meanwhile" in answer["error"]
    for other in (segments("other", id="film2", revision=2), segments("no id"), {"kept": 1}, [], None):
        assert put(server, b"null" if other is None else other, "b")[0] == 409
    assert (folder / "project.json").read_bytes() == before
    assert server.json("GET", "/project/stamp") == (200, {"id": "film", "revision": 2})
    assert put(server, segments("seen", id="film", revision=2), "b")[1]["revision"] == 3
    assert server.json("GET", "/project")[1]["name"] == "seen"


def test_a_client_whose_answer_was_lost_is_not_taken_for_somebody_else(server: Server, folder: Path) -> None:
    put(server, segments("a", id="film", revision=0), "a")
    assert put(server, segments("b", id="film", revision=1), "b")[1]["revision"] == 2
    assert put(server, segments("b again", id="film", revision=1), "b")[1]["revision"] == 3
    assert put(server, segments("a", id="film", revision=1), "a")[0] == 409
    assert put(server, segments("from before b", id="film", revision=0), "b")[0] == 409
    assert put(server, segments("nobody", id="film", revision=1))[0] == 409


def test_what_is_there_is_replaced_where_the_client_names_it(server: Server, folder: Path) -> None:
    """And what was saved after that is not; another project then stays under another name."""
    put(server, segments("one", id="film", revision=0))
    stamp = server.json("GET", "/project/stamp")[1]
    put(server, segments("two", id="film", revision=1))
    assert put(server, segments("mine", id="film", revision=0), over=stamp)[0] == 409
    stamp = server.json("GET", "/project/stamp")[1]
    assert put(server, segments("mine", id="film", revision=0), over=stamp)[1]["revision"] == 3
    assert not list(folder.glob("project.2*"))
    stamp = server.json("GET", "/project/stamp")[1]
    status, answer = put(server, segments("another film", id="other", revision=5), over=stamp)
    assert (status, answer["id"], answer["revision"]) == (200, "other", 6)
    status, rows = server.json("GET", "/projects")
    assert [(one["id"], one["name"], one.get("open", False)) for one in rows] == [
        ("other", "another film", True),
        ("film", "mine", False),
    ]


def test_projects_of_a_folder_are_listed_and_opened_and_none_is_lost(server: Server, folder: Path) -> None:
    put(server, segments("one", id="film", revision=0))
    stamp = server.json("GET", "/project/stamp")[1]
    take = {"motion": "0123456789abcdef", "seconds": 2}
    block = {"text": "a person walks", "seconds": 2.5}
    put(server, segments("two", id="other", revision=0, segments=[block, block], takes=[take], kept=0), over=stamp)
    assert server.json("POST", "/project/open?id=film") == (200, {"id": "film", "revision": 1})
    assert server.json("GET", "/project")[1]["name"] == "one"
    rows = server.json("GET", "/projects")[1]
    assert [one["id"] for one in rows] == ["film", "other"]
    assert (rows[1]["words"], rows[1]["blocks"], rows[1]["seconds"]) == (["a person walks"] * 2, 2, 5.0)
    assert rows[1]["motion"] == take["motion"]
    assert put(server, segments("late", id="other", revision=1))[0] == 409, "a page that still shows the other one"
    put(server, segments("one more", id="film", revision=1))
    assert server.json("POST", "/project/open?id=other")[0] == 200
    assert server.json("POST", "/project/open?id=film") == (200, {"id": "film", "revision": 2})
    assert server.json("POST", "/project/open?id=nobody")[0] == 404
    assert server.json("POST", "/project/open")[0] == 404


def test_a_state_of_another_project_that_nobody_has_seen_is_kept(server: Server, folder: Path) -> None:
    """A page saves a project over another one, while the folder keeps a later state of the first."""
    put(server, segments("first", id="film", revision=0), "a")
    put(server, segments("later", id="film", revision=1), "b")
    put(server, segments("other", id="other", revision=0), "a", over=server.json("GET", "/project/stamp")[1])
    put(server, segments("mine", id="film", revision=1), "a", over=server.json("GET", "/project/stamp")[1])
    first, *others = [one["name"] for one in server.json("GET", "/projects")[1]]
    assert (first, set(others)) == ("mine", {"later", "other"})


def test_what_lies_damaged_among_the_projects_is_left_out_and_stays(server: Server, folder: Path) -> None:
    (folder / "projects").mkdir(exist_ok=True)
    for number, damage in enumerate((b"", b"{", b"[]", b'{"id": 5}', b'{"id": "film"}')):
        (folder / "projects" / f"{number}.json").write_bytes(damage)
    assert server.json("GET", "/projects") == (200, [])
    assert len(list((folder / "projects").glob("*.json"))) == 5


def test_a_sentence_becomes_a_segment_for_each_action(server: Server) -> None:
    status, timeline = server.json("POST", "/sentence.json", b"a person walks, turns around and waves")
    assert status == 200
    assert [one["text"] for one in timeline["segments"]] == [
        "a person walks",
        "a person turns around",
        "a person waves",
    ]
    assert all(1 < one["seconds"] < 10 for one in timeline["segments"])
    assert server.json("POST", "/sentence.json", b" ")[0] == 400
    assert server.json("POST", "/sentence.json", b"\xff")[0] == 400


def test_a_project_of_before_there_were_ids_gets_one_that_stays(server: Server, folder: Path) -> None:
    (folder / "project.json").write_text(json.dumps(segments("old") | {"version": 1}))
    first = server.json("GET", "/project")[1]
    assert (first["name"], first["revision"], len(first["id"])) == ("old", 0, 16)
    assert server.json("GET", "/project")[1] == first
    assert put(server, first | {"name": "new"}, "a")[1]["revision"] == 1
    assert put(server, first | {"name": "stale"}, "b")[0] == 409


@pytest.mark.parametrize("damage", [b"", b"{", b"\xff\xfe", b'{"id": 1e999}', b"[" * 100_000], ids=range(5))
def test_a_project_that_cannot_be_read_is_told_and_put_aside_never_replaced(
    server: Server, folder: Path, damage: bytes
) -> None:
    (folder / "project.json").write_bytes(damage)
    project = segments("a", id="b")
    for method, path, body in (("GET", "", None), ("GET", "/stamp", None), ("PUT", "", project)):
        status, answer = server.json(method, f"/project{path}", body)
        assert (status, "project.json in the project folder is not JSON" in answer["error"]) == (422, True), path
    assert (folder / "project.json").read_bytes() == damage
    status, answer = server.json("POST", "/project/aside")
    assert status == 200
    assert (folder / answer["kept"]).read_bytes() == damage
    assert server.json("GET", "/project") == (200, None)
    assert server.json("POST", "/project/aside")[0] == 404
    (folder / "project.json").write_bytes(damage)
    assert server.json("POST", "/project/aside")[1]["kept"] != answer["kept"]


@pytest.mark.parametrize("stamp", [{"id": 5}, {"id": "a/b"}, {"id": "a", "revision": -1}, {"id": "a", "revision": 1.5}])
def test_a_stamp_that_cannot_be_is_refused(server: Server, folder: Path, stamp: dict[str, Any]) -> None:
    status, answer = put(server, segments("a", **stamp))
    assert (status, "the project's '" in answer["error"]) == (400, True)
    assert not (folder / "project.json").exists()


JUNK = {
    "empty": b"",
    "cut": b"{",
    "a list": b"[]",
    "a number": b"5",
    "nothing": b"null",
    "less than nobody": b'{"people": -1}',
    "a word": b'{"people": "x"}',
    "endless": b'{"people": 1e999}',
    "many digits": b'{"people": 1' + b"0" * 5000 + b"}",
    "many people": b'{"people": 1' + b"0" * 400 + b"}",
    "deep": b'{"people": 1, "a": ' + b"[" * 5000,
    "no name": b'{"name": 5, "suffix": []}',
    "no file": b'{"name": "a", "suffix": ".glb", "people": 1}',
}


@pytest.mark.parametrize("junk", JUNK)
def test_damaged_json_in_the_folder_is_a_sentence(server: Server, junk: str) -> None:
    name = "0123456789abcdef"
    for place, kinds in (("motions", ("", ".bvh")), ("characters", ("",))):
        (server.project / place / f"{name}.json").write_bytes(JUNK[junk])
        for kind in kinds:
            status, answer = server.json("GET", f"/{place}/{name}{kind}")
            assert (status, name in answer["error"] or "no such character" in answer["error"]) == (404, True)
        assert server.json("POST", "/jobs", {"task": "predict", "motion": name, "seconds": 1})[0] == 404
        (server.project / place / f"{name}.json").unlink()


@pytest.mark.skipif(not hasattr(resource, "prlimit"), reason="limits another process's files as Linux does")
@pytest.mark.parametrize("path", ["/motions?name=a.bvh", "/motions?name=a.npz", "/characters?name=a.bvh", "/project"])
def test_a_full_disk_is_told_and_nothing_stays_half_written(server: Server, folder: Path, walk: str, path: str) -> None:
    """Of a server whose files may have so many bytes and no more: at whichever of them a write ends."""
    put(server, segments("before", id="film"))
    body: Any = segments("after", id="film", revision=1, clips=["x" * 20_000])
    if path != "/project":
        kind = path[-4:]
        body = server.ask("GET", f"/motions/{walk}{kind}")[2]
    before = {place: place.read_bytes() for place in folder.rglob("*") if place.is_file()}
    sentences = []
    for room in (100, 3_000, 10_000, 20_000, 40_000, 1 << 40):
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))
        try:
            status, answer = server.json("PUT" if path == "/project" else "POST", path, body)
        finally:
            resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, NO_LIMIT)
        sentences.append(status)
        if status < 300:
            break
        assert (status, "the disk of the project folder is full" in answer["error"]) == (507, True)
        assert {place: place.read_bytes() for place in folder.rglob("*") if place.is_file()} == before
    assert len(sentences) > 2


@pytest.mark.skipif(not hasattr(resource, "prlimit"), reason="limits another process's files as Linux does")
def test_a_motion_that_finds_no_room_is_told(server: Server) -> None:
    before = sorted(place.name for place in (server.project / "motions").iterdir())
    resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))
    try:
        ended = server.wait(server.submit(task="generate", prompt="a person walks", seconds=1.0, steps=2))
    finally:
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, NO_LIMIT)
    assert (ended["state"], ended["status"]) == ("failed", 507)
    assert "the disk of the project folder is full" in ended["error"]
    assert sorted(place.name for place in (server.project / "motions").iterdir()) == before


@pytest.mark.parametrize("body", [b"", b"{", b'{"a": NaN}', b"\xff", b"[" * 100_000])
def test_what_is_no_json_is_not_saved(server: Server, body: bytes) -> None:
    server.json("PUT", "/project", {"kept": 1})
    status, answer = server.json("PUT", "/project", body)
    assert (status, "not JSON" in answer["error"]) == (400, True)
    assert server.json("GET", "/project") == (200, {"kept": 1})


def test_a_timeline_goes_to_yaml_and_back(server: Server) -> None:
    status, _, text = server.ask("POST", "/timeline.yaml", TIMELINE)
    assert status == 200
    assert server.json("POST", "/timeline.json", text) == (200, TIMELINE)


def test_a_mistake_in_a_timeline_is_reported_with_its_place(server: Server) -> None:
    status, answer = server.json("POST", "/timeline.yaml", {"segments": [{"text": "a", "transition": 9}]})
    assert (status, answer["error"].startswith("the timeline, segments[0].transition: ")) == (400, True)
    status, answer = server.json("POST", "/timeline.json", b"segments: [a\n")
    assert (status, "the timeline" in answer["error"]) == (400, True)
    status, answer = server.json("POST", "/timeline.json", b"segments:\n  - text: a person walks\n    secnds: 3\n")
    assert (status, answer["error"].startswith("the timeline, line 3: unknown key 'secnds'")) == (400, True)
    status, answer = server.json("POST", "/timeline.json", b"segments: [a\0]")
    assert (status, answer["error"]) == (
        400,
        "the timeline holds the control character U+0000, which is no text; leave it out",
    )
    assert not list((server.project / "motions").glob("*.yaml"))
    assert not list((server.project / "motions").glob(".*.yaml"))


@pytest.mark.parametrize(
    ("segment", "path", "where"),
    [
        ({"seconds": "x"}, None, "segments[1].seconds"),
        ({"text": " "}, None, "segments[1].text"),
        (
            {"goal": {"joints": [{"joint": "head", "points": [{"time": 9, "position": [0, 1, 0]}]}]}},
            None,
            "segments[1].goal.joints[0].points[0].time",
        ),
        ({}, {"path": {"points": [[0, 0], [0, 99]], "times": [0, 1]}}, "path.path"),
    ],
)
def test_a_mistake_says_which_keys_are_its_cause(server: Server, segment: dict, path: dict | None, where: str) -> None:
    segments = [{"text": "a person walks", "seconds": 2.0}, {"text": "a person sits", "seconds": 2.0} | segment]
    timeline = {"segments": segments} | ({"path": path} if path else {})
    status, answer = server.json("POST", "/jobs", {"task": "compose", "timeline": timeline})
    assert (status, answer["where"]) == (400, where)


def test_the_command_line_makes_the_same_motion_of_the_yaml(server: Server, tmp_path: Path) -> None:
    (result,) = server.draw(task="compose", timeline=TIMELINE, steps=4)["results"]
    (tmp_path / "t.yaml").write_bytes(server.ask("POST", "/timeline.yaml", TIMELINE)[2])
    (tmp_path / "served.npz").write_bytes(server.ask("GET", f"/motions/{result['id']}.npz")[2])
    command = [sys.executable, "-m", "motionloom", "compose", "t.yaml", "--steps", "4", "--out", "own.npz"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    served, own = load(tmp_path / "served.npz"), load(tmp_path / "own.npz")
    assert np.abs(served.positions() - own.positions()).max() < 1e-6


def test_a_body_of_100_mb_is_refused_before_it_is_sent(server: Server) -> None:
    before = server.memory()
    for path in ("/jobs", "/project", "/motions?name=big.npz", "/characters?name=big.glb", "/timeline.yaml"):
        with socket.create_connection(("127.0.0.1", server.port), timeout=60) as connection:
            method = "PUT" if path == "/project" else "POST"
            head = f"{method} {path} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {100 << 20}\r\n\r\n"
            connection.sendall(head.encode())
            answer = b"".join(iter(lambda: connection.recv(4096), b""))
        assert b" 413 " in answer.split(b"\r\n")[0], path
        assert b"MB" in answer
    assert server.memory() - before < 20 << 20


def test_a_body_that_does_not_say_its_length_is_cut_off_at_the_limit(server: Server) -> None:
    before = server.memory()
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
    piece = b"x" * (1 << 20)
    try:
        connection.request(
            "POST",
            "/jobs",
            body=(piece for _ in range(100)),
            encode_chunked=True,
            headers={"Transfer-Encoding": "chunked"},
        )
        status = connection.getresponse().status
    except (BrokenPipeError, ConnectionResetError):
        status = 413  # it closed the door while we were still talking
    finally:
        connection.close()
    assert status == 413
    assert server.memory() - before < 30 << 20


def test_a_client_that_leaves_in_the_middle_of_a_file_leaves_nothing(server: Server) -> None:
    with socket.create_connection(("127.0.0.1", server.port), timeout=60) as connection:
        connection.sendall(
            b"POST /motions?name=a.bvh HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\nHIERARCHY"
        )
    assert server.json("GET", "/health")[0] == 200
    for _ in range(200):
        if not list((server.project / "temporary").iterdir()):
            return
        server.json("GET", "/health")
    pytest.fail("the part of a file stays")


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "evil.example"}, 403),
        ({"Host": "127.0.0.1.evil.example:80"}, 403),
        ({"Host": ""}, 403),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "http://localhost:1"}, 403),
        ({"Sec-Fetch-Site": "cross-site"}, 403),
        ({"Host": "localhost"}, 200),
        ({"Host": "[::1]:99"}, 200),
    ],
)
def test_other_sites_pages_are_not_answered(server: Server, headers: dict[str, str], status: int) -> None:
    assert server.json("GET", "/capabilities", headers=headers)[0] == status


def test_the_servers_own_page_is_answered(server: Server) -> None:
    own = {"Host": f"localhost:{server.port}", "Origin": f"http://localhost:{server.port}"}
    assert server.json("GET", "/capabilities", headers=own)[0] == 200


def test_the_documents_are_there(server: Server) -> None:
    assert server.json("GET", "/openapi.json")[1]["openapi"].startswith("3.")
    assert b"/jobs/{id}/events" in server.ask("GET", "/docs")[2]


def test_the_front_door_says_what_is_missing_or_shows_the_page(server: Server) -> None:
    status, _, page = server.ask("GET", "/")
    assert status == 200
    assert b"<!doctype html>" in page.lower()


def test_a_server_that_is_killed_comes_back_with_project_and_motions(tmp_path: Path) -> None:
    pytest.importorskip("starlette")
    with running(tmp_path) as first:
        (result,) = first.draw(task="generate", prompt="a person walks", seconds=1.0, steps=2)["results"]
        first.json("PUT", "/project", {"takes": [result["id"]]})
        job = first.submit(task="generate", prompt="a person walks", seconds=10.0, count=8, steps=200)
        next(event for event in first.events(job) if event[1] == "level")
        first.kill()
    with running(tmp_path) as second:
        assert second.json("GET", "/project") == (200, {"takes": [result["id"]]})
        assert second.json("GET", f"/motions/{result['id']}")[0] == 200
        assert second.json("GET", f"/jobs/{job}")[0] == 404
        assert second.draw(task="predict", motion=result["id"], seconds=0.5, count=1)["state"] == "done"
        left = [path.name for path in (tmp_path / "motions").iterdir() if not path.name.startswith(result["id"])]
        assert not [name for name in left if name.startswith(".")]


def test_a_folder_has_one_server(server: Server) -> None:
    command = [sys.executable, "-m", "motionloom", "serve", "--port", "0", "--project", str(server.project)]
    second = subprocess.run(command, capture_output=True, text=True, check=False)
    assert second.returncode == 2
    assert "another server has the project folder" in second.stderr
    assert server.json("GET", "/health")[0] == 200


def test_a_server_for_others_wants_its_token(tmp_path: Path) -> None:
    pytest.importorskip("starlette")
    with running(tmp_path, "--host", "0.0.0.0") as open_one:
        assert open_one.token is not None
        assert len(open_one.token) >= 20
        assert open_one.json("GET", "/health")[0] == 200
        for headers in ({}, {"Authorization": "Bearer wrong"}, {"Authorization": "Basic " + open_one.token}):
            status, answer = open_one.json("GET", "/capabilities", headers=headers)
            assert (status, "token" in answer["error"]) == (401, True)
        assert open_one.json("GET", "/capabilities?token=wrong")[0] == 401
        assert open_one.json("GET", f"/capabilities?token={open_one.token}")[0] == 200
        right = {"Authorization": f"Bearer {open_one.token}"}
        assert open_one.json("POST", "/jobs", {}, headers=right)[0] == 400
        assert open_one.json("POST", "/jobs", {})[0] == 401
