"""Unit, frame rate and what is there already, in every command that writes motions."""

from pathlib import Path

import pytest

from motionloom.cli import main
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.models.predictor import save_predictor
from motionloom.core.models.prior import save_prior
from motionloom.io.bvh import read_bvh
from tests.cli.predict.clips import tiny_predictor
from tests.cli.said import complaint
from tests.recorded import tiny
from tests.tasks.test_edit import person
from tests.tasks.two_people import block

COMMANDS = {
    "generate": ("generate", "a person walks", "--seconds", "1"),
    "compose": ("compose", "a person walks", "a person turns", "--seconds", "1.5"),
    "control": ("control", "a person walks", "--follow", "left_wrist", "--from", "walk.bvh"),
    "edit": ("edit", "walk.bvh", "a person waves", "--between", "0.5", "1.5"),
    "predict": ("predict", "walk.bvh", "--seconds", "0.5", "--count", "1"),
    "predict long": ("predict", "walk.bvh", "--seconds", "31", "--count", "1"),
    "switch": ("switch", "walk.bvh", "walk.bvh", "--seconds", "0.5"),
    "duet": ("duet", "two people dance", "--seconds", "1", "--out", "other.bvh"),
    "duet given": ("duet", "waves", "--react-to", "walk.bvh", "--out", "other.bvh"),
    "export": ("export", "walk.bvh"),
}
WEIGHTS = {"predict": ("predictor",), "switch": ("predictor",), "duet": ("prior", "block"), "export": ()}
OPTION = {"predictor": "--weights", "prior": "--weights", "block": "--pair-weights"}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("weights")
    prior = tiny.prior()
    save_prior(prior, folder / "prior.safetensors", half=False)
    save_predictor(tiny_predictor(), folder / "predictor.safetensors")
    block(prior).save(folder / "block.safetensors", half=False)
    return folder


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    save_bvh(person(2.0, 30.0), "walk.bvh")
    return tmp_path


def line(name: str, files: Path) -> list[str]:
    """What is typed, on tiny weights."""
    words = list(COMMANDS[name])
    for kind in WEIGHTS.get(words[0], ("prior",)):
        words += [OPTION[kind], str(files / f"{kind}.safetensors")]
    return words if words[0] == "export" else [*words, "--steps", "2", "--no-foot-lock"]


@pytest.mark.parametrize("skeleton", [(), ("--skeleton", "mixamo")], ids=["own", "mixamo"])
@pytest.mark.parametrize("name", COMMANDS)
def test_a_bvh_is_in_the_unit_and_at_the_rate_that_are_asked(name: str, skeleton: tuple[str, ...], files: Path) -> None:
    words = [*line(name, files), "--out", "out.bvh", "--out-unit", "cm", "--fps", "24", *skeleton]
    assert main(words) == 0
    raw = read_bvh("out.bvh", unit=1.0).motion
    assert 30 < raw.skeleton.bone_lengths().max() < 60  # a shin, in centimetres
    assert raw.fps == pytest.approx(24, rel=1e-4)
    assert read_bvh("out.bvh").unit == 0.01


@pytest.mark.parametrize("name", COMMANDS)
def test_files_are_written_over_with_a_remark_and_never_those_that_are_read(
    name: str, files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("out.bvh").write_text("something of the user's")
    assert main([*line(name, files), "--out", "out.bvh"]) == 0
    assert "note: out.bvh was there and is written over" in capsys.readouterr().err
    before = Path("walk.bvh").read_bytes()
    assert main([*line(name, files), "--out", "walk.bvh", "--skeleton", "walk.bvh", "--force"]) == 2
    assert "walk.bvh is read and would be written over" in complaint(capsys)
    assert Path("walk.bvh").read_bytes() == before


@pytest.mark.parametrize("name", COMMANDS)
def test_a_unit_for_files_that_say_theirs_is_refused(
    name: str, files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [word.replace("other.bvh", "other.npz") for word in line(name, files)]
    assert main([*words, "--out", "out.npz", "--out-unit", "cm"]) == 2
    assert "for BVH files" in complaint(capsys)


def test_a_timelines_start_is_not_written_over(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("t.yaml").write_text('{"start": "walk.bvh", "segments": [{"text": "walks", "seconds": 1.5}]}')
    before = Path("walk.bvh").read_bytes()
    assert main(["compose", "t.yaml", "--out", "walk.bvh", "--weights", str(files / "prior.safetensors")]) == 2
    assert "is read and would be written over" in complaint(capsys)
    assert Path("walk.bvh").read_bytes() == before


def test_pictures_and_adapters_are_written_over_with_a_remark(capsys: pytest.CaptureFixture[str]) -> None:
    Path("walk.png").write_text("something of the user's")
    assert main(["view", "walk.bvh"]) == 0
    assert "note: walk.png was there" in capsys.readouterr().err
    assert main(["view", "walk.bvh", "--force"]) == 0
    assert capsys.readouterr().err == ""
