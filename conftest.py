"""What holds for every test."""

import os

import pytest
from hypothesis import is_hypothesis_test, settings

SEARCHED = int(os.environ.get("SEARCH", "0"))
"""Examples that `make search` draws at random for each property; 0: the same few each time, so that a test that passed
once passes for everybody. What a search finds becomes an explicit example of its test."""

# a busy machine is no fault of the code
settings.register_profile("same", deadline=None, derandomize=True, database=None)
settings.register_profile("search", deadline=None, derandomize=False, print_blob=True)
settings.load_profile("search" if SEARCHED else "same")

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
    """Mark what is slow by its place, begin with what takes longest, and leave a search its properties alone."""
    items.sort(key=lambda item: not item.nodeid.startswith(LONGEST))
    for item in items:
        if item.nodeid.startswith(SLOW):
            item.add_marker("slow")
    if SEARCHED:
        items[:] = [item for item in items if isinstance(item, pytest.Function) and is_hypothesis_test(item.obj)]
        for function in {item.function for item in items}:
            few = function._hypothesis_internal_use_settings
            function._hypothesis_internal_use_settings = settings(few, max_examples=SEARCHED, derandomize=False)
