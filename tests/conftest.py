"""What holds for every test."""

from collections.abc import Iterator

import pytest
from hypothesis import settings

settings.register_profile("house", deadline=None)  # a busy machine is no fault of the code
settings.load_profile("house")

SLOW = (
    "tests/kills",
    "tests/studio",
    "tests/bulk/test_batch.py",
    "tests/cli/test_batch.py",
    "tests/live/test_socket.py",
    "tests/server/test_project.py",
    "tests/server/test_assistant.py",
)
"""Folders and files of tests that start other programs, or wait for a clock: all of them are slow."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is slow by its place."""
    for item in items:
        if item.nodeid.startswith(SLOW):
            item.add_marker("slow")


@pytest.fixture(autouse=True, scope="session")
def _no_product_is_timed() -> Iterator[None]:
    """Training that leaves open what it multiplies in takes float32 in every test, on every processor."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("motionloom.train.precision.product_seconds", lambda inner, outer, *, half: 2.0 if half else 1.0)
        yield
