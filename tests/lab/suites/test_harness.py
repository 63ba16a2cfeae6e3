"""Suites take one `Run`; what they took before it answers for one release, with a warning."""

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionloom.lab.metrics.obedience import check
from motionloom.lab.suites import (
    control,
    duet,
    duet_answers,
    duet_long,
    duet_text,
    obey,
    prediction,
    prediction_studies,
    realism,
    text,
    transitions,
)
from motionloom.lab.suites.harness import Run, takes_run
from tests.kinematics.people import FPS, walking


def walk(prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[np.ndarray], float]:
    return [walking(1.2, seconds)] * len(prompts), FPS


def before(module: Any) -> Any:
    """The run of a suite, called with what it took before."""
    return module.run


@takes_run(place=1, weights="predictor")
def typed(name: str, run: Run, *, kinds: str = "all") -> tuple[str, Run, str]:
    return name, run, kinds


suite: Any = typed  # called with keywords that its type no longer has


def test_settings_of_a_run_are_gathered_with_a_warning() -> None:
    with pytest.warns(FutureWarning, match="Run"):
        assert suite("a", data="set", device="cuda") == ("a", Run("predictor", "set", device="cuda"), "all")
    with pytest.warns(FutureWarning):
        assert suite("a", "mine", kinds="few") == ("a", Run("mine"), "few")


def test_a_run_is_taken_as_it_is() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert suite("a", Run("mine"), kinds="few") == ("a", Run("mine"), "few")
        assert suite("a", run=Run("mine")) == ("a", Run("mine"), "all")
        with pytest.raises(TypeError):
            suite("a", Run("mine"), data="set")  # a setting beside a run belongs into it


def test_obedience_and_realism_take_a_function_as_they_did(tmp_path: Path) -> None:
    said: list[str] = []
    with pytest.warns(FutureWarning, match="generate"):
        [found] = before(obey)(walk, [check("walk forward")], seeds=2, folder=tmp_path, progress=said.append)
    assert [attempt.obeyed for attempt in found.attempts] == [True, True]
    assert (tmp_path / "obedience.json").is_file()
    with pytest.warns(FutureWarning, match="generate"):
        made, fps = before(realism)(walk, [realism.Order(("a person walks",) * 3, 2.0)], progress=said.append)
    assert (len(made), fps) == (3, FPS)
    assert len(said) == 2


@pytest.mark.parametrize(
    "module",
    [
        control,
        duet,
        duet_answers,
        duet_long,
        duet_text,
        obey,
        prediction,
        prediction_studies,
        realism,
        text,
        transitions,
    ],
)
def test_every_suite_takes_what_it_took(module) -> None:
    assert hasattr(module.run, "__wrapped__")
    assert "run" in module.run.__wrapped__.__annotations__
