"""Contrastive training: the loss in closed form, which pairs are no negatives, and exact resume."""

from pathlib import Path

import numpy as np
import pytest
import torch
from torch.nn import functional as F

from motionloom.cli import main
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml as hml
from motionloom.core.features.layout import WIDTH
from motionloom.core.models.prior import save_prior
from motionloom_lab.evaluator.evaluators import Caption
from motionloom_lab.evaluator.net import load_embedder
from motionloom_lab.evaluator.pairs import PairBatch, Pairs, backwards, contrary, negatives, opposed, senses
from motionloom_lab.evaluator.training import config_of, contrast, train_evaluator
from motionloom_train.loop import Training
from motionloom_train.recipe import Recipe
from tests.kinematics import people
from tests.recorded import tiny
from tests.recorded.tiny import WIDTH as TEXT
from tests_train import runs


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return runs.write_set(tmp_path_factory.mktemp("set") / "set")


def recipe(**changes) -> Recipe:
    net = {"width": 32, "layers": 1, "heads": 2, "hidden": 32, "text": TEXT, "dropout": 0.1}
    values = {"name": "small", "steps": 6, "batch": 4, "save_every": 2, "warmup": 2, "rate": 3e-3, "net": net}
    return Recipe(**(values | changes))


def test_each_row_is_held_against_what_is_allowed_and_its_own_contrary() -> None:
    """Products by hand: -inf where a pair is no negative, the own pair always in, the contrary in the last column."""
    ask, answer = torch.eye(3)[:, :2] * 2 + 1, torch.tensor([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    allowed = torch.tensor([[False, True, False], [True, False, True], [False, False, False]])
    products = contrast(ask, answer, torch.tensor([[5.0, 7.0]]), torch.tensor([1]), allowed)
    low = float("-inf")
    expected = [[3, 1, low, low], [1, 3, 4, 1 * 5 + 3 * 7], [low, low, 2, low]]
    assert torch.equal(products, torch.tensor(expected))


def test_forbidden_pairs_leave_finite_gradients() -> None:
    """Also for what scales the products."""
    scale, points = torch.tensor(2.0, requires_grad=True), torch.randn(4, 3, requires_grad=True)
    products = contrast(points * scale, points, points[:1], torch.tensor([2]), torch.zeros(4, 4, dtype=torch.bool))
    F.cross_entropy(products, torch.arange(4)).backward()
    assert scale.grad is not None
    assert bool(scale.grad.isfinite())
    assert points.grad is not None
    assert bool(points.grad.isfinite().all())


def batch_of(texts: list[int], groups: list[int], takes: list[int]) -> PairBatch:
    none = torch.zeros(0, dtype=torch.long)
    rows = len(texts)
    return PairBatch(
        torch.zeros(rows, 4, WIDTH),
        torch.full((rows,), 4),
        torch.tensor(texts),
        rows,
        none,
        none,
        torch.tensor(groups),
        torch.tensor(takes),
    )


def test_the_same_action_in_other_words_is_no_negative() -> None:
    """Same label, same recording, alike sentences are not; opposite directions are, however alike they read."""
    sentences = ["turns left", "turns right", "waves", "waves a hand"]
    pooled = torch.tensor([[1.0, 0.1], [1.0, 0.0], [0.0, 1.0], [0.1, 1.0]])
    allowed = negatives(batch_of([0, 1, 2, 3], [-1, -2, -3, -4], [0, 1, 2, 3]), pooled, senses(sentences))
    assert allowed.tolist() == [
        [False, True, True, True],
        [True, False, True, True],
        [True, True, False, False],
        [True, True, False, False],
    ]
    labelled = negatives(batch_of([0, 2, 1], [7, 7, -1], [0, 1, 1]), pooled, senses(sentences))
    assert labelled.tolist() == [[False, False, True], [False, False, False], [True, False, False]]


def test_opposite_directions_are_told_from_both_and_from_none() -> None:
    """Left against right, forward against backward; a sentence that names both opposes nothing."""
    sentences = ["steps left", "steps right", "left then right", "walks forward", "walks backwards", "waves"]
    opposite = opposed(senses(sentences), senses(sentences)).tolist()
    pairs = {(i, j) for i in range(6) for j in range(6) if opposite[i][j]}
    assert pairs == {(0, 1), (1, 0), (3, 4), (4, 3)}


@pytest.mark.parametrize(
    ("text", "other"),
    [
        ("turns left", "turns right"),
        ("walks forward and back", "walks backward and back"),
        ("walks forward to the left", "walks forward to the right"),
        ("waves", "waves"),
    ],
)
def test_the_contrary_of_a_sentence(text: str, other: str) -> None:
    """Sides first, then forward and backward, else itself."""
    assert contrary(text) == other
    assert contrary(contrary(text)) == text


def test_a_film_run_backwards_twice_is_itself() -> None:
    """But for the two end frames; a walk ahead becomes one to the rear."""
    walk = hml.encode(hml.canonical(people.walking(1.2, 3.0)), heading="corrected")
    back = backwards(walk)
    assert back.shape == (len(walk) - 1, WIDTH)
    assert back[5:-5, 2].mean() == pytest.approx(-walk[5:-5, 2].mean(), rel=1e-3)
    assert backwards(back)[:, 4:67] == pytest.approx(walk[1:-1, 4:67], abs=1e-4)


def test_a_batch_follows_from_seed_and_step(data: Path) -> None:
    """The same twice, another at the next step; contraries belong to rows whose words ask for one."""
    pairs = Pairs.load(data, sources=[], seed=0)
    first, again, other = pairs.draw(0, 3, 8), pairs.draw(0, 3, 8), pairs.draw(0, 4, 8)
    assert torch.equal(first.features, again.features)
    assert torch.equal(first.texts, again.texts)
    assert first.features.shape != other.features.shape or not torch.equal(first.features, other.features)
    assert len(first.features) == 8 + len(first.hard_motion)
    assert len(first.hard_motion) == 3  # a third: every sentence here walks
    for row, number in enumerate(first.hard_motion.tolist()):
        length = int(first.lengths[8 + row])
        motion = first.features[8 + row, :length].numpy()
        assert np.allclose(motion, backwards(first.features[number, : length + 1].numpy()), atol=1e-6)


def test_a_stopped_run_goes_on_with_the_same_losses(data: Path, tmp_path: Path) -> None:
    """Weights after a stop in the middle equal those of a run in one go, bit for bit; the file opens."""
    whole = train_evaluator(Training(recipe(), tmp_path / "a", "cpu", say=lambda line: None), data, tiny.text())
    for stop in (3, None):
        parts = train_evaluator(Training(recipe(), tmp_path / "b", "cpu", stop, lambda line: None), data, tiny.text())
    assert whole.read_bytes() == parts.read_bytes()
    judge = load_embedder(whole, tiny.text())
    assert judge.card["licence"] == "free"
    assert judge.texts([Caption("a person walks")]).shape == (1, 128)


@pytest.mark.parametrize("net", [{"patch": 4, "text": TEXT}, {"text": 384}, {"width": 30, "text": TEXT}])
def test_a_network_that_cannot_be_is_refused(net: dict) -> None:
    """Unknown settings, another text width, a width that heads do not divide."""
    with pytest.raises(MotionloomError):
        config_of(recipe(net=net), tiny.text())


RECIPE = """
name = "mine"
steps = 2
batch = 3
save_every = 1
[net]
width = 32
layers = 1
heads = 2
hidden = 32
text = 64
"""


def test_the_commands_train_an_evaluator_and_refuse_what_they_cannot_measure(
    data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As a stranger types them: one file comes out; a set without captioned held-out clips is one sentence and 2."""
    monkeypatch.chdir(tmp_path)
    Path("recipe.toml").write_text(RECIPE)
    save_prior(tiny.prior(), "tiny.safetensors")
    arguments = ["--recipe", "recipe.toml", "--data", str(data), "--out", "run", "--text", "tiny.safetensors"]
    assert main(["train", "evaluator", *arguments, "--device", "cpu"]) == 0
    assert load_embedder(Path("run/mine.safetensors"), tiny.text()).card["name"] == "mine"
    capsys.readouterr()
    assert main(["evaluate", "evaluator", "--data", str(data), "--evaluator", "run/mine.safetensors"]) == 2
    assert "another text encoder" in capsys.readouterr().err
    assert main(["evaluate", "evaluator", "--data", str(data), "--seeds", "0"]) == 2
    assert "no clips of source cmu, accad, ui_prmd in val, test" in capsys.readouterr().err
