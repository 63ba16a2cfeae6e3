"""`duet`: motion of two people."""

from dataclasses import dataclass
from typing import Any

from motionloom.requests.fields import declare, group, like
from motionloom.requests.sampling import PairSampling
from motionloom.requests.shared import Adapted, Finish, prompt, seconds


@dataclass(frozen=True, kw_only=True)
class Duet(Finish, Adapted):
    """Make motion of two people, from words or around a motion that is there."""

    prompt: str | None = prompt("what the two do; 'what the first does :: what the second does'")
    timeline: Any = declare("timeline", "what a timeline file holds")
    past: Any = declare("motion", "a motion of two people that both go on from")
    react_to: Any = declare("motion", "a motion of the first person, whom the second answers")
    goals: Any = declare("goals", "what a goal file holds, for one of the two")
    other_goals: Any = declare("goals", "the same for the other of the two; with words or a timeline, and goals")
    person: int = declare("whole", "whose the goals are, counted from 0", 0, low=0, high=7)
    seconds: float | None = seconds("length: 6, or what a past gets: 3")
    seed: int | None = like(
        PairSampling, "seed", "the same seed makes the same duets: 0, or the timeline's", default=None
    )
    guidance: float | None = like(
        PairSampling, "guidance", "strength of the text: 2.5, or the timeline's", default=None
    )
    sampling: PairSampling = group(PairSampling(count=1), "count", "steps", "best_of", "pair_guidance", "bodies")
