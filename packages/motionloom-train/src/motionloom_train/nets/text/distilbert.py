"""DistilBERT (Sanh et al. 2019), the token-level text encoder of MDM's decoder variants."""

from pathlib import Path

import torch

from motionloom.runtime.text.protocol import Row
from motionloom_train.nets.text.hub import Pretrained, PretrainedText, open_pretrained

HUB_NAME = "distilbert/distilbert-base-uncased"


class DistilBert(PretrainedText):
    """tokens: last hidden states, start and end marks included; pooled: their mean, not normalised."""

    name = "distilbert"

    def __init__(self, parts: Pretrained, *, cache: int = 1024) -> None:
        super().__init__(parts, length=int(parts.model.config.max_position_embeddings), cache=cache)

    @staticmethod
    def open(place: Path | str = HUB_NAME) -> "DistilBert":
        """Open from a folder or the hub's cache.

        Raises MotionloomError where transformers (extra `distilbert`) or the files are missing.
        """
        return DistilBert(open_pretrained("DistilBertModel", place, extra="distilbert"))

    def _rows(self, ids: list[list[int]], padded: torch.Tensor, real: torch.Tensor) -> list[Row]:
        out = self._model(padded, attention_mask=real).last_hidden_state
        words = [states[: len(row)].cpu().numpy().copy() for row, states in zip(ids, out)]
        return [(states, states.mean(0)) for states in words]
