"""import, as a stranger types it."""

import json
import pickle
from pathlib import Path

import numpy as np
import pytest
import torch

from motionloom.cli import main
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import load_prior
from motionloom.io import load
from motionloom_lab.papers.guo import load_guo
from tests.tasks.test_text import Words
from tests_lab.nets import test_pair
from tests_lab.papers import test_guo
from tests_lab.papers.test_mdm import Bomb, state, write


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
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.count("\n") == 1
    assert "Traceback" not in output.err
    assert sorted(Path().rglob("*")) == before
    return output.err


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
    output = capsys.readouterr().out
    assert "research only" in output
    assert "humanml" in output


def test_missing_options_are_warned_of_and_babel_makes_motions(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """BABEL's weights, here with the flags of transitions: 135 numbers at 30 fps, prompts of 77 word pieces."""
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
    opened: list[int] = []

    def clip(*, length: int) -> Words:
        opened.append(length)
        return Words()

    monkeypatch.setattr("motionloom_train.nets.text.hub.ClipText.open", clip)
    arguments = ["--weights", "b.safetensors", "--seconds", "0.5", "--steps", "2", "--out", "a.bvh"]
    assert main(["generate", "walk", *arguments]) == 0
    motion = load("a.bvh")
    assert (len(motion), round(motion.fps), opened) == (15, 30, [77])


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


TWO = ["import", "model000200000.pt", "--out", "a.safetensors", *STATISTICS]


@pytest.mark.parametrize("half", [[], ["--half"]], ids=["whole", "half"])
def test_a_checkpoint_of_two_people_becomes_a_prior_and_its_block(
    folder: Path, capsys: pytest.CaptureFixture[str], half: list[str]
) -> None:
    state = test_pair.published()
    write(folder, state, {"layers": 5, "multi_func": "in_both_out_cond"})
    assert main([*TWO, "--name", "dance", "--licence", "research only", *half]) == 0
    output = capsys.readouterr().out.splitlines()
    assert [line.split()[1].strip(",") for line in output] == ["a.safetensors", "a-pair.safetensors"]
    prior = load_prior(Path("a.safetensors"))
    end = state["seqTransEncoder_end.layers.0.norm2.bias"]
    np.testing.assert_allclose(prior.net.weights["net.blocks.3.norm2.bias"], end.numpy(), atol=1e-3)
    block = PairBlock.load("a-pair.safetensors", prior)
    assert (block.name, block.base, block.licence, block.config.adds) == (
        "dance-pair",
        "dance",
        "research only",
        "condition",
    )
    np.testing.assert_allclose(block.tensors["place.weight"], state["multi_person.canon_out.weight"].numpy(), atol=1e-3)
    assert main(["weights", "a-pair.safetensors"]) == 0
    card = capsys.readouterr().out
    assert all(word in card for word in ("dance-pair", "two-person block", "research only", "3DPW", "behind 3"))
    assert main(["weights", "a-pair.safetensors", "--json"]) == 0
    about = json.loads(capsys.readouterr().out)
    assert about["belongs_to"] == {"name": "dance", "fingerprint": block.fingerprint}
    assert about["parameters"] == sum(v.numel() for k, v in state.items() if k.startswith("multi_person."))


def test_of_two_people_both_files_are_written_or_none(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    state, one = test_pair.published(), "multi_person.canon_out.weight"
    Path("a-pair.safetensors").mkdir()
    write(folder, state)
    assert "folder" in refused_after_warnings(capsys, *TWO)
    Path("a-pair.safetensors").rmdir()
    write(folder, state, {"multi_func": "in_both_out_direct"})
    assert "multi_func" in refused_after_warnings(capsys, *TWO)
    write(folder, state | {one: torch.zeros(5, 16)})
    assert "place.weight" in refused_after_warnings(capsys, *TWO)
    write(folder, state)
    assert "--mean" in refused(capsys, "import", "model000200000.pt", "--out", "a.safetensors")


def refused_after_warnings(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The last sentence on stderr; nothing is written."""
    before = sorted(Path().rglob("*"))
    assert main(list(words)) == 2
    output = capsys.readouterr()
    assert (output.out, sorted(Path().rglob("*"))) == ("", before)
    return output.err.splitlines()[-1]


EVALUATOR = ["import", "finest.tar", "--out", "guo.safetensors"]


def test_an_imported_evaluator_is_one_file_that_says_what_it_is(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The user's files from anywhere, by name."""
    (folder / "elsewhere").mkdir()
    test_guo.files(folder / "elsewhere").rename("finest.tar")
    statistics = ["--mean", "elsewhere/t2m_mean.npy", "--std", "elsewhere/t2m_std.npy"]
    words = ["--glove", "elsewhere", "--vip", "elsewhere/word_vectorizer.py"]
    assert main([*EVALUATOR, *statistics, *words, "--licence", "research only"]) == 0
    output = capsys.readouterr()
    assert output.err == ""
    assert all(word in output.out for word in ("research only", "weighs 25 times", "6 vectors", "true, with sos"))
    evaluator = load_guo("guo.safetensors")
    assert evaluator.motions([test_guo.motion(40)]).shape == (1, 9)
    assert evaluator.texts(test_guo.CAPTIONS).shape == (3, 9)


def test_an_evaluator_without_its_files_says_so(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    test_guo.files(folder).rename("alone.tar")
    for name in ("t2m_mean.npy", "our_vab_data.npy", "word_vectorizer.py"):
        Path(name).unlink()
    Path("t2m_std.npy").rename("std.npy")
    assert main(["import", "alone.tar", "--out", "guo.safetensors"]) == 0
    assert capsys.readouterr().out.count("none: ") == 2


def test_wrong_files_of_an_evaluator_are_one_sentence(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    test_guo.files(folder)
    torch.save({"movement_encoder": {}}, "parts.tar")
    Path("code.tar").write_bytes(pickle.dumps(Bomb(folder / "was run"), protocol=2))
    (folder / "bomb").mkdir()
    Path("bomb/our_vab_data.npy").write_bytes(Path("our_vab_data.npy").read_bytes())
    Path("bomb/our_vab_idx.pkl").write_bytes(Path("our_vab_idx.pkl").read_bytes())
    Path("bomb/our_vab_words.pkl").write_bytes(pickle.dumps(Bomb(folder / "was run")))
    np.save("short.npy", np.ones(9))
    assert "no checkpoint" in refused(capsys, "import", "absent.tar", "--out", "guo.safetensors")
    assert "text_encoder" in refused(capsys, "import", "parts.tar", "--out", "guo.safetensors")
    assert "not opened" in refused(capsys, "import", "code.tar", "--out", "guo.safetensors")
    assert "not opened" in refused(capsys, *EVALUATOR, "--glove", "bomb")
    assert "no lists" in refused(capsys, *EVALUATOR, "--vip", "short.npy")
    assert "there is no" in refused(capsys, *EVALUATOR, "--glove", "absent")
    assert "259 or 263" in refused(capsys, *EVALUATOR, "--mean", "short.npy", "--std", "short.npy")
    assert "absent.npy" in refused(capsys, *EVALUATOR, "--mean", "absent.npy")
    assert "float32" in refused(capsys, *EVALUATOR, "--half")
    assert "suffix" in refused(capsys, "import", "finest.tar", "--out", "guo.tar")
    assert not (folder / "was run").exists()
    Path("t2m_mean.npy").unlink()
    assert "together" in refused(capsys, *EVALUATOR)


def test_word_files_with_another_checkpoint_are_reported(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(folder, state())
    start = ["import", "model000200000.pt", "--out", "a.safetensors", *STATISTICS]
    assert "finest.tar" in refused(capsys, *start, "--glove", ".")
    assert "finest.tar" in refused(capsys, *start, "--vip", "a.py")
