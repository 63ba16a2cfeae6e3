"""CLIP ViT-B/32's text tower (Radford et al. 2021), which the published MDM and PriorMDM weights were trained with."""

import html
from collections.abc import Sequence
from pathlib import Path

import torch

from motionloom.errors import MotionloomError
from motionloom.runtime.text.protocol import Row, RowCache, TextEmbedding, as_rows, cut, stack_rows
from motionloom_train.nets.text.hub import Pretrained, open_pretrained

HUB_NAME = "openai/clip-vit-base-patch32"
HUMANML_LENGTH = 22  # 20 word pieces, start and end: what the HumanML3D and KIT models saw
FULL_LENGTH = 77  # what the BABEL models saw
BATCH = 64


class ClipText:
    """tokens: last hidden states after the final norm; pooled: the projected state at the end mark, not normalised.

    The published code pads the ids with zeros to 77 places. The tower is causal and the end mark comes before the
    padding, so nothing here depends on it and the padding is left out.
    """

    name = "clip"

    def __init__(self, parts: Pretrained, *, length: int = HUMANML_LENGTH, cache: int = 1024) -> None:
        self._model, self._tokenizer = parts.model, parts.tokenizer
        config = self._model.config
        if config.hidden_size != config.projection_dim:
            raise MotionloomError(
                f"This CLIP has states of width {config.hidden_size} and pooled vectors of width "
                f"{config.projection_dim}; name one where they agree, as in {HUB_NAME}."
            )
        places = int(config.max_position_embeddings)
        if not 2 <= length <= places:
            raise ValueError(f"length {length} is not in 2..{places}")
        self.length = length
        self._cache = RowCache(cache)

    @staticmethod
    def open(place: Path | str = HUB_NAME, *, length: int = HUMANML_LENGTH) -> "ClipText":
        """Open from a folder or the hub's cache; length counts word pieces with both marks (22 or 77).

        Raises MotionloomError where transformers (extra `clip`) or the files are missing.
        """
        return ClipText(open_pretrained("CLIPTextModelWithProjection", place, extra="clip"), length=length)

    @property
    def width(self) -> int:
        return int(self._model.config.projection_dim)

    def to(self, device: torch.device | str) -> "ClipText":
        """This encoder, moved to another device; its cache is emptied."""
        self._model.to(device)
        self._cache = RowCache(self._cache.size)
        return self

    def encode(self, texts: Sequence[str] | str) -> TextEmbedding:
        """Tokens (rows, words <= length, 512), mask (rows, words), pooled (rows, 512); long texts are truncated."""
        return stack_rows(self._cache.fetch(as_rows(texts), self._encode), self.width)

    def ids(self, text: str) -> list[int]:
        """Byte-pair ids of one text with start and end marks, at most `length` (warns where it had to cut)."""
        text, room = html.unescape(html.unescape(text)), self.length - 2
        return [
            self._tokenizer.bos_token_id,
            *cut(text, lambda part: self._tokenizer(part, add_special_tokens=False, verbose=False).input_ids, room),
            self._tokenizer.eos_token_id,
        ]

    @torch.no_grad()
    def _encode(self, texts: list[str]) -> list[Row]:
        rows: list[Row] = []
        for start in range(0, len(texts), BATCH):
            ids = [self.ids(text) for text in texts[start : start + BATCH]]
            longest = max(map(len, ids))
            padded = torch.tensor([row + [0] * (longest - len(row)) for row in ids])
            out = self._model(padded.to(self._model.device))
            rows += [
                (states[: len(row)].cpu().numpy().copy(), pooled.cpu().numpy())
                for row, states, pooled in zip(ids, out.last_hidden_state, out.text_embeds)
            ]
        return rows
