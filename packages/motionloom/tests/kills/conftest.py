"""What the tests of interruptions share."""

import pytest

from motionloom.core.models.prior import save_prior
from tests.recorded import tiny


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A file of small weights."""
    return str(save_prior(tiny.prior(), tmp_path_factory.mktemp("weights") / "tiny.safetensors"))
