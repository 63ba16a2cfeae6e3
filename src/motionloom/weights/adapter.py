"""Low-rank changes of a prior's network that teach it an action, a style or one kind of control, and their files.

A layer's weight W becomes W + U D with thin U and D (LoRA, Hu et al. 2022). What is taught from a few clips is merged
into the weights, each adapter with a factor (`merged`). An adapter for control may also add an input: the
network then sees which numbers are given and what they are, through embed(x) + U_g D_g [given, mask]. In the state
itself they are scaled by the signal, which is next to nothing at the levels where it is decided what will be shown. The
published control models are full fine-tunes and have the state alone (Shafir et al. 2024, algorithm 1); those are
ordinary priors.

An `AdaptedNet` is called like the network it comes from; with `Controlled` as its condition it sees what is given.
"""

import copy
import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from motionloom.errors import MotionloomError
from motionloom.nets.prior import Bound, Condition, NetConfig, PriorNet
from motionloom.weights.container import ADAPTERS, check, halved

KEY = ADAPTERS.key
MAX_RANK = 512
CHANGED = ("embed", "out", "project", "query", "heard", "linear1", "linear2", "change")
"""Last names of the layers that an adapter changes."""
TAUGHT = "taught"
"""The ``control`` of an adapter that holds an action or a style learned from clips (`motionloom.train.teach`)."""
READS = ("words", "text")
"""Last names of the layers that such an adapter changes besides: those that read the text."""
GIVEN = "given"
"""The name under which an adapter keeps its input for what is given."""

SPARSE = 100
"""Numbers of a token that are given at once, roughly: how strong that input is when training begins."""

QUICK = 5.0
"""How much quicker that input learns than the changes of the network: in training it is kept divided by this."""


class Controlled(NamedTuple):
    """The condition of an `AdaptedNet`: what the network is bound to, and what is given."""

    bound: Bound
    given: Tensor
    """(rows, frames, features) standardised; what is not given may be anything finite."""
    mask: Tensor
    """(rows, frames, features) bool: which numbers are given."""


class HasNet(Protocol):
    """A prior, as far as an adapter looks at it."""

    @property
    def net(self) -> PriorNet: ...


@dataclass(frozen=True, eq=False)
class Adapter:
    """A low-rank change of one network."""

    name: str
    control: str
    """What it was trained for: ``trajectory``, a joint, ``any`` ..."""
    rank: int
    tensors: Mapping[str, Tensor]
    """``LAYER.down`` (rank, in) and ``LAYER.up`` (out, rank); ``given.down`` (its rank, patch * 2 * features: for each
    frame of a token first the given numbers, then the mask) and ``given.up``."""
    base: str
    """Name of the prior it changes."""
    fingerprint: str
    """`fingerprint` of that prior's network."""
    licence: str = "unknown: ask whoever gave you this file"
    data: str = "unknown"
    notes: dict[str, Any] = field(default_factory=dict)

    @property
    def taught(self) -> bool:
        """Whether it holds an action or a style, to be merged into the weights; else it is one for control."""
        return self.control == TAUGHT

    @property
    def sees_given(self) -> bool:
        """Whether it has an input for what is given."""
        return f"{GIVEN}.down" in self.tensors

    @property
    def given_rank(self) -> int:
        """Rank of that input; 0: none."""
        return len(self.tensors[f"{GIVEN}.down"]) if self.sees_given else 0

    @staticmethod
    def load(adapter: str | Path, prior: HasNet) -> "Adapter":
        """A shipped adapter by name, or one from a file, for this prior.

        Raises `MotionloomError` for a file that is missing, damaged or too large, and for another prior's adapter.
        """
        path = ADAPTERS.find(adapter)
        found = read_adapter(path)
        found.check_prior(prior, path.name)
        layers = linears(prior.net, taught=found.taught)
        check(found.tensors, dict(_shapes(found, prior.net.config, layers)), str(path))
        return found

    @property
    def captions(self) -> tuple[str, ...]:
        """The sentences that it was taught, where it was."""
        said = self.notes.get("captions", [])
        return tuple(text for text in said if isinstance(text, str)) if isinstance(said, list) else ()

    def check_prior(self, prior: HasNet, file: str = "") -> None:
        """Raise `MotionloomError` where it belongs to another prior; ``file``: what the sentence calls it."""
        if self.fingerprint != origin(prior):
            raise MotionloomError(
                f"the adapter {file or self.name} belongs to the weights {self.base!r}, and these are others; "
                "use those weights, or train an adapter for these"
            )

    def save(self, path: Path | str) -> Path:
        """Write it as a .safetensors file (float16) and give the path back; the file appears whole or not at all."""
        about = {key: getattr(self, key) for key in _TEXTS} | {"rank": self.rank, "notes": self.notes}
        return ADAPTERS.write(path, halved(self.tensors), about)


_TEXTS = ("name", "control", "base", "fingerprint", "licence", "data")


def adapters() -> dict[str, Path]:
    """Names and places of the adapters inside the package, for the prior ``default``."""
    return ADAPTERS.shipped()


def is_adapter(path: Path) -> bool:
    """True for a file of `Adapter.save`, damaged or not, by what its head says."""
    return ADAPTERS.signed(path)


def read_adapter(path: Path) -> Adapter:
    """What a file holds and says, without a prior to fit it to; raises MotionloomError as `Adapter.load`."""
    about, tensors = ADAPTERS.read(path)
    with ADAPTERS.parsing(path):
        rank, notes, said = about["rank"], about.get("notes", {}), {key: about[key] for key in _TEXTS}
        good = isinstance(rank, int) and not isinstance(rank, bool) and 1 <= rank <= MAX_RANK
        if not good or not isinstance(notes, dict) or not all(isinstance(value, str) for value in said.values()):
            raise ValueError("values of the wrong kind")
    return Adapter(rank=rank, tensors={k: v.float() for k, v in tensors.items()}, notes=notes, **said)


def fingerprint(net: PriorNet) -> str:
    """A digest of a network's weights as its file holds them (float16)."""
    digest = hashlib.sha256()
    for name, value in sorted(net.state_dict().items()):
        digest.update(f"{name}{tuple(value.shape)}".encode())
        digest.update(value.detach().cpu().half().contiguous().numpy().tobytes())
    return digest.hexdigest()


def origin(prior: HasNet) -> str:
    """The `fingerprint` of a prior's network as it was before adapters were merged into it."""
    return getattr(prior, "origin", "") or fingerprint(prior.net)


def linears(net: PriorNet, *, taught: bool = False) -> dict[str, nn.Linear]:
    """The layers of a network that an adapter changes, by name; ``taught``: also those that read the text."""
    names = (*CHANGED, *READS) if taught else CHANGED
    return {
        name: layer
        for name, layer in net.named_modules()
        if isinstance(layer, nn.Linear) and name.rsplit(".", 1)[-1] in names
    }


def merged(net: PriorNet, adapters: Sequence[tuple[Adapter, float]]) -> PriorNet:
    """A copy of the network with W + sum of factor * U D for the weights W; as quick as the network itself.

    Raises `MotionloomError` for an adapter for control, which is no change of weights alone, and for a factor that is
    not finite.
    """
    made = copy.deepcopy(net).eval().requires_grad_(False)
    layers = linears(made, taught=True)
    for adapter, factor in adapters:
        if not adapter.taught:
            raise MotionloomError(
                f"the adapter {adapter.name!r} is one for control ({adapter.control}); only adapters made by "
                "'motionloom teach' change what is sampled by words"
            )
        if not math.isfinite(factor):
            raise MotionloomError(f"the adapter {adapter.name!r} has the factor {factor}; give a number such as 0.8")
        for name, layer in layers.items():
            down, up = (adapter.tensors[f"{name}.{part}"].to(layer.weight) for part in ("down", "up"))
            layer.weight += factor * (up @ down)
    return made


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
            plain, shown = bound.bound, [torch.where(bound.mask, bound.given.to(x), 0.0), bound.mask.to(x)]
        else:
            plain, shown = bound, [torch.zeros_like(x)] * 2
        return self.net(torch.cat([x, *shown], dim=-1) if self.sees_given else x, level, plain)


def show(net: nn.Module, bound: Bound, given: Tensor, mask: Tensor) -> Bound | Controlled:
    """The condition that shows a network what is given, if it takes one; see `Controlled`."""
    return Controlled(bound, given, mask) if isinstance(net, AdaptedNet | AdapterNet) else bound


def adapted(net: PriorNet, adapter: Adapter) -> AdaptedNet:
    """A copy of the network with the adapter merged into its weights: as quick as the network itself."""
    made = copy.deepcopy(net).eval().requires_grad_(False)
    for name, layer in linears(made, taught=adapter.taught).items():
        down, up = (adapter.tensors[f"{name}.{part}"].to(layer.weight) for part in ("down", "up"))
        layer.weight = nn.Parameter(layer.weight + up @ down, requires_grad=False)
    if adapter.sees_given:
        down, up = (adapter.tensors[f"{GIVEN}.{part}"].to(made.embed.weight) for part in ("down", "up"))
        wide = beside(made.embed.weight, up @ down, net.config)
        made.embed = nn.Linear(wide.shape[1], wide.shape[0], device="meta")
        made.embed.weight = nn.Parameter(wide, requires_grad=False)
        made.embed.bias = nn.Parameter(net.embed.bias.detach().clone(), requires_grad=False)
    return AdaptedNet(made, adapter.sees_given)


def beside(embed: Tensor, given: Tensor, config: NetConfig) -> Tensor:
    """Weights that read frames of [state, given, mask, flags], from those of state and flags and those of the rest."""
    state = embed.unflatten(1, (config.patch, -1))
    shown = given.unflatten(1, (config.patch, -1))
    return torch.cat([state[..., : config.features], shown, state[..., config.features :]], dim=-1).flatten(1)


class LowRank(nn.Module):
    """A frozen layer and its change, kept apart: in training no gradient of the layer's own weight is made."""

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
        state, given, flags = x.unflatten(-1, (self.config.patch, -1)).split(
            [count, 2 * count, x.shape[-1] // self.config.patch - 3 * count], dim=-1
        )
        seen = F.linear(F.linear(given.flatten(-2), QUICK * self.down), QUICK * self.up)
        return self.embed(torch.cat([state, flags], dim=-1).flatten(-2)) + seen


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
            self.load_state_dict({f"factors.{_plain(k)}": v.float() / _pace(k) for k, v in start.tensors.items()})
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


def tensors_of(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """An adapter's tensors out of the state of an `AdapterNet`."""
    named = {key.removeprefix("factors.").replace("/", "."): value for key, value in state.items()}
    return {key: value * _pace(key) for key, value in named.items()}


def _pace(key: str) -> float:
    return QUICK if key.startswith(f"{GIVEN}.") else 1.0


def _plain(name: str) -> str:
    return name.replace(".", "/")  # names of parameters may not have dots


def _shapes(
    adapter: Adapter, config: NetConfig, layers: Mapping[str, nn.Linear]
) -> Iterator[tuple[str, tuple[int, ...]]]:
    for name, layer in layers.items():
        yield f"{name}.down", (adapter.rank, layer.in_features)
        yield f"{name}.up", (layer.out_features, adapter.rank)
    if adapter.sees_given:
        down = adapter.tensors[f"{GIVEN}.down"]
        size = min(len(down), MAX_RANK) if down.ndim else 0
        yield f"{GIVEN}.down", (size, config.patch * 2 * config.features)
        yield f"{GIVEN}.up", (config.width, size)
