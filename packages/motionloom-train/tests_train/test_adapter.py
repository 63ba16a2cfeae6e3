"""Adapters in training: what they answer is what their file makes of the network, and nothing else learns."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor

from motionloom.core.models.adapter import GIVEN, Adapter, adapted, fingerprint, layers
from motionloom.core.models.networks import prior_condition
from motionloom.core.models.networks.prior import PriorSession
from motionloom_train.low_rank import AdapterNet, Controlled, linears, tensors_of
from motionloom_train.modules import prior_module, prior_session
from motionloom_train.nets.prior import Condition, NetConfig, PriorNet, condition
from tests.noise import normal
from tests.recorded import tiny
from tests.recorded.tiny import WIDTH
from tests_train.nets.modules import tiny_net

FLAGGED = NetConfig(width=32, layers=1, heads=4, hidden=48, text=WIDTH, features=24, flags=True, dropout=0.0)
NETS = {"modulated": tiny.MODULATED, "published": tiny.PUBLISHED, "flags": FLAGGED}


def parts(config: NetConfig, rows: int = 2, lengths=None) -> dict:
    generator = torch.Generator().manual_seed(7)
    condition = [torch.randn(rows, *shape, generator=generator) for shape in ((WIDTH,), (3, WIDTH))]
    flags = torch.randint(0, 2, (rows, 10), generator=generator) if config.flags else None
    return {"pooled": condition[0], "tokens": condition[1], "lengths": lengths, "flags": flags}


def bound(net: PriorNet, rows: int = 2, lengths=None):
    return net.bind(condition(**parts(net.config, rows, lengths)))


def bound_arrays(net: PriorSession, rows: int = 2, lengths=None) -> prior_condition.Bound:
    condition = parts(net.config, rows, lengths)
    arrays = {key: value.numpy() if isinstance(value, Tensor) else value for key, value in condition.items()}
    return net.bind(prior_condition.condition(**arrays))


def trained(net: PriorNet, *, given_rank: int = 3, seed: int = 1) -> AdapterNet:
    """An adapter whose every number matters."""
    adapter = AdapterNet(net, 2, given_rank=given_rank)
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for value in adapter.parameters():
            value.copy_(0.2 * torch.randn(value.shape, generator=generator))
    return adapter


def adapter_of(adapter: AdapterNet, net: PriorNet) -> Adapter:
    return Adapter(
        "tiny",
        "any",
        2,
        tensors_of(adapter.state_dict()),
        "tiny",
        fingerprint(prior_session(net)),
        "free",
        "numbers",
        {"a": 1},
    )


def sample(net: PriorNet, rows: int = 2) -> tuple[torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(3)
    x = torch.randn(rows, 10, net.config.features, generator=generator)
    return x, torch.rand(x.shape, generator=generator) < 0.3


@pytest.mark.parametrize("config", NETS.values(), ids=NETS)
@torch.no_grad()
def test_merged_weights_answer_what_the_trained_adapter_answers(config):
    """Two ways to compute the same network, with patches, flags and padded rows."""
    net = tiny_net(config)
    adapter, (x, mask) = trained(net), sample(net)
    condition = Controlled(bound(net, lengths=[10, 7]), x, mask)
    merged = adapted(prior_session(net), adapter_of(adapter, net))
    bound_state = merged.show(bound_arrays(merged, lengths=[10, 7]), x.numpy(), mask.numpy())
    answer, target = merged(x.numpy(), 5, bound_state), adapter(x, 5, condition).numpy()
    np.testing.assert_allclose(answer[0], target[0], rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(answer[1, :7], target[1, :7], rtol=1e-4, atol=1e-5)
    assert np.abs(answer - net(x, 5, condition.bound).numpy()).max() > 0.1


@torch.no_grad()
def test_a_fresh_adapter_changes_nothing():
    net = tiny_net()
    x, mask = sample(net)
    condition = bound(net)
    torch.testing.assert_close(
        AdapterNet(net, 2, given_rank=3)(x, 5, Controlled(condition, x, mask)), net(x, 5, condition)
    )


def test_only_the_adapter_learns_and_only_it_is_in_the_state():
    net = tiny_net(replace(tiny.MODULATED, dropout=0.5))
    before = {k: v.clone() for k, v in net.state_dict().items()}
    adapter, (x, mask) = trained(net).train(), sample(net)
    condition = Controlled(bound(net), x, mask)
    torch.testing.assert_close(
        adapter(x, 5, condition), adapter(x, 5, condition), rtol=0, atol=0
    )  # no dropout in what is frozen
    adapter(x, 5, condition).square().mean().backward()
    assert all(p.grad is not None and bool(p.grad.abs().max() > 0) for p in adapter.parameters())
    assert set(tensors_of(adapter.state_dict())) == {
        f"{name}.{part}" for name in (*linears(net), GIVEN) for part in ("down", "up")
    }
    assert all(torch.equal(v, before[k]) for k, v in net.state_dict().items())
    assert layers(prior_session(net)).keys() == linears(net).keys()


def test_a_taught_adapter_is_merged_as_trained() -> None:
    """The network in training, with its change kept apart, guesses what the merged one guesses."""
    prior = tiny.prior()
    adapter = AdapterNet(prior_module(prior), 2, given_rank=0, taught=True)
    with torch.no_grad():
        for value in adapter.parameters():
            value.copy_(torch.from_numpy(0.2 * normal(value.shape, 3)))
    file = replace(tiny.adapter(prior), tensors=tensors_of(adapter.state_dict()))
    merged = prior.with_adapters([(file, 1.0)]).net
    x = normal((2, 10, 263), 4)
    cond = prior.condition(["a person walks", "a person turns"])
    with torch.no_grad():
        bound = adapter.bind(Condition(*map(torch.from_numpy, cond)))
        target = adapter(torch.from_numpy(x), 9, bound).numpy()
    np.testing.assert_allclose(merged(x, 9, merged.bind(cond)), target, rtol=0, atol=1e-4)
