"""Modules under their old names: the very modules they became."""

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import motionloom
from motionloom._moved import Moved

PLACES = sorted(Moved().places.items())


def test_the_finder_is_there_once() -> None:
    importlib.reload(motionloom)
    assert sum(isinstance(finder, Moved) for finder in sys.meta_path) == 1


@pytest.mark.parametrize(("old", "new"), PLACES, ids=lambda name: name)
def test_an_old_name_gives_the_new_module_itself_and_says_so(old: str, new: str) -> None:
    sys.modules.pop(old, None)
    with pytest.warns(FutureWarning, match=f"{old} is {new} now"):
        module = importlib.import_module(old)
    assert module is importlib.import_module(new)
    assert module.__name__ == new
    assert module.__spec__ is not None
    assert module.__spec__.name == new


def test_values_of_both_names_are_of_one_kind() -> None:
    """A class that is asked for under an old name is the same, in a process that has seen only that name."""
    code = (
        "import warnings; warnings.simplefilter('ignore')\n"
        "from motionloom.checkpoint import Prior\n"
        "from motionloom.tasks import goals\n"
        "from motionloom.metrics import frechet\n"
        "import motionloom, motionloom.lab.metrics.frechet\n"
        "assert Prior is motionloom.Prior and goals.Goal is motionloom.Goal\n"
        "assert frechet is motionloom.lab.metrics.frechet\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("module", "old", "new"),
    [
        ("motionloom.diffusion", "row_draw", "row_noise"),
        ("motionloom.features.pair", "told_from", "from_world"),
        ("motionloom.goals.goal", "Placement", "GroundPose"),
        ("motionloom.goals.goal", "placement_of", "start_of"),
    ],
)
def test_an_old_name_in_a_module_gives_what_it_became_and_says_so(module: str, old: str, new: str) -> None:
    found = importlib.import_module(module)
    with pytest.warns(FutureWarning, match=f"{old} is {new} now"):
        assert getattr(found, old) is getattr(found, new)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        getattr(found, "nothing")  # noqa: B009


def test_no_moved_name_is_taken_anew() -> None:
    """No file of the package answers to a name that is given away."""
    for old, _ in PLACES:
        place = Path(motionloom.__path__[0], *old.split(".")[1:])
        assert not place.with_suffix(".py").exists()
        assert not (place / "__init__.py").exists()
