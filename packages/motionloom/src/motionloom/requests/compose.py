"""`compose`: a long motion of one person from a timeline."""

from dataclasses import dataclass
from typing import Any

from motionloom.requests.fields import declare, group, like
from motionloom.requests.sampling import Sampling
from motionloom.requests.shared import Adapted, Finish


@dataclass(frozen=True, kw_only=True)
class Compose(Finish, Adapted):
    """Make one long motion of several actions, one after the other, such as {"segments": ["a person
    walks", "a person sits"]}.
    """

    timeline: Any = declare("timeline", "what a timeline file holds", needed=True)
    kept_from: Any = declare("motion", "a motion of an earlier timeline; blocks that ask for the same keep its frames")
    seed: int | None = like(Sampling, "seed", "the same seed makes the same motion: 0, or the timeline's", default=None)
    guidance: float | None = like(
        Sampling, "guidance", "strength of the text where a segment has none of its own: 2.5", default=None
    )
    sampling: Sampling = group(Sampling(count=1), "count", "steps", "best_of")
