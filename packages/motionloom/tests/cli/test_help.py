"""`--help` shows the everyday options on a screen, `--help-all` all of them, and neither what cannot be used."""

import argparse
from collections.abc import Iterator

import pytest

from motionloom.cli import commands, commands_of, help, main, parser
from motionloom.core.reading import read_table

TABLE = read_table("motionloom.cli", "help.toml")


def leaves(command: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """The commands below one that has some, else itself."""
    below = [a for a in command._actions if isinstance(a, argparse._SubParsersAction)]
    for action in below:
        for one in action.choices.values():
            yield from leaves(one)
    if not below:
        yield command


def every() -> list[argparse.ArgumentParser]:
    return [leaf for command in commands_of(parser()).values() for leaf in leaves(command)]


@pytest.fixture(autouse=True)
def _eighty_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


@pytest.fixture
def _everything_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(help, "find_spec", lambda name: object())


def names(text: str) -> list[str]:
    """The options that lines begin with."""
    return [line.split()[0].rstrip(",") for line in text.splitlines() if line.startswith("  -")]


@pytest.mark.usefixtures("_everything_installed")
def test_generate_fits_on_a_screen(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["generate", "--help"])
    shown = capsys.readouterr().out
    assert shown.count("\n") <= 50
    titles = [line for line in shown.splitlines() if line.endswith(":") and not line.startswith(" ")]
    assert titles == ["words:", "length:", "character:", "output:"]
    assert "--help-all" in shown


@pytest.mark.usefixtures("_everything_installed")
@pytest.mark.parametrize("whole", [False, True])
def test_every_option_is_printed_once(whole: bool) -> None:
    for command in every():
        shown = names(help.help_of(command, whole=whole))
        expert = set() if whole else set(TABLE["groups"]["expert"])
        asked = [one for one in command._actions if one.option_strings and one.help != argparse.SUPPRESS]
        grouped = len(asked) + len(command._get_positional_actions()) > help.SCREEN
        hidden = {"help", *expert} if grouped else set()
        assert sorted(shown) == sorted(one.option_strings[0] for one in asked if one.dest not in hidden), command.prog


@pytest.mark.usefixtures("_everything_installed")
def test_what_a_command_needs_is_never_hidden() -> None:
    for command in every():
        needed = [one for one in command._actions if one.required and one.dest in TABLE["groups"]["expert"]]
        assert not needed, command.prog


def test_groups_name_options_that_there_are() -> None:
    known = {one.dest for command in every() for one in command._actions}
    grouped = [name for names in TABLE["groups"].values() for name in names]
    assert len(grouped) == len(set(grouped))
    assert set(grouped) <= known
    assert {name for names in TABLE["needs"].values() for name in names} <= known


@pytest.mark.parametrize("module", TABLE["needs"])
def test_options_of_packages_that_are_not_installed_are_not_printed(
    module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(help, "find_spec", lambda name: None if name == module else object())
    for command in every():
        absent = {o for one in command._actions if one.dest in TABLE["needs"][module] for o in one.option_strings}
        assert not absent & set(names(help.help_of(command, whole=True))), command.prog
        assert not [name for name in absent if f"[{name}" in help.help_of(command)]


@pytest.mark.parametrize("name", commands.OTHERS)
def test_a_command_of_an_absent_package_has_help(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    package = commands.OTHERS[name].module.partition(".")[0]

    def absent(_: str) -> None:
        raise ModuleNotFoundError(name=package)

    monkeypatch.setattr(commands, "_registered", absent)
    with pytest.raises(SystemExit) as end:
        main([name, "--help"])
    assert end.value.code == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert commands.OTHERS[name].about in shown
    assert f"pip install '{commands.BROUGHT_BY[package]}'" in shown
    assert main([name, "a person walks", "--out", "x"]) == 2
    assert f"needs {package}" in capsys.readouterr().err
