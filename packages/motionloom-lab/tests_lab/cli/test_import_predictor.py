"""import and weights with HumanMAC checkpoints, as a stranger types them."""

import json
from pathlib import Path

import pytest
import torch

from motionloom.cli import main
from motionloom.core.models.predictor import Predictor
from tests_lab.papers.test_humanmac_checkpoint import checkpoint
from tests_lab.papers.test_mdm import Bomb

START = ["import", "ckpt_ema_550.pt", "--out", "a.safetensors"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in a folder of its own that holds a checkpoint."""
    monkeypatch.chdir(tmp_path)
    checkpoint(tmp_path)
    return tmp_path


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The one sentence on stderr; nothing is written."""
    before = sorted(Path().rglob("*"))
    assert main(list(words)) == 2
    output = capsys.readouterr()
    assert (output.out, output.err.count("\n")) == ("", 1)
    assert "Traceback" not in output.err
    assert sorted(Path().rglob("*")) == before
    return output.err


@pytest.mark.parametrize("half", [[], ["--half"]], ids=["whole", "half"])
def test_a_checkpoint_becomes_a_predictor_that_says_what_it_is(
    capsys: pytest.CaptureFixture[str], half: list[str]
) -> None:
    assert main([*START, "--licence", "research only", "--name", "humanmac", *half]) == 0
    assert capsys.readouterr().err == ""
    predictor = Predictor.load("a.safetensors")
    assert (predictor.variant, predictor.observed, predictor.frames, predictor.card.name) == (
        "published",
        25,
        125,
        "humanmac",
    )
    assert main(["weights", "a.safetensors"]) == 0
    output = capsys.readouterr().out
    assert all(
        word in output for word in ("research only", "Human3.6M", "17 joints", "100 frames after 25", "published")
    )
    assert main(["weights", "a.safetensors", "--json"]) == 0
    about = json.loads(capsys.readouterr().out)
    assert (about["frames_per_second"], about["frames"]) == (50, {"observed": 25, "predicted": 100})
    assert about["sizes"] == {"layers": 2, "width": 16, "heads": 8, "frequencies": 20}


def test_mistakes_are_one_sentence(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "metres" in refused(capsys, *START, "--mean", "Mean.npy", "--std", "Std.npy")
    assert "finest.tar" in refused(capsys, *START, "--glove", ".")
    assert "suffix" in refused(capsys, "import", "ckpt_ema_550.pt", "--out", "a.pt")
    state = torch.load("ckpt_ema_550.pt", weights_only=True)
    torch.save(state | {"out.weight": torch.zeros(63, 16)}, "amass.pt")
    assert "48 channels" in refused(capsys, "import", "amass.pt", "--out", "a.safetensors")
    torch.save({key: value for key, value in state.items() if key != "out.bias"}, "part.pt")
    assert "out.bias" in refused(capsys, "import", "part.pt", "--out", "a.safetensors")
    torch.save(state | {"x": Bomb(folder / "was run")}, "code.pt")
    assert "not opened" in refused(capsys, "import", "code.pt", "--out", "a.safetensors")
    assert not (folder / "was run").exists()
