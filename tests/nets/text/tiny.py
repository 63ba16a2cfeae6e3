"""A BERT small enough for tests, with random weights and a vocabulary one can read."""

import torch
from torch import Tensor

from motionloom.nets.text.bert import Bert
from motionloom.runtime.text.wordpiece import SPECIALS

WORDS = ["a", "person", "walks", "turns", "left", "right", "walk", "##s", "##ing", "jump", "un", "##aff", "##able", "."]
VOCABULARY = [
    *SPECIALS,
    *WORDS,
    *"bcdefghijklmnopqrstuvwxyz",
    *(f"##{letter}" for letter in "abcdefghijklmnopqrtuvwxyz"),
]
WIDTH, HIDDEN, LAYERS, PLACES = 64, 96, 2, 64


def weights(seed: int = 0) -> dict[str, Tensor]:
    """A state dict of `Bert` for VOCABULARY, values large enough that every part matters."""
    generator = torch.Generator().manual_seed(seed)
    net = Bert(vocabulary=len(VOCABULARY), places=PLACES, width=WIDTH, heads=2, hidden=HIDDEN, layers=LAYERS)
    return {
        name: torch.randn(value.shape, generator=generator) * 0.2 + (1.0 if name.endswith("norm.weight") else 0.0)
        for name, value in net.state_dict().items()
    }
