"""The recorded graphs of tiny networks are those of their modules, and compute what these compute."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch

from motionloom.core.models.networks import prior_condition
from motionloom_train.modules import arrays, pair_module, predictor_module, prior_module
from motionloom_train.nets.pair import Talk
from motionloom_train.nets.prior import Condition
from tests.recorded import tiny
from tests.recorded.graphs import BLOCKS, FILE, PREDICTORS, PRIORS, load_graphs
from tests.recorded.tiny_predictor import network
from tests.tasks.two_people import block
from tests_train.nets.modules import text_module
from tests_train.record_graphs import record

NEAR = 1e-4
FRAMES = 18


def noise(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(shape, np.float32)


def condition(width: int, rows: int) -> prior_condition.Condition:
    """Vectors of a text and its words, and rows of different lengths."""
    pooled, tokens = noise(rows, width, seed=1), noise(rows, 5, width, seed=2)
    return prior_condition.condition(pooled, tokens=tokens, lengths=[FRAMES, 7, -1, 12][:rows])


def tensors(cond: prior_condition.Condition) -> Condition:
    return Condition(*map(torch.from_numpy, cond))


def assert_near(answer: np.ndarray, target: torch.Tensor, lengths: np.ndarray) -> None:
    """Equal in what is no padding, and something."""
    assert np.abs(answer).max() > 0.1
    for row, length in enumerate(lengths):
        part = slice(length if length > 0 else answer.shape[1])
        np.testing.assert_allclose(answer[row, part], target.numpy()[row, part], rtol=0, atol=NEAR)


def test_recording_again_gives_the_same_graphs() -> None:
    """Byte by byte, with the pinned versions of PyTorch and ONNX."""
    assert load_graphs() == record()
    assert FILE.stat().st_size < 300_000


@pytest.mark.parametrize("name", PRIORS)
@torch.inference_mode()
def test_priors(name: str) -> None:
    config = PRIORS[name]
    prior = tiny.prior(config)
    module, cond = prior_module(prior), condition(config.text, 4)
    x, levels = noise(4, FRAMES, config.features), np.array([1, 9, 20, 50])
    target = module(torch.from_numpy(x), torch.from_numpy(levels), module.bind(tensors(cond)))
    assert_near(prior.net(x, levels, prior.net.bind(cond)), target, cond.lengths)


@pytest.mark.parametrize("name", BLOCKS)
@torch.inference_mode()
def test_blocks_of_two_people(name: str) -> None:
    prior = tiny.prior(BLOCKS[name][1])
    talk = block(prior)
    net, module, cond = talk.net(prior), pair_module(talk, prior), condition(prior.net.config.text, 4)
    x = noise(4, 1 + FRAMES, 263)
    cond = cond._replace(lengths=np.full(4, -1))
    target = module(torch.from_numpy(x), 9, module.bind(tensors(cond)))
    assert_near(net(x, 9, net.bind(cond)), target, cond.lengths)


@pytest.mark.parametrize("name", PREDICTORS)
@torch.inference_mode()
def test_predictors(name: str) -> None:
    config = PREDICTORS[name]
    net = network(config, 3)
    module = predictor_module(SimpleNamespace(net=net))
    x, condition = noise(3, config.kept, config.channels), noise(3, *config.condition_shape, seed=1)
    levels, keep = np.array([0, 9, 999]), np.array([True, False, True])
    target = module(*map(torch.from_numpy, (x, levels, condition)), torch.from_numpy(keep.astype(np.float32)))
    assert_near(net(x, levels, condition, keep), target, np.full(3, -1))


@torch.inference_mode()
def test_the_text_encoder() -> None:
    text = tiny.text()
    module, ids = text_module(text), torch.tensor([text.ids("a person turns left")])
    target = module(ids, torch.ones(ids.shape, dtype=torch.bool))
    assert_near(text.encode("a person turns left").tokens, target, np.array([-1]))


def test_a_fresh_block_has_the_zeros_of_a_fresh_module() -> None:
    prior = tiny.prior()
    made = block(prior, fresh=True)
    talk = arrays(Talk(made.config, prior.net.config))
    assert {key for key, value in talk.items() if not value.any() and "norm" not in key} <= {
        key for key, value in made.tensors.items() if not value.any()
    }
