"""Text encoders: a sentence becomes one state per word piece and one pooled vector.

The embedded default is `minilm.MiniLM`; `clip.ClipText` and `distilbert.DistilBert` serve the published weights
and need the extras of the same names.
"""

from motionloom.nets.text.minilm import MiniLM
from motionloom.nets.text.protocol import TextEmbedding, TextEncoder

__all__ = ["MiniLM", "TextEmbedding", "TextEncoder"]
