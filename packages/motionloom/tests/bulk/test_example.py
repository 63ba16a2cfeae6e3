"""The example of a Ray Data pipeline: what its actors do, and all of it where Ray is installed."""

import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom.bulk.maker import Options

EXAMPLE = Path(__file__).parents[4] / "examples" / "13_batch_ray.py"


@pytest.fixture
def motions(weights: str, monkeypatch: pytest.MonkeyPatch) -> Any:
    """One of its actors, with a tiny prior."""
    about = importlib.util.spec_from_file_location("example", EXAMPLE)
    assert about is not None
    assert about.loader is not None
    example = importlib.util.module_from_spec(about)
    about.loader.exec_module(example)
    monkeypatch.setattr(example, "Options", lambda: Options(weights=weights, steps=2))
    return example.Motions()


def test_an_actor_turns_columns_into_motions_and_leaves_out_what_cannot_be_made(motions: Any) -> None:
    columns = {
        "prompt": np.array(["a person walks", "", "a person sits"]),
        "seconds": np.array([1.0, 1.0, 2.0]),
        "seed": np.array([3, 4, 5]),
    }
    result = motions(columns)
    assert sorted(zip(result["text"], (len(one) for one in result["positions"]))) == [
        ("a person sits", 40),
        ("a person walks", 20),
    ]
    assert result["positions"][0].shape[1:] == (22, 3)
    assert len({len(column) for column in result.values()}) == 1


@pytest.mark.slow
def test_the_pipeline_runs_as_it_stands() -> None:
    pytest.importorskip("ray.data", exc_type=ImportError)
    process = subprocess.run([sys.executable, EXAMPLE], capture_output=True, text=True, timeout=600, check=False)
    assert process.returncode == 0, process.stderr[-2000:]
    lines = process.stdout.splitlines()
    assert len(lines) == 8
    assert all("(40, 22, 3) skate" in line for line in lines)
