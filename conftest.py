"""What holds for every test."""

import pytest
from hypothesis import settings

settings.register_profile("house", deadline=None)  # a busy machine is no fault of the code
settings.load_profile("house")

SLOW = (
    "packages/motionloom/tests/kills",
    "packages/motionloom/tests/studio",
    "packages/motionloom-train/tests_train/kills",
    "packages/motionloom/tests/bulk/test_batch.py",
    "packages/motionloom/tests/cli/test_batch.py",
    "packages/motionloom/tests/live/test_socket.py",
    "packages/motionloom/tests/outputs/test_processors.py",
    "packages/motionloom/tests/server/test_project.py",
    "packages/motionloom/tests/server/test_assistant.py",
)
"""Folders and files of tests that start other programs, or wait for a clock: all of them are slow."""

LONGEST = (
    "packages/motionloom-train/tests_train/kills",
    "tests/test_readme.py",
    "packages/motionloom/tests/kills",
    "packages/motionloom/tests/bulk/test_batch.py",
    "packages/motionloom/tests/cli/test_batch.py",
    "packages/motionloom/tests/studio/test_walk.py",
    "packages/motionloom/tests/studio/test_timeline.py",
)
"""Files that take longest come first: a worker takes whole files, and none is to begin one when the others end."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is slow by its place, and begin with what takes longest."""
    items.sort(key=lambda item: not item.nodeid.startswith(LONGEST))
    for item in items:
        if item.nodeid.startswith(SLOW):
            item.add_marker("slow")
