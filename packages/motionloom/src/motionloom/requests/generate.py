"""`generate`: motion of one person from a sentence."""

from dataclasses import dataclass

from motionloom.requests.fields import declare, group
from motionloom.requests.sampling import Sampling
from motionloom.requests.shared import SAMPLED, Adapted, Finish, prompt, seconds


@dataclass(frozen=True, kw_only=True)
class Generate(Finish, Adapted):
    """Make motion of one person from a sentence, such as 'a person walks forward and waves'."""

    prompt: str = prompt(needed=True)
    seconds: float | None = seconds(
        "length of each motion: 5, on stairs 4, or of several actions in a sentence what they take"
    )
    as_one: bool = declare("flag", "do not part 'A, then B' into actions that follow each other", False)
    literal: bool = declare("flag", "do not read numbers as goals: '3 meters', 'turns left 90 degrees'", False)
    sampling: Sampling = group(Sampling(count=1), *SAMPLED, "solver")
