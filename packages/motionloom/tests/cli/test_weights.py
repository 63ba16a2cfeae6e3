"""weights, as a stranger types it."""

import json
from pathlib import Path

import pytest

from motionloom.cli import main
from motionloom.core.models.predictor import save_predictor
from motionloom.core.models.prior import save_prior
from tests.recorded import tiny, tiny_predictor
from tests.tasks.two_people import block


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The one sentence on stderr; nothing is written."""
    before = sorted(Path().rglob("*"))
    assert main(list(words)) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.count("\n") == 1
    assert "Traceback" not in output.err
    assert sorted(Path().rglob("*")) == before
    return output.err


def test_damaged_blocks_are_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    path = block(tiny.prior()).save("b.safetensors")
    path.write_bytes(path.read_bytes()[:-5])
    refused(capsys, "weights", "b.safetensors")


def test_all_kinds_of_shipped_weights_are_listed_and_found_by_name(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {
        "shipped": {"one": save_prior(tiny.prior(), "1.safetensors")},
        "shipped_predictors": {"two": save_predictor(tiny_predictor.predictor(), "2.safetensors")},
        "blocks": {"three": block(tiny.prior()).save("3.safetensors")},
    }
    for function, paths in files.items():
        monkeypatch.setattr(f"motionloom.cli.weights.{function}", lambda paths=paths: paths)
    assert main(["weights", "--json"]) == 0
    listed = {about["name"]: about["kind"] for about in json.loads(capsys.readouterr().out)}
    assert listed == {"one": "prior", "two": "predictor", "three": "two-person block"}
    assert main(["weights"]) == 0
    assert capsys.readouterr().out.count(" MB ") == 3
    for name, kind in listed.items():
        assert main(["weights", name, "--json"]) == 0
        about = json.loads(capsys.readouterr().out)
        assert (about["name"], about["kind"]) == (name, kind)


def test_a_card_is_printed_and_shipped_weights_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    save_prior(tiny.prior(), "tiny.safetensors")
    assert main(["weights", "tiny.safetensors"]) == 0
    output = capsys.readouterr().out
    assert all(word in output for word in ("tiny", "do what you like", "random numbers", "minilm", "263", "cosine"))
    assert main(["weights", "--json"]) == 0
    assert isinstance(json.loads(capsys.readouterr().out), list)


@pytest.mark.parametrize("content", [b"PK\3\4" + bytes(60), b"x" * 100], ids=["zip", "text"])
def test_what_is_no_weight_file_is_one_sentence(content: bytes, capsys: pytest.CaptureFixture[str]) -> None:
    Path("model.pt").write_bytes(content)
    refused(capsys, "weights", "absent")
    refused(capsys, "weights", "model.pt")
