"""Every command makes what it made when it was recorded, to a fifth of a millimetre, on the shipped weights.

It fails where outputs change, meant or not. Where they are meant to change (new shipped weights above all) record them
anew, in the same commit:

    python tools/record_outputs.py

Code that is moved, renamed or joined is held to more on one machine: `tools/record_outputs.py --compare COMMIT` runs
the commands with the code of both and compares to a thousandth of a millimetre.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.outputs.commands import COMMANDS, RECORDED, ROOT, places, sampled

METRES = 2e-4
"""Four times what kinds of processors were seen to differ by (docs/trust.md)."""


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
        "generate",
        "compose",
        "live",
        "control",
        "edit",
        "predict",
        "switch",
        "duet",
    }


def compared(*words: str) -> subprocess.CompletedProcess[str]:
    """The tool that compares, in a process of its own."""
    program = [sys.executable, "tools/record_outputs.py", "--only", "edit loop", "--compare", *words]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "packages" / "motionloom" / "src")}
    return subprocess.run(program, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)


def test_the_same_code_makes_the_same_on_one_machine() -> None:
    done = compared(str(ROOT))
    assert (done.returncode, done.stdout.split()) == (0, ["edit", "loop", "0.0e+00", "m"]), done.stderr


def test_other_code_is_told_from_this(tmp_path: Path) -> None:
    """A checkout whose clips go a millimetre further."""
    source = Path("packages") / "motionloom" / "src" / "motionloom"
    there = tmp_path / source
    shutil.copytree(ROOT / source, there, ignore=lambda folder, names: {"weights", "page", "__pycache__"})
    (there / "weights").mkdir()
    for place in (ROOT / source / "weights").iterdir():
        (there / "weights" / place.name).symlink_to(place)
    with (there / "io" / "npz.py").open("a") as file:
        file.write(MOVED)
    done = compared(str(tmp_path))
    assert (done.returncode, done.stdout.split()) == (1, ["edit", "loop", "1.0e-03", "m"]), done.stderr


MOVED = """
_as_it_is = load_npz

def load_npz(path, *, fps=None):
    from dataclasses import replace
    motion = _as_it_is(path, fps=fps)
    return replace(motion, root=motion.root + 1e-3)
"""
