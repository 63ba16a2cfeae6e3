"""A real server and a real browser for the tests of the page; skipped, with the reason, where one is missing.

One server and one browser serve all tests, one tab those of a file; every test loads the page anew in it.
"""

from collections.abc import Iterator

import pytest

from tests.studio import started
from tests.studio.studio import Studio


@pytest.fixture(scope="session")
def all_there() -> None:
    """Whatever a test of a page needs; skips it, with what is missing."""
    try:
        started.check()
    except started.Missing as missing:
        pytest.skip(str(missing))


@pytest.fixture(scope="session")
def server(all_there: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[started.Server]:
    """A server of its own, with an empty project."""
    with started.server(tmp_path_factory.mktemp("project")) as running:
        yield running


@pytest.fixture(scope="session")
def browser(all_there: None) -> Iterator:
    """One browser for all tests."""
    with started.browser() as opened:
        yield opened


@pytest.fixture(scope="module")
def tab(server: started.Server, browser) -> Iterator[Studio]:
    """One tab for the tests of a file."""
    context = browser.new_context(viewport={"width": 1280, "height": 720}, accept_downloads=True, color_scheme="light")
    yield Studio(context.new_page(), server)
    context.close()


@pytest.fixture
def studio(tab: Studio) -> Studio:
    """The page as it is opened, with a project of one short block that nobody has touched."""
    tab.faults.clear()
    tab.open(("a person walks forward", 2.0))
    return tab


@pytest.fixture(scope="module")
def empty(all_there: None, browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Studio]:
    """A page on a folder in which nothing was ever saved, just opened."""
    context = browser.new_context(viewport={"width": 1280, "height": 800}, accept_downloads=True, color_scheme="light")
    with started.server(tmp_path_factory.mktemp("empty")) as server:
        studio = Studio(context.new_page(), server)
        studio.page.goto(server.page)
        studio.page.wait_for_selector("body[data-ready]")
        yield studio
        context.close()
