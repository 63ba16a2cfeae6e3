"""`Prior`: everything one weight file holds, and the file itself.

One safetensors file: tensors ``net.*`` (float16 or float32), ``mean``, ``std``, optionally ``text.*`` (the embedded
text encoder) and ``known.*`` (a table of training sentences), and JSON metadata under ``motionloom``: version, network
sizes, schedule, features, text encoder, licence, provenance, known sentences. Nothing in it is ever executed.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError, safe_open

from motionloom.core.arrays import unit
from motionloom.core.diffusion import SCHEDULES, Schedule
from motionloom.core.errors import MotionloomError
from motionloom.core.files.tensors import check_head
from motionloom.core.models.adapter import NET, Adapter, fingerprint, merged, origin
from motionloom.core.models.container import (
    PRIORS,
    check,
    check_graphs,
    graph_tensors,
    halved,
    read_tensors,
    split_graphs,
)
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.networks.prior_condition import Condition, condition
from motionloom.core.models.networks.session import find_device
from motionloom.core.models.networks.shapes import prior_shapes
from motionloom.core.models.networks.sizes import NetConfig
from motionloom.core.models.networks.text.known import Known, add_sentences, bare, pack_known, unpack_known
from motionloom.core.models.networks.text.minilm import MiniLM
from motionloom.core.models.networks.text.protocol import TextEncoder
from motionloom.core.models.networks.text.published import TEXTS, PublishedText

__all__ = ["find_device", "read_tensors"]
Array = np.ndarray
GRAPHS = ("prior", "bind")
"""Graphs of a prior's network; that of the embedded text encoder is ``text``."""


@dataclass(frozen=True)
class Card:
    """What a weight file says about itself."""

    name: str
    licence: str = "unknown: ask whoever gave you this file"
    """What one may do with the weights."""
    data: str = "unknown"
    """What they were trained on, with the acknowledgements that asks for."""
    notes: dict[str, Any] = field(default_factory=dict)
    """How they were trained: steps, seed, recipe, measured numbers."""

    @staticmethod
    def parse(about: dict[str, Any]) -> "Card":
        """From a file's description; raises TypeError or ValueError for what is none."""
        card = Card(**about)
        if not (isinstance(card.notes, dict) and all(isinstance(t, str) for t in (card.name, card.licence, card.data))):
            raise ValueError("a card whose entries are of the wrong kind")
        return card


def parse_schedule(about: dict[str, Any]) -> Schedule:
    """From a file's description; raises ValueError or KeyError for what is none."""
    name, levels = about["name"], about["steps"]
    if name not in SCHEDULES or type(levels) is not int or not 1 <= levels <= 100_000:
        raise ValueError(f"a schedule {name!r} of {levels!r} levels")
    return SCHEDULES[name](levels)


UNLIKE, ALIKE = 0.8, 0.95
"""Cosines to a taught caption up to which a prompt is guided as ever, and from which it is that caption."""
OWN_WORDS = 0.22
"""How much nearer a sentence may be to one that the prior knows than to a taught caption, and an adapter without a
factor still changes it (decision 0039)."""
MERGED = 4
"""Merged networks that are kept for sentences which only some adapters change; each is as large as the prior's."""
HALF_TAUGHT, LEAST_GUIDED = 0.7, 0.1
"""A factor of an adapter with which its captions need all guidance, and the share of it with which they do at 1."""


@dataclass(frozen=True, eq=False)
class Prior:
    """A diffusion model of motion, ready to sample."""

    net: PriorSession
    schedule: Schedule
    mean: Array
    """(features,) of the training data; 263 for HumanML3D."""
    std: Array
    text: TextEncoder
    card: Card
    fps: float = 20.0
    known: Known | None = None
    """What it has learned, in words; None: its file does not say."""
    origin: str = ""
    """The fingerprint of the network that adapters were merged into; empty where none were."""
    taught: tuple[tuple[str, float], ...] = ()
    """The captions that these were taught, each with the factor of its adapter."""
    base: "Prior | None" = None
    """The same without the adapters that change only sentences like their captions; None: it has no such adapters."""
    optional: tuple[Adapter, ...] = ()
    """Those adapters."""

    @staticmethod
    def load(weights: str | Path = "default", *, device: str = "cpu") -> "Prior":
        """Read a weight file: a path, or the name of one that ships with the package (``default``).

        Raises `MotionloomError` for a file that is missing, damaged or of another kind, and for a device there is not.
        """
        place = find_device(device)
        return load_prior(find_weights(weights), place)

    def to(self, device: str) -> "Prior":
        """The same prior with its network on another device."""
        base = self.base and self.base.to(device)
        return replace(self, net=self.net.on(device), base=base)

    @cached_property
    def spread(self) -> Array:
        """``std``, with 1 for numbers that never change."""
        return np.where(self.std > 0, self.std, np.float32(1))

    @cached_property
    def digest(self) -> str:
        """The `fingerprint` of the network, with what was merged into it."""
        return fingerprint(self.net)

    def to_features(self, states: Array) -> Array:
        """Standardised states (..., frames, features) to features, `smoothed`."""
        return self.smoothed(states * self.std + self.mean)

    def smoothed(self, features: Array) -> Array:
        """(..., frames, numbers) weighted 1/6, 2/3, 1/6 along time, ends repeated, where tokens hold several frames.

        Such a network makes each token smooth and leaves small steps between them.
        """
        if self.net.config.patch == 1:
            return features
        before = np.concatenate([features[..., :1, :], features[..., :-1, :]], axis=-2)
        after = np.concatenate([features[..., 1:, :], features[..., -1:, :]], axis=-2)
        return (before + 4 * features + after) / 6

    def with_adapters(self, adapters: Sequence[tuple[Adapter, float | None]]) -> "Prior":
        """The same prior with adapters of `motionloom teach` merged into its weights, each times its factor.

        Several add up, in whatever order they are merged. Adapters for control still belong to the result, as does a
        two-person block. A factor of None is 1, and the adapter changes those sentences alone that are like its
        captions (`for_words`). Raises `MotionloomError` for adapters of another kind or prior and for factors out of
        range.
        """
        if not adapters:
            return self
        for adapter, _ in adapters:
            adapter.check_prior(self)
        optional = tuple(adapter for adapter, factor in adapters if factor is None)
        whole = self._merged([(adapter, 1.0 if factor is None else factor) for adapter, factor in adapters])
        if not optional and self.base is None:
            return whole
        fixed = [(adapter, factor) for adapter, factor in adapters if factor is not None]
        return replace(whole, base=(self.base or self)._merged(fixed), optional=(*self.optional, *optional))

    def for_words(self, *prompts: str) -> "Prior":
        """The prior that samples these words: without the optional adapters that were taught nothing like any of them.

        A prompt is like a caption where no known sentence is nearer to it by more than `OWN_WORDS` (cosines of the text
        encoder, subjects left out). An empty prompt is like none.
        """
        if self.base is None:
            return self
        absent = self.left_out(*prompts)
        return self._with_optional(tuple(one not in absent for one in self.optional))

    def left_out(self, *prompts: str) -> list[Adapter]:
        """The optional adapters that do not change these words, as `for_words` says."""
        texts = [text for text in map(bare, prompts) if text.strip()]
        if self.base is None or not texts:
            return list(self.optional)
        vectors, known = unit(self.text.encode(texts).pooled), self.base.known
        familiar = (vectors @ known.vectors.T).max(axis=1) if known is not None else np.full(len(texts), -np.inf)
        return [
            adapter
            for adapter, captions in zip(self.optional, self._caption_vectors, strict=True)
            if len(captions) and ((vectors @ captions.T).max(axis=1) < familiar - OWN_WORDS).all()
        ]

    @cached_property
    def _caption_vectors(self) -> list[Array]:
        return [
            unit(self.text.encode([bare(text) for text in one.captions]).pooled) if one.captions else np.zeros((0, 1))
            for one in self.optional
        ]

    @cached_property
    def _with_optional(self) -> Callable[[tuple[bool, ...]], "Prior"]:
        """The prior with some of its optional adapters."""
        base = self.base
        assert base is not None

        @lru_cache(MERGED)
        def some(apply: tuple[bool, ...]) -> Prior:
            chosen = [(adapter, 1.0) for adapter, own in zip(self.optional, apply, strict=True) if own]
            return self if all(apply) else base._merged(chosen)

        return some

    def _merged(self, adapters: Sequence[tuple[Adapter, float]]) -> "Prior":
        if not adapters:
            return self
        taught = tuple((text, factor) for adapter, factor in adapters if factor > 0 for text in adapter.captions)
        texts = [text for text, _ in taught]
        known = add_sentences(self.known, texts, self.text) if self.known is not None and texts else self.known
        return replace(
            self, net=merged(self.net, adapters), origin=origin(self), known=known, taught=(*self.taught, *taught)
        )

    def guided_shares(self, prompts: Sequence[str]) -> Array:
        """(prompts,) of what guidance adds to 1, the share that is right for each prompt: all of it, or `LEAST_GUIDED`.

        The estimate without words knows nothing of what an adapter was taught, so guidance exaggerates the taught
        words until nothing moves any more. Other words for the same need it (decision 0019).
        """
        if not self.taught:
            return np.ones(len(prompts))
        near = unit(self.text.encode([bare(text) for text in prompts]).pooled) @ self._taught_vectors.T
        close = ((near - UNLIKE) / (ALIKE - UNLIKE)).clip(0, 1)
        whole = np.array([(factor - HALF_TAUGHT) / (1 - HALF_TAUGHT) for _, factor in self.taught]).clip(0, 1)
        return 1 - (1 - LEAST_GUIDED) * (close * whole).max(axis=1)

    @cached_property
    def _taught_vectors(self) -> Array:
        return unit(self.text.encode([bare(text) for text, _ in self.taught]).pooled)

    def condition(self, prompts: list[str], lengths: list[int] | None = None) -> Condition:
        """Encode prompts, one row each; an empty prompt is for nothing in particular."""
        text = self.text.encode(prompts)
        if self.net.modulated:
            cond = condition(text.pooled, tokens=text.tokens, words=text.mask, lengths=lengths)
        else:
            cond = condition(text.pooled, lengths=lengths)
        keep = np.array([bool(p.strip()) for p in prompts])
        return cond if keep.all() else cond.choose(keep)


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
    tensors = halved(prior.net.weights, half)
    tensors |= {name: getattr(prior, name).astype(np.float32) for name in ("mean", "std")}
    graphs = dict(prior.net.graphs)
    if isinstance(prior.text, MiniLM):
        tensors |= {f"text.{k}": v for k, v in prior.text.to_tensors().items()}
        graphs["text"] = prior.text.graph
    tensors |= graph_tensors(graphs)
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
        with safe_open(path, framework="np") as file:
            return _about(path, PRIORS.describe(path, dict(file.metadata() or {})))["card"]
    except (SafetensorError, OSError, ValueError) as error:
        if isinstance(error, MotionloomError):
            raise
        raise MotionloomError(f"{path} is not a whole safetensors file ({error}); fetch the weights again") from None


def load_prior(path: Path, device: str = "cpu") -> Prior:
    """Read a prior; raises MotionloomError where the file is damaged, of another kind or of a newer format."""
    about, tensors = PRIORS.read(path)
    about = _about(path, about)
    config = NetConfig.parse(about["net"])
    tensors, graphs = split_graphs(tensors)
    weights = {key: value for key, value in tensors.items() if key.startswith(NET)}
    check({key[len(NET) :]: value for key, value in weights.items()}, prior_shapes(config), str(path))
    for name in ("mean", "std"):
        values = tensors.get(name, np.empty(0)).astype(np.float32)
        usable = values.shape == (config.features,) and np.isfinite(values).all()
        if not usable or (name == "std" and values.min() < 0):
            raise MotionloomError(f"{path} lacks a usable {name} of {config.features} numbers; fetch the weights again")
    check_graphs(path, graphs, GRAPHS if about["text"] != "minilm" else (*GRAPHS, "text"))
    net = PriorSession(config, weights, {name: graphs[name] for name in GRAPHS}, device)
    net.check()
    prior = Prior(
        net,
        about["schedule"],
        tensors["mean"].astype(np.float32),
        tensors["std"].astype(np.float32),
        _text(path, about["text"], tensors, graphs),
        about["card"],
        float(about["fps"]),
        _known(path, about.get("known"), tensors, config.text),
    )
    if prior.text.width != config.text:
        raise MotionloomError(
            f"{path} reads texts of width {config.text} and its text encoder gives {prior.text.width}; fetch it again"
        )
    return prior


def _about(path: Path, about: dict[str, Any]) -> dict[str, Any]:
    """A description with every value of the right kind, the card and the schedule among them as such."""
    with PRIORS.parsing(path):
        good_rate = type(about["fps"]) in (int, float) and math.isfinite(about["fps"]) and 1 <= about["fps"] <= 1000
        if not (good_rate and isinstance(about["net"], dict) and isinstance(about["text"], str)):
            raise ValueError("values of the wrong kind")
        card = Card.parse({key: value for key, value in about["card"].items() if key in Card.__annotations__})
        return about | {"card": card, "schedule": parse_schedule(about["schedule"])}


def _text(path: Path, name: str, tensors: dict[str, Array], graphs: dict[str, bytes]) -> TextEncoder:
    if name == "minilm":
        packed = {k[5:]: v for k, v in tensors.items() if k.startswith("text.")}
        return MiniLM.from_tensors(packed, graphs["text"])
    if name in TEXTS:
        return PublishedText(name)
    raise MotionloomError(f"{path} wants the text encoder {name!r}, which this motionloom does not have")


def _known(path: Path, about: Any, tensors: dict[str, Array], width: int) -> Known | None:
    if about is None:  # files of before there were tables
        return None
    try:
        return unpack_known(tensors, about, width=width)
    except ValueError as error:
        raise MotionloomError(f"{path} is damaged: {error}; fetch the weights again") from None
