"""The embedded default text encoder: all-MiniLM-L6-v2 in eight bits with a smaller vocabulary.

How it was built and how far it is from the original: docs/decisions/0002-text-encoder.md.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from tokenizers import Tokenizer, models, normalizers, pre_tokenizers

from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.session import Session, check_graph
from motionloom.core.models.networks.text.protocol import Row, RowCache, TextEmbedding, as_rows, cut, stack_rows
from motionloom.core.models.networks.text.quantise import dequantise, quantise

PAD, UNKNOWN, START, END, MASK = "[PAD]", "[UNK]", "[CLS]", "[SEP]", "[MASK]"
SPECIALS = (PAD, UNKNOWN, START, END, MASK)


def make_tokenizer(vocabulary: Sequence[str]) -> Tokenizer:
    """WordPiece as BERT does it: lower case, no accents, split at spaces and punctuation, longest piece first.

    Ids are places in the vocabulary; no start or end marks are added and nothing is truncated.
    """
    ids = {piece: place for place, piece in enumerate(vocabulary)}
    tokenizer = Tokenizer(models.WordPiece(vocab=ids, unk_token=UNKNOWN, max_input_chars_per_word=100))
    tokenizer.normalizer = normalizers.BertNormalizer()
    tokenizer.pre_tokenizer = pre_tokenizers.BertPreTokenizer()
    return tokenizer


HEAD_WIDTH = 32
LENGTH = 64  # word pieces, start and end marks included
BATCH_WORDS = 2048
VOCABULARY = "vocabulary"
SCALE = ".scale"
WORDS = "words.weight"
"""The table of word pieces, which stays packed: a sentence needs a few rows of it."""
TINY = 1e-12


class MiniLM:
    """BERT of 6 layers and width 384 (head width 32); tokens are its last hidden states, pooled is their normed mean.

    Build it with `from_tensors`. Texts beyond 64 word pieces are truncated with a Python warning.
    """

    name = "minilm"

    def __init__(
        self,
        vocabulary: Sequence[str],
        packed: Mapping[str, np.ndarray],
        graph: bytes,
        *,
        cache: int = 1024,
    ) -> None:
        """packed: the weights as in a file."""
        self.vocabulary, self.graph = tuple(vocabulary), graph
        self._packed = packed
        self._places = packed["places.weight"].astype(np.float32)
        self._session = Session(graph, self._weights, seldom=True)
        self._tokenizer = make_tokenizer(self.vocabulary)
        self._start = self.vocabulary.index(START)
        self._end = self.vocabulary.index(END)
        self._cache = RowCache(cache)

    @property
    def width(self) -> int:
        """Channels of states and vectors."""
        return self._places.shape[1]

    @staticmethod
    def from_tensors(tensors: Mapping[str, np.ndarray], graph: bytes, *, cache: int = 1024) -> "MiniLM":
        """Unpack what `to_tensors` or `pack` gave (int8 matrices, float16 rest, the vocabulary as UTF-8 bytes).

        graph: of the encoder's layers, as `motionloom_train.export` writes it.
        Raises MotionloomError where tensors are missing, misshapen or not finite.
        """
        try:
            vocabulary = read_vocabulary(tensors[VOCABULARY])
            check_finite(tensors)
            weights = {key: value for key, value in tensors.items() if _is_weight(key)}
            sizes = sizes_of(weights)
            table, scale = tensors[WORDS], tensors[WORDS + SCALE]
            if table.shape != (len(vocabulary), sizes["width"]) or scale.shape != (len(vocabulary),):
                raise ValueError(f"a table of {table.shape} for {len(vocabulary)} word pieces")
            if sizes["places"] < 3 or sizes["width"] % HEAD_WIDTH:
                raise ValueError(f"{sizes['places']} places of width {sizes['width']}")
            wrong = {name: shape for name, shape in shapes(sizes).items() if weights[name].shape != shape}
            if wrong or len(weights) != len(shapes(sizes)):
                raise ValueError(f"tensors of other shapes: {wrong or 'too many'}")
        except (KeyError, RuntimeError, ValueError, IndexError) as error:
            reason = " ".join(str(error).split())[:200]
            raise MotionloomError(
                f"The text encoder inside the weights is damaged ({reason}); fetch the weights again."
            ) from error
        check_graph(graph, {f"text.{key}": value for key, value in weights.items()}, ["states"])
        return MiniLM(vocabulary, dict(tensors), graph, cache=cache)

    def to_tensors(self) -> dict[str, np.ndarray]:
        """The packed tensors this encoder was read from."""
        return dict(self._packed)

    def encode(self, texts: Sequence[str] | str) -> TextEmbedding:
        """Tokens (rows, words <= 64, width), mask (rows, words), pooled (rows, width) of unit length.

        An empty text is its start and end marks. The null condition of guidance is the caller's business.
        """
        return stack_rows(self._cache.fetch(as_rows(texts), self._encode), self.width)

    def ids(self, text: str) -> list[int]:
        """Word-piece ids of one text with start and end marks, at most 64 of them (warns where it had to cut)."""
        room = len(self._places) - 2
        pieces = cut(text, lambda part: self._tokenizer.encode(part, add_special_tokens=False).ids, room)
        return [self._start, *pieces, self._end]

    def _weights(self) -> dict[str, np.ndarray]:
        return {f"text.{name}": value for name, value in unpacked(self._packed).items()}

    def _encode(self, texts: list[str]) -> list[Row]:
        ids = [self.ids(text) for text in texts]
        rows: dict[int, Row] = {}
        for chosen in _batches([len(row) for row in ids]):
            lengths = np.array([len(ids[place]) for place in chosen])
            width = lengths.max()
            padded = np.array([ids[place] + [0] * (width - len(ids[place])) for place in chosen])
            mask = np.arange(width) < lengths[:, None]
            [states] = self._session.run({"pieces": self._embedded(padded), "mask": mask})
            for place, row in zip(chosen, states, strict=True):
                words = row[: len(ids[place])].copy()
                mean = words.mean(0)
                rows[place] = (words, mean / max(float(np.linalg.norm(mean)), TINY))
        return [rows[place] for place in range(len(texts))]

    def _embedded(self, ids: NDArray[np.int64]) -> NDArray[np.float32]:
        """Word pieces (rows, words) to vectors (rows, words, width), with those of their places."""
        values, scale = self._packed[WORDS][ids], self._packed[WORDS + SCALE][ids]
        return values.astype(np.float32) * scale.astype(np.float32)[..., None] + self._places[: ids.shape[1]]


def sizes_of(weights: Mapping[str, np.ndarray]) -> dict[str, int]:
    """Places, width, hidden width and layers of an encoder, by its weights; raises KeyError where some lack."""
    places, width = weights["places.weight"].shape
    layers = len({key.split(".")[1] for key in weights if key.startswith("layers.")})
    return {
        "places": places,
        "width": width,
        "hidden": weights["layers.0.hidden_in.weight"].shape[0],
        "layers": layers,
    }


def shapes(sizes: Mapping[str, int]) -> dict[str, tuple[int, ...]]:
    """Names and shapes of an encoder's weights, but the table of word pieces."""
    width, hidden = sizes["width"], sizes["hidden"]
    linears = {
        "attention_in": (3 * width, width),
        "attention_out": (width, width),
        "hidden_in": (hidden, width),
        "hidden_out": (width, hidden),
    }
    result: dict[str, tuple[int, ...]] = {"places.weight": (sizes["places"], width)}
    norms = ["norm"]
    for layer in range(sizes["layers"]):
        norms += [f"layers.{layer}.attention_norm", f"layers.{layer}.hidden_norm"]
        for name, shape in linears.items():
            result[f"layers.{layer}.{name}.weight"] = shape
            result[f"layers.{layer}.{name}.bias"] = shape[:1]
    for name in norms:
        result[f"{name}.weight"] = result[f"{name}.bias"] = (width,)
    return result


def _batches(lengths: list[int]) -> Iterator[list[int]]:
    """Places of rows of about equal length, at most BATCH_WORDS words a batch with padding."""
    order = sorted(range(len(lengths)), key=lambda place: lengths[place])
    batch: list[int] = []
    for place in order:
        if batch and lengths[place] * (len(batch) + 1) > BATCH_WORDS:
            yield batch
            batch = []
        batch.append(place)
    if batch:
        yield batch


def pack(weights: Mapping[str, np.ndarray], vocabulary: Sequence[str]) -> dict[str, np.ndarray]:
    """`Bert`'s float weights and its vocabulary -> storage: linear and word matrices int8, the rest float16."""
    tensors: dict[str, np.ndarray] = {VOCABULARY: write_vocabulary(vocabulary)}
    for name, value in weights.items():
        if value.ndim == 2 and name != "places.weight":
            tensors[name], tensors[name + SCALE] = quantise(value)
        else:
            tensors[name] = value.astype(np.float16)
    return tensors


def check_finite(tensors: Mapping[str, np.ndarray]) -> None:
    """Raise ValueError for packed tensors that are not finite floats, or int8 without a scale for each row."""
    for name, value in tensors.items():
        if name == VOCABULARY or name.endswith(SCALE):
            continue
        scale = tensors[name + SCALE] if value.dtype == np.int8 else value  # an int8 times a float16 is finite
        if scale.dtype.kind != "f" or not np.isfinite(scale).all():
            raise ValueError(f"{name} is not finite")
        if scale is not value and scale.shape != value.shape[:1]:
            raise ValueError(f"{name} has scales of shape {scale.shape}")


def unpacked(tensors: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Float32 weights out of packed tensors, but the table of word pieces."""
    return {
        name: dequantise(value, tensors[name + SCALE]) if value.dtype == np.int8 else value.astype(np.float32)
        for name, value in tensors.items()
        if _is_weight(name)
    }


def _is_weight(name: str) -> bool:
    return name not in (VOCABULARY, WORDS) and not name.endswith(SCALE)


def write_vocabulary(vocabulary: Sequence[str]) -> NDArray[np.uint8]:
    """Pieces joined by newlines as UTF-8 bytes (uint8)."""
    return np.frombuffer("\n".join(vocabulary).encode(), dtype=np.uint8)


def read_vocabulary(data: np.ndarray) -> list[str]:
    """The inverse of `write_vocabulary`; raises ValueError where pieces repeat or a special one is missing."""
    vocabulary = data.astype(np.uint8).tobytes().decode("utf-8").split("\n")
    if len(set(vocabulary)) != len(vocabulary) or not set(SPECIALS) <= set(vocabulary):
        raise ValueError("its vocabulary has repeated pieces or lacks a special one")
    return vocabulary
