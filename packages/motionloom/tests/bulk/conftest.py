"""What tests of batches share: a tiny prior, and a job of a few rows."""

from pathlib import Path

import pytest

from motionloom.core.models.prior import Prior, save_prior
from tests.recorded import tiny
from tests.tasks.two_people import block


@pytest.fixture(scope="session")
def weights(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The file of a tiny prior with random weights."""
    return str(save_prior(tiny.prior(), tmp_path_factory.mktemp("weights") / "tiny.safetensors"))


@pytest.fixture(scope="session")
def pair_weights(weights: str, tmp_path_factory: pytest.TempPathFactory) -> str:
    """The file of a block that makes two people of that prior."""
    return str(block(Prior.load(weights)).save(tmp_path_factory.mktemp("pair") / "pair.safetensors", half=False))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in an empty folder of its own, outside of any array of jobs."""
    monkeypatch.chdir(tmp_path)
    for name in ("SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_COUNT", "RAY_ADDRESS"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path
