"""What is mistyped is answered with one sentence that names the right page of help, before any work is done."""

import warnings
from pathlib import Path

import pytest

from motionloom.cli import generate, main, parser, tables


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("words", "page"),
    [
        (["info", "walk.bvh", "--fps", "3"], "motionloom info --help"),
        (["generate", "a person walks", "--bogus"], "motionloom generate --help"),
        (["--bogus"], "motionloom --help"),
    ],
)
def test_an_unknown_option_points_to_the_help_of_its_command(words, page, capsys):
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.count("\n") == 1
    assert "unrecognized arguments" in output.err
    assert output.err.endswith(f"see {page}\n")


@pytest.mark.parametrize("moment", ["while commands are read", "while one runs"])
def test_ctrl_c_is_one_line_and_130_at_any_moment(moment, monkeypatch, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    module, name = (tables, "add_entries") if moment == "while commands are read" else (generate, "_prompts")
    monkeypatch.setattr(module, name, interrupted)
    assert main(["generate", "a person walks"]) == 130
    assert capsys.readouterr() == ("", "motionloom: interrupted\n")


def test_no_command_at_all_lists_the_commands_on_stderr(capsys):
    assert main([]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert "generate" in output.err


@pytest.mark.parametrize(
    ("outs", "message"),
    [
        (["a.npz", "sub/../a.npz"], "given twice"),
        (["a.npz", "b.npz"], "b_1.npz: it is a folder"),  # the numbered names are what is written
        (["x" * 250 + ".npz"], "cannot write"),
    ],
)
def test_every_place_is_looked_at_before_anything_is_made(folder, outs, message, capsys):
    (folder / "sub").mkdir()
    (folder / "b_1.npz").mkdir()
    words = [word for out in outs for word in ("--out", out)]
    assert main(["generate", "a person walks", "--count", "2", "--weights", "none", *words]) == 2
    assert message in capsys.readouterr().err
    assert not [path for path in folder.rglob("*") if path.is_file()]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"a person walks\xff\xfe", "is not UTF-8 text"),
        ("a person walks".encode("utf-16"), "binary data"),
        (b"\xef\xbb\xbf \r\n\r\n", "no prompt"),
        (b"a person walks\n" * 1001, "1001 prompts are too many"),
        (b"walk " * 10_000, "49,999 characters"),
    ],
)
def test_a_file_of_prompts_is_plain_text_of_a_sane_size(folder, content, message, capsys):
    (folder / "prompts.txt").write_bytes(content)
    assert main(["generate", "--from", "prompts.txt", "--weights", "none"]) == 2
    assert message in capsys.readouterr().err


def test_marks_of_other_systems_are_no_part_of_a_prompt(folder):
    (folder / "prompts.txt").write_bytes("\ufeffa person walks\r\n\r\n a person jumps ".encode())
    arguments = parser().parse_args(["generate", "someone waves", "--from", "prompts.txt"])
    assert generate._prompts(arguments) == ["someone waves", "a person walks", "a person jumps"]


def test_a_warning_is_one_line_without_a_place_in_the_source(monkeypatch, capsys):
    monkeypatch.setattr(generate, "run_generate", lambda arguments: warnings.warn("mind the\n gap", stacklevel=1))
    assert main(["generate", "a person walks"]) == 0
    assert capsys.readouterr().err == "motionloom: mind the gap\n"
