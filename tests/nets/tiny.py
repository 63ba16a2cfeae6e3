"""Priors small enough for tests: random weights, an embedded text encoder one can read."""

from dataclasses import replace

import torch

from motionloom.diffusion import cosine
from motionloom.nets.prior import NetConfig, PriorNet
from motionloom.runtime.text.minilm import MiniLM, pack
from motionloom.train.modules import prior_session, text_encoder
from motionloom.weights.prior import Card, Prior
from tests.nets.text import tiny

MODULATED = NetConfig(
    variant="modulated", width=32, layers=2, heads=2, hidden=48, text=tiny.WIDTH, patch=4, dropout=0.0
)
CLOCKED = replace(MODULATED, clock=True)
PUBLISHED = NetConfig(width=32, layers=2, heads=4, hidden=48, text=tiny.WIDTH, dropout=0.0)


def text() -> MiniLM:
    """A MiniLM with random weights and the vocabulary of `tests.nets.text.tiny`."""
    weights = {name: value.numpy() for name, value in tiny.weights().items()}
    return text_encoder(pack(weights, tiny.VOCABULARY))


def net(config: NetConfig = MODULATED, seed: int = 0) -> PriorNet:
    """A network whose every weight matters: none is left at zero."""
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        made = PriorNet(config)
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for value in made.parameters():
            scale = 0.5 / value.shape[-1] ** 0.5 if value.ndim > 1 else 0.1
            value.add_(torch.randn(value.shape, generator=generator) * scale)
    return made.eval().requires_grad_(False)


def prior(config: NetConfig = MODULATED, *, seed: int = 0, levels: int = 50) -> Prior:
    """A prior of 263 features with statistics that keep a made-up person near a human size."""
    generator = torch.Generator().manual_seed(seed)
    mean = torch.randn(config.features, generator=generator) * 0.1
    std = torch.rand(config.features, generator=generator) * 0.1 + 0.01
    card = Card("tiny", "do what you like", "random numbers", {"steps": 3})
    return Prior(prior_session(net(config, seed)), cosine(levels), mean.numpy(), std.numpy(), text(), card)
