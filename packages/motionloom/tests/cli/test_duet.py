"""duet, as a stranger types it, on a tiny prior and a block with random weights."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import main
from motionloom.core.models.networks.text.known import known_sentences
from motionloom.core.models.prior import save_prior
from motionloom.requests.sampling import PairSampling
from motionloom.tasks import pair
from tests.io.motions import largest_distance
from tests.recorded import tiny
from tests.tasks.two_people import block, walkers


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with weights, a block, and two people's motions."""
    folder = tmp_path_factory.mktemp("files")
    prior = tiny.prior()
    save_prior(prior, folder / "tiny.safetensors", half=False)
    block(prior).save(folder / "block.safetensors", half=False)
    save_prior(tiny.prior(seed=1), folder / "other.safetensors", half=False)
    for name, motion in zip("ab", walkers(1.2), strict=True):
        io.save(motion, folder / f"{name}.bvh")
    io.save(walkers(1.0)[1], folder / "short.bvh")
    io.save(walkers(1.2)[1].resample(40), folder / "fast.bvh")
    io.save(replace(walkers(2.0)[0], fps=10.0), folder / "slow.bvh")
    return folder


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in an empty folder of its own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def duet(files: Path, *words: str, weights: str = "tiny", block: str = "block") -> int:
    own = [str(files / word[1:]) if word.startswith("@") else word for word in words]
    block_words = [] if "--pair-weights" in words else ["--pair-weights", str(files / f"{block}.safetensors")]
    return main(["duet", *own, *block_words, "--weights", str(files / f"{weights}.safetensors"), "--steps", "2"])


def file_names() -> set[str]:
    return {path.name for path in Path().iterdir()}


def test_both_people_are_in_one_scene_and_in_a_file_each_of_the_same_world(files: Path) -> None:
    outs = [word for name in ("d.glb", "a.npz", "b.npz") for word in ("--out", name)]
    assert duet(files, "two people walk", "--seconds", "0.6", "--no-foot-lock", "--seed", "2", *outs) == 0
    assert file_names() == {"d.glb", "a.npz", "b.npz"}
    scene = io.load_scene("d.glb")
    assert [len(motion) for motion in scene] == [12, 12]
    for motion, name in zip(scene, "ab", strict=True):
        assert largest_distance(motion, io.load(f"{name}.npz")) < 1e-3


def test_several_duets_are_numbered(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        duet(files, "a person walks :: a person turns", "--seconds", "0.5", "--count", "2", "--no-foot-lock", "--json")
        == 0
    )
    assert file_names() == {"duet_0.glb", "duet_1.glb"}
    about = json.loads(capsys.readouterr().out)
    assert about["files"] == ["duet_0.glb", "duet_1.glb"]
    assert (about["duets"], about["seconds"]) == (2, 0.5)


def test_a_past_is_the_beginning_of_what_is_written(files: Path) -> None:
    assert duet(files, "--past", "@a.bvh", "@b.bvh", "--seconds", "0.4", "--out", "c.bvh", "--out", "d.bvh") == 0
    for old, new in (("a", "c"), ("b", "d")):
        before, after = io.load(files / f"{old}.bvh"), io.load(f"{new}.bvh")
        assert after.skeleton.names == before.skeleton.names
        assert len(after) == len(before) + round(0.4 * before.fps)
        np.testing.assert_allclose(after.frames(0, len(before)).positions(), before.positions(), atol=1e-4)


def test_whoever_is_given_is_the_first(files: Path) -> None:
    assert (
        duet(files, "--react-to", "@a.bvh", "two people walk", "--out", "c.npz", "--out", "d.npz", "--no-foot-lock")
        == 0
    )
    assert largest_distance(io.load("c.npz"), io.load(files / "a.bvh")) < 1e-6
    assert len(io.load("d.npz")) == len(io.load("c.npz"))


def test_a_path_in_a_file_is_walked_by_the_person_it_is_for(files: Path) -> None:
    Path("path.yaml").write_text("points: [[1, 2], [1, 4]]\n", encoding="utf-8")
    words = ("two people walk", "--path", "path.yaml", "--person", "2", "--seconds", "2", "--no-foot-lock")
    assert duet(files, *words, "--out", "a.npz", "--out", "b.npz") == 0
    root = io.load("b.npz").root
    assert np.linalg.norm(root[0, [0, 2]] - [1, 2]) < 0.05
    assert np.linalg.norm(root[-1, [0, 2]] - [1, 4]) < 0.3


def test_each_of_the_two_has_a_path(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.yaml").write_text("points: [[1, 2], [1, 4]]\n", encoding="utf-8")
    Path("b.yaml").write_text("points: [[3, 2], [3, 4]]\n", encoding="utf-8")
    words = ("two people walk", "--path", "a.yaml", "--path", "b.yaml", "--seconds", "2", "--no-foot-lock")
    assert duet(files, *words, "--out", "a.npz", "--out", "b.npz") == 0
    for name, x in (("a.npz", 1), ("b.npz", 3)):
        root = io.load(name).root
        assert np.linalg.norm(root[0, [0, 2]] - [x, 2]) < 0.05
        assert np.linalg.norm(root[-1, [0, 2]] - [x, 4]) < 0.3
    assert duet(files, *words, "--path", "a.yaml", "--out", "d.glb") == 2
    assert "--path is given 3 times" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "remark"),
    [
        ("one person bows and the other waves", "read as: 'a person bows :: a person waves'"),
        ("two people shake hands", "read as: the two shake hands, facing each other, for 1.2 s"),
        ("two people walk", ""),
    ],
)
def test_how_the_words_are_read_is_said(
    files: Path, capsys: pytest.CaptureFixture[str], words: str, remark: str
) -> None:
    assert duet(files, words, "--seconds", "0.5", "--out", "d.glb") == 0
    errors = capsys.readouterr().err
    assert remark in errors
    assert bool(remark) == ("read as" in errors)


def test_words_that_no_pair_was_called_are_remarked_on(
    files: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # to the tiny encoder all texts are alike
    monkeypatch.setattr("motionloom.core.models.networks.text.known.SAME", 0.999)
    monkeypatch.setattr("motionloom.core.models.networks.text.known.NEAR", 1.1)
    prior = tiny.prior()
    known = known_sentences(["dance salsa together"], {}, prior.text)
    replace(block(prior), known=known).save(files / "dancers.safetensors", half=False)
    assert duet(files, "two people dance salsa together", "--seconds", "0.5", "--out", "a.glb", block="dancers") == 0
    assert "of two people" not in capsys.readouterr().err
    assert duet(files, "two people fix a car", "--seconds", "0.5", "--out", "b.glb", block="dancers") == 0
    errors = capsys.readouterr().err
    assert "of two people these weights have seen nothing like 'fix a car'; nearest: 'dance salsa together'" in errors


def test_a_timeline_is_one_duet_of_all_its_segments(files: Path) -> None:
    Path("t.yaml").write_text(
        "seed: 3\nsegments:\n  - {text: two people walk, seconds: 1}\n  - {text: 'a :: b', seconds: 1.5}\n",
        encoding="utf-8",
    )
    assert duet(files, "--timeline", "t.yaml", "--no-foot-lock", "--out", "a.npz", "--out", "b.npz") == 0
    assert [len(io.load(f"{name}.npz")) for name in "ab"] == [50, 50]


LED = {
    "a text": ("two people walk", "--seconds", "3.5"),
    "somebody given": ("--react-to", "@slow.bvh"),
    "a timeline": ("--timeline", "t.yaml"),
}
"""Long enough that the two are led."""


@pytest.mark.parametrize("name", sorted(LED))
def test_how_firmly_the_two_stay_together_changes_what_is_drawn(files: Path, name: str) -> None:
    """From one seed the second person goes elsewhere with 0 than with 1, which is what is done unless told."""
    Path("t.yaml").write_text("segments:\n  - {text: two people walk, seconds: 3.5}\n", encoding="utf-8")
    motions = []
    for words in (("--pair-guidance", "0"), ("--pair-guidance", "1"), ()):
        assert duet(files, *LED[name], *words, "--no-foot-lock", "--out", "a.npz", "--out", "b.npz") == 0
        motions.append(io.load("b.npz").root)
    free, firm, untold = motions
    assert np.abs(free - firm).max() > 1e-2
    np.testing.assert_array_equal(firm, untold)


def test_how_firmly_the_two_stay_together_is_asked_behind_a_past_too(files: Path, monkeypatch) -> None:
    calls = []

    def complete(*_, sampling: PairSampling, **__):
        calls.append(sampling.pair_guidance)
        return [walkers(1.0)]

    monkeypatch.setattr(pair, "complete_pair", complete)
    assert duet(files, "--past", "@a.bvh", "@b.bvh", "--pair-guidance", "0.25") == 0
    assert calls == [0.25]


WRONG = {
    "no words": ((), "no prompt"),
    "an empty prompt": (("",), "prompt is empty"),
    "half of two prompts": (("a ::",), "around one ::"),
    "one file for two": (("walk", "--out", "a.bvh"), "one person"),
    "an unknown kind of file": (("walk", "--out", "a.txt"), "must end in"),
    "the same file twice": (("walk", "--out", "a.bvh", "--out", "./a.bvh"), "twice"),
    "no time": (("walk", "--seconds", "0"), "--seconds"),
    "no number of seconds": (("walk", "--seconds", "nan"), "--seconds"),
    "too much time": (("walk", "--seconds", "61"), "at most 60"),
    "no duets": (("walk", "--count", "0"), "--count"),
    "more than together": (("walk", "--pair-guidance", "1.5"), "--pair-guidance must be 0 to 1; got 1.5"),
    "no share": (("walk", "--pair-guidance", "nan"), "--pair-guidance must be 0 to 1; got nan"),
    "less than apart in a timeline": (("--timeline", "t.yaml", "--pair-guidance", "-0.1"), "must be 0 to 1; got -0.1"),
    "a block that is not there": (("walk", "--pair-weights", "nobody"), "no two-person block"),
    "a past that is not there": (("--past", "@a.bvh", "no.bvh"), "no.bvh"),
    "one person as both": (("--past", "@a.bvh", "@a.bvh"), "named twice"),
    "pasts of other lengths": (("--past", "@a.bvh", "@short.bvh"), "lengths differ"),
    "pasts of other rates": (("--past", "@a.bvh", "@fast.bvh"), "rates differ"),
    "two tasks": (("--past", "@a.bvh", "@b.bvh", "--react-to", "@a.bvh"), "give one of them"),
    "the length of somebody given": (("--react-to", "@a.bvh", "--seconds", "2"), "--seconds"),
    "a path for a past": (("--past", "@a.bvh", "@b.bvh", "--path", "p.yaml"), "--path"),
    "no such path": (("walk", "--path", "p.yaml"), "p.yaml"),
}


@pytest.mark.parametrize("name", sorted(WRONG))
def test_a_mistake_is_one_sentence_and_leaves_nothing_behind(
    files: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    words, message = WRONG[name]
    assert duet(files, *words) == 2
    errors = capsys.readouterr().err.strip()
    assert message in errors
    assert len(errors.splitlines()) == 1
    assert file_names() == set()


def test_one_past_is_too_few(files: Path) -> None:
    with pytest.raises(SystemExit) as end:
        duet(files, "--past", "@a.bvh")
    assert end.value.code == 2


def test_a_block_of_other_weights_is_refused(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert duet(files, "two people walk", weights="other") == 2
    assert "belongs to the weights" in capsys.readouterr().err
    assert file_names() == set()


LINES = {
    "a key that is none": ("segments:\n  - walk\nsed: 3\n", "line 3"),
    "a text for one of two": ("segments:\n  - walk\n  - 'turn ::'\n", "line 3"),
    "a beginning": ("segments:\n  - walk\nstart: a.bvh\n", "line 3"),
    "an hour and more": ("segments:\n" + 70 * "  - {text: walk, seconds: 60}\n", "line 1"),
}


@pytest.mark.parametrize("name", sorted(LINES))
def test_a_wrong_timeline_is_reported_with_its_line(files: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    text, place = LINES[name]
    Path("t.yaml").write_text(text, encoding="utf-8")
    Path("a.bvh").write_bytes((files / "a.bvh").read_bytes())
    assert duet(files, "--timeline", "t.yaml") == 2
    errors = capsys.readouterr().err.strip()
    assert "t.yaml" in errors
    assert place in errors
    assert len(errors.splitlines()) == 1
    assert file_names() == {"t.yaml", "a.bvh"}


def test_bodies_that_are_in_each_other_are_measured_and_told(
    files: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    person = walkers(1.0)[0]
    aside = replace(person, root=person.root + np.array([3.0, 0.0, 0.0]))
    monkeypatch.setattr(pair, "generate_pair", lambda *_, **__: [(person, person), (person, aside)])
    words = "two people walk", "--count", "2", "--out", "d.glb"
    assert duet(files, *words, "--json") == 0
    output = capsys.readouterr()
    report = json.loads(output.out)
    inside, apart = report["measures"]
    assert inside["least_trunk_distance"] == 0
    assert inside["overlapping_frames"] == len(person)
    assert inside["deepest_overlap"] > 0.15
    assert apart["deepest_overlap"] == apart["overlapping_frames"] == 0
    assert apart["least_trunk_distance"] > 2
    assert len(report["remarks"]) == 1
    assert report["remarks"][0] == (
        f"duet 1: the two bodies overlap by up to {100 * inside['deepest_overlap']:.0f} cm; frames: {len(person)}"
    )
    assert report["remarks"][0] in output.err
