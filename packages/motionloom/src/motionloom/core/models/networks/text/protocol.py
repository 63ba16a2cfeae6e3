"""What every text encoder gives, and the cache they share."""

import threading
import warnings
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

CHARACTERS = 20_000


@dataclass(frozen=True)
class TextEmbedding:
    """Encoded texts, float32.

    tokens: (rows, words, width) one state per word piece, start and end marks included; zero where mask is False.
    mask: (rows, words) bool, True = a real piece, False = padding.
    pooled: (rows, width) one vector per text.
    """

    tokens: Floats
    mask: NDArray[np.bool_]
    pooled: Floats


class TextEncoder(Protocol):
    """Texts in, `TextEmbedding` out. A row never depends on the other rows."""

    @property
    def name(self) -> str:
        """Short identifier, written into checkpoints: "minilm", "clip", "distilbert"."""
        ...

    @property
    def width(self) -> int:
        """Channels of tokens and pooled."""
        ...

    def encode(self, texts: Sequence[str] | str) -> TextEmbedding:
        """Encode texts (a single string counts as one row)."""
        ...


Row = tuple[Floats, Floats]
"""One encoded text: its states (words, width) without padding, and its pooled vector (width,)."""


def as_rows(texts: Sequence[str] | str) -> list[str]:
    """The texts as a list of well-formed strings; half surrogate pairs, which no tokenizer takes, become '?'."""
    rows = [texts] if isinstance(texts, str) else list(texts)
    return [text.encode("utf-8", "replace").decode("utf-8") for text in rows]


def cut(text: str, split: Callable[[str], list[int]], room: int) -> list[int]:
    """The ids of the text's first `room` pieces; warns where there are more.

    Texts beyond CHARACTERS are shortened first, so that a hostile prompt costs no time in the tokenizer.
    """
    ids = split(text[:CHARACTERS])
    if len(ids) > room or len(text) > CHARACTERS:
        warnings.warn(f"The text has more than {room} word pieces; the rest is ignored.", stacklevel=2)
    return ids[:room]


def stack_rows(rows: Sequence[Row], width: int) -> TextEmbedding:
    """Pad rows of different lengths with zeros into one embedding."""
    words = max((len(states) for states, _ in rows), default=0)
    tokens = np.zeros((len(rows), words, width), np.float32)
    mask = np.zeros((len(rows), words), np.bool_)
    pooled = np.zeros((len(rows), width), np.float32)
    for index, (states, vector) in enumerate(rows):
        tokens[index, : len(states)] = states
        mask[index, : len(states)] = True
        pooled[index] = vector
    return TextEmbedding(tokens, mask, pooled)


class RowCache:
    """Least-recently-used cache from text to encoded row, for several threads."""

    def __init__(self, size: int = 1024) -> None:
        self.size = size
        self._rows: OrderedDict[str, Row] = OrderedDict()
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._rows)

    def fetch(self, texts: Sequence[str], encode: Callable[[list[str]], list[Row]]) -> list[Row]:
        """The rows of all texts; `encode` is called once, with the distinct texts that it does not hold."""
        with self._lock:
            by_text = {text: self._rows.get(text) for text in texts}
        missing = [text for text, row in by_text.items() if row is None]
        by_text |= dict(zip(missing, encode(missing))) if missing else {}
        rows = [row for text in texts if (row := by_text[text]) is not None]
        with self._lock:
            for text, row in zip(texts, rows):
                self._rows[text] = row
                self._rows.move_to_end(text)
            while len(self._rows) > self.size:
                self._rows.popitem(last=False)
        return rows
