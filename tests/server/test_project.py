"""The project and its timeline, bodies that are too large, doors that are closed, a server that is killed."""

import http.client
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from motionloom import load
from tests.server.serving import Server, running

TIMELINE = {
    "segments": [{"text": "a person walks", "seconds": 2.0}, {"text": "a person jumps", "seconds": 1.5}],
    "seed": 3,
}


def test_what_was_saved_is_given_back(server: Server) -> None:
    said = {"timeline": TIMELINE, "name": "ein Gang – été", "takes": [1, 2.5, None, True]}
    assert server.json("PUT", "/project", said)[0] == 200
    assert server.json("GET", "/project") == (200, said)


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


def test_a_mistake_in_a_timeline_is_reported_with_its_line(server: Server) -> None:
    status, answer = server.json("POST", "/timeline.yaml", {"segments": [{"text": "a", "transition": 9}]})
    assert (status, answer["error"].startswith("the timeline, line 3")) == (400, True)
    status, answer = server.json("POST", "/timeline.json", b"segments: [a\n")
    assert (status, "the timeline" in answer["error"]) == (400, True)


@pytest.mark.parametrize(
    ("segment", "path", "where"),
    [
        ({"seconds": "x"}, None, "segments[1].seconds"),
        ({"text": " "}, None, "segments[1].text"),
        ({"goal": {"joints": [{"joint": "head", "points": [{"time": 9, "position": [0, 1, 0]}]}]}}, None,
         "segments[1].goal.joints[0].points[0].time"),
        ({}, {"path": {"points": [[0, 0], [0, 99]], "times": [0, 1]}}, "path.path"),
    ],
)  # fmt: skip
def test_a_mistake_says_which_keys_are_its_cause(server: Server, segment: dict, path: dict | None, where: str) -> None:
    segments = [{"text": "a person walks", "seconds": 2.0}, {"text": "a person sits", "seconds": 2.0} | segment]
    timeline = {"segments": segments} | ({"path": path} if path else {})
    status, answer = server.json("POST", "/jobs", {"task": "compose", "timeline": timeline})
    assert (status, answer["where"]) == (400, where)


def test_the_command_line_makes_the_same_motion_of_the_yaml(server: Server, tmp_path: Path) -> None:
    (made,) = server.draw(task="compose", timeline=TIMELINE, steps=4)["results"]
    (tmp_path / "t.yaml").write_bytes(server.ask("POST", "/timeline.yaml", TIMELINE)[2])
    (tmp_path / "served.npz").write_bytes(server.ask("GET", f"/motions/{made['id']}.npz")[2])
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
        connection.request("POST", "/jobs", body=(piece for _ in range(100)), encode_chunked=True,
                           headers={"Transfer-Encoding": "chunked"})  # fmt: skip
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
        (made,) = first.draw(task="generate", prompt="a person walks", seconds=1.0, steps=2)["results"]
        first.json("PUT", "/project", {"takes": [made["id"]]})
        job = first.submit(task="generate", prompt="a person walks", seconds=10.0, count=8, steps=200)
        next(event for event in first.events(job) if event[1] == "level")
        first.kill()
    with running(tmp_path) as second:
        assert second.json("GET", "/project") == (200, {"takes": [made["id"]]})
        assert second.json("GET", f"/motions/{made['id']}")[0] == 200
        assert second.json("GET", f"/jobs/{job}")[0] == 404
        assert second.draw(task="predict", motion=made["id"], seconds=0.5, count=1)["state"] == "done"
        left = [path.name for path in (tmp_path / "motions").iterdir() if not path.name.startswith(made["id"])]
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
