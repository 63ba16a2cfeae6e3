"""What clients send to a running server, read back afterwards: jobs, motions, projects and lists over HTTP, MMCP, MCP
and films. The application is called as a server calls it, without a network, with a prior of random weights.
"""

import asyncio
import contextlib
import io
import json
import os
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from PIL import Image

from motionloom.core.errors import MotionloomError, one_line
from motionloom.core.files.npz_writer import save_npz
from tests.fuzz.reader import reader
from tests.fuzz.readers_of_jobs import CONTROL, EDIT, NAME, REQUEST, TIMELINE, project
from tests.fuzz.readers_of_motions import motion

ASKED = 12
"""Requests of one file that are answered."""

FILM = {"version": 1, "id": "film", "revision": 0, "name": "a film", "segments": [{"text": "walk", "seconds": 2}]}
ASKS: list[tuple[str, str, Any]] = [
    ("POST", "/jobs", REQUEST | {"seconds": 1.0, "count": 1}),
    ("POST", "/jobs", CONTROL | {"seconds": 1.0}),
    ("POST", "/jobs", EDIT | {"steps": 3}),
    ("PUT", "/project", FILM | {"markers": [{"time": 1, "name": "here"}], "kept": 0, "takes": [{"motion": NAME}]}),
    ("POST", "/project/open?id=other", None),
    ("GET", f"/motions/{NAME}/deeds?begin=0&end=0.1", None),
    ("GET", f"/motions/{NAME}.bvh?fps=30&mirror=true", None),
    ("POST", "/timeline.yaml", TIMELINE["timeline"]),
    ("POST", "/sentence.json", "a person walks, then sits"),
]
MMCP: dict[str, Any] = {
    "protocol_version": "1.0",
    "model": "motionloom",
    "segments": [{"type": "text", "prompt": "a person walks", "duration_frames": 12}],
    "constraints": [
        {"type": "root_path", "frames": [0, 11], "positions_xz": [[0, 0], [0, 0.5]]},
        {"type": "effector_target", "joint": "left_wrist", "frames": [5], "positions": [[0.3, 1.2, 0.2]]},
        {"type": "ground_height", "points": [[0, 0, 0], [0, 1, 0.1]]},
    ],
    "options": {"seed": 1, "diffusion_steps": 3, "num_samples": 1, "transition_frames": 4, "loop": False},
}
CALLS: list[tuple[str, dict[str, Any]]] = [
    ("generate_motion", {"prompt": "a person walks", "seconds": 0.6, "seed": 1, "steps": 3, "count": 1}),
    ("compose", {"timeline": {"segments": [{"text": "a person walks", "seconds": 1}]}, "steps": 3}),
    ("control", {"prompt": "a", "seconds": 0.6, "steps": 3, "goals": {"path": {"points": [[0, 0], [0, 1]]}}}),
    ("edit", {"motion": NAME, "loop": True, "blend": 0.1, "steps": 3}),
    ("export", {"motion": NAME, "format": "bvh", "name": "walk", "fps": 30}),
]


@cache
def models() -> Any:
    """The prior, loaded once before any process is forked; one thread, since a fork has no others."""
    from motionloom.core.models.networks import set_threads
    from motionloom.tasks.run import Models
    from tests.recorded import tiny

    set_threads(1)
    return Models(tiny.prior())


@contextlib.contextmanager
def running(folder: Path) -> Iterator[Any]:
    """The worker of a project, whose thread samples as long as the block lasts; it takes little at once."""
    from motionloom.server.limits import Limits
    from motionloom.server.project import Project
    from motionloom.server.refusal import Refusal
    from motionloom.server.worker import Worker

    limits = Limits(seconds=2.0, total_seconds=4.0, count=2, steps=3)
    try:
        found = Project(folder, limits)
    except Refusal as refusal:
        raise MotionloomError(refusal.sentence) from None
    worker = Worker(found, limits)
    worker._load = models
    worker.start()
    try:
        yield worker
    finally:
        worker.stop()
        worker._thread.join()
        if found._owned is not None:
            os.close(found._owned)


def application(worker: Any) -> Any:
    from motionloom.server.app import build
    from motionloom.server.guard import door

    return build(worker.project, worker, door("127.0.0.1", None, hosts=(), origins=(), page=()))


async def ask(app: Any, method: str, address: str, body: bytes) -> tuple[int, bytes]:
    """Status and body of one request; what the application raises is raised here."""
    path, _, query = address.partition("?")
    scope = {
        "type": "http",
        "method": method,
        "path": path,
        "raw_path": path.encode("utf-8", "replace"),
        "root_path": "",
        "scheme": "http",
        "http_version": "1.1",
        "query_string": query.encode("utf-8", "replace"),
        "headers": [(b"host", b"localhost"), (b"content-length", str(len(body)).encode())],
        "client": ("127.0.0.1", 1),
        "server": ("127.0.0.1", 80),
    }
    status, data, sent = 0, bytearray(), asyncio.Event()
    messages = iter([{"type": "http.request", "body": body, "more_body": False}])

    async def receive() -> Any:
        if (message := next(messages, None)) is not None:
            return message
        await sent.wait()
        return {"type": "http.disconnect"}

    async def send(message: Any) -> None:
        nonlocal status
        if message["type"] == "http.response.start":
            status = message["status"]
        data.extend(message.get("body", b""))

    try:
        await app(scope, receive, send)
    finally:
        sent.set()
    return status, bytes(data)


def looked_at(status: int, data: bytes, what: str) -> Any:
    """The JSON of an answer; a fault of the program is an error here, and what is refused is one sentence."""
    assert 200 <= status < 500 or status in (503, 507), f"{what}: {status} {data[:200]!r}"
    value = json.loads(data) if data[:1] in (b"{", b"[", b'"') else None
    if status >= 400:
        assert isinstance(value, dict), f"{what}: {status} {data[:200]!r}"
        error = value["error"]
        error = error["message"] if isinstance(error, dict) else error
        assert error, what
        assert "Traceback" not in error, error
    return value


def longer_project(folder: Path) -> None:
    """The project of other readers, with a motion that is long enough to be edited."""
    project(folder)
    save_npz(motion(12), folder / "motions" / f"{NAME}.npz")


def asks(folder: Path) -> None:
    longer_project(folder)
    lines = [{"method": method, "path": path, "body": body} for method, path, body in ASKS]
    (folder / "asks.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))


def read_asks(folder: Path) -> None:
    """Every request, and then all that can be read of what they made."""
    with running(folder) as worker:
        app = application(worker)

        async def talk() -> None:
            for line in (folder / "asks.jsonl").read_bytes().split(b"\n")[:ASKED]:
                method, path, body = _asked(line)
                looked_at(*await ask(app, method, path, body), f"{method} {path[:60]}")
            for job in list(worker._jobs.values()):
                await job.ended()
                assert job.status != 500, job.error
                about = looked_at(*await ask(app, "GET", f"/jobs/{job.id}", b""), "a job")
                for result in about["results"]:
                    assert looked_at(*await ask(app, "GET", f"/motions/{result['id']}", b""), "a motion")["people"]
                await ask(app, "GET", f"/jobs/{job.id}/events", b"")
            for path in ("/projects", "/project", "/project/stamp", f"/motions/{NAME}", "/capabilities", "/health"):
                looked_at(*await ask(app, "GET", path, b""), path)

        asyncio.run(talk())


def _asked(line: bytes) -> tuple[str, str, bytes]:
    """A request as the line of a file has it; a damaged line is a body that is no JSON."""
    try:
        value = json.loads(line)
        method, path, body = value["method"], value["path"], value["body"]
    except (ValueError, TypeError, KeyError, RecursionError):
        return "POST", "/jobs", line
    if not isinstance(method, str) or method not in ("GET", "POST", "PUT", "DELETE"):
        method = "POST"
    path = path if isinstance(path, str) and path.startswith("/") else "/jobs"
    data = body if isinstance(body, str) else json.dumps(body)
    return method, path, data.encode("utf-8", "surrogatepass")


def mmcp(folder: Path) -> None:
    from motionloom.server.mmcp.rigs import canonical

    longer_project(folder)
    (folder / "mmcp.json").write_text(json.dumps(MMCP | {"skeleton": {"joints": canonical()}}))


def read_mmcp(folder: Path) -> None:
    with running(folder) as worker:
        app = application(worker)
        body = _small((folder / "mmcp.json").read_bytes())
        status, data = asyncio.run(ask(app, "POST", "/generate", body))
        value = looked_at(status, data, "MMCP")
        if status >= 400:
            raise MotionloomError(one_line(value["error"]["message"]))
        assert value["asset"]


def _small(body: bytes) -> bytes:
    """The body, whose counts are at most those of a small request: what is long and right takes its time."""
    try:
        value = json.loads(body)
        for name, most in (("diffusion_steps", 3), ("num_samples", 2)):
            number = value["options"].get(name)
            if isinstance(number, int) and number > most:
                value["options"][name] = most
        for segment in value["segments"]:
            if isinstance(segment["duration_frames"], int) and segment["duration_frames"] > 100:
                segment["duration_frames"] = 100
        del value["segments"][4:]
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return body
    return json.dumps(value).encode("utf-8", "surrogatepass")


def calls(folder: Path) -> None:
    longer_project(folder)
    lines = [{"tool": tool, "arguments": arguments} for tool, arguments in CALLS]
    (folder / "calls.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))


def read_calls(folder: Path) -> None:
    """Each line as a call of a tool of MCP; the last that is refused is what is answered."""
    from motionloom.server.assistant import Assistant, strict
    from motionloom.server.job_request import TASKS

    mistakes = import_module("mcp.server.mcpserver.exceptions")
    refused: str | None = None
    with running(folder) as worker:
        tools = Assistant(worker.project, worker)
        known = {one.name: one for one in map(strict, (*map(tools.tool, TASKS), tools.export))}
        for line in (folder / "calls.jsonl").read_bytes().split(b"\n")[:ASKED]:
            try:
                value = json.loads(line)
                tool, arguments = known[value["tool"]], value["arguments"]
            except (ValueError, TypeError, KeyError, RecursionError):
                continue
            if not isinstance(arguments, dict):
                continue  # the SDK refuses it before any tool is called
            try:
                answer = asyncio.run(tool.run(arguments, None, convert_result=True))
                answer.model_dump_json()
            except mistakes.UnexpectedToolError as error:
                raise error.__cause__ or error from None
            except mistakes.ToolError as error:
                refused = one_line(str(error))
    if refused is not None:
        raise MotionloomError(refused)


def film(folder: Path) -> None:
    project(folder)
    picture = Image.new("RGB", (64, 64), "navy")
    for number, kind in enumerate(("PNG", "JPEG", "PNG")):
        data = io.BytesIO()
        picture.save(data, kind)
        (folder / f"{number}").write_bytes(len(data.getvalue()).to_bytes(4, "little") + data.getvalue())
    (folder / "film.json").write_text(json.dumps({"format": "gif", "width": 64, "height": 64, "fps": 10, "count": 3}))


def read_film(folder: Path) -> None:
    """What a client sends to /film: the description, then the pictures; what comes back is a file or one sentence."""
    with running(folder) as worker:
        app = application(worker)
        words = (folder / "film.json").read_bytes().decode("utf-8", "replace").replace('"mp4"', '"gif"')
        pieces: list[dict[str, Any]] = [{"type": "websocket.connect"}, {"type": "websocket.receive", "text": words}]
        pieces += [{"type": "websocket.receive", "bytes": (folder / f"{number}").read_bytes()} for number in range(3)]
        messages = iter([*pieces, {"type": "websocket.disconnect", "code": 1000}])
        answers: list[dict[str, Any]] = []

        async def receive() -> Any:
            return next(messages)

        async def send(message: Any) -> None:
            answers.append(message)

        scope = {"type": "websocket", "path": "/film", "raw_path": b"/film", "root_path": "", "scheme": "ws"}
        scope |= {"query_string": b"", "headers": [(b"host", b"localhost")], "subprotocols": []}
        with contextlib.suppress(StopIteration, RuntimeError):
            asyncio.run(app(scope, receive, send))
        left = [path.name for path in worker.project.temporary.iterdir()]
        assert not left, left
    texts = [json.loads(one["text"]) for one in answers if one.get("text")]
    for one in texts:
        if "error" in one:
            raise MotionloomError(one["error"])


if find_spec("starlette"):
    PROJECT = {"project.json": "json", f"motions/{NAME}.json": "json"}
    reader("server, read back", asks, {"asks.jsonl": "jsonl"} | PROJECT, read_asks, weight=2)
    reader("film", film, {"film.json": "json", "0": "raw", "1": "raw"}, read_film, weight=2)
if find_spec("starlette") and find_spec("motionmcp") and find_spec("fastapi"):
    reader("MMCP", mmcp, {"mmcp.json": "json"}, read_mmcp, weight=2)
if find_spec("mcp"):
    reader("MCP", calls, {"calls.jsonl": "jsonl"}, read_calls, weight=2)
