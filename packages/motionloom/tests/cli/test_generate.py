"""generate, as a stranger types it, on a tiny prior with random weights."""

import json
import shutil
from pathlib import Path

import pytest

from motionloom import io
from motionloom.cli import main
from tests.cli.said import complaint
from tests.io.motions import largest_distance


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in an empty folder of its own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def generate(weights: str, *words: str) -> int:
    return main(["generate", *words, "--weights", weights, "--steps", "2", "--seconds", "1"])


def file_names() -> set[str]:
    return {path.name for path in Path().iterdir()}


def test_several_files_hold_the_same_motion(weights: str) -> None:
    assert generate(weights, "a person walks", "--out", "a.bvh", "--out", "a.npz", "--seed", "3") == 0
    assert file_names() == {"a.bvh", "a.npz"}
    a, b = io.load("a.bvh"), io.load("a.npz")
    assert (len(a), a.fps) == (20, 20)
    assert largest_distance(a, b) < 1e-3


def test_the_default_file_is_a_bvh(weights: str) -> None:
    assert generate(weights, "a person walks") == 0
    assert file_names() == {"motion.bvh"}


def test_prompts_come_from_the_line_and_a_file(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("prompts.txt").write_text("a person turns\n\n  a person jumps  \n", encoding="utf-8")
    assert (
        generate(
            weights,
            "a person walks",
            "--from",
            "prompts.txt",
            "--count",
            "2",
            "--out",
            "m.npz",
            "--json",
            "--no-foot-lock",
        )
        == 0
    )
    about = json.loads(capsys.readouterr().out)
    assert [m["prompt"] for m in about["motions"]] == [
        f"a person {v}" for v in ("walks", "turns", "jumps") for _ in range(2)
    ]
    assert [m["seed"] for m in about["motions"]] == list(range(6))
    assert {Path(f).name for f in about["files"]} == file_names() - {"prompts.txt"} == {f"m_{i}.npz" for i in range(6)}


def test_the_rate_of_the_files_can_be_chosen(weights: str) -> None:
    assert generate(weights, "a person walks", "--out", "a.npz", "--fps", "60") == 0
    assert io.load("a.npz").fps == 60


@pytest.mark.parametrize(
    "words",
    [
        [""],
        ["  "],
        [],
        ["walk", "--out", "a.xyz"],
        ["walk", "--out", "absent/a.bvh"],
        ["walk", "--out", "."],
        ["walk", "--seed", "-1"],
        ["walk", "--count", "0"],
        ["walk", "--guidance", "nan"],
        ["walk", "--solver", "euler"],
        ["walk", "--fps", "0"],
        ["walk", "--fps", "nan"],
        ["walk", "--device", "toaster"],
        ["walk", "--out", "a.bvh", "--out", "a.bvh"],
        ["walk", "--from", "absent.txt"],
        ["walk " * 10_000],
    ],
    ids=lambda words: " ".join(words)[:30],
)
def test_mistakes_are_one_sentence_and_nothing_is_written(
    weights: str, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """The last one has ten thousand words."""
    assert generate(weights, *words) == 2
    complaint(capsys)
    assert not file_names()


@pytest.mark.parametrize(
    "options",
    [["--seconds", "0"], ["--seconds", "-1"], ["--seconds", "nan"], ["--steps", "0"], ["--weights", "absent"]],
    ids=" ".join,
)
def test_numbers_out_of_range_are_refused(weights: str, options: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["generate", "walk", "--weights", weights, *options]) == 2
    complaint(capsys)
    assert not file_names()


def test_a_folder_that_may_not_be_written_is_reported_before_the_work(
    weights: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("locked").write_text("a file where a folder should be")
    assert generate(weights, "walk", "--out", "locked/a.bvh") == 2
    assert "locked" in capsys.readouterr().err
    assert file_names() == {"locked"}


def test_a_damaged_weight_file_is_reported(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(weights, "cut.safetensors")
    Path("cut.safetensors").write_bytes(Path("cut.safetensors").read_bytes()[:-10])
    assert main(["generate", "walk", "--weights", "cut.safetensors"]) == 2
    complaint(capsys)
    assert file_names() == {"cut.safetensors"}


def test_bytes_that_are_no_text_are_refused(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    """What a shell hands over for a byte that is not UTF-8."""
    assert generate(weights, "walk \udcff", "--out", "a.npz") == 2
    assert "holds half a character (a lone surrogate, U+DCFF)" in complaint(capsys)
    assert file_names() == set()


def test_the_best_of_several_is_kept(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    different = 0
    for seed in ("1", "2", "3"):
        for options, name in ((("--best-of", "4"), "a.npz"), (("--best-of", "4"), "b.npz"), ((), "c.npz")):
            assert generate(weights, "a person walks", "--seed", seed, "--out", name, "--force", *options) == 0
        a, b, c = io.load("a.npz"), io.load("b.npz"), io.load("c.npz")
        assert largest_distance(a, b) == 0
        different += largest_distance(a, c) > 1e-3
    assert different
    assert "--best-of" not in capsys.readouterr().err
    for words in ("a person walks", "a person walks, then sits"):
        assert main(["generate", words, "--weights", weights, "--out", "d.npz", "--best-of", "99"]) == 2
        assert complaint(capsys).startswith("motionloom: --best-of must be a whole number from 1 to 16; got 99")
    assert not Path("d.npz").exists()


def test_numbers_in_the_words_are_goals(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    """What was read is said once and measured; the seed decides; `--literal` reads nothing."""
    for out in ("a.npz", "b.npz"):
        assert generate(weights, "turn left 90 degrees", "--json", "--out", out) == 0
    output, errors = capsys.readouterr()
    assert "read as: a turn of 90 degrees to the left, 1 s" in errors
    assert '"asked": 90.0' in output
    assert largest_distance(io.load("a.npz"), io.load("b.npz")) == 0
    assert generate(weights, "turn left 90 degrees", "--literal", "--out", "c.npz") == 0
    assert "read as" not in capsys.readouterr().err


def test_other_languages_are_told(weights: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert generate(weights, "eine Person geht vorwärts") == 0
    assert "does not look like English" in capsys.readouterr().err
