"""import and weights, as a stranger types them."""

import json
import pickle
from pathlib import Path

import numpy as np
import pytest

from motionloom.checkpoint import load_prior, save_prior
from motionloom.cli import main
from tests.nets import tiny
from tests.nets.test_published import Bomb, state, write


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in a folder of its own that holds the statistics of 263 features."""
    monkeypatch.chdir(tmp_path)
    np.save("Mean.npy", np.arange(263, dtype=np.float32))
    np.save("Std.npy", np.full(263, 2.0))
    return tmp_path


STATISTICS = ["--mean", "Mean.npy", "--std", "Std.npy"]


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The one sentence on stderr; nothing is written."""
    before = sorted(Path().rglob("*"))
    assert main(list(words)) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert "Traceback" not in said.err
    assert sorted(Path().rglob("*")) == before
    return said.err


def test_an_imported_checkpoint_is_a_prior_with_its_card(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = {
        "arch": "trans_enc",
        "noise_schedule": "cosine",
        "diffusion_steps": 50,
        "dataset": "humanml",
        "data_dir": "/home/x",
    }
    write(folder, state(), options)
    assert (
        main(["import", "model000200000.pt", "--out", "a.safetensors", *STATISTICS, "--licence", "research only"]) == 0
    )
    assert capsys.readouterr().err == ""
    prior = load_prior(Path("a.safetensors"))
    assert (prior.schedule.steps, prior.text.name, prior.fps) == (50, "clip", 20.0)
    assert prior.mean[7] == 7
    assert prior.card.licence == "research only"
    assert prior.card.notes["imported_from"] == "model000200000.pt"
    assert "/home/x" not in json.dumps(prior.card.notes)
    assert main(["weights", "a.safetensors"]) == 0
    said = capsys.readouterr().out
    assert "research only" in said
    assert "humanml" in said


def test_missing_options_are_warned_of_and_babel_imports_but_is_not_decoded(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(folder, state(135, flags=True))
    np.save("Mean.npy", np.zeros(135, np.float32))
    np.save("Std.npy", np.ones(135, np.float32))
    assert (
        main(["import", "model000200000.pt", "--out", "b.safetensors", *STATISTICS, "--name", "babel", "--half"]) == 0
    )
    assert capsys.readouterr().err.count("is assumed") == 3
    assert main(["weights", "b.safetensors", "--json"]) == 0
    about = json.loads(capsys.readouterr().out)
    assert (about["name"], about["features"], about["frames_per_second"], about["text"]) == (
        "babel",
        135,
        30,
        "clip-77",
    )
    assert "unknown" in about["licence"]
    assert "135" in refused(capsys, "generate", "walk", "--weights", "b.safetensors", "--out", "a.bvh")


def test_statistics_are_asked_for_and_checked(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(folder, state(), {"arch": "trans_enc", "noise_schedule": "cosine", "diffusion_steps": 50})
    start = ["import", "model000200000.pt", "--out", "a.safetensors"]
    assert "--mean" in refused(capsys, *start)
    np.save("short.npy", np.ones(9))
    assert "263" in refused(capsys, *start, "--mean", "Mean.npy", "--std", "short.npy")
    np.save("negative.npy", -np.ones(263))
    assert "negative" in refused(capsys, *start, "--mean", "Mean.npy", "--std", "negative.npy")
    np.save("nan.npy", np.full(263, np.nan))
    assert "finite" in refused(capsys, *start, "--mean", "nan.npy", "--std", "Std.npy")
    assert "no file" in refused(capsys, *start, "--mean", "absent.npy", "--std", "Std.npy")


def test_a_pickle_as_statistics_is_not_run(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(folder, state(), {"arch": "trans_enc"})
    Path("code.npy").write_bytes(pickle.dumps(Bomb(folder / "was run")))
    refused(capsys, "import", "model000200000.pt", "--out", "a.safetensors", "--mean", "code.npy", "--std", "Std.npy")
    np.save("object.npy", np.array([Bomb(folder / "was run")], dtype=object), allow_pickle=True)
    refused(capsys, "import", "model000200000.pt", "--out", "a.safetensors", "--mean", "object.npy", "--std", "Std.npy")
    assert not (folder / "was run").exists()


def test_other_mistakes_are_one_sentence(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(folder, state())
    refused(capsys, "import", "absent.pt", "--out", "a.safetensors", *STATISTICS)
    refused(capsys, "import", "model000200000.pt", "--out", "a.pt", *STATISTICS)
    refused(capsys, "import", "model000200000.pt", "--out", "absent/a.safetensors", *STATISTICS)
    refused(capsys, "import", "Mean.npy", "--out", "a.safetensors", *STATISTICS)
    refused(capsys, "weights", "absent")
    refused(capsys, "weights", "model000200000.pt")


def test_a_card_is_printed_and_shipped_weights_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    save_prior(tiny.prior(), "tiny.safetensors")
    assert main(["weights", "tiny.safetensors"]) == 0
    said = capsys.readouterr().out
    assert all(word in said for word in ("tiny", "do what you like", "random numbers", "minilm", "263", "cosine"))
    assert main(["weights", "--json"]) == 0
    assert isinstance(json.loads(capsys.readouterr().out), list)
