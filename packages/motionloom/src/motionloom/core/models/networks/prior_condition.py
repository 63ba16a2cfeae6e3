"""What a prior's network is conditioned on, and what becomes of it before the sampler's loop; one entry per row."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]


class Condition(NamedTuple):
    """What a motion is to be, one entry per row. Zeros in place of a text mean: no text."""

    pooled: Floats
    """(rows, text) one vector per text."""
    tokens: Floats
    """(rows, words, text) one vector per word piece; (rows, 0, text) where the network reads none."""
    words: NDArray[np.bool_]
    """(rows, words) True where there is a word piece."""
    lengths: NDArray[np.int64]
    """(rows,) valid frames; frames behind them are padding that nothing attends to. -1: all frames are valid."""
    flags: NDArray[np.int64]
    """(rows, frames) 0 or 1: transition flags; (rows, 0) for networks without them."""

    def null(self) -> "Condition":
        """The same rows without their text."""
        words = np.zeros_like(self.words)
        words[:, :1] = True
        return self._replace(pooled=np.zeros_like(self.pooled), tokens=np.zeros_like(self.tokens), words=words)

    def choose(self, keep: NDArray[np.bool_]) -> "Condition":
        """Text where ``keep`` (rows,) is True, none elsewhere."""
        null = self.null()
        return self._replace(
            pooled=np.where(keep[:, None], self.pooled, null.pooled),
            tokens=np.where(keep[:, None, None], self.tokens, null.tokens),
            words=np.where(keep[:, None], self.words, null.words),
        )


def condition(
    pooled: Floats,
    *,
    tokens: Floats | None = None,
    words: NDArray[np.bool_] | None = None,
    lengths: Sequence[int] | NDArray[np.int64] | None = None,
    flags: NDArray[np.int64] | None = None,
) -> Condition:
    """A `Condition` with the parts that are not given left empty."""
    rows, width = pooled.shape
    tokens = np.zeros((rows, 0, width), np.float32) if tokens is None else tokens
    words = np.ones(tokens.shape[:2], np.bool_) if words is None else words
    valid = np.asarray([-1] * rows if lengths is None else lengths, np.int64)
    flags = np.zeros((rows, 0), np.int64) if flags is None else flags
    return Condition(pooled, tokens, words, valid, flags)


class Bound(NamedTuple):
    """A condition as the network's layers need it; rows are the first axis of every part."""

    text: Floats
    """(rows, width) projected pooled text."""
    keys: Floats
    """(rows, layers, heads, words, head width)."""
    values: Floats
    words: NDArray[np.bool_]
    """(rows, 1, 1, words)."""
    lengths: NDArray[np.int64]
    flags: NDArray[np.int64]
    shown: Floats
    """(rows, tokens, width) what a control adapter is shown, ready to be added to the tokens; (rows, 0, 0) where there
    is nothing."""
