"""Headers of every answer, and that a character's file makes the server ask nobody."""

import json
import socket
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

pytest.importorskip("starlette", reason="needs the extra 'studio'")
pytest.importorskip("uvicorn", reason="needs the extra 'studio'")

from tests.io.rigged import Hero
from tests.server.serving import PATIENCE, Server

ANSWERS = [
    ("GET", "/", None, {}, 200),
    ("GET", "/docs", None, {}, 200),
    ("GET", "/health", None, {}, 200),
    ("GET", "/nothing", None, {}, 404),
    ("POST", "/health", b"", {}, 405),
    ("POST", "/jobs", b"{", {}, 400),
    ("POST", "/jobs", b"", {"Content-Length": "99999999"}, 413),
    ("GET", "/health", None, {"Origin": "https://elsewhere.example"}, 403),
    ("POST", "/generate", b"{", {}, 400),
]


def _promises(headers: dict[str, str]) -> bool:
    policy = headers["content-security-policy"]
    return (
        "frame-ancestors 'none'" in policy
        and "default-src 'none'" in policy
        and "unsafe" not in policy.replace("script-src 'self' 'wasm-unsafe-eval'", "")  # decoders of packed meshes
        and headers["x-content-type-options"] == "nosniff"
        and headers["referrer-policy"] == "no-referrer"
    )


@pytest.mark.parametrize(("method", "path", "body", "more", "status"), ANSWERS)
def test_every_answer_says_what_a_page_may_load_and_who_may_frame_it(
    server: Server, method: str, path: str, body: bytes | None, more: dict[str, str], status: int
) -> None:
    code, headers, _ = server.ask(method, path, body, headers=more)
    if path == "/generate":
        assert 400 <= code < 504
    else:
        assert code == status
    assert _promises(headers)


def test_files_and_streams_say_it_too(server: Server, walk: str) -> None:
    assert _promises(server.ask("GET", f"/motions/{walk}.bvh")[1])
    job = server.submit(task="generate", prompt="a person walks", seconds=1.0, steps=1)
    assert _promises(server.ask("GET", f"/jobs/{job}/events")[1])


def test_what_is_no_http_at_all_is_answered_with_the_same_headers(server: Server) -> None:
    with socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE) as one:
        one.sendall(b"\x00\x01 nonsense\r\n\r\n")
        data = b""
        while piece := one.recv(1 << 16):
            data += piece
    head, _, body = data.decode("ascii").partition("\r\n\r\n")
    status, *lines = head.split("\r\n")
    assert (status, body) == ("HTTP/1.1 400 Bad Request", "Invalid HTTP request received.")
    assert _promises({name.lower(): value for name, _, value in (line.partition(": ") for line in lines)})


@pytest.fixture
def listener() -> Iterator[tuple[str, list[str]]]:
    """The address of somebody else's server, and what it was asked for."""
    paths: list[str] = []

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            paths.append(self.path)
            self.send_error(404)

        def log_message(self, *_: object) -> None:
            """Nothing is printed."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}", paths
    server.shutdown()
    server.server_close()


@pytest.mark.parametrize("suffix", [".glb", ".vrm", ".gltf"])
def test_what_a_character_names_elsewhere_is_asked_for_by_no_reader(
    server: Server, walk: str, listener: tuple[str, list[str]], tmp_path: Path, suffix: str
) -> None:
    address, paths = listener
    hero = Hero(seed=5)
    hero.json["images"] = [{"uri": f"{address}/picture.png"}]
    hero.json["textures"] = [{"source": 0}]
    if suffix == ".gltf":
        buffers = [{"byteLength": len(hero.data), "uri": f"{address}/buffer.bin"}]
        body = json.dumps(hero.json | {"buffers": buffers}).encode()
    else:
        body = hero.write(tmp_path / "hero.glb").read_bytes()
    status, answer = server.json("POST", f"/characters?name=hero{suffix}", body)
    if suffix == ".gltf":
        assert (status, "buffer.bin" in answer["error"]) == (400, True)
    else:
        assert status == 201
        for kind in ("glb", "png"):
            assert server.ask("GET", f"/motions/{walk}.{kind}?skeleton={answer['id']}")[0] == 200
    assert paths == []
