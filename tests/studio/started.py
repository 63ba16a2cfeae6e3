"""A real server and a real browser, for tests and for the scripts that measure and take pictures."""

import importlib.util
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

FLAGS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""WebGL is drawn in software; `CHROMIUM_FLAGS` says otherwise, such as --use-gl=angle --use-angle=gl."""
PATIENCE = 120.0
"""Seconds until a server that starts is given up."""


class Missing(Exception):
    """Something that cannot be installed by a test is not there; the message says what, and how to get it."""


def check() -> None:
    """Raise `Missing` for the first of browser, driver, server and page that is not there."""
    if importlib.util.find_spec("playwright") is None:
        raise Missing("playwright is not installed (pip install playwright)")
    if chromium() is None:
        raise Missing("no chromium is installed (apt-get install chromium)")
    if importlib.util.find_spec("motionloom.server") is None:
        raise Missing("this installation has no server")
    if importlib.util.find_spec("uvicorn") is None or importlib.util.find_spec("starlette") is None:
        raise Missing("the server's packages are not installed (pip install 'motionloom[studio]')")
    if not (page_folder() / "index.html").is_file():
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


@contextmanager
def server(folder: Path) -> Iterator[str]:
    """The address of a server of its own, with its project in ``folder`` and the prior loaded."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "motionloom", "serve", "--port", str(port), "--project", str(folder)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    address = f"http://127.0.0.1:{port}"
    try:
        _wait(address, process)
        yield address
    finally:
        process.terminate()
        process.wait(30)


@contextmanager
def browser() -> Iterator:
    """A browser without a window."""
    from playwright.sync_api import sync_playwright

    flags = os.environ.get("CHROMIUM_FLAGS", "").split() or list(FLAGS)
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=chromium(), args=flags)
        yield opened
        opened.close()


def _wait(address: str, process: subprocess.Popen) -> None:
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and process.poll() is None:
        try:
            with urllib.request.urlopen(f"{address}/health", timeout=5) as response:
                if b'"warm":true' in response.read().replace(b" ", b""):
                    return
        except OSError:
            pass
        time.sleep(0.3)
    raise RuntimeError(f"the server at {address} did not start")
