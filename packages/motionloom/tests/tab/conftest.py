"""The built page with its weights, a web server, and a browser; skipped, with the reason, where one is missing."""

import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from motionloom.core.models.container import weights_digest
from motionloom.core.models.prior import Prior, find_weights
from tests.studio import started
from tests.tab import made
from tests.tab.tab import Tab


@pytest.fixture(scope="session")
def prior() -> Prior:
    """The weights that ship."""
    return Prior.load()


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        """Say nothing."""


@pytest.fixture(scope="session")
def address(prior: Prior, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Where the page is served, without any headers of its own."""
    try:
        started.check(page=False)
    except started.Missing as missing:
        pytest.skip(str(missing))
    folder: Path = tmp_path_factory.mktemp("tab")
    for config, empty in (("vite.tab.config.ts", True), ("vite.viewer.config.ts", False)):
        words = ("build", "--config", config, "--outDir", str(folder), "--logLevel", "error")
        found = made.node("vite/bin/vite.js", *words, *(["--emptyOutDir"] if empty else []))
        assert found.returncode == 0, found.stdout + found.stderr
    made.EXPORT["export"](prior, weights_digest(find_weights("default")), folder)
    made.EXPORT["copy_notices"](folder)
    made.EXPORT["keep_offline"](folder)
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()


@pytest.fixture(scope="session")
def browser(address: str) -> Iterator:
    """One browser for all tests."""
    with started.browser() as opened:
        yield opened


@pytest.fixture(scope="module")
def context(browser) -> Iterator:
    """What the browser keeps, for the tests of a file: the weights are downloaded once."""
    opened = browser.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True, color_scheme="dark")
    yield opened
    opened.close()


@pytest.fixture
def tab(context, address: str) -> Iterator[Tab]:
    """A fresh tab."""
    page = context.new_page()
    yield Tab(page, address)
    context.set_offline(False)
    page.close()
