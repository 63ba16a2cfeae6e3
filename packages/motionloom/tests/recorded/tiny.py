"""Priors small enough for tests: random weights, an embedded text encoder one can read."""

import numpy as np

from motionloom.core.diffusion import cosine
from motionloom.core.models.adapter import GIVEN, NET, TAUGHT, Adapter, fingerprint, layers
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.networks.shapes import prior_shapes
from motionloom.core.models.networks.sizes import NetConfig
from motionloom.core.models.networks.text.minilm import SPECIALS, WORDS, MiniLM, pack, shapes
from motionloom.core.models.prior import Card, Prior
from tests.recorded.graphs import MODULATED, PUBLISHED, TEXT, graph, random_weights

__all__ = ["MODULATED", "PUBLISHED"]
PIECES = ["a", "person", "walks", "turns", "left", "right", "walk", "##s", "##ing", "jump", "un", "##aff", "##able"]
VOCABULARY = [
    *SPECIALS,
    *PIECES,
    ".",
    *"bcdefghijklmnopqrstuvwxyz",
    *(f"##{letter}" for letter in "abcdefghijklmnopqrtuvwxyz"),
]
WIDTH, PLACES = TEXT["width"], 64


def text_weights(seed: int = 0) -> dict[str, np.ndarray]:
    """Weights of the text encoder, large enough that every part matters."""
    rng = np.random.default_rng(seed)
    wanted = shapes({**TEXT, "places": PLACES}) | {WORDS: (len(VOCABULARY), WIDTH)}
    return {
        name: rng.standard_normal(shape, np.float32) * np.float32(0.2) + np.float32(name.endswith("norm.weight"))
        for name, shape in wanted.items()
    }


def text() -> MiniLM:
    """A MiniLM with random weights and `VOCABULARY`."""
    return MiniLM.from_tensors(pack(text_weights(), VOCABULARY), graph("text"))


def weights(config: NetConfig = MODULATED, seed: int = 0) -> dict[str, np.ndarray]:
    """Of a prior's network, without ``net.``."""
    return random_weights(prior_shapes(config), seed)


def net(config: NetConfig = MODULATED, seed: int = 0) -> PriorSession:
    """A network whose every weight matters."""
    named = {NET + name: value for name, value in weights(config, seed).items()}
    return PriorSession(config, named, {name: graph(name, config) for name in ("prior", "bind")})


def prior(config: NetConfig = MODULATED, *, seed: int = 0, levels: int = 50) -> Prior:
    """A prior of 263 features with statistics that keep a made-up person near a human size."""
    rng = np.random.default_rng(seed)
    mean = rng.standard_normal(config.features, np.float32) * np.float32(0.1)
    std = rng.random(config.features, np.float32) * np.float32(0.1) + np.float32(0.01)
    card = Card("tiny", "do what you like", "random numbers", {"steps": 3})
    return Prior(net(config, seed), cosine(levels), mean, std, text(), card)


def adapter(prior: Prior, *, control: str = TAUGHT, seed: int = 1, size: float = 0.2, given_rank: int = 0) -> Adapter:
    """An adapter of rank 2 whose every number matters; one for control with an input where it has a ``given_rank``."""
    rng, tensors = np.random.default_rng(seed), {}
    sizes = {name: (*weight.shape, 2) for name, weight in layers(prior.net, taught=control == TAUGHT).items()}
    if given_rank:
        config = prior.net.config
        sizes[GIVEN] = config.width, config.patch * 2 * config.features, given_rank
    for name, (outer, inner, rank) in sizes.items():
        tensors[f"{name}.down"] = rng.standard_normal((rank, inner), np.float32) * np.float32(size)
        tensors[f"{name}.up"] = rng.standard_normal((outer, rank), np.float32) * np.float32(size)
    notes = {"captions": [f"caption {seed}"]}
    return Adapter(f"a{seed}", control, 2, tensors, "tiny", fingerprint(prior.net), "free", "numbers", notes)
