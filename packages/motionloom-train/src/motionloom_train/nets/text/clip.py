"""CLIP ViT-B/32's text tower (Radford et al. 2021), which the published MDM and PriorMDM weights were trained with."""

import html
from pathlib import Path

import torch

from motionloom.errors import MotionloomError
from motionloom.runtime.text.protocol import Row
from motionloom_train.nets.text.hub import Pretrained, PretrainedText, open_pretrained

HUB_NAME = "openai/clip-vit-base-patch32"
HUMANML_LENGTH = 22  # 20 word pieces, start and end: what the HumanML3D and KIT models saw


class ClipText(PretrainedText):
    """tokens: last hidden states after the final norm; pooled: the projected state at the end mark, not normalised.

    The published code pads the ids with zeros to 77 places. The tower is causal and the end mark comes before the
    padding, so nothing here depends on it and the padding is left out.
    """

    name = "clip"

    def __init__(self, parts: Pretrained, *, length: int = HUMANML_LENGTH, cache: int = 1024) -> None:
        config = parts.model.config
        if config.hidden_size != config.projection_dim:
            raise MotionloomError(
                f"This CLIP has states of width {config.hidden_size} and pooled vectors of width "
                f"{config.projection_dim}; name one where they agree, as in {HUB_NAME}."
            )
        places = int(config.max_position_embeddings)
        if not 2 <= length <= places:
            raise ValueError(f"length {length} is not in 2..{places}")
        super().__init__(parts, length=length, cache=cache)

    @staticmethod
    def open(place: Path | str = HUB_NAME, *, length: int = HUMANML_LENGTH) -> "ClipText":
        """Open from a folder or the hub's cache; length counts word pieces with both marks (22 or 77).

        Raises MotionloomError where transformers (extra `clip`) or the files are missing.
        """
        return ClipText(open_pretrained("CLIPTextModelWithProjection", place, extra="clip"), length=length)

    def ids(self, text: str) -> list[int]:
        """Byte-pair ids; what HTML hides is read first, as CLIP does."""
        return super().ids(html.unescape(html.unescape(text)))

    def _rows(self, ids: list[list[int]], padded: torch.Tensor, real: torch.Tensor) -> list[Row]:
        out = self._model(padded)
        return [
            (states[: len(row)].cpu().numpy().copy(), pooled.cpu().numpy())
            for row, states, pooled in zip(ids, out.last_hidden_state, out.text_embeds)
        ]
