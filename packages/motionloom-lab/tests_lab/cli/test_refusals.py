"""Where `motionloom evaluate` refuses, whatever it measures, no folders are left that it would have written to."""

import argparse
from pathlib import Path

import pytest

from motionloom.cli import main
from motionloom_lab.cli import evaluate

SUFFIXES = {"--sheet": ".png", "--make-reference": ".safetensors", "--write-bare": ".safetensors", "--results": ".md"}
"""Of options that name a file; the others name a folder, but for `evaluate reference`."""
INPUTS = {"--data", "--recordings", "--mrt", "--beside", "--communication-only"}


def commands() -> dict[str, argparse.ArgumentParser]:
    """Every command of `evaluate`."""
    top = argparse.ArgumentParser().add_subparsers()
    evaluate.add(top)
    actions = top.choices["evaluate"]._actions
    return next(action for action in actions if isinstance(action, argparse._SubParsersAction)).choices  # type: ignore[return-value]


COMMANDS = commands()
PLACES = [
    (name, action.option_strings[0])
    for name, command in COMMANDS.items()
    for action in command._actions
    if action.type is Path and action.option_strings and action.option_strings[0] not in INPUTS
]
"""Every command with each of its options that name where to write."""


def test_every_command_that_measures_is_among_them() -> None:
    assert {name for name, _ in PLACES} == COMMANDS.keys() - {"compare"}


@pytest.mark.parametrize(("name", "option"), PLACES)
def test_a_refusal_leaves_no_folders(
    name: str, option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither weights nor recordings can be read, and the place is to lie in folders that are still to be made."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "recordings").mkdir()
    (tmp_path / "recordings" / "a.bvh").write_text("no recording")
    (tmp_path / "bad.safetensors").write_text("no weights")
    known = {word for action in COMMANDS[name]._actions for word in action.option_strings}
    place = "new/folders/out" + SUFFIXES.get(option, ".json" if name == "reference" else "")
    words = ["evaluate", name, *(["steps"] if name == "study" else []), option, place]
    words += ["--weights", "bad.safetensors"] if "--weights" in known else []
    for source in sorted({"--data", "--recordings"} & known):
        words += [source, "recordings"]
    words += ["--out", "new/folders/other"] if name == "study" and option != "--out" else []
    assert main(words) == 2
    problems = [line for line in capsys.readouterr().err.splitlines() if line.startswith("motionloom: ")]
    assert name == "all" or len(problems) == 1  # `all` says it of every suite
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bad.safetensors", "recordings"]
