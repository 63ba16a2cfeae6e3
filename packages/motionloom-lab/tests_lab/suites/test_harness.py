"""Suites take one `Run`; what they took before it answers for one release, with a warning."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from motionloom_lab.metrics.obedience import check
from motionloom_lab.suites import (
    control,
    duet,
    duet_text,
    obey,
    prediction,
    prediction_studies,
    realism,
    text,
    transitions,
)
from motionloom_lab.suites.harness import Run
from tests.kinematics.people import FPS, walking


def walk(prompts: Sequence[str], *, seconds: float, seed: int) -> tuple[list[np.ndarray], float]:
    return [walking(1.2, seconds)] * len(prompts), FPS


def test_obedience_and_realism_take_a_function_that_makes_motions(tmp_path: Path) -> None:
    lines: list[str] = []
    run = Run(folder=tmp_path, progress=lines.append)
    [result] = obey.run(run, [check("walk forward")], generate=walk, seeds=2)
    assert [attempt.obeyed for attempt in result.attempts] == [True, True]
    assert (tmp_path / "obedience.json").is_file()
    clips, fps = realism.run(run, [realism.Order(("a person walks",) * 3, 2.0)], generate=walk)
    assert (len(clips), fps) == (3, FPS)
    assert len(lines) == 2


@pytest.mark.parametrize(
    "module",
    [
        control,
        duet,
        duet_text,
        obey,
        prediction,
        prediction_studies,
        realism,
        text,
        transitions,
    ],
)
def test_every_suite_takes_a_run(module) -> None:
    assert "run" in module.run.__annotations__
