"""A real server and a real browser for the tests of the page; skipped, with the reason, where one of them is missing."""

import importlib.util
import os
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.studio.studio import Studio

FLAGS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
PATIENCE = 120.0
"""Seconds until a server that starts is given up."""


def chromium() -> str:
    """Debian's browser, or the one that `CHROMIUM` names."""
    found = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    if not found:
        pytest.skip("no chromium is installed (apt-get install chromium)")
    return found


def built_page() -> Path:
    """The page's folder inside of the package."""
    package = importlib.util.find_spec("motionloom.server")
    if package is None or package.origin is None:
        pytest.skip("the server is not part of this installation")
    page = Path(package.origin).with_name("page")
    if not (page / "index.html").is_file():
        pytest.skip("the page is not built (make studio-page)")
    return page


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a server of its own, with an empty project."""
    built_page()
    if importlib.util.find_spec("uvicorn") is None or importlib.util.find_spec("starlette") is None:
        pytest.skip("the server's packages are not installed (pip install 'motionloom[studio]')")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    folder = tmp_path_factory.mktemp("project")
    command = [sys.executable, "-m", "motionloom", "serve", "--port", str(port), "--project", str(folder)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    address = f"http://127.0.0.1:{port}"
    try:
        answers(address, process)
        yield address
    finally:
        process.terminate()
        process.wait(30)


def answers(address: str, process: subprocess.Popen) -> None:
    """Return when the server has its prior loaded."""
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


@pytest.fixture(scope="session")
def browser() -> Iterator:
    """One browser for all tests; WebGL is drawn in software."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed (pip install playwright)")
    path = chromium()
    with api.sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=path, args=list(FLAGS))
        yield opened
        opened.close()


@pytest.fixture
def studio(server: str, browser) -> Iterator[Studio]:
    """A page with a project of one short block that nobody has touched."""
    context = browser.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True, color_scheme="light")
    page = Studio(context.new_page(), server)
    page.open(("a person walks forward", 2.0))
    yield page
    context.close()
