"""`teach`: an action or a style from a few clips, into an adapter. Carried out by `motionloom_train`."""

from dataclasses import dataclass

from motionloom.requests.fields import Checked, declare

PRECISIONS = ("auto", "bf16", "float32")


@dataclass(frozen=True, kw_only=True)
class Teach(Checked):
    """How something is taught."""

    name: str = declare("text", "name on the adapter's card; without it that of the file", "", high=200)
    licence: str = declare(
        "text", "what one may do with the adapter, as the owner of the clips and that of the prior allow", "", high=1000
    )
    steps: int = declare("whole", "training steps; more clips may need more", 2000, low=1, high=100_000)
    rank: int = declare("whole", "size of the change: 16 makes a file of 1.5 MB", 16, low=1, high=128)
    keep: float = declare("number", "share of the training on what the weights know already", 0.5, low=0, high=0.9)
    mirror: bool = declare("flag", "learn from the clips' mirror images", True)
    seed: int = declare("whole", "the same seed teaches the same", 0, low=0, high=2**31 - 1)
    amp: str = declare(
        "word", "what is multiplied in; auto takes what is quicker on this machine", "auto", words=PRECISIONS
    )
