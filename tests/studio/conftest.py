"""A real server and a real browser for the tests of the page; skipped, with the reason, where one is missing."""

from collections.abc import Iterator

import pytest

from tests.studio import started
from tests.studio.studio import Studio


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a server of its own, with an empty project."""
    try:
        started.check()
    except started.Missing as missing:
        pytest.skip(str(missing))
    with started.server(tmp_path_factory.mktemp("project")) as address:
        yield address


@pytest.fixture(scope="session")
def browser(server: str) -> Iterator:
    """One browser for all tests."""
    with started.browser() as opened:
        yield opened


@pytest.fixture
def studio(server: str, browser) -> Iterator[Studio]:
    """A page with a project of one short block that nobody has touched."""
    context = browser.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True, color_scheme="light")
    page = Studio(context.new_page(), server)
    page.open(("a person walks forward", 2.0))
    yield page
    context.close()
