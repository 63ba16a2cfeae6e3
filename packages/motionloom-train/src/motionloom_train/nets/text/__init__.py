"""Networks of text encoders, in PyTorch.

`ClipText` and `DistilBert` serve the published weights; they need the extras `clip` and `distilbert`, and files that
are already on this machine. The embedded default is `motionloom.core.models.networks.text.minilm`, whose network is
`bert.Bert`.
"""

from motionloom_train.nets.text.hub import ClipText, DistilBert

__all__ = ["ClipText", "DistilBert"]
