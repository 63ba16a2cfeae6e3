"""What people type who have not read the help."""

import io
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from motionloom.cli import main
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.io import load
from tests.cli.said import complaint
from tests.tasks.test_edit import person

TINY = ("--steps", "2", "--no-foot-lock")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in an empty folder of its own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "words",
    [
        ("generate", "a", "person", "walks", "--seconds", "1", "--out", "x.npz"),
        ("gen", "a person walks", "--length", "1", "-o", "x.npz"),
        ("generate", "--prompt", "a person walks", "--duration=1", "--output", "x.npz", "-n", "1"),
    ],
)
def test_other_names_mean_the_same(weights: str, words: tuple[str, ...]) -> None:
    assert main(["generate", "a person walks", "--seconds", "1", "--out", "same.npz", "--weights", weights, *TINY]) == 0
    assert main([*words, "--weights", weights, *TINY]) == 0
    assert (load("x.npz").positions() == load("same.npz").positions()).all()
    assert {path.name for path in Path().iterdir()} == {"x.npz", "same.npz"}


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["a", "person", "walks"], 'did you mean: motionloom generate "a person walks"'),
        (["a person walks"], 'did you mean: motionloom generate "a person walks"'),
        (["genrate", "walk"], "did you mean: motionloom generate walk"),
        (["xyzzy"], "the commands are generate"),
        (["export", "a.bvh", "a.usdz"], "usdcat"),
        (["export", "a.bvh", "a.vrm"], "--skeleton hero.vrm"),
        (["export", "a.dae", "a.bvh"], "Blender turns it into a .glb"),
    ],
)
def test_what_is_meant_is_suggested(words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    assert sentence in complaint(capsys)


@pytest.mark.parametrize(
    ("option", "sentence"),
    [("--secnds", "did you mean --seconds?"), ("-s", "--seconds or --seed?"), ("--out-u", "--out")],
)
def test_options_are_not_abbreviated_but_suggested(
    option: str, sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["generate", "walk", option, "3"])
    assert ended.value.code == 2
    assert sentence in capsys.readouterr().err


def test_files_are_not_written_over_silently(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["generate", "a person walks", "--seconds", "1", "--out", "x.bvh", "--weights", weights, *TINY]
    assert main(words) == 0
    assert capsys.readouterr().err == ""
    assert main(words) == 0
    assert "x.bvh was there and is written over" in capsys.readouterr().err
    assert main([*words, "--force"]) == 0
    assert capsys.readouterr().err == ""


def test_what_is_read_is_never_written_over(capsys: pytest.CaptureFixture[str]) -> None:
    save_bvh(person(1.0, 30.0), "walk.bvh")
    before = Path("walk.bvh").read_bytes()
    assert main(["export", "walk.bvh", "walk.bvh", "--force"]) == 2
    assert "is read and would be written over" in complaint(capsys)
    assert Path("walk.bvh").read_bytes() == before


def test_prompts_come_through_a_pipe(weights: str, monkeypatch: pytest.MonkeyPatch) -> None:
    class Piped:
        buffer = io.BytesIO(b"a person walks\na person jumps\n")

    monkeypatch.setattr("sys.stdin", Piped())
    assert main(["generate", "--from", "-", "--seconds", "1", "--out", "x.npz", "--weights", weights, *TINY]) == 0
    assert {path.name for path in Path().iterdir()} == {"x_0.npz", "x_1.npz"}


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_accept_the_completion(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert "out-unit" in script
    program = shutil.which("bash" if shell == "zsh" else shell)
    if program:
        subprocess.run([program, "-n"], input=script, text=True, check=True, timeout=60)


# Recordings that do not say what they are ---------------------------------------------------------------------------


def lying_on_its_side(path: str) -> None:
    """A walk as programs with Z up write it, that says nothing of it."""
    from dataclasses import replace

    from motionloom.core import rotations as rot

    walk = person(1.0, 30.0)
    turn = rot.rotvec_to_quat(np.array([np.pi / 2, 0, 0]))
    turns = walk.rotations.copy()
    turns[:, 0] = rot.multiply(turn, turns[:, 0])
    save_bvh(replace(walk, root=rot.rotate(turn, walk.root), rotations=turns), path)


def test_a_recording_with_z_up_is_set_upright_with_a_remark(capsys: pytest.CaptureFixture[str]) -> None:
    lying_on_its_side("zup.bvh")
    assert main(["export", "zup.bvh", "up.bvh"]) == 0
    assert "Z is up in zup.bvh" in capsys.readouterr().err
    motion = load("up.bvh")
    head, toe = (motion.positions()[:, motion.skeleton.index(name), 1] for name in ("head", "left_foot"))
    assert (head - toe).min() > 1.0
    assert main(["export", "zup.bvh", "as_is.bvh", "--up", "y"]) == 0
    assert "--up y is followed" in capsys.readouterr().err


@pytest.mark.parametrize("up", ["y", "z", "x", "y-down", "z-down", "x-down"])
def test_what_the_user_calls_up_is_up_whatever_is_seen(capsys: pytest.CaptureFixture[str], up: str) -> None:
    walk = person(1.0, 30.0)
    save_bvh(walk, "walk.bvh")
    for name in ("out.bvh", "out.npz"):
        assert main(["export", "walk.bvh", name, "--up", up]) == 0
        assert ("Y is up in walk.bvh" in capsys.readouterr().err) == (up != "y")
        axis = "xyz".index(up[0])
        told = walk.positions()[..., axis] * (-1 if "down" in up else 1)
        turned = load(name, up="y")
        order = [turned.skeleton.index(joint) for joint in walk.skeleton.names]
        np.testing.assert_allclose(turned.positions()[:, order, 1], told, atol=1e-5)


def test_bones_of_no_human_length_are_a_question(capsys: pytest.CaptureFixture[str]) -> None:
    save_bvh(person(1.0, 30.0).scaled(0.35), "small.bvh")
    assert main(["export", "small.bvh", "out.bvh"]) == 2
    assert "--unit" in complaint(capsys)
    assert main(["export", "small.bvh", "out.bvh", "--unit", "m"]) == 0


def test_what_is_written_reads_back_at_the_same_size() -> None:
    save_bvh(person(1.0, 30.0), "feet.bvh", unit=0.3048)
    assert main(["export", "feet.bvh", "out.bvh", "--unit", "ft"]) == 0
    motion = load("out.bvh")
    height = person(1.0, 30.0).positions()[0, 15, 1]
    assert motion.positions()[0, motion.skeleton.index("head"), 1] == pytest.approx(height, abs=1e-4)


def test_the_roots_offset_is_zero_so_that_all_programs_agree() -> None:
    """three.js adds the root's OFFSET to its position channels, others put the channels in its place."""
    save_bvh(person(1.0, 30.0), "walk.bvh")
    first = Path("walk.bvh").read_text().split("OFFSET")[1].split("\n")[0]
    assert [float(number) for number in first.split()] == [0.0, 0.0, 0.0]


def test_a_misspelt_other_name_of_an_option_suggests_the_option(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["generate", "a person walks", "--lenght", "3"])
    assert "did you mean --seconds?" in capsys.readouterr().err
