"""Teaching: what a step sees, that the same seed teaches the same, that it is learned, and what is kept."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from motionloom.core.body.ik import motion_from_positions
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.layout import ric
from motionloom.core.models.adapter import Adapter
from motionloom.core.models.networks.text.known import known_sentences
from motionloom.core.models.prior import Prior
from motionloom_train import teach as module
from motionloom_train.data.examples import CaptionedClip, Example, make_examples
from motionloom_train.low_rank import AdapterNet
from motionloom_train.modules import prior_module
from motionloom_train.nets.prior import Condition
from motionloom_train.objectives import Conditioned
from motionloom_train.teach import Lesson, Teaching, known_prompts, teach, wordings
from tests.kinematics import people
from tests.noise import normal
from tests.recorded import tiny
from tests.tasks.test_edit import person

KNOWN = ["a person walks", "a person turns left", "a person turns right", "a person stands"]


@pytest.fixture(scope="module")
def prior() -> Prior:
    """Random weights around a walking person, that say what they know."""
    features = humanml.motion_to_features(person(2.0))
    std = np.full(263, 0.02, np.float32)
    result = replace(tiny.prior(), mean=features.mean(0), std=std)
    return replace(result, known=known_sentences(KNOWN, {"walk": 9.0}, result.text))


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Little is drawn of what is known."""
    monkeypatch.setattr(module, "DRAWS", 4)
    monkeypatch.setattr(module, "DRAWN_STEPS", 1)


@pytest.fixture(scope="module")
def examples() -> list[Example]:
    motion = motion_from_positions(people.walking(1.2, 3.0), people.FPS)
    return make_examples(motion, CaptionedClip(Path("zombie.bvh"), ("a person walks to the left",)))


def taught(prior: Prior, examples: list[Example], **lesson) -> Adapter:
    return teach(prior, examples, Lesson(**({"name": "zombie", "steps": 3, "batch": 4, "rank": 2} | lesson)))


def test_the_same_seed_teaches_the_same(prior: Prior, examples: list[Example]) -> None:
    one, same, other = (taught(prior, examples, seed=seed) for seed in (1, 1, 2))
    assert all(np.array_equal(one.tensors[key], same.tensors[key]) for key in one.tensors)
    assert any(not np.array_equal(one.tensors[key], other.tensors[key]) for key in one.tensors)


def test_the_card_says_what_was_taught(prior: Prior, examples: list[Example], tmp_path: Path) -> None:
    result = taught(prior, examples, licence="mine")
    again = Adapter.load(result.save(tmp_path / "zombie.safetensors"), prior)
    assert again.taught
    assert again.captions == ("a person walks to the left", "a person walks to the right")
    assert (again.name, again.licence, again.base, again.rank) == ("zombie", "mine", "tiny", 2)
    assert (again.notes["clips"], again.notes["steps"]) == (1, 3)
    assert "the owner of the clips" in taught(prior, examples).licence


def test_what_was_taught_is_known(prior: Prior, examples: list[Example]) -> None:
    more = prior.with_adapters([(taught(prior, examples), 1.0)])
    assert more.known is not None
    assert "walks to the left" in more.known.sentences


def test_training_comes_nearer_to_the_clips(prior: Prior, examples: list[Example]) -> None:
    """The error of the guess at a clip, with its caption, falls; it is the same noise before and after."""
    clean = ((examples[0].features[None, :100] - prior.mean) / prior.std).astype(np.float32)
    cond = prior.condition(list(examples[0].captions), [100])
    state = prior.schedule.noised(clean, prior.schedule.steps, normal(clean.shape, 5))

    def error(net) -> float:
        guess = net(state, prior.schedule.steps, net.bind(cond))
        return float(((guess - clean) ** 2).mean())

    after = prior.with_adapters([(taught(prior, examples, steps=80, rate=1e-2, keep=0.0), 1.0)])
    assert error(after.net) < 0.9 * error(prior.net)


def change(prior: Prior, adapter: Adapter, prompts: list[str]) -> float:
    """How far the taught network's guesses at noise are from the prior's, relative to them."""
    cond = prior.condition(prompts, [40] * len(prompts))
    x = normal((len(prompts), 40, 263), 6)
    nets = [prior.net, prior.with_adapters([(adapter, 1.0)]).net]
    old, new = (net(x, prior.schedule.steps - 2, net.bind(cond)) for net in nets)
    return float(((new - old) ** 2).mean() / (old**2).mean())


def test_what_was_known_changes_less_where_it_is_kept(prior: Prior, examples: list[Example]) -> None:
    bound, free = (taught(prior, examples, steps=60, batch=8, rate=1e-2, keep=keep) for keep in (0.8, 0.0))
    prompts = [text for text in KNOWN if "left" not in text]
    assert change(prior, bound, prompts) < 0.5 * change(prior, free, prompts)


def teaching(prior: Prior, examples: list[Example], keep: float = 0.5) -> Teaching:
    motions = [("a person stands", np.tile(prior.mean, (100, 1)))] * 4
    return Teaching(AdapterNet(prior_module(prior), 2, given_rank=0, taught=True), prior, examples, motions, keep=keep)


def test_an_adapter_that_changes_nothing_costs_what_the_clips_cost(prior: Prior, examples: list[Example]) -> None:
    """Before the first step the kept rows agree with the prior, so their part of the loss is nothing."""
    objective = teaching(prior, examples)
    clean, texts, lengths = objective._rows(np.random.default_rng(1), 60, 6, 3)
    assert len(texts) == len(lengths) == len(clean) == 6
    same = torch.randn(6, 60, 263)
    whole = objective._error(same, clean, same[3:], torch.tensor(lengths), 3)
    own = objective._error(same[:3], clean[:3], same[:0], torch.tensor(lengths[:3]), 3)
    assert float(whole) == pytest.approx(float(own))


def test_a_step_depends_on_its_number_alone(prior: Prior, examples: list[Example]) -> None:
    objective = teaching(prior, examples)
    net = Conditioned(objective.net)
    first, again, other = (float(objective.loss(net, 3, step, 4).detach()) for step in (7, 7, 8))
    assert first == again != other


def test_near_pure_noise_other_known_sentences_are_kept(prior: Prior, examples: list[Example]) -> None:
    """They take the place of those of the drawn motions, never that of what is taught."""
    motions = [("a person stands", np.tile(prior.mean, (100, 1)))] * 4
    net = AdapterNet(prior_module(prior), 2, given_rank=0, taught=True)
    objective = Teaching(net, prior, examples, motions, ["a person climbs", "a person crawls"], keep=0.5)
    calls = []
    plain = objective.words.condition

    def remembered(texts: torch.Tensor, lengths: torch.Tensor) -> Condition:
        calls.append(texts.tolist())
        return plain(texts, lengths)

    objective.words.condition = remembered
    for step in range(12):
        objective.loss(Conditioned(net), 3, step, 8)
    others = set(objective.others)
    assert not others & {number for row in calls for number in row[:4]}
    numbers = [number for row in calls for number in row[4:]]
    assert others < set(numbers)
    assert 0.1 < np.mean([number in others for number in numbers]) < 0.6


@pytest.mark.parametrize("window", [60, 160])
def test_windows_of_a_change_show_all_of_it_soon(window: int) -> None:
    """A change of 30 frames that is held: every window holds it whole, within 0.8 s of its beginning."""
    example = Example("x", ("x",), np.zeros((330, 263), np.float32), (100, 130))
    rng = np.random.default_rng(0)
    firsts = [module._first(example, np.zeros(0, int), window, rng) for _ in range(200)]
    assert min(firsts) == 84
    assert max(firsts) == 100
    assert len(set(firsts)) > 10


def repeating(period: int | None) -> np.ndarray:
    """Features (240, 263) of a wrist that goes up and down every ``period`` frames; None: up once and for all."""
    features = np.random.default_rng(0).normal(0, 0.02, (240, 263)).astype(np.float32)
    time = np.arange(240)
    features[:, ric(20)] += ((1 - np.cos(2 * np.pi * time / period)) if period else time / 60)[:, None]
    return features


def test_windows_begin_with_a_repetition() -> None:
    """Else the same sentence is shown with every phase, of which the mean hardly moves."""
    features = repeating(50)
    example = Example("x", ("x",), features, (0, 240))
    begins = module._beginnings(example, features)
    np.testing.assert_allclose(begins, [0, 50, 100, 150, 200], atol=3)
    rng = np.random.default_rng(0)
    assert {module._first(example, begins, 100, rng) for _ in range(200)} == set(begins[:3].tolist())


def test_windows_of_what_is_not_repeated_begin_anywhere() -> None:
    features = repeating(None)
    example = Example("x", ("x",), features, (0, 240))
    begins = module._beginnings(example, features)
    assert not begins.size
    rng = np.random.default_rng(0)
    assert len({module._first(example, begins, 100, rng) for _ in range(200)}) > 50


def test_sentences_that_say_what_is_taught_are_not_kept_as_they_were(prior: Prior) -> None:
    prompts, others = known_prompts(prior, ["a person turns left"], 0)
    assert len(prompts) == 4
    assert "a person turns left" not in [*prompts, *others]


def test_weights_that_know_nothing_else_cannot_keep_it(prior: Prior) -> None:
    only = replace(prior, known=known_sentences(["walks"], {}, prior.text))
    with pytest.raises(MotionloomError, match="know no other sentences"):
        known_prompts(only, ["a person walks"], 0)


def test_captions_in_other_words() -> None:
    assert "walk like a zombie" in wordings("a person walks like a zombie")
    assert "someone walks like a zombie" in wordings("a person walks like a zombie")
    assert wordings("a zombie walks") == ("a zombie walks",)


def test_what_cannot_be_taught_is_refused(prior: Prior, examples: list[Example]) -> None:
    with pytest.raises(MotionloomError, match="there is no clip"):
        teach(prior, [])
    with pytest.raises(MotionloomError, match=r"keep must be 0 to 0\.9"):
        Lesson(keep=1.0)
    with pytest.raises(MotionloomError, match="rank must be"):
        Lesson(rank=0)
    with pytest.raises(MotionloomError, match="can be taught"):
        teach(replace(prior, fps=30.0), examples)
