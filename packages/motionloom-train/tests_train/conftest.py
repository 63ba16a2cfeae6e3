"""What holds for every test that trains."""

from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True, scope="session")
def _no_product_is_timed() -> Iterator[None]:
    """Training that leaves open what it multiplies in takes float32 in every test, on every processor."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("motionloom_train.precision.product_seconds", lambda inner, outer, *, half: 2.0 if half else 1.0)
        yield
