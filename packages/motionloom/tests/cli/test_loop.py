"""`--loop` of the commands that draw: the motion's first frame can follow its last one."""

from pathlib import Path

import numpy as np
import pytest

from motionloom import Prior, io
from motionloom.cli import main
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.models.predictor import save_predictor
from motionloom.core.motion import Motion
from tests.cli.predict.clips import tiny_predictor
from tests.cli.said import complaint
from tests.tasks.test_edit import person
from tests.tasks.two_people import block

TINY = ("--steps", "2", "--no-foot-lock", "--seed", "3")
SCRIPT = """
seconds: 3
commands: [{at: 0, say: a person walks}, {at: 1.5, say: a person turns}]
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    save_bvh(person(2.0, 20.0), "walk.bvh")
    return tmp_path


@pytest.mark.parametrize(
    "words",
    [
        ("generate", "a person walks", "--seconds", "3"),
        ("compose", "a person walks", "a person turns", "--seconds", "2"),
        ("control", "a person walks", "--follow", "left_wrist", "--from", "walk.bvh"),
    ],
)
def test_a_looped_motion_is_the_same_but_for_its_end(weights: str, words: tuple[str, ...]) -> None:
    """The last half second is generated anew, towards the first frame."""
    line = [*words, "--weights", weights, *TINY]
    assert main([*line, "--out", "plain.npz"]) == 0
    assert main([*line, "--out", "loop.npz", "--loop", "--blend", "0.5"]) == 0
    plain, loop = io.load("plain.npz"), io.load("loop.npz")
    check_looped(loop, plain, 10)


def check_looped(loop: Motion, plain: Motion, blend: int) -> None:
    """The last ``blend`` frames alone are generated anew; that they lead to the first is tested where edits are."""
    assert len(loop) == len(plain)
    np.testing.assert_array_equal(loop.rotations[:-blend], plain.rotations[:-blend])
    np.testing.assert_array_equal(loop.root[:-blend], plain.root[:-blend])

    changed = np.abs(loop.rotations[-blend:] - plain.rotations[-blend:]).max(axis=(1, 2))
    assert (changed > 1e-3).all(), "the last frames are those of the motion without --loop"


@pytest.fixture(scope="module")
def predictor(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(save_predictor(tiny_predictor(), tmp_path_factory.mktemp("weights") / "predictor.safetensors"))


@pytest.mark.parametrize("words", [("predict", "walk.bvh", "--seconds", "1.5"), ("switch", "walk.bvh", "bow.bvh")])
def test_a_future_and_a_switch_loop_too(weights: str, predictor: str, words: tuple[str, ...]) -> None:
    """Of several each, behind a past that stays as it is; the words' prior draws what the predictor cannot."""
    bent = person(2.0, 20.0)
    turns = bent.rotations.copy()
    turns[:, 3:10] = np.roll(turns[:, 3:10], 1, axis=-1)
    save_bvh(Motion(bent.skeleton, bent.fps, bent.root, turns), "bow.bvh")
    line = [*words, "--weights", predictor, *TINY, "--count", "2"]
    assert main([*line, "--out", "plain.npz"]) == 0
    assert main([*line, "--out", "loop.npz", "--loop", "--blend", "0.5", "--loop-weights", weights]) == 0
    for number in (0, 1):
        check_looped(io.load(f"loop_{number}.npz"), io.load(f"plain_{number}.npz"), 10)


@pytest.mark.parametrize("people", [1, 2])
def test_a_session_of_a_script_loops_too(weights: str, people: int) -> None:
    Path("script.yaml").write_text(f"people: {people}{SCRIPT}")
    path = block(Prior.load(weights)).save("block.safetensors")
    line = ["live", "script.yaml", "--weights", weights, "--pair-weights", str(path), *TINY[:2], "--seed", "3"]
    names = ("a.npz", "b.npz")[:people]
    for folder, options in (("plain", []), ("loop", ["--loop", "--blend", "0.5"])):
        Path(folder).mkdir()
        assert main([*line, *(word for name in names for word in ("--out", f"{folder}/{name}")), *options]) == 0
    for name in names:
        check_looped(io.load(f"loop/{name}"), io.load(f"plain/{name}"), 10)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["predict", "walk.bvh", "--seconds", "0.5"], "but only 0.5 s come after walk.bvh"),
        (["predict", "walk.bvh", "--seconds", "31"], "motionloom edit FILE --loop"),
        (["predict", "walk.bvh", "--no-root"], "give one of them"),
        (["predict", "walk.bvh", "--loop-weights", "none.safetensors"], "none.safetensors"),
        (["switch", "walk.bvh", "walk.bvh", "--blend", "9"], "but only 3 s come after walk.bvh"),
        (["live", "script.yaml", "--blend", "2.9"], "a loop of a clip of 3.00 s"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_has_no_room_for_a_loop_is_refused(
    predictor: str, words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("script.yaml").write_text(SCRIPT)
    assert main([*words, "--weights", predictor, "--loop", "--out", "out.npz"]) == 2
    assert message in complaint(capsys)
    assert not Path("out.npz").exists()


def test_a_loop_that_does_not_fit_is_refused_before_anything_is_drawn(
    weights: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for words in (["generate", "a person walks"], ["compose", "a person walks"]):
        line = [*words, "--seconds", "1", "--weights", weights, *TINY, "--loop", "--out", "out.bvh"]
        assert main(line) == 2
        assert "a loop of a clip of" in complaint(capsys)
    assert not Path("out.bvh").exists()
