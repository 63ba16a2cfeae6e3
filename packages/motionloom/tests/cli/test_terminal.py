"""Nothing that a command quotes, wherever it comes from, steers the terminal."""

import argparse
import contextlib
import io
import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from motionloom.cli import main, parser
from motionloom.cli.terminal import escaping, unescaped
from motionloom.core.errors import one_line, printable
from motionloom.core.models.networks.text.known import known_sentences
from motionloom.core.models.prior import save_prior
from tests.recorded import tiny

HOSTILE = "a man\x1b[31m\x1b]0;title\x07 \x9b2J walks\u202e\x7f\r back"
"""Colours, a title for the window, a cleared screen, text that runs to the left, a line written over."""


def leaves(
    top: argparse.ArgumentParser, path: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], argparse.ArgumentParser]]:
    """Every command by its words."""
    below = [action for action in top._actions if isinstance(action, argparse._SubParsersAction)]
    if not below:
        yield path, top
    for action in below:
        for name, inner in action.choices.items():
            yield from leaves(inner, (*path, name))


COMMANDS = dict(leaves(parser()))


def lines(command: tuple[str, ...], hostile: str) -> Iterator[list[str]]:
    """What is typed after a command: hostile words alone, and as what each option takes."""
    yield [*command, hostile]
    yield [*command, f"{hostile}.bvh", f"{hostile}.glb"]
    yield [*command, hostile, "--out", f"{hostile}.dae"]
    yield [*command, f"--{hostile}"]
    for action in COMMANDS[command]._actions:
        if action.option_strings and action.nargs is None and action.type is not None:
            yield [*command, "x", action.option_strings[-1], hostile]


def shows_nothing_hostile(text: str) -> bool:
    return all(letter.isprintable() or letter in "\n\t" for letter in text)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in an empty folder of its own, and nothing is served or waited for."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(HOSTILE.encode())))
    return tmp_path


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_no_command_passes_on_what_steers_a_terminal(
    command: tuple[str, ...], capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether the words are taken for a prompt, a file, an option or its value; where weights are opened it ends."""

    def refuse(*_: object, **__: object) -> None:
        print(HOSTILE)
        raise OSError(2, HOSTILE, HOSTILE)

    monkeypatch.setattr("motionloom.core.models.prior.Prior.load", refuse)
    for words in lines(command, HOSTILE):
        with contextlib.suppress(SystemExit):
            main(words)
        out, err = capfd.readouterr()
        assert shows_nothing_hostile(out + err), words


def test_a_remark_on_an_unknown_prompt_is_escaped(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the weights themselves hold such a sentence."""
    monkeypatch.setattr("motionloom.core.models.networks.text.known.SAME", 2.0)
    monkeypatch.setattr("motionloom.core.models.networks.text.known.NEAR", 2.0)
    prior = tiny.prior()
    known = known_sentences(["a person walks", HOSTILE], {"walk": 9.0}, prior.text)
    place = save_prior(replace(prior, known=known), tmp_path / "a.safetensors")
    words = ["generate", "xyzzy \u202e \u200b", "--seconds", "1", "--steps", "2", "--weights", str(place), "--json"]
    assert main([*words, "--out", "x.npz"]) == 0
    out, err = capsys.readouterr()
    assert "nothing like" in err
    assert shows_nothing_hostile(out + err)


def test_what_is_written_out_is_json_in_json() -> None:
    assert json.loads(printable(json.dumps(HOSTILE, ensure_ascii=False, indent=1))) == HOSTILE
    assert printable("a\tb\nc\u00e9\U0001f600") == "a\tb\nc\u00e9\U0001f600"
    assert one_line("a\nb\x1b") == "a\\nb\\u001b"


def test_streams_are_as_they_were_afterwards() -> None:
    """And whoever draws a bar gets at the terminal itself."""
    before = sys.stdout, sys.stderr
    with escaping():
        assert unescaped(sys.stderr) is before[1]
        assert sys.stdout.isatty() == before[0].isatty()
    assert (sys.stdout, sys.stderr) == before
    assert unescaped(sys.stdout) is before[0]
