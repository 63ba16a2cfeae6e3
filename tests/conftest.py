"""What holds for every test."""

import pytest
from hypothesis import settings

settings.register_profile("house", deadline=None)  # a busy machine is no fault of the code
settings.load_profile("house")

SLOW = (
    "tests/kills",
    "tests/studio",
    "tests/train/kills",
    "tests/bulk/test_batch.py",
    "tests/cli/test_batch.py",
    "tests/live/test_socket.py",
    "tests/outputs/test_processors.py",
    "tests/server/test_project.py",
    "tests/server/test_assistant.py",
)
"""Folders and files of tests that start other programs, or wait for a clock: all of them are slow."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is slow by its place."""
    for item in items:
        if item.nodeid.startswith(SLOW):
            item.add_marker("slow")
