"""Commands that other packages bring: their line in --help, their absence, and those that a user's package adds."""

import argparse
import sys
from importlib import metadata

import pytest

from motionloom import cli
from motionloom.cli import commands


@pytest.mark.parametrize("name", commands.OTHERS)
def test_the_line_in_help_is_the_commands_own(name: str) -> None:
    top = cli.parser(name)
    [action] = [a for a in top._actions if isinstance(a, argparse._SubParsersAction)]
    assert [a.help for a in action._choices_actions if a.dest == name] == [commands.OTHERS[name].about]


def test_help_and_mistakes_list_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        cli.main(["--help"])
    shown = capsys.readouterr().out
    assert all(f"    {name} " in shown for name in ("generate", "weights", *commands.OTHERS))
    assert cli.main(["evalute"]) == 2
    assert "did you mean: motionloom evaluate" in capsys.readouterr().err


def test_completion_knows_the_options_of_other_packages(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["completion", "bash"]) == 0
    shown = capsys.readouterr().out
    assert "--licence" in shown.split("teach)")[1].split("\n")[0]


@pytest.mark.parametrize("name", commands.BROUGHT_BY)
def test_what_is_not_installed_is_named_with_what_installs_it(name: str) -> None:
    said = commands.absence(ModuleNotFoundError(name=f"{name}.part"))
    assert said is not None
    assert f"pip install '{commands.BROUGHT_BY[name]}'" in said


def test_another_missing_module_is_no_sentence_but_a_fault() -> None:
    assert commands.absence(ModuleNotFoundError(name="motionloom.tasks")) is None
    assert commands.absence(ModuleNotFoundError(name="numpy")) is None


def test_a_package_of_somebody_else_adds_a_command(
    tmp_path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "juggling.py").write_text(
        "def add(commands):\n"
        "    parser = commands.add_parser('juggle', help='keep balls in the air')\n"
        "    parser.add_argument('balls', type=int)\n"
        "    parser.set_defaults(run=lambda arguments: print(arguments.balls, 'in the air'))\n"
    )
    about = tmp_path / "juggling-1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: juggling\nVersion: 1\n")
    (about / "entry_points.txt").write_text(f"[{commands.GROUP}]\njuggle = juggling:add\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "juggling", raising=False)
    assert metadata.entry_points(group=commands.GROUP, name="juggle")
    assert cli.main(["juggle", "3"]) == 0
    assert capsys.readouterr().out == "3 in the air\n"
