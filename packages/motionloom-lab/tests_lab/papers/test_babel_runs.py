"""BABEL from made label files to Table 1: the set, priors with flags and geometric losses, evaluator and report."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionloom.cli import main
from motionloom.core.errors import MotionloomError
from motionloom.core.features.representation import BABEL, HUMANML3D
from motionloom.core.models.prior import load_prior, save_prior
from motionloom_lab.evaluator.evaluators import Caption, load_evaluator
from motionloom_lab.papers import babel
from motionloom_lab.report import report
from motionloom_lab.suites import transitions
from motionloom_lab.suites.harness import Run
from motionloom_lab.suites.protocol import Selection, Transitions
from motionloom_train.data.batches import Batches
from motionloom_train.data.clips import read_clip
from motionloom_train.data.sets import load_set
from tests.recorded import tiny
from tests_lab.papers.test_babel import amass, entry, label
from tests_train import runs

ROOT = Path(__file__).parents[4]
NET = ["net.width=32", "net.layers=1", "net.heads=2", "net.hidden=32", "net.dropout=0.0"]
SMALL = ["steps=2", "batch=4", "levels=20", "windows=[64]", "shares=[1.0]", *NET]
JUDGE = ["steps=2", "batch=4", "net.width=32", "net.layers=1", "net.heads=2", "net.hidden=32"]
MEASURE = ["--steps", "2", "--intervals", "4", "--unfoldings", "1", "--replications", "1"]


def write_babel(root: Path) -> Path:
    """A folder of BABEL's form: two recordings to train on, six to measure with, of two labels and a transition."""
    for split, count in (("train", 2), ("val", 6)):
        entries = {}
        for k in range(count):
            place, second = f"CMU/CMU/{split}/{k}_poses.npz", ("jump", "turn left", "sit")[k % 3]
            parts = [label("walk", 0, 3), label("transition", 3, 4), label(second, 4, 8)]
            entries[f"{split}{k}"] = entry(parts, place)
            amass(root / "amass" / place, speed=0.5 + 0.1 * k, frames=960)
        (root / f"{split}.json").write_text(json.dumps(entries))
    return root


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the set, a text encoder, two priors and an evaluator, by the commands."""
    out = tmp_path_factory.mktemp("babel")
    folder = out / "babel"
    folder.mkdir()
    assert main(["data", "build", str(write_babel(folder)), "--features", "babel", "--out", str(out / "set")]) == 0
    save_prior(tiny.prior(), out / "words.safetensors")
    shared = ["--data", str(out / "set"), "--text", str(out / "words.safetensors"), "--device", "cpu", "--set"]
    text = f"net.text={tiny.WIDTH}"
    for name, more in (("plain", []), ("both", ["net.flags=true", "geometric=1.0"])):
        words = ["--recipe", str(ROOT / "recipes/babel.toml"), "--out", str(out / name), *shared, *SMALL]
        assert main(["train", "prior", *words, text, f"name={name}", *more]) == 0
    return out


@pytest.fixture(scope="module")
def judge(made: Path) -> Path:
    words = ["--recipe", str(ROOT / "recipes/babel_evaluator.toml"), "--data", str(made / "set"), "--device", "cpu"]
    assert main(["train", "evaluator", *words, "--out", str(made / "judge"), "--set", "name=judge", *JUDGE]) == 0
    return made / "judge" / "judge.safetensors"


def test_a_built_set_holds_the_items_of_both_splits_with_their_flags(made: Path) -> None:
    """As `load_items` gives them: four of each recording, of which two end or begin with its second of transition."""
    expected = [item for split in babel.SPLITS for item in babel.load_items(made / "babel", split, crop=True)]
    clips = {path.stem: read_clip(path) for path in (made / "set" / "clips").iterdir()}
    assert set(clips) == {item.name for item in expected}
    for item in expected:
        clip = clips[item.name]
        assert clip.representation is BABEL
        assert np.array_equal(clip.features, item.features)
        assert clip.flags is not None
        assert np.array_equal(clip.flags, item.flags)
        assert clip.notes[0].texts == (item.text,)
    assert sorted(int(clip.flags.sum()) for clip in clips.values() if clip.split == "train") == [0] * 4 + [30] * 4


def test_a_set_is_not_built_over_another_and_not_of_nothing(made: Path, tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="holds clips already"):
        babel.build_set([made / "babel"], made / "set")
    (tmp_path / "train.json").write_text(json.dumps({"1": entry([label("walk", 0, 3)])}))
    amass(tmp_path / "amass" / "CMU/CMU/01/01_01_poses.npz")
    with pytest.raises(MotionloomError, match=r"no item of 1\.5 to"):
        babel.build_set([tmp_path], tmp_path / "set", progress=lambda line: None)
    with pytest.raises(MotionloomError, match=r"train\.json"):
        babel.build_set([tmp_path / "nowhere"], tmp_path / "set")


def test_statistics_are_per_number_and_batches_carry_the_flags_of_their_frames(made: Path) -> None:
    data = load_set(made / "set")
    items = babel.load_items(made / "babel", "train", crop=True)
    frames = np.concatenate([item.features for item in items]).astype(np.float64)
    np.testing.assert_allclose(data.mean, frames.mean(0), atol=1e-5)
    np.testing.assert_allclose(data.std, np.maximum(frames.std(0), 1e-4), rtol=1e-3, atol=1e-6)
    batches = Batches(data, windows=[64], shares=[1.0])
    window, picked = batches.pick(0, 0, 16)
    batch = batches.show(window, picked)
    assert batch.flags is not None
    assert data.flags is not None
    for row, (start, length) in enumerate(zip(picked[0].tolist(), picked[1].tolist(), strict=True)):
        assert batch.flags[row, :length].tolist() == data.flags[start : start + length].tolist()
        assert not batch.flags[row, length:].any()
    assert batch.flags.any()


def test_priors_of_135_numbers_are_trained_with_and_without_flags(made: Path) -> None:
    for name, flags in (("plain", False), ("both", True)):
        prior = load_prior(made / name / f"{name}.safetensors")
        assert (len(prior.mean), prior.fps, prior.net.config.flags) == (135, 30.0, flags)
        assert "net.flag.weight" in prior.net.weights or not flags
        assert "non-commercial" in prior.card.licence


@pytest.mark.parametrize(
    ("kind", "change", "said"),
    [
        ("babel", ["net.features=263"], "net.features = 263; this set has 135"),
        ("babel", ["displacement=0.5"], "displacement is a loss of HumanML3D's"),
        ("humanml3d", ["net.flags=true"], "where actions change, which this set does not say"),
        ("humanml3d", ["geometric=1.0"], "geometric losses are of BABEL's numbers"),
    ],
)
def test_networks_and_losses_that_a_set_has_not_the_numbers_for_are_refused(
    made: Path, tmp_path: Path, capsys, kind: str, change: list[str], said: str
) -> None:
    data = made / "set" if kind == "babel" else runs.write_set(tmp_path / "set")
    words = ["--recipe", str(ROOT / "recipes/babel.toml"), "--data", str(data), "--out", str(tmp_path / "run")]
    text = ["--text", str(made / "words.safetensors"), "--device", "cpu"]
    assert main(["train", "prior", *words, *text, "--set", *SMALL, "windows=[32]", *change]) == 2
    assert said in capsys.readouterr().err


def test_control_is_trained_on_humanml3d_alone(made: Path) -> None:
    with pytest.raises(MotionloomError, match=r"has 135 numbers at 30 frames per second \(babel\), and 263"):
        load_set(made / "set", only=HUMANML3D)


def test_an_evaluator_of_the_same_numbers_reads_them_and_no_others(judge: Path) -> None:
    own = load_evaluator(str(judge))
    assert own.representation is BABEL
    points = own.motions([np.zeros((40, 135)), np.ones((61, 135))])
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1, atol=1e-5)
    assert own.texts([Caption("walk")]).shape[1] == points.shape[1]
    with pytest.raises(MotionloomError, match="135"):
        own.motions([np.zeros((40, 263))])


def test_table_1_is_one_command_with_transitions_of_70_and_of_30_frames(
    made: Path, judge: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sizes: list[int] = []
    embedded = transitions.embedded
    monkeypatch.setattr(
        transitions, "embedded", lambda own, parts: sizes.extend(map(len, parts)) or embedded(own, parts)
    )
    weights = [str(made / name / f"{name}.safetensors") for name in ("plain", "both")]
    words = ["--weights", weights[0], "--beside", weights[1], "--data", str(made / "set"), "--evaluator", str(judge)]
    out = made / "table1"
    assert main(["evaluate", "transitions", "--rows", "table1", *words, *MEASURE, "--out", str(out)]) == 0
    found = report.read(out)
    assert [row.name for row in found.rows[1:3]] == ["DoubleTake, plain, 2 steps", "DoubleTake, both, 2 steps"]
    wanted = {"r3", "fid", "diversity", "mm_dist", "transition_fid", "transition_diversity"}
    assert wanted | {"handshake_fid", "handshake_diversity"} <= set(found.rows[1].values) & set(found.rows[0].values)
    assert {30, 70} <= set(sizes)
    assert "auj_humanml3d" not in found.rows[1].values  # of 20 frames per second
    assert any(row.name == "TEACH" and "handshake_fid" in row.values for row in found.rows)


def test_what_does_not_fit_together_is_one_sentence(made: Path, judge: Path, tmp_path: Path) -> None:
    how = replace(Transitions.of(BABEL), steps=2)
    plain = str(made / "plain" / "plain.safetensors")
    with pytest.raises(MotionloomError, match="the evaluator reads 263"):
        transitions.run(Run(plain, made / "set"), how=how)
    with pytest.raises(MotionloomError, match="the evaluator reads 135"):
        transitions.run(Run(str(made / "words.safetensors"), made / "set", str(judge)), how=how)
    data, own = runs.write_set(tmp_path / "set"), load_evaluator(str(judge))
    with pytest.raises(MotionloomError, match="263 numbers per frame; judge reads 135"):
        transitions.real_motion(own, data, Selection(("train",), ()), how, print)
    with pytest.raises(MotionloomError, match="not all different: plain, plain"):
        transitions.run(Run(plain, made / "set", str(judge)), how=how, beside=[plain])
    with pytest.raises(MotionloomError, match="'slerp' needs weights of 263"):
        transitions.run(Run(plain, made / "set", str(judge)), how=how, names=["slerp"])


def run_script(name: str, *words: str, **settings: str) -> None:
    """A script of the examples, with commands of this Python."""
    place = {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    command = ["sh", str(ROOT / "examples" / "papers" / name), *words]
    done = subprocess.run(command, env=os.environ | place | settings, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.mark.slow
def test_the_script_of_table_1_ends_with_its_report(tmp_path: Path) -> None:
    folder = tmp_path / "babel"
    folder.mkdir()
    small = {"TRAIN": " ".join(SMALL), "JUDGE": " ".join(JUDGE), "MEASURE": " ".join(MEASURE)}
    run_script("table1.sh", str(write_babel(folder)), str(tmp_path / "out"), **small)
    found = report.read(tmp_path / "out" / "table1")
    names = ("plain", "geometric", "embedded", "embedded_geometric")
    assert [row.name for row in found.rows[1:5]] == [f"DoubleTake, {name}, 2 steps" for name in names]
    assert (tmp_path / "out" / "table1" / "report.md").is_file()
    assert [load_prior(tmp_path / f"out/{n}/{n}.safetensors").net.config.flags for n in names] == [False] * 2 + [
        True
    ] * 2


@pytest.mark.slow
def test_the_script_of_table_2_ends_with_its_report(tmp_path: Path) -> None:
    """A folder of HumanML3D's form: eight motions of everybody's own words."""
    folder = tmp_path / "HumanML3D"
    for part in ("new_joint_vecs", "texts"):
        (folder / part).mkdir(parents=True)
    for k in range(8):
        numbers = 0.1 * np.random.default_rng(k).standard_normal((150, 263)).astype(np.float32)
        np.save(folder / "new_joint_vecs" / f"{k:06d}.npy", numbers)
        (folder / "texts" / f"{k:06d}.txt").write_text(f"person {k} walks.#person/NOUN walk/VERB#0.0#0.0\n")
    (folder / "test.txt").write_text("\n".join(f"{k:06d}" for k in range(8)) + "\n")
    save_prior(tiny.prior(), tmp_path / "tiny.safetensors")
    out = tmp_path / "out"
    run_script("table2.sh", str(tmp_path / "tiny.safetensors"), str(folder), "own", str(out), MEASURE=" ".join(MEASURE))
    found = report.read(out)
    assert len([row for row in found.rows if row.name.endswith(", 2 steps")]) == 9
    assert (out / "report.md").is_file()
