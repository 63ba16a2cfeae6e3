"""`control`: motion of one person from words that keeps to goals."""

from dataclasses import dataclass
from typing import Any

from motionloom.requests.fields import declare, group
from motionloom.requests.sampling import Sampling
from motionloom.requests.shared import SAMPLED, Adapted, Finish, prompt, seconds


@dataclass(frozen=True, kw_only=True)
class Control(Finish, Adapted):
    """Make motion of one person that keeps to goals, such as {"path": {"points": [[0, 0], [1, 2], [0,
    4]]}} (x and z, metres).
    """

    prompt: str | None = prompt()
    goals: Any = declare("goals", "what a goal file holds", needed=True)
    timeline: Any = declare("timeline", "what a timeline file holds, instead of a prompt; the goals have a path then")
    seconds: float | None = seconds("length of each motion: 5, or that of the motion that is followed")
    fit: bool = declare("flag", "bend what was sampled, so that it meets its goals", True)
    sampling: Sampling = group(Sampling(count=1), *SAMPLED)
