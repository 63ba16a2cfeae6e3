"""One real server for the tests of this folder."""

from collections.abc import Iterator

import pytest

from tests.server.serving import Server, running


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    pytest.importorskip("starlette", reason="needs the extra 'studio': pip install 'motionloom[studio]'")
    pytest.importorskip("uvicorn", reason="needs the extra 'studio': pip install 'motionloom[studio]'")
    with running(tmp_path_factory.mktemp("project")) as instance:
        yield instance


@pytest.fixture(scope="session")
def walk(server: Server) -> str:
    """The id of a short walk."""
    return server.draw(task="generate", prompt="a person walks", seconds=2.0, seed=1, steps=6)["results"][0]["id"]
