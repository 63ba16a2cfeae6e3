"""Every command makes what it made when it was recorded, to a thousandth of a millimetre, on the shipped weights.

This holds while code is moved, renamed and joined. It fails where outputs change, meant or not. Where they are meant
to change (new shipped weights above all) record them anew, in the same commit:

    python tools/record_outputs.py

`python tools/record_outputs.py --compare` prints how far each command is from what is recorded.
"""

from pathlib import Path

import numpy as np
import pytest

from tests.outputs.commands import COMMANDS, RECORDED, places, sampled

METRES = 1e-6


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_makes_what_is_recorded(name: str, tmp_path: Path) -> None:
    """All frames that are kept of all files of the command are where they were."""
    with np.load(RECORDED, allow_pickle=False) as recorded:
        before = recorded[name]
    now = sampled(places(name, tmp_path))
    assert now.shape == before.shape
    np.testing.assert_allclose(now, before, rtol=0, atol=METRES)


def test_every_recorded_command_is_compared() -> None:
    """The file and the table hold the same commands."""
    with np.load(RECORDED, allow_pickle=False) as recorded:
        assert set(recorded) == set(COMMANDS)


def test_every_command_that_draws_is_recorded() -> None:
    """Eight commands draw motion; each is there."""
    assert {words[0] for words in COMMANDS.values()} == {
        "generate", "compose", "live", "control", "edit", "predict", "switch", "duet"
    }  # fmt: skip
