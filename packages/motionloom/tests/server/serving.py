"""A real server in a process of its own, and a plain client of it."""

import http.client
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np

PATIENCE = 300.0
"""Seconds after which an answer counts as lost; no test measures time with it."""


@dataclass(eq=False)
class Server:
    """A running `motionloom serve` and what tests ask it."""

    process: subprocess.Popen[str]
    port: int
    token: str | None
    project: Path

    def ask(
        self, method: str, path: str, body: Any = None, *, headers: dict[str, str] | None = None
    ) -> tuple[int, dict[str, str], bytes]:
        """Status, headers and body of one request on a connection of its own."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        try:
            connection.request(method, path, body=data, headers=headers or {})
            answer = connection.getresponse()
            return answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read()
        finally:
            connection.close()

    def json(
        self, method: str, path: str, body: Any = None, *, headers: dict[str, str] | None = None
    ) -> tuple[int, Any]:
        """Status and JSON."""
        status, _, data = self.ask(method, path, body, headers=headers)
        return status, json.loads(data)

    def submit(self, client: str = "test", /, **fields: Any) -> str:
        """The id of a new job."""
        status, answer = self.json("POST", "/jobs", fields, headers={"X-Client": client})
        assert status == 202, answer
        return answer["id"]

    def events(self, job: str, *, after: int = 0) -> Iterator[tuple[int, str, dict[str, Any]]]:
        """(id, event, data) of a job's stream, until it ends."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        try:
            connection.request("GET", f"/jobs/{job}/events", headers={"Last-Event-ID": str(after)} if after else {})
            answer = connection.getresponse()
            assert answer.status == 200, answer.read()
            fields: dict[str, str] = {}
            for raw in answer:
                line = raw.decode().rstrip("\n")
                if line:
                    key, _, value = line.partition(": ")
                    fields[key] = value
                elif "event" in fields:
                    yield int(fields["id"]), fields["event"], json.loads(fields["data"])
                    fields = {}
        finally:
            connection.close()

    def wait(self, job: str) -> dict[str, Any]:
        """The job once it has ended."""
        for _, kind, data in self.events(job):
            if kind in ("done", "failed", "cancelled"):
                return data
        raise AssertionError("the stream ended before the job did")

    def draw(self, **fields: Any) -> dict[str, Any]:
        """A job that is done."""
        job = self.wait(self.submit(**fields))
        assert job["state"] == "done", job
        return job

    def memory(self) -> int:
        """Bytes that the process holds in memory."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return 1024 * int(next(line.split()[1] for line in status.splitlines() if line.startswith("VmRSS")))

    def kill(self) -> None:
        """End it as a crash would."""
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()


LIMITED = """
import json, sys
from functools import partial
from motionloom.cli import main
from motionloom.server import serving
from motionloom.server.limits import Limits
serving.serve = partial(serving.serve, limits=Limits(**json.loads(sys.argv.pop(1))))
main()
"""
"""The command with other limits than the usual ones."""


@contextmanager
def running(project: Path, *options: str, **limits: float) -> Iterator[Server]:
    """A server on a free port, ended behind the block; ``limits``: of `Limits`, where they are not the usual ones."""
    program = ["-c", LIMITED, json.dumps(limits)] if limits else ["-m", "motionloom"]
    command = [sys.executable, *program, "serve", "--port", "0", "--project", str(project), "--threads", "1"]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    process = subprocess.Popen([*command, *options], stderr=subprocess.PIPE, text=True, env=environment)
    try:
        assert process.stderr is not None
        line = process.stderr.readline()
        assert line.startswith("motionloom: http://"), line + process.stderr.read()
        address = urlsplit(line.split()[1])
        token = address.query.removeprefix("token=") or None
        assert address.port is not None
        yield Server(process, address.port, token, project)
    finally:
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def decoded(text: str, *shape: int) -> np.ndarray:
    """An array of float32 that JSON carries as base64."""
    import base64

    return np.frombuffer(base64.b64decode(text), dtype="<f4").reshape(shape)
