"""`edit`: a clip changed by words."""

from dataclasses import dataclass
from typing import Any

from motionloom.requests.fields import declare, group
from motionloom.requests.sampling import Sampling
from motionloom.requests.shared import LONGEST, SAMPLED, Adapted, Finish, prompt

Span = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Edit(Finish, Adapted):
    """Change a motion by words: some seconds, some joints, its end."""

    motion: Any = declare("motion", "the clip", needed=True)
    prompt: str | None = prompt("what the person is to do, such as 'waves'")
    between: tuple[Span, ...] = declare(
        "number", "change only these seconds", (), low=0, many=50, size=2, unit="seconds"
    )
    keep: tuple[str, ...] = declare(
        "text", "part that stays: a joint, a group such as lower_body, root", (), high=1000, many=100
    )
    extend: float = declare("number", "go on behind the clip", 0.0, low=0, high=LONGEST, unit="seconds")
    strength: float = declare("number", "how far from the clip: 1 is from noise alone", 1.0, low=0, high=1, above=True)
    person: int = declare("whole", "whom to change, of several people in one motion, counted from 0", 0, low=0, high=7)
    source: Any = declare("motion", "a clip whose beginning the parts that do not stay follow, instead of words")
    look: tuple[float, float, float] | None = declare(
        "number", "turn the head to this place: x, y, z", None, low=-1000, high=1000, size=3, unit="metres"
    )
    smooth: float = declare(
        "number",
        "even out what is quicker than this, in the parts that do not stay",
        0.0,
        low=0,
        high=2,
        unit="seconds",
    )
    look_at: int | None = declare("whole", "turn the head to this person's, counted from 0", None, low=0, high=7)
    sampling: Sampling = group(Sampling(count=1), *SAMPLED)
