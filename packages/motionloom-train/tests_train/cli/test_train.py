"""data build, train and generate, one after the other, as the documents tell a stranger to do it."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file

from motionloom.cli import main
from motionloom.core.models.prior import load_prior, save_prior
from tests.recorded import tiny
from tests_train import runs

RECIPE = """
name = "mine"
licence = "mine alone"
steps = 3
batch = 2
windows = [20]
shares = [1.0]
levels = 20
save_every = 2
[net]
variant = "modulated"
width = 32
layers = 1
heads = 2
hidden = 32
text = 64
patch = 4
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("recipe.toml").write_text(RECIPE)
    save_prior(tiny.prior(), "tiny.safetensors")
    runs.write_set(tmp_path / "set")
    return tmp_path


BASE = ["train", "prior", "--recipe", "recipe.toml", "--data", "set", "--text", "tiny.safetensors", "--device", "cpu"]


def test_a_model_is_trained_continued_and_used(capsys: pytest.CaptureFixture[str]) -> None:
    """Trained, found finished, continued from its own weights, and generated from."""
    assert main([*BASE, "--out", "run", "--threads", "1"]) == 0
    assert "wrote run/mine.safetensors" in capsys.readouterr().out
    prior = load_prior(Path("run/mine.safetensors"))
    assert prior.card.licence == "mine alone"
    assert prior.card.notes["steps"] == 3
    assert main([*BASE, "--out", "run", "--set", "steps=5"]) == 0
    assert "another recipe than before: steps is now 5 and was 3" in capsys.readouterr().out
    assert load_prior(Path("run/mine.safetensors")).card.notes["steps"] == 5
    assert main([*BASE, "--out", "more", "--set", "start=run/mine.safetensors", "steps=1"]) == 0
    np.testing.assert_array_equal(load_prior(Path("more/mine.safetensors")).mean, prior.mean)
    assert (
        main(["generate", "a person walks", "--weights", "more/mine.safetensors", "--steps", "2", "--out", "a.npz"])
        == 0
    )


def test_a_continuation_that_keeps_what_is_old_resumes_exactly() -> None:
    """Half of each batch fresh, held near the weights it began with, which the recipe names by their hash."""
    assert main([*BASE, "--out", "run"]) == 0
    digest = hashlib.sha256(Path("run/mine.safetensors").read_bytes()).hexdigest()
    start = ["start=run/mine.safetensors", f"start_sha256={digest}", "keep=1.0"]
    words = ["--set", *start, "fresh=0.5", "fresh_of=['walk fast']", "steps=6"]
    assert main([*BASE, "--out", "whole", *words]) == 0
    assert main([*BASE, "--out", "parts", *words, "--stop", "3"]) == 0
    assert main([*BASE, "--out", "parts", *words]) == 0
    assert load_prior(Path("parts/mine.safetensors")).card.notes["start_sha256"] == digest
    whole, parts = (load_file(f"{run}/state.safetensors") for run in ("whole", "parts"))
    assert all(np.array_equal(parts[key], value) for key, value in whole.items())


@pytest.mark.parametrize(
    "words",
    [
        ["--set", "start=tiny.safetensors", f"start_sha256={'0' * 64}"],
        ["--set", "keep=1.0"],
        ["--set", "fresh=0.5"],
        ["--set", "fresh=0.5", "fresh_of=['absent']"],
        ["--set", "stepps=1"],
        ["--set", "steps"],
        ["--set", "net.width=7"],
        ["--set", "windows=[900]"],
        ["--threads", "-1"],
        ["--stop", "0"],
        ["--device", "toaster"],
        ["--set", "start=absent"],
        ["--set", "start=tiny.safetensors"],
        ["--set", "sources=['x']"],
        ["--data", "absent"],
        ["--recipe", "absent.toml"],
        ["--text", "recipe.toml"],
    ],
    ids=" ".join,
)
def test_mistakes_are_one_sentence(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """The last word wins: options given twice are replaced."""
    assert main([*BASE, "--out", "run", *words]) == 2
    assert capsys.readouterr().err.strip().count("\n") == 0
    assert not list(Path().glob("run/*.safetensors"))


def test_the_card_of_a_run_without_a_licence_lists_those_of_the_data(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*BASE, "--out", "run", "--set", "licence=", "steps=1"]) == 0
    capsys.readouterr()
    assert main(["weights", "run/mine.safetensors", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["licence"] == "free"


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no devices here")
def test_nothing_is_read_out_of_a_device() -> None:
    for suffix in (".toml", ".bvh"):
        Path(f"zero{suffix}").symlink_to("/dev/zero")
    assert main(["train", "prior", "--recipe", "zero.toml", "--data", "set", "--out", "run"]) == 2
    assert main(["teach", "a walk", "zero.bvh", "--out", "b.safetensors"]) == 2
    assert not Path("run").exists()
    assert not Path("b.safetensors").exists()
