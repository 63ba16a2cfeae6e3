"""DistilBERT (Sanh et al. 2019), the token-level text encoder of MDM's decoder variants."""

from collections.abc import Sequence
from pathlib import Path

import torch

from motionloom.runtime.text.protocol import Row, RowCache, TextEmbedding, as_rows, cut, stack_rows
from motionloom_train.nets.text.hub import Pretrained, open_pretrained

HUB_NAME = "distilbert/distilbert-base-uncased"
BATCH = 64


class DistilBert:
    """tokens: last hidden states, start and end marks included; pooled: their mean, not normalised."""

    name = "distilbert"

    def __init__(self, parts: Pretrained, *, cache: int = 1024) -> None:
        self._model, self._tokenizer = parts.model, parts.tokenizer
        self.length = int(self._model.config.max_position_embeddings)
        self._cache = RowCache(cache)

    @staticmethod
    def open(place: Path | str = HUB_NAME) -> "DistilBert":
        """Open from a folder or the hub's cache.

        Raises MotionloomError where transformers (extra `distilbert`) or the files are missing.
        """
        return DistilBert(open_pretrained("DistilBertModel", place, extra="distilbert"))

    @property
    def width(self) -> int:
        return int(self._model.config.dim)

    def to(self, device: torch.device | str) -> "DistilBert":
        """This encoder, moved to another device; its cache is emptied."""
        self._model.to(device)
        self._cache = RowCache(self._cache.size)
        return self

    def encode(self, texts: Sequence[str] | str) -> TextEmbedding:
        """Tokens (rows, words <= 512, 768), mask (rows, words), pooled (rows, 768); long texts are truncated."""
        return stack_rows(self._cache.fetch(as_rows(texts), self._encode), self.width)

    def ids(self, text: str) -> list[int]:
        """Word-piece ids of one text with start and end marks, at most 512 (warns where it had to cut)."""
        room = self.length - 2
        return [
            self._tokenizer.cls_token_id,
            *cut(text, lambda part: self._tokenizer(part, add_special_tokens=False, verbose=False).input_ids, room),
            self._tokenizer.sep_token_id,
        ]

    @torch.no_grad()
    def _encode(self, texts: list[str]) -> list[Row]:
        rows: list[Row] = []
        for start in range(0, len(texts), BATCH):
            ids = [self.ids(text) for text in texts[start : start + BATCH]]
            longest = max(map(len, ids))
            padded = torch.tensor([row + [0] * (longest - len(row)) for row in ids])
            real = torch.tensor([[1] * len(row) + [0] * (longest - len(row)) for row in ids])
            device = self._model.device
            out = self._model(padded.to(device), attention_mask=real.to(device)).last_hidden_state
            words = [states[: len(row)].cpu().numpy().copy() for row, states in zip(ids, out)]
            rows += [(states, states.mean(0)) for states in words]
        return rows
