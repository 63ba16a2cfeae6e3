"""Graphs against the modules they were made of: every shipped network, and small ones of every other kind."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from motionloom.core.diffusion import cosine
from motionloom.core.features.pair import PlaceCode
from motionloom.core.models.adapter import Adapter, adapted, adapters
from motionloom.core.models.networks import prior_condition
from motionloom.core.models.networks.predictor import PredictorConfig
from motionloom.core.models.networks.shapes import pair_shapes, predictor_shapes, prior_shapes
from motionloom.core.models.pair import PairBlock, blocks
from motionloom.core.models.predictor import Predictor, shipped_predictors
from motionloom.core.models.prior import Prior, shipped
from motionloom_train.low_rank import Controlled
from motionloom_train.low_rank import adapted as adapted_module
from motionloom_train.modules import (
    pair_module,
    predictor_module,
    predictor_session,
    prior_module,
    prior_session,
    shapes,
)
from motionloom_train.nets.pair import PairConfig, PairNet, Talk
from motionloom_train.nets.predictor import TransLinear
from motionloom_train.nets.prior import Bound, Condition, NetConfig, PriorNet
from tests_train.nets.modules import pair_session, text_module

NEAR = 1e-4
FRAMES = 45
LENGTHS = [FRAMES, -1, 17, 30]
PROMPTS = ["a person walks", "", "someone sits down slowly and then waves with the left hand", "jumps"]


def noise(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(shape, np.float32)


def tensor(values: np.ndarray) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(values))


def condition_of(cond: prior_condition.Condition) -> Condition:
    return Condition(*map(tensor, cond))


def assert_near(answer: np.ndarray, target: Tensor, lengths: list[int]) -> None:
    """Equal in what is no padding."""
    for row, length in enumerate(lengths):
        part = slice(length if length > 0 else answer.shape[1])
        np.testing.assert_allclose(answer[row, part], target.numpy()[row, part], rtol=0, atol=NEAR)


def filled(net: nn.Module) -> nn.Module:
    """Every weight matters: none is zero or one."""
    generator = torch.Generator().manual_seed(1)
    with torch.no_grad():
        for value in net.parameters():
            spread = 0.7 / value.shape[-1] ** 0.5 if value.ndim > 1 else 0.2
            value.copy_(torch.randn(value.shape, generator=generator) * spread)
    return net.eval().requires_grad_(False)


@pytest.mark.parametrize("name", shipped())
@torch.inference_mode()
def test_a_shipped_prior(name: str) -> None:
    prior = Prior.load(name)
    module, cond = prior_module(prior), prior.condition(PROMPTS, LENGTHS)
    x, levels = noise(4, FRAMES, prior.net.config.features), np.array([1, 300, 700, prior.schedule.steps])
    bound, target = prior.net.bind(cond), module.bind(condition_of(cond))
    for answer, part in zip(bound[:3], target[:3], strict=True):
        np.testing.assert_allclose(answer, part.numpy(), rtol=0, atol=NEAR)
    assert_near(prior.net(x, levels, bound), module(tensor(x), tensor(levels), target), LENGTHS)


@pytest.mark.parametrize("name", adapters())
@torch.inference_mode()
def test_a_shipped_adapter(name: str) -> None:
    """With and without something that it is shown."""
    prior = Prior.load()
    adapter = Adapter.load(name, prior)
    net, module = adapted(prior.net, adapter), adapted_module(prior_module(prior), adapter)
    cond = prior.condition(PROMPTS, LENGTHS)
    bound, target = net.bind(cond), module.bind(condition_of(cond))
    x, known = noise(4, FRAMES, 263), noise(4, FRAMES, 263, seed=1)
    mask = noise(4, FRAMES, 263, seed=2) > 1
    answer = module(tensor(x), 400, Controlled(target, tensor(known), tensor(mask)))
    assert_near(net(x, 400, net.show(bound, known, mask)), answer, LENGTHS)
    assert_near(net(x, 400, bound), module(tensor(x), 400, target), LENGTHS)


@pytest.mark.parametrize("name", blocks())
@torch.inference_mode()
def test_a_shipped_block(name: str) -> None:
    prior = Prior.load()
    block = PairBlock.load(name, prior)
    net, module = block.net(prior), pair_module(block, prior)
    lengths = [FRAMES, FRAMES, 30, 30]
    cond = prior.condition(["two people dance"] * 4, lengths)
    x, levels = noise(4, 1 + FRAMES, 263), np.array([20, 20, 900, 900])
    answer = net(x, levels, net.bind(cond))
    target = module(tensor(x), tensor(levels), module.bind(condition_of(cond)))
    assert_near(answer, target, [1 + length for length in lengths])


@pytest.mark.parametrize("name", shipped_predictors())
@torch.inference_mode()
def test_a_shipped_predictor(name: str) -> None:
    predictor = Predictor.load(name)
    module, config = predictor_module(predictor), predictor.net.config
    assert_equal_predictors(predictor.net, module, config)


def assert_equal_predictors(net: object, module: TransLinear, config: PredictorConfig) -> None:
    x, condition = noise(3, config.kept, config.channels), noise(3, *config.condition_shape)
    levels, keep = np.array([0, 400, 999]), np.array([True, False, True])
    for asked, kept in ((condition, None), (condition, keep), (None, None)):
        answer = net(x, levels, asked, kept)  # type: ignore[operator]
        said = None if asked is None else tensor(asked), None if kept is None else tensor(kept)
        np.testing.assert_allclose(answer, module(tensor(x), tensor(levels), *said).numpy(), rtol=0, atol=NEAR)


@torch.inference_mode()
def test_the_shipped_text_encoder() -> None:
    prior = Prior.load()
    module = text_module(prior.text)  # type: ignore[arg-type]
    answer = prior.text.encode(PROMPTS)
    for row, prompt in enumerate(PROMPTS):
        ids = prior.text.ids(prompt)  # type: ignore[attr-defined]
        target = module(torch.tensor([ids]), torch.ones(1, len(ids), dtype=torch.bool))[0]
        np.testing.assert_allclose(answer.tokens[row, : len(ids)], target.numpy(), rtol=0, atol=NEAR)


SMALL = NetConfig(features=11, width=32, layers=2, heads=4, hidden=48, text=24)
PRIORS = {
    "published (MDM)": SMALL,
    "published, BABEL's flags": replace(SMALL, flags=True),
    "modulated": replace(SMALL, variant="modulated", patch=2),
    "modulated, clock": replace(SMALL, variant="modulated", patch=4, clock=True),
}


@pytest.mark.parametrize("config", PRIORS.values(), ids=PRIORS.keys())
@torch.inference_mode()
def test_small_priors_of_every_kind(config: NetConfig) -> None:
    module = filled(PriorNet(config))
    assert isinstance(module, PriorNet)
    net = prior_session(module)
    words = np.ones((4, 6), bool)
    words[1, 3:] = False
    flags = np.random.default_rng(0).integers(0, 2, (4, FRAMES)) if config.flags else None
    cond = prior_condition.condition(noise(4, 24), tokens=noise(4, 6, 24), words=words, lengths=LENGTHS, flags=flags)
    x, levels = noise(4, FRAMES, 11), np.array([1, 9, 300, 1000])
    target = module(tensor(x), tensor(levels), module.bind(condition_of(cond)))
    assert_near(net(x, levels, net.bind(cond)), target, LENGTHS)


MUTUAL = PairConfig(split=1, width=32, heads=2, hidden=48)
PUBLISHED = replace(SMALL, features=263)
MODULATED = replace(PUBLISHED, variant="modulated", patch=4)
PAIRS = {
    "published (ComMDM)": (PUBLISHED, replace(MUTUAL, places=PlaceCode("world", 0.1, 0.1))),
    "published, the condition alone": (PUBLISHED, replace(MUTUAL, adds="condition", split=2)),
    "modulated, two layers": (MODULATED, replace(MUTUAL, layers=2, split=0)),
    "modulated, aware": (MODULATED, replace(MUTUAL, aware=True, split=2)),
    "published, aware": (PUBLISHED, replace(MUTUAL, aware=True)),
}


@pytest.mark.parametrize(("config", "block"), PAIRS.values(), ids=PAIRS.keys())
@torch.inference_mode()
def test_small_blocks_of_every_kind(config: NetConfig, block: PairConfig) -> None:
    talk, mean = Talk(block, config), tensor(0.1 * noise(263))
    net = PairNet(filled(PriorNet(config)), filled(talk), cosine(50), mean=mean, std=mean.abs() + 0.05)  # type: ignore[arg-type]
    session = pair_session(net.eval())
    lengths = [FRAMES, FRAMES, 22, 22]
    cond = prior_condition.condition(noise(4, 24), tokens=noise(4, 6, 24), lengths=lengths)
    x, levels = noise(4, 1 + FRAMES, 263), np.array([3, 3, 40, 40])
    answer = session(x, levels, session.bind(cond))
    target = net(tensor(x), tensor(levels), net.bind(condition_of(cond)))
    assert_near(answer, target, [1 + length for length in lengths])


PREDICTORS = {
    "published (HumanMAC)": PredictorConfig(channels=9, kept=5, layers=2, width=32, heads=4),
    "ours": PredictorConfig(channels=9, kept=5, layers=4, width=32, heads=2, condition=(6, 12), beside=True),
}


@pytest.mark.parametrize("config", PREDICTORS.values(), ids=PREDICTORS.keys())
@torch.inference_mode()
def test_small_predictors_of_every_kind(config: PredictorConfig) -> None:
    module = filled(TransLinear(config))
    assert isinstance(module, TransLinear)
    assert_equal_predictors(predictor_session(module), module, config)


def test_shapes_are_those_of_the_modules() -> None:
    """What a file is checked against without PyTorch."""
    for config in (*PRIORS.values(), NetConfig()):
        with torch.device("meta"):
            assert shapes(PriorNet(config)) == prior_shapes(config)
    for prior, block in PAIRS.values():
        assert shapes(Talk(block, prior)) == pair_shapes(block, prior)
    for config in PREDICTORS.values():
        assert shapes(TransLinear(config)) == predictor_shapes(config)


def test_graphs_hold_no_weights_and_say_nothing_of_this_machine(tmp_path: Path) -> None:
    net = prior_session(filled(PriorNet(PRIORS["modulated"])))  # type: ignore[arg-type]
    size = sum(value.nbytes for value in net.weights.values())
    for graph in net.graphs.values():
        assert len(graph) < 30_000 < size
        assert b"/home" not in graph
        assert b".py" not in graph
    assert Bound._fields == prior_condition.Bound._fields[: len(Bound._fields)]
