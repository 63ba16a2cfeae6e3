"""What tests of batches share: a tiny prior, and a job of a few rows."""

from pathlib import Path

import pytest

from motionloom.weights.prior import save_prior
from tests.nets import tiny


@pytest.fixture(scope="session")
def weights(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The file of a tiny prior with random weights."""
    return str(save_prior(tiny.prior(), tmp_path_factory.mktemp("weights") / "tiny.safetensors"))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in an empty folder of its own, outside of any array of jobs."""
    monkeypatch.chdir(tmp_path)
    for name in ("SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_COUNT", "RAY_ADDRESS"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path
