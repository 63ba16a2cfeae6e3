"""A real server and a real browser, for tests and for the scripts that measure and take pictures."""

import importlib.util
import json
import os
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

FLAGS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
FLAGS += ("--enable-unsafe-webgpu",)
"""WebGL and WebGPU are drawn in software; `CHROMIUM_FLAGS` says otherwise, such as --use-gl=angle --use-angle=gl."""
PATIENCE = 600.0
"""Seconds until a server that starts is given up."""
TOKEN = "a-token-for-tests"


class Missing(Exception):
    """Something that cannot be installed by a test is not there; the message says what, and how to get it."""


def check(*, page: bool = True) -> None:
    """Raise `Missing` for the first of browser, driver and, unless another ``page`` is looked at, server and page."""
    if importlib.util.find_spec("playwright") is None:
        raise Missing("playwright is not installed (pip install playwright)")
    if chromium() is None:
        raise Missing("no chromium is installed (apt-get install chromium)")
    if not page:
        return
    if importlib.util.find_spec("motionloom.server") is None:
        raise Missing("this installation has no server")
    if importlib.util.find_spec("uvicorn") is None or importlib.util.find_spec("starlette") is None:
        raise Missing("the server's packages are not installed (pip install 'motionloom[studio]')")
    if not (page_folder() / "index.html").is_file() or not (page_folder().parents[1] / "viz/viewer.html").is_file():
        raise Missing("the page is not built (make page)")


def chromium() -> str | None:
    """Debian's browser, or the one that `CHROMIUM` names."""
    return os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")


def page_folder() -> Path:
    """Where the built page lies."""
    package = importlib.util.find_spec("motionloom.server")
    assert package is not None
    assert package.origin is not None
    return Path(package.origin).with_name("page")


class Server:
    """`motionloom serve` with a token, which the page has to send; it can be killed and come back."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.folder = folder
        self.address = f"http://127.0.0.1:{self.port}"
        self.page = f"{self.address}/?token={TOKEN}"
        self.start()

    def start(self) -> None:
        """Start the process and wait until its prior is loaded."""
        options = ["--host", "0.0.0.0", "--token", TOKEN, "--port", str(self.port), "--project", str(self.folder)]
        begin = time.monotonic()
        self.answered: float | None = None
        """Seconds from the command to the first answer."""
        self.warm = 0.0
        """Seconds from the command until the prior is loaded."""
        self.process = subprocess.Popen(
            [sys.executable, "-m", "motionloom", "serve", *options],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end and self.process.poll() is None:
            try:
                found = self.ask("/health")
                self.answered = self.answered or time.monotonic() - begin
                if found["warm"]:
                    self.warm = time.monotonic() - begin
                    return
            except OSError:
                pass
            time.sleep(0.05)
        raise RuntimeError(f"the server at {self.address} did not start")

    def kill(self) -> None:
        """End it as a crash would."""
        self.process.kill()
        self.process.wait()

    def end(self) -> None:
        """End it as its user would."""
        self.process.terminate()
        self.process.wait(60)

    def ask(self, path: str, body: Any = None, *, method: str = "GET") -> Any:
        """The JSON of an answer."""
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.address + path, data, {"Authorization": f"Bearer {TOKEN}"}, method=method)
        with urllib.request.urlopen(request, timeout=120) as response:
            return json.load(response)

    def put(self, project: dict[str, Any]) -> None:
        """Save a project as the next state of the one that is there."""
        there = self.ask("/project/stamp")
        over = "" if there is None else f"?over={there['id']}.{there['revision']}"
        self.ask(f"/project{over}", {**project, **(there or {"id": "test", "revision": 0})}, method="PUT")


@contextmanager
def server(folder: Path) -> Iterator[Server]:
    """A server of its own, with its project in ``folder`` and the prior loaded."""
    running = Server(folder)
    try:
        yield running
    finally:
        running.end()


@contextmanager
def browser() -> Iterator:
    """A browser without a window; the one that this process has open already, since Playwright opens no second."""
    from playwright.sync_api import sync_playwright

    if _OPEN:
        yield _OPEN[0]
        return
    flags = os.environ.get("CHROMIUM_FLAGS", "").split() or list(FLAGS)
    with sync_playwright() as playwright:
        _OPEN.append(playwright.chromium.launch(executable_path=chromium(), args=flags))
        yield _OPEN[0]
        _OPEN.pop().close()


_OPEN: list[Any] = []
