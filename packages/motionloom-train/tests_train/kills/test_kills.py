"""Built sets and training that are ended at random moments by SIGINT, SIGTERM and SIGKILL.

``KILLS=200 make slow PYTEST_FLAGS=packages/motionloom-train/tests_train/kills`` tries as many moments of each.
"""

import json
import shutil
import signal
from pathlib import Path

import numpy as np
import pytest
import torch

from motionloom.core.files.atomic import finished
from motionloom_train.data import build
from motionloom_train.data.clips import read_clip
from tests.kills import programs
from tests.kills.programs import SEED, ended_by, kills, moments, needs_signals, parts, run, uninterrupted
from tests_train import runs
from tests_train.data import people

pytestmark = needs_signals
programs.PRELOADED += [build.__name__, runs.__name__]


def train(data: str, out: str, steps: str) -> None:
    """A small training run, begun or gone on with; its losses on stdout."""
    torch.set_num_threads(1)
    runs.losses(Path(data), Path(out), runs.recipe(steps=int(steps), save_every=3))


@pytest.fixture(scope="module")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Path:
    clips = {
        "go": (people.walker(seconds=2.0), "train", "walk"),
        "back": (people.walker(-1.0, seconds=2.0), "train", ""),
        "kept": (people.walker(0.9, seconds=2.0), "val", "walk"),
        "blink": (people.walker(seconds=0.6), "train", ""),
    }
    return people.write_pack(tmp_path_factory.mktemp("pack") / "pack", clips, {"go": "a person walks"})


@pytest.mark.parametrize("workers", ["1", "2"])
def test_data_build_goes_on_where_it_was_killed(pack: Path, tmp_path: Path, workers: str) -> None:
    """The set is the one of an uninterrupted build, and nothing of the killed ones is taken for a clip, or stays."""
    words = ["data", "build", str(pack), "--out", "set", "--workers", workers, "--mixed", "2"]
    chosen = moments(uninterrupted(words, tmp_path / "whole"), kills(4), seed=SEED)
    right = json.loads((tmp_path / "whole" / "set" / "set.json").read_text())
    folder = tmp_path / "killed"
    for turn, at in enumerate(chosen):
        number = (signal.SIGKILL, signal.SIGTERM, signal.SIGKILL, signal.SIGINT)[turn % 4]
        ended = run(words, folder, at=at, number=number)
        late = ended.code == 0 and json.loads((folder / "set" / "set.json").read_text()) == right  # all was written
        assert late or ended_by(number, ended), (at, ended)
        for path in finished(folder / "set" / "clips", "*"):
            read_clip(path)
        if turn % 2:  # every second time it goes on twice
            continue
        assert run(words, folder).code == 0
        assert json.loads((folder / "set" / "set.json").read_text()) == right
        assert parts(folder) == []
        shutil.rmtree(folder)
    assert run(words, folder).code == 0
    assert json.loads((folder / "set" / "set.json").read_text()) == right
    assert parts(folder) == []


def test_training_goes_on_bit_for_bit(tmp_path: Path) -> None:
    """Ended at random moments, again and again: the losses and the last state are those of an uninterrupted run."""
    data = runs.write_set(tmp_path / "data")
    words = [f"{__name__}:train", str(data), "run", "14"]
    whole = uninterrupted(words, tmp_path / "whole")
    right = dict(line.split() for line in whole.out.splitlines())
    state = (tmp_path / "whole" / "run" / "state.safetensors").read_bytes()
    for turn in range(kills(2)):
        folder = tmp_path / f"killed {turn}"
        rng = np.random.default_rng((SEED, turn))
        for number in (signal.SIGKILL, signal.SIGTERM, signal.SIGKILL):
            ended = run(words, folder, at=int(rng.integers(1, whole.marks)), number=number)
            assert ended.code in (0, 130, -signal.SIGKILL), ended
            losses = dict(line.split() for line in ended.out.splitlines() if len(line.split()) == 2)
            assert losses.items() <= right.items()
        ended = run(words, folder)
        assert ended.code == 0, ended.said
        assert _content((folder / "run" / "state.safetensors").read_bytes()) == _content(state)
        assert parts(folder) == []


def _content(state: bytes) -> tuple[dict, bytes]:
    """The head of a safetensors file as values, since the order of its metadata is nobody's, and the numbers."""
    size = int.from_bytes(state[:8], "little")
    return json.loads(state[8 : 8 + size]), state[8 + size :]
