"""Low-rank changes of a prior's network that teach it an action, a style or one kind of control, and their files.

A layer's weight W becomes W + U D with thin U and D (LoRA, Hu et al. 2022). All are merged into the weights, those that
are taught from a few clips each with a factor (`merged`). An adapter for control may also add an input: the
network then sees which numbers are given and what they are, through embed(x) + U_g D_g [given, mask]. In the state
itself they are scaled by the signal, which is next to nothing at the levels where the motion is decided. The
published control models are full fine-tunes and have the state alone (Shafir et al. 2024, algorithm 1); those are
ordinary priors.
"""

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.models.container import ADAPTERS, check, halved
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.networks.sizes import NetConfig

MAX_RANK = 512
CHANGED = ("embed", "out", "project", "query", "heard", "linear1", "linear2", "change")
"""Last names of the layers that an adapter changes."""
TAUGHT = "taught"
"""The ``control`` of an adapter that holds an action or a style learned from clips (`motionloom_train.teach`)."""
READS = ("words", "text")
"""Last names of the layers that such an adapter changes besides: those that read the text."""
GIVEN = "given"
"""The name under which an adapter keeps its input for what is given."""
NET = "net."
"""What the names of a prior's weights begin with in its file."""


class HasNet(Protocol):
    """A prior, as far as an adapter looks at it."""

    @property
    def net(self) -> PriorSession: ...


@dataclass(frozen=True, eq=False)
class Adapter:
    """A low-rank change of one network."""

    name: str
    control: str
    """What it was trained for: ``trajectory``, a joint, ``any`` ..."""
    rank: int
    tensors: Mapping[str, np.ndarray]
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
        result = read_adapter(path)
        result.check_prior(prior, path.name)
        changed = layers(prior.net, taught=result.taught)
        shapes = dict(_shapes(result, prior.net.config, changed))
        check(result.tensors, shapes, str(path))
        return result

    @property
    def captions(self) -> tuple[str, ...]:
        """The sentences that it was taught, where it was."""
        texts = self.notes.get("captions", [])
        return tuple(text for text in texts if isinstance(text, str)) if isinstance(texts, list) else ()

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


def read_adapter(path: Path) -> Adapter:
    """What a file holds and says, without a prior to fit it to; raises MotionloomError as `Adapter.load`."""
    about, tensors = ADAPTERS.read(path)
    with ADAPTERS.parsing(path):
        rank, notes = about["rank"], about.get("notes", {})
        texts = {key: about[key] for key in _TEXTS}
        good = type(rank) is int and 1 <= rank <= MAX_RANK
        if not good or not isinstance(notes, dict) or not all(isinstance(value, str) for value in texts.values()):
            raise ValueError("values of the wrong kind")
    tensors = {key: value.astype(np.float32) for key, value in tensors.items()}
    return Adapter(rank=rank, tensors=tensors, notes=notes, **texts)


def fingerprint(net: PriorSession) -> str:
    """A digest of a network's weights as its file holds them (float16)."""
    digest = hashlib.sha256()
    for name, value in sorted((key.removeprefix(NET), value) for key, value in net.weights.items()):
        digest.update(f"{name}{tuple(value.shape)}".encode())
        digest.update(np.ascontiguousarray(value, np.float16).tobytes())
    return digest.hexdigest()


def origin(prior: HasNet) -> str:
    """The `fingerprint` of a prior's network as it was before adapters were merged into it."""
    return getattr(prior, "origin", "") or fingerprint(prior.net)


def layers(net: PriorSession, *, taught: bool = False) -> dict[str, np.ndarray]:
    """Weights (out, in) of the layers of a network that an adapter changes, by name; ``taught``: also those that read
    the text."""
    names = (*CHANGED, *READS) if taught else CHANGED
    keys = {key.removeprefix(NET).removesuffix(".weight"): key for key in net.weights if key.endswith(".weight")}
    return {
        name: net.weights[key]
        for name, key in keys.items()
        if name.rsplit(".", 1)[-1] in names and net.weights[key].ndim == 2
    }


def merged(net: PriorSession, adapters: Sequence[tuple[Adapter, float]]) -> PriorSession:
    """The network with W + sum of factor * U D for the weights W; as quick as the network itself.

    Raises `MotionloomError` for an adapter for control, which is no change of weights alone, and for a factor that is
    not finite.
    """
    for adapter, factor in adapters:
        if not adapter.taught:
            raise MotionloomError(
                f"the adapter {adapter.name!r} is one for control ({adapter.control}); only adapters made by "
                "'motionloom teach' change what is sampled by words"
            )
        if not math.isfinite(factor):
            raise MotionloomError(f"the adapter {adapter.name!r} has the factor {factor}; give a number such as 0.8")
    return _changed(net, adapters)


def adapted(net: PriorSession, adapter: Adapter) -> PriorSession:
    """The network with the adapter merged into its weights, as quick as the network itself; it may be shown what is
    known (`PriorSession.show`)."""
    changed = _changed(net, [(adapter, 1.0)])
    if not adapter.sees_given:
        return changed
    up, down = (adapter.tensors[f"{GIVEN}.{part}"] for part in ("up", "down"))
    return replace(changed, control=up @ down)


def _changed(net: PriorSession, adapters: Sequence[tuple[Adapter, float]]) -> PriorSession:
    weights = dict(net.weights)
    for name, weight in layers(net, taught=any(adapter.taught for adapter, _ in adapters)).items():
        whole = weight.astype(np.float32)
        for adapter, factor in adapters:
            if f"{name}.up" in adapter.tensors:
                change = adapter.tensors[f"{name}.up"] @ adapter.tensors[f"{name}.down"]
                whole += np.float32(factor) * change
        weights[f"{NET}{name}.weight"] = whole
    return replace(net, weights=weights)


def _shapes(
    adapter: Adapter, config: NetConfig, layers: Mapping[str, np.ndarray]
) -> Iterator[tuple[str, tuple[int, ...]]]:
    for name, weight in layers.items():
        yield f"{name}.down", (adapter.rank, weight.shape[1])
        yield f"{name}.up", (weight.shape[0], adapter.rank)
    if adapter.sees_given:
        down = adapter.tensors[f"{GIVEN}.down"]
        size = min(len(down), MAX_RANK) if down.ndim else 0
        yield f"{GIVEN}.down", (size, config.patch * 2 * config.features)
        yield f"{GIVEN}.up", (config.width, size)
