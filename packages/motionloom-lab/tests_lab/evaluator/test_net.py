"""The evaluator's networks and file: what they read, what they ignore, what they refuse."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import load_file, save_file

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml as hml
from motionloom.core.features.layout import LAYOUT
from motionloom.core.models.networks.text.minilm import pack
from motionloom_lab.evaluator.evaluators import Caption
from motionloom_lab.evaluator.net import (
    INPUTS,
    KEY,
    Embedder,
    EvaluatorConfig,
    EvaluatorNet,
    inputs,
    is_embedder,
    load_embedder,
    save_embedder,
)
from motionloom_train.modules import text_encoder
from tests.kinematics import people
from tests.recorded import tiny

CONFIG = EvaluatorConfig(width=32, layers=2, heads=2, hidden=48, text=tiny.WIDTH, embed=16, dropout=0.1)


def embedder(seed: int = 0) -> Embedder:
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        net = EvaluatorNet(CONFIG).eval().requires_grad_(False)
        mean, std = torch.randn(INPUTS) * 0.1, torch.rand(INPUTS) * 0.3 + 0.1
    return Embedder(net, mean, std, tiny.text(), {"name": "tiny", "licence": "free", "data": "none", "made": "here"})


def features(positions: np.ndarray) -> np.ndarray:
    return hml.encode(hml.canonical(positions), heading="corrected")


@pytest.fixture(scope="module")
def motions() -> list[np.ndarray]:
    """Of different lengths, none a multiple of four but one."""
    walks = [people.walking(1.2, 4.0), people.walking(0.7, 2.15), people.circling(1.0, 0.4)]
    return [features(walk) for walk in walks] + [features(people.walking(1.0, 3.0))[:40]]


def test_points_are_unit_vectors(motions: list[np.ndarray]) -> None:
    """Of motions and of sentences."""
    judge = embedder()
    for points in (judge.motions(motions), judge.texts([Caption("a person walks"), Caption("turn left")])):
        assert points.dtype == np.float64
        assert np.linalg.norm(points, axis=1) == pytest.approx(1.0, abs=1e-6)


def test_a_motion_stands_alone(motions: list[np.ndarray]) -> None:
    """Neither the rows beside it nor the padding behind it nor its place in the list matters."""
    judge = embedder()
    together = judge.motions(motions)
    alone = np.concatenate([judge.motions([one]) for one in motions])
    assert together == pytest.approx(alone, abs=1e-5)
    assert judge.motions(motions[::-1])[::-1] == pytest.approx(together, abs=1e-5)
    assert np.abs(together[0] - together[1]).max() > 1e-3


def test_a_sentence_stands_alone() -> None:
    """A longer sentence in the same call changes nothing."""
    judge = embedder()
    assert judge.texts([Caption("walk"), Caption("a person turns left . a person walks")])[:1] == pytest.approx(
        judge.texts([Caption("walk")]), abs=1e-5
    )


def test_only_what_is_seen_is_read(motions: list[np.ndarray]) -> None:
    """Rotations, stored velocities and contact flags are ignored; the root and the places are not."""
    judge, walk = embedder(), motions[0]
    hidden, visible = walk.copy(), walk.copy()
    hidden[:, LAYOUT["ric"].stop :] += 3.0
    visible[:, LAYOUT["ric"]] += 0.3
    assert np.array_equal(judge.motions([hidden]), judge.motions([walk]))
    assert np.abs(judge.motions([visible]) - judge.motions([walk])).max() > 1e-3


def test_inputs_are_places_displacements_and_the_way(motions: list[np.ndarray]) -> None:
    """Displacements equal the published velocity block, the way is that of the decoded pelvis; ends repeat."""
    walk = motions[2].astype(np.float64)
    padded = np.concatenate([walk, np.zeros((9, 263))])
    values = inputs(torch.from_numpy(padded)[None], torch.tensor([len(walk)]))[0, : len(walk)].numpy()
    assert np.array_equal(values[:, :67], walk[:, :67])
    assert values[:-1, 67:133] == pytest.approx(walk[:-1, LAYOUT["joint_velocity"]], abs=1e-5)
    assert np.array_equal(values[-1, 67:133], values[-2, 67:133])
    pelvis = hml.decode_positions(walk)[:, 0]
    assert values[:, 135:] == pytest.approx(pelvis[:, [0, 2]], abs=1e-9)
    heading = 2 * np.arctan2(*hml.recover_root(walk)[0][:, [2, 0]].T)
    assert values[:, 133] == pytest.approx(np.cos(heading), abs=1e-9)
    assert values[:, 134] == pytest.approx(np.sin(heading), abs=1e-9)


@pytest.mark.parametrize("bad", ["nan", "short", "width", "empty"])
def test_motions_that_cannot_be_judged_are_refused(bad: str, motions: list[np.ndarray]) -> None:
    """With the number of the motion."""
    walk = motions[0].copy()
    walk[3, 3] = np.nan
    wrong = {"nan": walk, "short": motions[0][:3], "width": motions[0][:, :200], "empty": motions[0][:0]}[bad]
    with pytest.raises(MotionloomError, match="motion 1"):
        embedder().motions([motions[0], wrong])


def test_nonsense_stays_finite(motions: list[np.ndarray]) -> None:
    """Numbers of any size give a unit vector."""
    assert np.isfinite(embedder().motions([motions[0] * 1e12])).all()


def test_a_file_gives_the_evaluator_back(tmp_path: Path, motions: list[np.ndarray]) -> None:
    """To the precision of float16; statistics and card exactly."""
    judge = embedder()
    back = load_embedder(save_embedder(judge, tmp_path / "a.safetensors"), tiny.text())
    assert is_embedder(tmp_path / "a.safetensors")
    assert back.card == judge.card
    assert torch.equal(back.mean, judge.mean)
    assert back.motions(motions) == pytest.approx(judge.motions(motions), abs=5e-3)
    assert back.texts([Caption("a person walks")]) == pytest.approx(judge.texts([Caption("a person walks")]), abs=5e-3)


def test_another_text_encoder_is_refused(tmp_path: Path) -> None:
    """One changed number in the encoder is enough."""
    path = save_embedder(embedder(), tmp_path / "a.safetensors")
    other = text_encoder(pack(tiny.text_weights(seed=1), tiny.VOCABULARY))
    with pytest.raises(MotionloomError, match="another text encoder"):
        load_embedder(path, other)


def damaged(path: Path, way: str) -> Path:
    tensors = load_file(path)
    with safe_open(path, framework="pt") as file:
        about = json.loads(file.metadata()[KEY])
    if way == "missing":
        del tensors["net.motion.second.weight"]
    elif way == "nan":
        tensors["mean"][0] = float("nan")
    elif way == "spread":
        tensors["std"][5] = 0.0
    elif way == "size":
        about["net"]["width"] = 10**9
    elif way == "format":
        about["format"] = 2
    elif way == "card":
        about["card"] = 3
    save_file(tensors, path, metadata={KEY: json.dumps(about)})
    if way == "cut":
        path.write_bytes(path.read_bytes()[:-100])
    return path


@pytest.mark.parametrize("way", ["missing", "nan", "spread", "size", "format", "card", "cut"])
def test_damaged_files_are_refused_in_one_sentence(tmp_path: Path, way: str) -> None:
    """Each names the file."""
    path = damaged(save_embedder(embedder(), tmp_path / "a.safetensors"), way)
    with pytest.raises(MotionloomError, match=r"a\.safetensors|no evaluator"):
        load_embedder(path, tiny.text())
