"""Commands that make several motions and are ended at random moments: those that were finished are kept.

``KILLS=200 make slow PYTEST_FLAGS=packages/motionloom/tests/kills`` tries as many moments of each.
"""

import json
import os
import shutil
import signal
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from motionloom import io
from motionloom.core.files.atomic import finished
from motionloom.core.models.predictor import save_predictor
from motionloom.core.models.prior import save_prior
from tests.cli.predict.clips import tiny_predictor
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
from tests.recorded import tiny
from tests.tasks.test_edit import person
from tests.tasks.two_people import block

pytestmark = needs_signals


@pytest.fixture(scope="module")
def inputs(weights: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the commands of `COUNTED` read: weights, clips and a goal."""
    folder = tmp_path_factory.mktemp("inputs")
    prior = tiny.prior()
    save_prior(prior, folder / "pair.safetensors", half=False)
    block(prior).save(folder / "block.safetensors", half=False)
    save_predictor(tiny_predictor(), folder / "predictor.safetensors")
    (folder / "goal.json").write_text(json.dumps({"path": {"points": [[1, 0], [1, 1.2]]}}))
    io.save(person(1.0, 20.0), folder / "past.npz")
    io.save(person(1.5, 20.0), folder / "kick.npz")
    return folder


COUNTED = {
    "generate": (30, "a person walks", "--seconds", "0.5"),
    "control": (12, "a person walks", "--goal", "@goal.json", "--seconds", "0.5"),
    "edit": (3, "@past.npz", "a person walks", "--between", "0.3", "0.7"),
    "predict": (18, "@past.npz", "--seconds", "0.3", "--weights", "@predictor.safetensors", "--no-foot-lock"),
    "switch": (
        18,
        "@past.npz",
        "@kick.npz",
        "--seconds",
        "0.3",
        "--weights",
        "@predictor.safetensors",
        "--no-foot-lock",
    ),
    "duet": (
        10,
        "two people walk",
        "--seconds",
        "0.5",
        "--pair-weights",
        "@block.safetensors",
        "--weights",
        "@pair.safetensors",
        "--no-foot-lock",
    ),
}
"""Commands with a count, how many, and the other words."""


def counted(command: str, inputs: Path, weights: str) -> tuple[list[str], int]:
    """The words of a command, and how many motions it makes."""
    count, *more = COUNTED[command]
    words = [str(inputs / word[1:]) if str(word).startswith("@") else str(word) for word in more]
    own = [] if "--weights" in words else ["--weights", weights]
    out = ["--out", "m.glb" if command == "duet" else "m.npz"]
    return [command, *words, "--count", str(count), "--steps", "3", *own, *out], int(count)


Whole = tuple[list[str], int, Ended, Path]


@pytest.fixture(scope="module")
def wholes(inputs: Path, weights: str, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Whole]:
    """By command: its words, how many motions it makes, how it ends uninterrupted, and the folder of what it made."""

    @cache
    def whole(command: str) -> Whole:
        words, count = counted(command, inputs, weights)
        folder = tmp_path_factory.mktemp(command) / "whole"
        return words, count, uninterrupted(words, folder), folder

    return whole


EACH = [
    (command, number)
    for place, command in enumerate(COUNTED)
    for turn, number in enumerate(SIGNALS)
    if command == "generate" or turn == place % len(SIGNALS) or "KILLS" in os.environ
]
"""A command and the signal that ends it: one each, every one for `generate`; all of all where `KILLS` is set."""


@pytest.mark.parametrize(("command", "number"), EACH, ids=[f"{command}-{number.name}" for command, number in EACH])
def test_every_command_with_a_count_keeps_what_was_finished(
    command: str, wholes: Callable[[str], Whole], tmp_path: Path, number
) -> None:
    """Several are drawn at a time: the first ones, those that were finished, are there, bit for bit."""
    words, count, whole, right = wholes(command)
    names = sorted(path.name for path in finished(right, "*"))
    assert len(names) == count
    for at in moments(whole, kills(8 if command == "generate" else 3), seed=SEED):
        folder = tmp_path / f"at {at}"
        ended = run(words, folder, at=at, number=number)
        found = finished(folder, "*")
        done = ended.code == 0 and len(found) == count  # Python drops what is raised while an object is cleaned up
        assert done or ended_by(number, ended), (at, ended)
        for path in found:
            assert path.read_bytes() == (right / path.name).read_bytes()
        if number != signal.SIGKILL:
            assert [path.name for path in found] == names[: len(found)], at
            assert parts(folder) == []
            assert (f"{len(found)} of {count} " in ended.said) == (len(found) > 0) or len(found) == count
        shutil.rmtree(folder)


@pytest.mark.parametrize("command", COUNTED)
def test_an_interruption_late_keeps_the_first_ones(
    command: str, wholes: Callable[[str], Whole], tmp_path: Path
) -> None:
    """Late enough some are finished, whatever the command; looked for from behind, since the last marks are writing."""
    words, count, whole, _ = wholes(command)
    for part in (8, 7, 6, 5, 9):
        ended = run(words, tmp_path / f"cut{part}", at=whole.marks * part // 10, number=signal.SIGTERM)
        if 0 < len(finished(tmp_path / f"cut{part}", "m*")) < count:
            break
    assert ended.code == 130
    assert 0 < len(finished(tmp_path / f"cut{part}", "m*")) < count
    assert "were finished" in ended.said
