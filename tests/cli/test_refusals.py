"""Where `motionloom evaluate` refuses, whatever it measures, no folders are left that it would have written to."""

import argparse
from pathlib import Path

import pytest

from motionloom.cli import evaluate, main
from motionloom.errors import MotionloomError
from motionloom.io.atomic import atomic_path, check_place

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


def test_folders_are_made_for_what_is_written_and_go_where_it_fails(tmp_path: Path) -> None:
    place = tmp_path / "a" / "b" / "c.txt"
    with pytest.raises(MotionloomError, match="No space"), atomic_path(place, folders=True):
        raise OSError(28, "No space left on device")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "a").mkdir()
    with pytest.raises(ZeroDivisionError), atomic_path(place, folders=True):
        raise ZeroDivisionError
    assert list(tmp_path.rglob("*")) == [tmp_path / "a"]  # it was there before
    with atomic_path(place, folders=True) as temp:
        temp.write_text("whole")
    assert place.read_text() == "whole"


@pytest.mark.parametrize("name", ["file/x/y.json", "x/" + "n" * 300 + "/y.json", "x/" + "n" * 300, "x/\0/y", "l/x/y"])
def test_places_that_can_never_be_are_refused_before_work(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "l").symlink_to("l")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(MotionloomError, match="cannot write"):
        check_place(tmp_path / name, folders=True)
    assert sorted(tmp_path.rglob("*")) == before
    check_place(tmp_path / "x" / "y" / "z.json", folders=True)
    with pytest.raises(MotionloomError, match="does not exist"):
        check_place(tmp_path / "x" / "y.json")
