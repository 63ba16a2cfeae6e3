"""`Prior`: everything one weight file holds, and the file itself.

One safetensors file: tensors ``net.*`` (float16 or float32), ``mean``, ``std``, optionally ``text.*`` (the embedded
text encoder) and ``known.*`` (a table of training sentences), and JSON metadata under ``motionloom``: version, network
sizes, schedule, features, text encoder, licence, provenance, known sentences. Nothing in it is ever executed.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from torch import Tensor

from motionloom.diffusion import SCHEDULES, Schedule
from motionloom.errors import MotionloomError
from motionloom.io.tensors import check_head
from motionloom.nets.prior import Condition, NetConfig, PriorNet, condition
from motionloom.nets.text import MiniLM, TextEncoder
from motionloom.nets.text.known import Known, pack_known, unpack_known, with_sentences
from motionloom.nets.text.published import TEXTS, PublishedText
from motionloom.nets.unfilled import unfilled
from motionloom.weights.adapter import Adapter, merged, origin
from motionloom.weights.container import PRIORS, fill, halved, read_tensors

__all__ = ["read_tensors"]


@dataclass(frozen=True)
class Card:
    """What a weight file says about itself."""

    name: str
    licence: str = "unknown: ask whoever gave you this file"
    """What one may do with the weights."""
    data: str = "unknown"
    """What they were trained on, with the acknowledgements that asks for."""
    notes: dict[str, Any] = field(default_factory=dict)
    """How they were made: steps, seed, recipe, measured numbers."""


@dataclass(frozen=True, eq=False)
class Prior:
    """A diffusion model of motion, ready to sample."""

    net: PriorNet
    schedule: Schedule
    mean: Tensor
    """(features,) of the training data; 263 for HumanML3D."""
    std: Tensor
    text: TextEncoder
    card: Card
    fps: float = 20.0
    known: Known | None = None
    """What it has learned, in words; None: its file does not say."""
    origin: str = ""
    """The fingerprint of the network that adapters were merged into; empty where none were."""

    @staticmethod
    def load(weights: str | Path = "default", *, device: str | torch.device = "cpu") -> "Prior":
        """Read a weight file: a path, or the name of one that ships with the package (``default``).

        Raises `MotionloomError` for a file that is missing, damaged or of another kind, and for a device there is not.
        """
        place = find_device(device)
        return load_prior(find_weights(weights), place)

    def to(self, device: str | torch.device) -> "Prior":
        """The same prior with its network and statistics on another device."""
        return replace(self, net=self.net.to(device), mean=self.mean.to(device), std=self.std.to(device))

    def with_adapters(self, adapters: Sequence[tuple[Adapter, float]]) -> "Prior":
        """The same prior with adapters of `motionloom teach` merged into its weights, each times its factor.

        Several add up, in whatever order they are merged. Adapters for control still belong to the result, as does a
        two-person block. Raises `MotionloomError` for adapters of another kind or prior and for factors out of range.
        """
        if not adapters:
            return self
        for adapter, _ in adapters:
            adapter.check_prior(self)
        said = [text for adapter, factor in adapters if factor > 0 for text in adapter.captions]
        known = with_sentences(self.known, said, self.text) if self.known is not None and said else self.known
        return replace(self, net=merged(self.net, adapters), origin=origin(self), known=known)

    def condition(self, prompts: list[str], lengths: list[int] | None = None) -> Condition:
        """Encode prompts, one row each; an empty prompt asks for nothing in particular."""
        said = self.text.encode(prompts).to(self.mean.device)
        if self.net.modulated:
            cond = condition(said.pooled, tokens=said.tokens, words=said.mask, lengths=lengths)
        else:
            cond = condition(said.pooled, lengths=lengths)
        keep = torch.tensor([bool(p.strip()) for p in prompts], device=self.mean.device)
        return cond if bool(keep.all()) else cond.choose(keep)


def find_device(name: str | torch.device) -> torch.device:
    """The device of that name; raises MotionloomError where this machine or this PyTorch has none."""
    try:
        device = torch.device(name)
        torch.empty(1, device=device).cpu()
        return device
    except (RuntimeError, AssertionError, NotImplementedError) as error:
        reason = " ".join(str(error).split())[:80]
        raise MotionloomError(f"the device {str(name)!r} cannot be used ({reason}); cpu always can") from None


def shipped() -> dict[str, Path]:
    """Names and places of the priors inside the package."""
    return PRIORS.shipped()


def find_weights(weights: str | Path) -> Path:
    """The file for a shipped name or a path."""
    return PRIORS.find(weights)


def save_prior(prior: Prior, path: Path | str, *, half: bool = True) -> Path:
    """Write a prior as a .safetensors file and give the path back; as float16 unless ``half`` is False.

    The embedded text encoder goes inside. Raises `MotionloomError` for another suffix or a place not to be written.
    """
    tensors = {f"net.{k}": v for k, v in halved(prior.net.state_dict(), half).items()}
    tensors |= {"mean": prior.mean.float().clone(), "std": prior.std.float().clone()}
    if isinstance(prior.text, MiniLM):
        tensors |= {f"text.{k}": v for k, v in prior.text.to_tensors().items()}
    about = {
        "net": asdict(prior.net.config),
        "schedule": {"name": prior.schedule.name, "steps": prior.schedule.steps},
        "text": prior.text.name,
        "fps": prior.fps,
        "card": asdict(prior.card),
    }
    if prior.known is not None:
        table, about["known"] = pack_known(prior.known)
        tensors |= table
    return PRIORS.write(path, tensors, about)


def read_card(path: Path) -> Card:
    """What a weight file says about itself, without its weights; raises MotionloomError as `load_prior` does."""
    try:
        check_head(path, max_bytes=PRIORS.max_bytes)
        with safe_open(path, framework="pt") as file:
            return Card(**_about(path, PRIORS.describe(path, dict(file.metadata() or {})))["card"])
    except (SafetensorError, OSError, ValueError) as error:
        if isinstance(error, MotionloomError):
            raise
        raise MotionloomError(f"{path} is not a whole safetensors file ({error}); fetch the weights again") from None


def load_prior(path: Path, device: str | torch.device = "cpu") -> Prior:
    """Read a prior; raises MotionloomError where the file is damaged, of another kind or of a newer format."""
    about, tensors = PRIORS.read(path)
    about = _about(path, about)
    config = NetConfig.parse(about["net"])
    with unfilled():
        net = PriorNet(config)
    fill(net, {k[4:]: v.float() for k, v in tensors.items() if k.startswith("net.")}, str(path))
    for name in ("mean", "std"):
        values = tensors.get(name, torch.empty(0)).float()
        usable = values.shape == (config.features,) and bool(values.isfinite().all())
        if not usable or (name == "std" and values.min() < 0):
            raise MotionloomError(f"{path} lacks a usable {name} of {config.features} numbers; fetch the weights again")
    schedule = SCHEDULES[about["schedule"]["name"]](about["schedule"]["steps"])
    prior = Prior(
        net.eval().requires_grad_(False), schedule, tensors["mean"].float(), tensors["std"].float(),
        _text(path, about["text"], tensors), Card(**about["card"]), float(about["fps"]),
        _known(path, about.get("known"), tensors, config.text),
    )  # fmt: skip
    if prior.text.width != config.text:
        raise MotionloomError(
            f"{path} reads texts of width {config.text} and its text encoder gives {prior.text.width}; fetch it again"
        )
    return prior if str(device) == "cpu" else prior.to(device)


def _about(path: Path, about: dict[str, Any]) -> dict[str, Any]:
    """A description with every value of the right kind."""
    with PRIORS.parsing(path):
        steps = about["schedule"]["steps"]
        known = about["schedule"]["name"] in SCHEDULES and type(steps) is int and 1 <= steps <= 100_000
        kinds = {"name": str, "licence": str, "data": str, "notes": dict}
        card = about["card"]
        good_card = "name" in card and all(isinstance(card.get(k, kind()), kind) for k, kind in kinds.items())
        good_rate = type(about["fps"]) in (int, float) and math.isfinite(about["fps"]) and 1 <= about["fps"] <= 1000
        if not (
            known and good_card and good_rate and isinstance(about["net"], dict) and isinstance(about["text"], str)
        ):
            raise ValueError("values of the wrong kind")
        return {**about, "card": {k: card[k] for k in kinds if k in card}}


def _text(path: Path, name: str, tensors: dict[str, Tensor]) -> TextEncoder:
    if name == "minilm":
        return MiniLM.from_tensors({k[5:]: v for k, v in tensors.items() if k.startswith("text.")})
    if name in TEXTS:
        return PublishedText(name)
    raise MotionloomError(f"{path} wants the text encoder {name!r}, which this motionloom does not have")


def _known(path: Path, about: Any, tensors: dict[str, Tensor], width: int) -> Known | None:
    if about is None:  # files of before there were tables
        return None
    try:
        return unpack_known(tensors, about, width=width)
    except ValueError as error:
        raise MotionloomError(f"{path} is damaged: {error}; fetch the weights again") from None
