"""Steps that are recorded once and run again give what the plain loop gives."""

from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from torch import Tensor

from motionloom_train import captured
from motionloom_train import loop as loop_module
from tests_train import runs


class Replay:
    """In place of a CUDA graph: what was recorded is run again by Python."""

    recorded = 0

    def __init__(self, work: Callable[[], Tensor], *, beside: "Replay | None") -> None:
        Replay.recorded += 1
        self.replay = work


def test_captured_steps_are_those_of_the_loop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(captured, "Graph", Replay)
    data, plan = runs.write_set(tmp_path / "data"), runs.recipe(steps=12, net={**runs.NET, "dropout": 0.0})
    plain = runs.losses(data, tmp_path / "plain", plan)
    Replay.recorded = 0
    run = loop_module.train
    monkeypatch.setattr(runs, "train", lambda *args, **named: run(*args, **named, capture=True))
    recorded = runs.losses(data, tmp_path / "captured", plan)
    assert Replay.recorded == len(plan.windows)
    assert torch.allclose(torch.tensor(recorded), torch.tensor(plain), rtol=1e-4)


def test_captured_steps_read_what_is_new_in_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing of the step that was recorded stays in those that follow: losses and rate go on changing."""
    monkeypatch.setattr(captured, "Graph", Replay)
    run = loop_module.train
    monkeypatch.setattr(runs, "train", lambda *args, **named: run(*args, **named, capture=True))
    losses = runs.losses(
        runs.write_set(tmp_path / "data"), tmp_path / "run", runs.recipe(steps=12, net={**runs.NET, "dropout": 0.0})
    )
    assert len(set(losses)) == 12
