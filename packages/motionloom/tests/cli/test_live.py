"""`motionloom live`: a script becomes files; what is wrong with it is said before anything is made."""

import json
from pathlib import Path

import pytest

from motionloom import Prior, load, save_prior
from motionloom.cli import main
from tests.live import people
from tests.tasks.two_people import block

SCRIPT = "seconds: 1.2\nseed: 2\ncommands:\n- {at: 0, say: a person walks}\n- {at: 0.6, steer: {direction: 90}}\n"


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(save_prior(people.prior(), tmp_path_factory.mktemp("weights") / "tiny.safetensors"))


def test_a_script_becomes_a_motion_and_a_picture(weights: str, tmp_path: Path, capsys) -> None:
    script = tmp_path / "a.yaml"
    script.write_text(SCRIPT)
    outs = [str(tmp_path / name) for name in ("a.bvh", "b.npz", "c.png")]
    words = [part for out in outs for part in ("--out", out)]
    assert main(["live", str(script), "--weights", weights, "--steps", "2", "--fps", "30", "--json", *words]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["frames"], report["files"], report["calls"]) == (36, outs, 4)
    assert (load(outs[0]).fps, len(load(outs[1]))) == (pytest.approx(30, abs=1e-3), 36)


def test_two_people_become_a_file_each_and_one_picture(weights: str, tmp_path: Path, capsys) -> None:
    script = tmp_path / "a.yaml"
    script.write_text("people: 2\n" + SCRIPT + "- {at: 0.3, person: 2, say: a person waves}\n")
    prior = Prior.load(weights)
    path = block(prior).save(tmp_path / "block.safetensors")
    common = ["live", str(script), "--weights", weights, "--pair-weights", str(path), "--steps", "2"]
    outs = [str(tmp_path / name) for name in ("a.bvh", "b.bvh", "c.png")]
    assert main([*common, "--json", *(word for out in outs for word in ("--out", out))]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == outs
    assert [len(load(out)) for out in outs[:2]] == [24, 24]
    assert main([*common, "--out", str(tmp_path / "alone.bvh")]) == 2
    assert "holds one person" in capsys.readouterr().err


def test_a_check_makes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.yaml").write_text(SCRIPT)
    assert main(["live", "a.yaml", "--check"]) == 0
    assert "2 commands in 1.20 s; nothing was made" in capsys.readouterr().out
    assert [path.name for path in tmp_path.iterdir()] == ["a.yaml"]


@pytest.mark.parametrize(
    "words",
    [["--steps", "0"], ["--fps", "500"], ["--out", "a.yaml"], ["--seed", "-1"], ["--weights", "none.safetensors"]],
)
def test_mistakes_end_with_one_sentence_and_2(words: list[str], tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.yaml").write_text(SCRIPT)
    assert main(["live", "a.yaml", *words]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["a.yaml"]
