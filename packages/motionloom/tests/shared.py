"""Where the optional test material lies: recorded numbers and real clips, beside the checkout, never inside it."""

import os
from pathlib import Path

import pytest

SHARED = Path(os.environ.get("MOTIONLOOM_SHARED", Path(__file__).resolve().parents[4] / "shared"))


def shared(path: str) -> Path:
    """``SHARED / path``; skips the test with a reason where it is absent."""
    place = SHARED / path
    if not place.exists():
        pytest.skip(
            f"{place} is not there: this test needs the material that lies beside the repository (MOTIONLOOM_SHARED)"
        )
    return place
