"""Long motions that are ended at random moments by SIGINT, SIGTERM and SIGKILL.

``KILLS=200 make slow PYTEST_FLAGS=packages/motionloom/tests/kills`` tries as many moments of each.
"""

import signal
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.core.files.atomic import finished
from tests.kills.programs import (
    SEED,
    SIGNALS,
    Ended,
    ended_by,
    kills,
    moments,
    needs_signals,
    parts,
    run,
    uninterrupted,
)

pytestmark = needs_signals
Whole = tuple[list[str], Ended, Path]


@pytest.fixture(scope="module")
def whole(weights: str, tmp_path_factory: pytest.TempPathFactory) -> Whole:
    """The words of the command, how it ends uninterrupted, and the folder that it wrote to."""
    words = [
        "compose",
        *["walk", "jump", "sit"] * 6,
        "--seconds",
        "1",
        "--steps",
        "3",
        "--literal",
        "--weights",
        weights,
    ]
    words += ["--out", "a.bvh", "--out", "b.npz"]
    folder = tmp_path_factory.mktemp("compose") / "whole"
    return words, uninterrupted(words, folder), folder


@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
def test_compose_keeps_what_was_finished_and_shows_nothing_half_written(whole: Whole, tmp_path: Path, number) -> None:
    """SIGINT and SIGTERM end it alike: the file has the frames that were finished, the same as without them."""
    words, uncut, made = whole
    right = {name: io.load(made / name) for name in ("a.bvh", "b.npz")}
    some = 0
    for at in moments(uncut, kills(10), seed=SEED):
        folder = tmp_path / f"at {at}"
        ended = run(words, folder, at=at, number=number)
        assert ended_by(number, ended), (at, ended)
        for name in {path.name for path in finished(folder, "*")}:
            found = io.load(folder / name)
            assert 0 < len(found) <= len(right[name])
            np.testing.assert_allclose(found.positions(), right[name].positions()[: len(found)], atol=3e-6)
            some += len(found) < len(right[name])
        if number != signal.SIGKILL:
            assert len(finished(folder, "*")) in (0, 2), at
            assert parts(folder) == [], at
            assert ("what was finished" in ended.said) <= (len(finished(folder, "*")) == 2)
            continue
        assert run(words, folder).code == 0  # and what a killed one left is gone after the next
        assert sorted(path.name for path in folder.iterdir()) == ["a.bvh", "b.npz"]
    assert some or number == signal.SIGKILL, "no interruption came between the first piece and the last"
