"""Text encoders: a sentence becomes one state per word piece and one pooled vector.

The embedded default is `MiniLM`. `ClipText` and `DistilBert` serve the published weights; they need the extras
`clip` and `distilbert`, and files that are already on this machine.
"""

from motionloom.nets.text.clip import ClipText
from motionloom.nets.text.distilbert import DistilBert
from motionloom.nets.text.minilm import MiniLM
from motionloom.nets.text.protocol import TextEmbedding, TextEncoder

__all__ = ["ClipText", "DistilBert", "MiniLM", "TextEmbedding", "TextEncoder"]
