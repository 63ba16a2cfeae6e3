"""examples/14_onnx_alone.py, which knows only docs/onnx.md, draws what the product draws of the same noise."""

import ast
import runpy
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.features.humanml import decode_positions
from motionloom.core.models.networks.text.minilm import MiniLM
from motionloom.core.models.prior import Prior, shipped
from motionloom.tasks.text import sample_features

ROOT = Path(__file__).parents[6]
EXAMPLE = ROOT / "examples" / "14_onnx_alone.py"
ALLOWED = {"json", "struct", "sys", "unicodedata", "itertools", "pathlib", "numpy", "onnxruntime"}
needs_weights = pytest.mark.skipif("default" not in shipped(), reason="no shipped weights")


@pytest.fixture(scope="module")
def prior() -> Prior:
    return Prior.load()


@pytest.fixture(scope="module")
def example() -> dict:
    return runpy.run_path(str(EXAMPLE))


def test_the_example_is_short_and_needs_nothing_else() -> None:
    text = EXAMPLE.read_text()
    assert text.count("\n") <= 120
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import | ast.ImportFrom)]
    names = {name.split(".")[0] for node in nodes for name in _names(node)}
    assert names <= ALLOWED


def _names(node: ast.Import | ast.ImportFrom) -> list[str]:
    return [node.module or ""] if isinstance(node, ast.ImportFrom) else [one.name for one in node.names]


@needs_weights
@pytest.mark.parametrize(
    "text",
    [
        "a person walks forward",
        "Café: she's WAVING — twice!",
        "日本 jumps",
        "xqzzv\tw" + "x" * 120,
        "a\x00b $5 ",
        "go " * 90,
    ],
)
@pytest.mark.filterwarnings("ignore:The text has more than")
def test_words_become_the_same_pieces(text: str, prior: Prior, example: dict) -> None:
    assert isinstance(prior.text, MiniLM)
    assert example["word_pieces"](text, prior.text.vocabulary) == prior.text.ids(text)


@needs_weights
@pytest.mark.parametrize(("text", "frames"), [("a person waves, then sits down", 61), ("somebody jumps", 40)])
def test_the_same_noise_becomes_the_same_places(text: str, frames: int, prior: Prior, example: dict) -> None:
    ours = example["draw"](text, frames / prior.fps, 3)
    theirs = decode_positions(sample_features(prior, [text], [frames], seeds=[3])[0])
    assert ours.shape == (frames, 22, 3)
    assert np.abs(ours - theirs).max() < 1e-3
