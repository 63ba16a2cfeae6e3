"""CLIP's text tower as published networks were trained with it."""

from collections.abc import Sequence
from importlib import import_module

from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.text.protocol import TextEmbedding, TextEncoder

READER = "motionloom_train.nets.text.hub"
"""The module that opens CLIP, which needs PyTorch."""


class PublishedText:
    """CLIP's text tower as the published weights were trained with it, opened when the first prompt is encoded.

    So published weights can be imported, saved, looked at and moved where CLIP is not installed. ``clip`` cuts
    prompts at 22 word pieces (HumanML3D, KIT), ``clip-77`` at 77 (BABEL).
    """

    width = 512

    def __init__(self, name: str) -> None:
        self.name = name
        self._clip: TextEncoder | None = None

    def encode(self, texts: Sequence[str] | str) -> TextEmbedding:
        """See `TextEncoder.encode`; raises MotionloomError where the extra `clip` or its files are missing."""
        if self._clip is None:
            self._clip = _open(TEXTS[self.name])
        return self._clip.encode(texts)


def _open(length: int) -> TextEncoder:
    try:
        return import_module(READER).ClipText.open(length=length)
    except ImportError as error:
        raise MotionloomError(
            f"these weights read texts with CLIP, and {error.name or 'a package'} for it is not installed; "
            "install motionloom-train with the extra 'clip'"
        ) from None


TEXTS = {"clip": 22, "clip-77": 77}
"""Names of the published text encoders, with the word pieces they read."""
