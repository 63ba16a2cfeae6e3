"""teach, as a stranger types it, on a tiny prior with random weights."""

import argparse
import json
from pathlib import Path

import pytest

from motionloom import io
from motionloom.cli import main, parser
from motionloom.cli.options import option
from motionloom.core.body.ik import motion_from_positions
from motionloom.core.models.adapter import Adapter
from motionloom.core.models.prior import Prior
from motionloom.requests.fields import specs
from motionloom.requests.teach import Teach
from motionloom_train import teach as module
from tests.cli.said import complaint
from tests.cli.test_adapters import folder, knowing
from tests.kinematics import people

__all__ = ["folder", "knowing"]


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Little is drawn of what is known."""
    monkeypatch.setattr(module, "DRAWS", 2)
    monkeypatch.setattr(module, "DRAWN_STEPS", 1)


def teach(weights: str, *words: str) -> int:
    return main(["teach", *words, "--weights", weights, "--steps", "2", "--rank", "2"])


def test_clips_become_an_adapter_with_a_card(knowing: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("a person turns", "clips/one.bvh", "clips/two.bvh")
    assert teach(knowing, *words, "--out", "z.safetensors", "--licence", "mine", "--json") == 0
    about = json.loads(capsys.readouterr().out)
    assert about["captions"] == ["a person turns"]
    assert about["clips"] == ["clips/one.bvh", "clips/two.bvh"]
    adapter = Adapter.load("z.safetensors", Prior.load(knowing))
    assert (adapter.name, adapter.licence, adapter.notes["clips"]) == ("z", "mine", 2)
    assert main(["weights", "z.safetensors"]) == 0
    assert "taught adapter" in capsys.readouterr().out


def test_its_options_are_the_fields_of_its_request() -> None:
    commands = next(one.choices for one in parser()._actions if isinstance(one, argparse._SubParsersAction))
    options = commands["teach"]._option_string_actions
    for name, spec in specs(Teach).items():
        assert spec.help in options[option(name, spec)].help
        assert options[option(name, spec)].default == spec.default


def test_check_says_what_is_wrong_and_writes_nothing(knowing: str, capsys: pytest.CaptureFixture[str]) -> None:
    io.save(motion_from_positions(people.standing(2.0), people.FPS), "clips/still.bvh")
    before = sorted(Path().rglob("*"))
    assert teach(knowing, "a zombie", "clips", "--check") == 2
    output = capsys.readouterr().out
    assert "wrong: nothing moves" in output
    assert "2 of 3 clips can be learned from" in output
    assert sorted(Path().rglob("*")) == before
    assert teach(knowing, "a zombie", "clips/one.bvh", "--check", "--json") == 0
    assert json.loads(capsys.readouterr().out)["usable"] == 1


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["a zombie"], "no clips behind"),
        (["a zombie", "none.bvh"], "there is no clip"),
        (["clips/one.bvh"], "nothing is said of"),
        (["a zombie", "clips/one.bvh", "--out", "z.pt"], "another suffix"),
        (["a zombie", "clips/one.bvh", "--keep", "2"], "keep must be"),
        (["a zombie", "clips/one.bvh", "--unit", "mm"], "unit of length is wrong"),
    ],
)
def test_mistakes_are_one_sentence(
    knowing: str, capsys: pytest.CaptureFixture[str], words: list[str], reason: str
) -> None:
    before = sorted(Path().rglob("*"))
    assert teach(knowing, *words) == 2
    assert reason in complaint(capsys)
    assert sorted(Path().rglob("*")) == before
