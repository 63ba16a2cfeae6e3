"""Weights of a file go into a network only if they are its own, each by name; graphs beside them are no weights."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import nn

from motionloom.errors import MotionloomError
from motionloom.train.modules import fill, shapes
from motionloom.weights.container import (
    PRIORS,
    check,
    finite,
    graph_tensors,
    read_tensors,
    split_graphs,
    weights_digest,
)


def good() -> dict[str, torch.Tensor]:
    return {"weight": torch.arange(6.0).reshape(2, 3), "bias": torch.ones(2)}


@pytest.mark.parametrize("device", ["cpu", "meta"])
def test_a_network_gets_its_weights(device: str) -> None:
    with torch.device(device):
        net = nn.Linear(3, 2)
    fill(net, good(), "a.safetensors")
    assert net(torch.tensor([1.0, 0.0, 2.0])).tolist() == [5.0, 14.0]  # by hand: 0 + 4 + 1 and 3 + 10 + 1
    assert shapes(net) == {"weight": (2, 3), "bias": (2,)}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"bias": None}, r"bias is missing, not \(2,\)"),
        ({"more": torch.ones(1)}, r"more is \(1,\), not absent"),
        ({"weight": torch.ones(3, 2)}, r"weight is \(3, 2\), not \(2, 3\)"),
        ({"bias": torch.tensor(1.0)}, r"bias is \(\), not \(2,\)"),
        ({"bias": torch.tensor([1.0, torch.nan])}, "not finite floats, in bias"),
        ({"bias": torch.tensor([1.0, -torch.inf])}, "not finite floats, in bias"),
        ({"bias": torch.ones(2, dtype=torch.long)}, "not finite floats, in bias"),
    ],
    ids=["missing", "unknown", "turned", "a number", "nan", "infinite", "whole numbers"],
)
def test_weights_that_do_not_fit_are_named(change: dict, said: str) -> None:
    weights = {key: value for key, value in (good() | change).items() if value is not None}
    net = nn.Linear(3, 2)
    before = net.weight.clone()
    with pytest.raises(MotionloomError, match=f"a.safetensors .*{said}"):
        fill(net, weights, "a.safetensors")
    with pytest.raises(MotionloomError, match=said):
        check({key: value.numpy() for key, value in weights.items()}, shapes(net), "it")
    assert torch.equal(net.weight, before)


def test_what_figures_quote_leaves_graphs_out(tmp_path: Path) -> None:
    """The digest of a file with graphs is that of the same file without: SHA-256 of its bytes."""
    plain, more = tmp_path / "a.safetensors", tmp_path / "b.safetensors"
    weights = {"net.b": np.arange(6, dtype=np.float16), "net.a": np.ones((2, 2), np.float32)}
    PRIORS.write(plain, weights, {"card": "x"})
    PRIORS.write(more, weights | graph_tensors({"prior": b"abc"}), {"card": "x"})
    assert plain.read_bytes() != more.read_bytes()
    assert weights_digest(more) == weights_digest(plain) == hashlib.sha256(plain.read_bytes()).hexdigest()
    tensors, _ = read_tensors(more)
    assert split_graphs(tensors)[1] == {"prior": b"abc"}


@pytest.mark.parametrize("kind", [np.float16, np.float32])
def test_numbers_that_are_not_finite_are_seen(kind: type) -> None:
    values = np.array([-65504, 0, 6e-8, 65504], kind)
    assert finite(values)
    assert finite(values[:0])
    for bad in (np.nan, np.inf, -np.inf):
        assert not finite(np.append(values, kind(bad)))
