"""The embedded encoder against naive BERT, its own padding, hostile texts and hostile tensors."""

import math
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.numpy import load_file, save_file

from motionloom.core.errors import MotionloomError
from motionloom.core.models.container import split_graphs
from motionloom.core.models.networks.text.minilm import WORDS, MiniLM, read_vocabulary, unpacked, write_vocabulary
from motionloom.core.models.networks.text.protocol import TextEncoder
from motionloom.core.models.networks.text.quantise import dequantise
from tests.recorded import tiny
from tests.recorded.tiny import PLACES, TEXT, VOCABULARY, WIDTH
from tests.work import work

SENTENCES = ["a person walks.", "", "a person turns left, turns right, jumping and walking unaffably", "left"]


@pytest.fixture(scope="module")
def encoder() -> MiniLM:
    return tiny.text()


def floats(encoder: MiniLM) -> dict[str, np.ndarray]:
    """What its packed weights are in float32."""
    tensors = encoder.to_tensors()
    weights = unpacked(tensors) | {WORDS: dequantise(tensors[WORDS], tensors[f"{WORDS}.scale"])}
    return {name: value.astype(np.float32) for name, value in weights.items()}


def naive_bert(state: dict[str, np.ndarray], ids: list[int]) -> np.ndarray:
    """Devlin et al. 2019 word by word and head by head, float64."""

    def norm(x: np.ndarray, name: str) -> np.ndarray:
        centred = x - x.mean(-1, keepdims=True)
        return centred / np.sqrt((centred**2).mean(-1, keepdims=True)) * state[f"{name}.weight"] + state[f"{name}.bias"]

    def linear(x: np.ndarray, name: str) -> np.ndarray:
        return x @ state[f"{name}.weight"].T + state[f"{name}.bias"]

    x = norm(state["words.weight"][ids] + state["places.weight"][: len(ids)], "norm")
    for layer in range(TEXT["layers"]):
        query, key, value = np.split(linear(x, f"layers.{layer}.attention_in"), 3, axis=1)
        mixed = np.zeros_like(x)
        for head in range(WIDTH // 32):
            part = slice(32 * head, 32 * head + 32)
            for word in range(len(ids)):
                scores = np.exp(key[:, part] @ query[word, part] / math.sqrt(32))
                mixed[word, part] = scores / scores.sum() @ value[:, part]
        x = norm(x + linear(mixed, f"layers.{layer}.attention_out"), f"layers.{layer}.attention_norm")
        hidden = linear(x, f"layers.{layer}.hidden_in")
        hidden = hidden * 0.5 * (1 + np.vectorize(math.erf)(hidden / math.sqrt(2)))
        x = norm(x + linear(hidden, f"layers.{layer}.hidden_out"), f"layers.{layer}.hidden_norm")
    return x


def test_tokens_are_those_of_a_naive_bert(encoder: MiniLM) -> None:
    state = {name: value.astype(np.float64) for name, value in floats(encoder).items()}
    for sentence in SENTENCES:
        expected = naive_bert(state, encoder.ids(sentence))
        np.testing.assert_allclose(encoder.encode(sentence).tokens[0], expected, atol=2e-5)


def test_a_row_does_not_depend_on_its_batch(encoder: MiniLM) -> None:
    batch = MiniLM.from_tensors(encoder.to_tensors(), encoder.graph).encode(SENTENCES)
    for row, text in enumerate(SENTENCES):
        alone = MiniLM.from_tensors(encoder.to_tensors(), encoder.graph).encode([text])
        words = alone.tokens.shape[1]
        assert batch.mask[row].sum() == words
        np.testing.assert_array_equal(batch.tokens[row, :words], alone.tokens[0])
        np.testing.assert_array_equal(batch.pooled[row], alone.pooled[0])


def test_many_texts_come_back_in_order(encoder: MiniLM) -> None:
    texts = [f"{'person ' * (place % 40)}{'turns walk' if place % 2 else 'left'} {place}" for place in range(200)]
    batch = MiniLM.from_tensors(encoder.to_tensors(), encoder.graph).encode(texts)
    for row in range(0, 200, 17):
        np.testing.assert_array_equal(batch.pooled[row], encoder.encode(texts[row]).pooled[0])


def test_padding_is_zero_and_pooled_is_the_unit_mean_of_the_words(encoder: MiniLM) -> None:
    out = encoder.encode(SENTENCES)
    assert (out.tokens[~out.mask] == 0).all()
    mean = out.tokens.sum(1) / out.mask.sum(1, keepdims=True)
    np.testing.assert_allclose(out.pooled, mean / np.linalg.norm(mean, axis=1, keepdims=True), atol=1e-6)


def test_an_empty_text_is_its_start_and_end(encoder: MiniLM) -> None:
    assert [encoder.vocabulary[place] for place in encoder.ids("")] == ["[CLS]", "[SEP]"]
    assert encoder.encode("").tokens.shape == (1, 2, WIDTH)
    assert encoder.encode([]).tokens.shape[0] == 0


def test_ten_thousand_words_are_cut_at_64_pieces_with_a_warning(encoder: MiniLM) -> None:
    with pytest.warns(UserWarning, match="62 word pieces"):
        out = encoder.encode("walk " * 10_000)
    assert out.tokens.shape == (1, PLACES, WIDTH)
    np.testing.assert_array_equal(out.tokens, encoder.encode(" ".join(["walk"] * 62)).tokens)


@settings(max_examples=60, deadline=None)
@given(st.text(alphabet=st.characters(), max_size=300))
def test_every_text_encodes_to_finite_numbers(encoder: MiniLM, text: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        out = encoder.encode(text)
    assert 2 <= out.tokens.shape[1] <= PLACES
    assert np.isfinite(out.tokens).all()


def test_recent_texts_are_not_computed_again_and_the_cache_stays_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    encoder = MiniLM.from_tensors(tiny.text().to_tensors(), tiny.text().graph, cache=2)
    seen: list[int] = []
    run = encoder._session.run

    def counted(feeds: dict[str, np.ndarray]) -> list[np.ndarray]:
        seen.append(len(feeds["mask"]))
        return run(feeds)

    monkeypatch.setattr(encoder._session, "run", counted)
    first = encoder.encode(["left", "right", "left"])
    first.tokens.fill(0)  # the caller's copy, not the cache's
    again = encoder.encode(["right", "left"])
    assert sum(seen) == 2
    assert np.abs(again.tokens).sum() > 0
    encoder.encode("jump")  # pushes out "right", the older of the two
    encoder.encode("left")
    assert sum(seen) == 3
    encoder.encode("right")
    assert sum(seen) == 4


def test_tensors_survive_a_file(encoder: MiniLM, tmp_path: Path) -> None:
    save_file(encoder.to_tensors(), tmp_path / "x.safetensors")
    again = MiniLM.from_tensors(load_file(tmp_path / "x.safetensors"), encoder.graph)
    assert again.vocabulary == tuple(VOCABULARY)
    np.testing.assert_array_equal(
        again.encode(SENTENCES).tokens,
        MiniLM.from_tensors(encoder.to_tensors(), encoder.graph).encode(SENTENCES).tokens,
    )


def test_packed_weights_stay_close_to_the_float_ones(encoder: MiniLM) -> None:
    exact = tiny.text_weights()
    for name, value in floats(encoder).items():
        assert np.abs(value - exact[name]).max() < 0.006, name


def without(tensors: dict[str, np.ndarray], name: str) -> dict[str, np.ndarray]:
    return {key: value for key, value in tensors.items() if key != name}


@pytest.mark.parametrize("name", ["vocabulary", "words.weight", "words.weight.scale", "layers.1.hidden_in.weight"])
def test_a_missing_tensor_is_named_in_one_sentence(encoder: MiniLM, name: str) -> None:
    with pytest.raises(MotionloomError, match="damaged"):
        MiniLM.from_tensors(without(encoder.to_tensors(), name), encoder.graph)


@pytest.mark.parametrize(
    "change",
    [
        {"norm.weight": np.full(WIDTH, np.nan, np.float32)},
        {"norm.weight": np.ones(WIDTH + 1, np.float32)},
        {"words.weight.scale": np.full(len(VOCABULARY), np.inf, np.float16)},
        {"words.weight.scale": np.ones(3, np.float16)},
        {"places.weight": np.zeros(WIDTH, np.float32)},
        {"places.weight": np.zeros((1, WIDTH), np.float32)},
        {"vocabulary": write_vocabulary(VOCABULARY[:-1])},
        {"vocabulary": write_vocabulary([*VOCABULARY[:-1], "left"])},
        {"vocabulary": write_vocabulary(["x", *VOCABULARY[1:]])},
        {"vocabulary": np.full(40, 255, np.uint8)},
        {"vocabulary": np.zeros((3, 3), np.float32)},
        {"layers.0.attention_in.weight": np.zeros((3, WIDTH, TEXT["hidden"]), np.float32)},
        {"extra": np.zeros(3, np.float32)},
    ],
    ids=lambda change: next(iter(change)),
)
def test_damaged_tensors_are_refused(encoder: MiniLM, change: dict[str, np.ndarray]) -> None:
    with pytest.raises(MotionloomError, match="damaged"):
        MiniLM.from_tensors({**encoder.to_tensors(), **change}, encoder.graph)


def test_the_vocabulary_survives_as_bytes() -> None:
    assert read_vocabulary(write_vocabulary([*VOCABULARY, "é", "日"])) == [*VOCABULARY, "é", "日"]


def test_it_is_a_text_encoder(encoder: MiniLM) -> None:
    as_protocol: TextEncoder = encoder
    assert (as_protocol.name, as_protocol.width) == ("minilm", WIDTH)


def shipped() -> MiniLM:
    """The encoder of the default weights in the package; skips where those are not built yet."""
    for file in sorted(
        (Path(__file__).parents[7] / "packages/motionloom/src/motionloom/weights").glob("*.safetensors")
    ):
        weights, graphs = split_graphs(load_file(file))
        found = {name[5:]: value for name, value in weights.items() if name.startswith("text.")}
        if found:
            return MiniLM.from_tensors(found, graphs["text"])
    pytest.skip("no weights with a text encoder inside packages/motionloom/src/motionloom/weights")


def test_the_shipped_encoder_gives_the_teachers_numbers() -> None:
    """Recorded from sentence-transformers 6.2 with all-MiniLM-L6-v2 in float32."""
    encoder = shipped()
    texts = ["a person walks forward and turns left.", "someone jumps up twice"]
    for text, recorded in zip(texts, RECORDED):
        assert np.abs(encoder.encode(text).pooled[0, :8] - recorded).max() < 0.005


def test_the_shipped_encoder_does_no_more_than_it_must() -> None:
    """Loading walks through the vocabulary a few times; a sentence goes through the network once, without padding."""
    encoder = shipped()
    tensors = encoder.to_tensors()
    assert work(lambda: MiniLM.from_tensors(tensors, encoder.graph)) < 4 * len(read_vocabulary(tensors["vocabulary"]))


RECORDED = [
    [-0.00924, 0.00566, -0.00032, 0.02777, 0.03344, 0.05497, 0.07887, 0.01693],
    [-0.00988, -0.0001, 0.03315, -0.02678, -0.04497, 0.01603, 0.06788, 0.0297],
]
