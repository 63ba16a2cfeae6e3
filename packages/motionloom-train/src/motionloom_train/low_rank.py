"""Adapters in training: low-rank changes of a frozen network (`motionloom.core.models.adapter` has their files).

An `AdaptedNet` is called like the network it comes from; with `Controlled` as its condition it sees what is given.
"""

import copy
import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from motionloom.core.models.adapter import CHANGED, GIVEN, READS, Adapter
from motionloom_train.nets.prior import Bound, Condition, NetConfig, PriorNet

SPARSE = 100
"""Numbers of a token that are given at once, roughly: how strong that input is when training begins."""

QUICK = 5.0
"""How much quicker that input learns than the changes of the network: in training it is kept divided by this."""


class Controlled(NamedTuple):
    """The condition of an `AdaptedNet`: what the network is bound to, and what is given."""

    bound: Bound
    values: Tensor
    """(rows, frames, features) standardised; what is not given may be anything finite."""
    mask: Tensor
    """(rows, frames, features) bool: which numbers are given."""


def linears(net: PriorNet, *, taught: bool = False) -> dict[str, nn.Linear]:
    """The layers of a network that an adapter changes, by name; ``taught``: also those that read the text."""
    names = (*CHANGED, *READS) if taught else CHANGED
    return {
        name: layer
        for name, layer in net.named_modules()
        if isinstance(layer, nn.Linear) and name.rsplit(".", 1)[-1] in names
    }


class AdaptedNet(nn.Module):
    """A network with an adapter inside: called as ``net(state, level, condition)`` like a `PriorNet`.

    The condition is a `Controlled`, or a plain `Bound`, which means that nothing is given.
    """

    def __init__(self, net: PriorNet, sees_given: bool) -> None:
        super().__init__()
        self.net, self.sees_given = net, sees_given

    @property
    def config(self) -> NetConfig:
        """Sizes of the network."""
        return self.net.config

    def bind(self, cond: Condition) -> Bound:
        """See `PriorNet.bind`."""
        return self.net.bind(cond)

    def forward(self, x: Tensor, level: int | Tensor, bound: Bound | Controlled) -> Tensor:
        """(rows, frames, features) standardised at ``level`` to the denoised estimate."""
        if isinstance(bound, Controlled):
            plain, extra = bound.bound, [torch.where(bound.mask, bound.values.to(x), 0.0), bound.mask.to(x)]
        else:
            plain, extra = bound, [torch.zeros_like(x)] * 2
        return self.net(torch.cat([x, *extra], dim=-1) if self.sees_given else x, level, plain)


def show(net: nn.Module, bound: Bound, values: Tensor, mask: Tensor) -> Bound | Controlled:
    """The condition that shows a network what is given, if it takes one; see `Controlled`."""
    return Controlled(bound, values, mask) if isinstance(net, AdaptedNet | AdapterNet) else bound


def adapted(net: PriorNet, adapter: Adapter) -> AdaptedNet:
    """A copy of the network with the adapter merged into its weights: as quick as the network itself."""
    result = copy.deepcopy(net).eval().requires_grad_(False)
    for name, layer in linears(result, taught=adapter.taught).items():
        down, up = (torch.from_numpy(adapter.tensors[f"{name}.{part}"]).to(layer.weight) for part in ("down", "up"))
        layer.weight = nn.Parameter(layer.weight + up @ down, requires_grad=False)
    if adapter.sees_given:
        down, up = (
            torch.from_numpy(adapter.tensors[f"{GIVEN}.{part}"]).to(result.embed.weight) for part in ("down", "up")
        )
        wide = beside(result.embed.weight, up @ down, net.config)
        result.embed = nn.Linear(wide.shape[1], wide.shape[0], device="meta")
        result.embed.weight = nn.Parameter(wide, requires_grad=False)
        result.embed.bias = nn.Parameter(net.embed.bias.detach().clone(), requires_grad=False)
    return AdaptedNet(result, adapter.sees_given)


def beside(embed: Tensor, control: Tensor, config: NetConfig) -> Tensor:
    """Weights that read frames of [state, given, mask, flags], from those of state and flags and those of the rest."""
    state = embed.unflatten(1, (config.patch, -1))
    extra = control.unflatten(1, (config.patch, -1))
    return torch.cat([state[..., : config.features], extra, state[..., config.features :]], dim=-1).flatten(1)


class LowRank(nn.Module):
    """A frozen layer and its change, kept apart: in training no gradient of the layer's own weight is computed."""

    def __init__(self, layer: nn.Linear, down: nn.Parameter, up: nn.Parameter) -> None:
        super().__init__()
        self.layer, self.down, self.up = layer, down, up

    def forward(self, x: Tensor) -> Tensor:
        return self.layer(x) + F.linear(F.linear(x, self.down), self.up)


class GivenEmbed(nn.Module):
    """The first layer with an input for what is given, in training."""

    def __init__(self, embed: nn.Module, down: nn.Parameter, up: nn.Parameter, config: NetConfig) -> None:
        super().__init__()
        self.embed, self.down, self.up, self.config = embed, down, up, config

    def forward(self, x: Tensor) -> Tensor:
        count = self.config.features
        state, known, flags = x.unflatten(-1, (self.config.patch, -1)).split(
            [count, 2 * count, x.shape[-1] // self.config.patch - 3 * count], dim=-1
        )
        hint = F.linear(F.linear(known.flatten(-2), QUICK * self.down), QUICK * self.up)
        return self.embed(torch.cat([state, flags], dim=-1).flatten(-2)) + hint


class AdapterNet(nn.Module):
    """An adapter in training over a frozen network, which stays in evaluation mode.

    Its parameters and its state are the adapter's tensors alone; the frozen network is not a part of it.
    """

    def __init__(
        self, net: PriorNet, rank: int, *, given_rank: int, start: Adapter | None = None, taught: bool = False
    ) -> None:
        super().__init__()
        base = copy.deepcopy(net).eval().requires_grad_(False)
        layers = linears(base, taught=taught)
        sizes = {name: (layer.in_features, layer.out_features, rank) for name, layer in layers.items()}
        if given_rank:
            sizes[GIVEN] = (net.config.patch * 2 * net.config.features, net.config.width, given_rank)
        self.factors = nn.ParameterDict()
        for name, (inner, outer, size) in sizes.items():
            spread = 1 / math.sqrt(inner) if name != GIVEN else 1 / (QUICK * math.sqrt(SPARSE))
            self.factors[_plain(f"{name}.down")] = nn.Parameter(torch.randn(size, inner) * spread)
            self.factors[_plain(f"{name}.up")] = nn.Parameter(torch.zeros(outer, size))
        if start:
            self.load_state_dict(
                {f"factors.{_plain(k)}": torch.from_numpy(v) / _pace(k) for k, v in start.tensors.items()}
            )
        for name, layer in layers.items():
            parent = base.get_submodule(name.rpartition(".")[0])
            setattr(parent, name.rsplit(".", 1)[-1], LowRank(layer, *self._pair(name)))
        if given_rank:
            setattr(base, "embed", GivenEmbed(base.embed, *self._pair(GIVEN), net.config))  # noqa: B010
        self._net = (AdaptedNet(base, bool(given_rank)),)  # in a tuple: not a sub-module

    def _pair(self, name: str) -> tuple[nn.Parameter, nn.Parameter]:
        return self.factors[_plain(f"{name}.down")], self.factors[_plain(f"{name}.up")]  # type: ignore[return-value]

    @property
    def whole(self) -> AdaptedNet:
        """The frozen network and the adapter's changes of it."""
        return self._net[0]

    def bind(self, cond: Condition) -> Bound:
        """See `PriorNet.bind`."""
        return self._net[0].bind(cond)

    def forward(self, x: Tensor, level: int | Tensor, bound: Bound | Controlled) -> Tensor:
        return self._net[0](x, level, bound)


def tensors_of(state: Mapping[str, Tensor]) -> dict[str, np.ndarray]:
    """An adapter's tensors out of the state of an `AdapterNet`."""
    named = {key.removeprefix("factors.").replace("/", "."): value for key, value in state.items()}
    return {key: (value.detach().cpu() * _pace(key)).float().numpy() for key, value in named.items()}


def _pace(key: str) -> float:
    return QUICK if key.startswith(f"{GIVEN}.") else 1.0


def _plain(name: str) -> str:
    return name.replace(".", "/")  # names of parameters may not have dots
