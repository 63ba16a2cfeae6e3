"""CLIP's text tower as published networks were trained with it."""

from collections.abc import Sequence

from motionloom.nets.text.clip import FULL_LENGTH, HUMANML_LENGTH, ClipText
from motionloom.nets.text.protocol import TextEmbedding


class PublishedText:
    """CLIP's text tower as the published weights were trained with it, opened when the first prompt is encoded.

    So published weights can be imported, saved, looked at and moved where CLIP is not installed. ``clip`` cuts
    prompts at 22 word pieces (HumanML3D, KIT), ``clip-77`` at 77 (BABEL).
    """

    width = 512

    def __init__(self, name: str) -> None:
        self.name = name
        self._clip: ClipText | None = None

    def encode(self, texts: Sequence[str] | str) -> TextEmbedding:
        """See `TextEncoder.encode`; raises MotionloomError where the extra `clip` or its files are missing."""
        if self._clip is None:
            self._clip = ClipText.open(length=TEXTS[self.name])
        return self._clip.encode(texts)


TEXTS = {"clip": HUMANML_LENGTH, "clip-77": FULL_LENGTH}
"""Names of the published text encoders, with the word pieces they read."""
