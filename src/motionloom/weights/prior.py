"""`Prior`: everything one weight file holds, and the file itself.

One safetensors file: tensors ``net.*`` (float16 or float32), ``mean``, ``std``, optionally ``text.*`` (the embedded
text encoder) and ``known.*`` (a table of training sentences), and JSON metadata under ``motionloom``: version, network
sizes, schedule, features, text encoder, licence, provenance, known sentences. Nothing in it is ever executed.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from torch import Tensor

from motionloom.diffusion import SCHEDULES, Schedule
from motionloom.errors import MotionloomError
from motionloom.io.atomic import finished
from motionloom.io.tensors import save_tensors
from motionloom.io.text import plain_json
from motionloom.nets.prior import Condition, NetConfig, PriorNet, condition
from motionloom.nets.text import MiniLM, TextEncoder
from motionloom.nets.text.known import Known, pack_known, unpack_known, with_sentences
from motionloom.nets.text.published import TEXTS, PublishedText
from motionloom.nets.unfilled import unfilled
from motionloom.weights.adapter import Adapter, merged, origin
from motionloom.weights.container import fill, is_signed

FORMAT = 1
MAX_BYTES = 2 << 30


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
    folder = Path(str(resources.files("motionloom"))) / "weights"
    return {path.stem: path for path in finished(folder, "*.safetensors") if is_signed(path, "motionloom")}


def find_weights(weights: str | Path) -> Path:
    """The file for a shipped name or a path."""
    names = shipped()
    if str(weights) in names:
        return names[str(weights)]
    path = Path(weights)
    if not path.is_file():
        listed = ", ".join(names) or "none"
        raise MotionloomError(f"no weights {str(weights)!r}: there is no such file, and the shipped names are {listed}")
    return path


def save_prior(prior: Prior, path: Path | str, *, half: bool = True) -> Path:
    """Write a prior as a .safetensors file and give the path back; as float16 unless ``half`` is False.

    The embedded text encoder goes inside. Raises `MotionloomError` for another suffix or a place not to be written.
    """
    path = Path(path)
    if path.suffix != ".safetensors":
        raise MotionloomError(f"weights are written as .safetensors; {path.name} has another suffix")
    kind = torch.float16 if half else torch.float32
    tensors = {f"net.{k}": v.detach().cpu().to(kind).contiguous() for k, v in prior.net.state_dict().items()}
    tensors |= {"mean": prior.mean.cpu().float().clone(), "std": prior.std.cpu().float().clone()}
    if isinstance(prior.text, MiniLM):
        tensors |= {f"text.{k}": v.contiguous() for k, v in prior.text.to_tensors().items()}
    about = {
        "format": FORMAT,
        "net": asdict(prior.net.config),
        "schedule": {"name": prior.schedule.name, "steps": prior.schedule.steps},
        "text": prior.text.name,
        "fps": prior.fps,
        "card": asdict(prior.card),
    }
    if prior.known is not None:
        table, about["known"] = pack_known(prior.known)
        tensors |= table
    save_tensors(tensors, path, metadata={"motionloom": json.dumps(about)})
    return path


def read_tensors(path: Path) -> tuple[dict[str, Tensor], dict[str, str]]:
    """Tensors and metadata of a safetensors file, sizes checked; pickles are refused by what they are."""
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise MotionloomError(f"{path} is {size / 2**30:.1f} GiB large; weight files of at most 2 GiB are read")
        with safe_open(path, framework="pt") as file:
            return {key: file.get_tensor(key) for key in file.keys()}, dict(file.metadata() or {})  # noqa: SIM118
    except (SafetensorError, OSError, ValueError, TypeError, KeyError, RuntimeError, AttributeError) as error:
        if isinstance(error, MotionloomError):
            raise
        raise MotionloomError(
            f"{path} is not a whole safetensors file ({error}); published .pt files come in through 'motionloom import'"
        ) from None


def read_card(path: Path) -> Card:
    """What a weight file says about itself, without its weights; raises MotionloomError as `load_prior` does."""
    try:
        with safe_open(path, framework="pt") as file:
            return Card(**_about(path, dict(file.metadata() or {}))["card"])
    except SafetensorError as error:
        raise MotionloomError(f"{path} is not a whole safetensors file ({error}); fetch the weights again") from None


def load_prior(path: Path, device: str | torch.device = "cpu") -> Prior:
    """Read a prior; raises MotionloomError where the file is damaged, of another kind or of a newer format."""
    tensors, metadata = read_tensors(path)
    about = _about(path, metadata)
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


def _about(path: Path, metadata: dict[str, str]) -> dict[str, Any]:
    if "motionloom" not in metadata:  # such as an evaluator's or an adapter's
        raise MotionloomError(f"{path} does not describe a motionloom prior; name a file that does")
    try:
        about = plain_json(metadata["motionloom"])
        if about["format"] != FORMAT:
            raise MotionloomError(
                f"{path} has format {about['format']}; this motionloom reads format {FORMAT}: update it"
            )
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
        about["card"] = {k: about["card"][k] for k in ("name", "licence", "data", "notes") if k in about["card"]}
        return about
    except MotionloomError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as error:
        raise MotionloomError(
            f"{path} does not describe a motionloom prior ({error!r}); name a file that does"
        ) from None


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
