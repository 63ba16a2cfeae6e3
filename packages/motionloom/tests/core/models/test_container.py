"""Weights of a file are a network's only if each fits by name; graphs beside them are no weights."""

import hashlib
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.models.container import (
    PRIORS,
    check,
    finite,
    graph_tensors,
    read_tensors,
    split_graphs,
    weights_digest,
)


def good() -> dict[str, np.ndarray]:
    return {"weight": np.arange(6, dtype=np.float32).reshape(2, 3), "bias": np.ones(2, np.float32)}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"bias": None}, r"bias is missing, not \(2,\)"),
        ({"more": np.ones(1)}, r"more is \(1,\), not absent"),
        ({"weight": np.ones((3, 2))}, r"weight is \(3, 2\), not \(2, 3\)"),
        ({"bias": np.array(1.0)}, r"bias is \(\), not \(2,\)"),
        ({"bias": np.array([1.0, np.nan])}, "not finite floats, in bias"),
        ({"bias": np.array([1.0, -np.inf])}, "not finite floats, in bias"),
        ({"bias": np.ones(2, np.int64)}, "not finite floats, in bias"),
    ],
    ids=["missing", "unknown", "turned", "a number", "nan", "infinite", "whole numbers"],
)
def test_weights_that_do_not_fit_are_named(change: dict, said: str) -> None:
    weights = {key: value for key, value in (good() | change).items() if value is not None}
    with pytest.raises(MotionloomError, match=f"a.safetensors .*{said}"):
        check(weights, {"weight": (2, 3), "bias": (2,)}, "a.safetensors")


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
