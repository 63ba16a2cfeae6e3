"""`motionloom weights convert`: older files get graphs, and nothing else in them changes."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from safetensors import safe_open

from motionloom.cli import main
from motionloom.core.errors import MotionloomError
from motionloom.core.files.tensors import save_tensors
from motionloom.core.models.container import read_tensors, split_graphs, weights_digest
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.predictor import Predictor, save_predictor
from motionloom.core.models.prior import Prior, save_prior
from motionloom_train.convert import convert
from tests.recorded import tiny
from tests.recorded.tiny_predictor import predictor
from tests_lab.nets.test_pair import block_of


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def without_graphs(path: Path) -> Path:
    """The same file as an older version wrote it."""
    tensors, head = read_tensors(path)
    return save_tensors(split_graphs(tensors)[0], path.with_name(f"old-{path.name}"), metadata=head)


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The one sentence; nothing is written."""
    before = sorted(Path().rglob("*"))
    assert main(list(words)) == 2
    message = capsys.readouterr()
    assert (message.out, message.err.count("\n")) == ("", 1)
    assert sorted(Path().rglob("*")) == before
    return message.err


def test_an_old_prior_is_refused_and_the_command_it_names_makes_it_run(capsys: pytest.CaptureFixture[str]) -> None:
    new = save_prior(tiny.prior(), Path("tiny.safetensors"))
    old = without_graphs(new)
    message = refused(capsys, "generate", "a person walks", "--weights", str(old), "--out", "a.bvh")
    assert f"motionloom weights convert {old} NEW.safetensors" in message
    assert main(["weights", "convert", str(old), "again.safetensors"]) == 0
    assert capsys.readouterr().out == "wrote again.safetensors\n"
    assert Path("again.safetensors").read_bytes() == new.read_bytes()
    assert weights_digest(old) == weights_digest(new)
    x, prior = np.ones((1, 9, 263), np.float32), Prior.load("again.safetensors")
    target = Prior.load(new)
    answers = [one.net(x, 3, one.net.bind(one.condition(["walks"]))) for one in (prior, target)]
    np.testing.assert_array_equal(*answers)


def test_predictors_and_blocks_are_converted_too() -> None:
    new = save_predictor(predictor(), Path("predictor.safetensors"))
    assert convert(without_graphs(new), Path("p.safetensors")).read_bytes() == new.read_bytes()
    assert Predictor.load("p.safetensors").variant == "masked"
    block, prior = block_of("modulated")
    base = save_prior(prior, Path("base.safetensors"))  # type: ignore[arg-type]
    path = block.save("block.safetensors")
    old = without_graphs(path)
    with pytest.raises(MotionloomError, match="has no graphs"):
        PairBlock.load(old, prior)  # type: ignore[arg-type]
    assert convert(old, Path("b.safetensors"), prior=base).read_bytes() == path.read_bytes()
    assert PairBlock.load("b.safetensors", prior).name == "dance"  # type: ignore[arg-type]


def test_a_file_with_graphs_is_written_the_same() -> None:
    new = save_prior(tiny.prior(), Path("tiny.safetensors"))
    assert convert(new, Path("again.safetensors")).read_bytes() == new.read_bytes()


def test_what_has_no_network_or_cannot_be_read_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    shipped = Path(__file__).parents[4] / "packages" / "motionloom" / "src" / "motionloom" / "weights"
    adapter = shipped / "control" / "any.safetensors"
    assert "an adapter, which has no network of its own" in refused(
        capsys, "weights", "convert", str(adapter), "a.safetensors"
    )
    Path("words.safetensors").write_text("no weights")
    assert "not a whole safetensors file" in refused(capsys, "weights", "convert", "words.safetensors", "a.safetensors")
    save_tensors({"a": np.zeros(1)}, Path("other.safetensors"), metadata={"x": "y"})
    assert "no weight file of motionloom" in refused(capsys, "weights", "convert", "other.safetensors", "a.safetensors")
    assert "there is no file none.safetensors" in refused(
        capsys, "weights", "convert", "none.safetensors", "a.safetensors"
    )
    assert "OLD NEW" in refused(capsys, "weights", "convert", "other.safetensors")
    assert "another suffix" in refused(capsys, "weights", "convert", "other.safetensors", "a.pt")
    assert "one weight file at a time" in refused(capsys, "weights", "a", "b")


def test_a_damaged_prior_is_refused_in_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    tensors, head = read_tensors(save_prior(tiny.prior(), Path("tiny.safetensors")))
    about = json.loads(head["motionloom"])
    changes = (
        ({**tensors, "net.out.bias": np.zeros(3, np.float16)}, about),
        ({key: value for key, value in tensors.items() if "hidden_in" not in key}, about),
        (tensors, about | {"net": about["net"] | {"layers": 3}}),
        (tensors, about | {"net": 3}),
    )
    for number, (changed, message) in enumerate(changes):
        path = Path(f"bad{number}.safetensors")
        save_tensors(changed, path, metadata={"motionloom": json.dumps(message)})
        refused(capsys, "weights", "convert", str(path), "a.safetensors")


def test_without_the_training_package_one_sentence_names_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    old = without_graphs(save_prior(tiny.prior(), Path("tiny.safetensors")))
    monkeypatch.setitem(sys.modules, "motionloom_train.convert", None)
    message = refused(capsys, "weights", "convert", str(old), "new.safetensors")
    assert "this command needs motionloom_train, which is not installed" in message


def test_reading_and_writing_one_file_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    new = save_prior(tiny.prior(), Path("tiny.safetensors"))
    before = new.read_bytes()
    assert "is read and would be written over" in refused(capsys, "weights", "convert", str(new), str(new))
    assert new.read_bytes() == before
    with safe_open(new, framework="np") as file:
        assert "graph.prior" in file.keys()  # noqa: SIM118
