"""The requests of all tasks, and these by the names of their tasks."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from motionloom.requests.fields import Checked, declare, group, like
from motionloom.requests.sampling import PairSampling, PredictionSampling, Sampling
from motionloom.requests.shared import LONGEST, SAMPLED, Adapted, Finish, prompt, seconds

Span = tuple[float, float]
DAY = 86_400
"""Seconds."""
NAMES = ("seed", "count", "guidance", "steps", "best_of", "temperature")


@dataclass(frozen=True, kw_only=True)
class Generate(Finish, Adapted):
    """Make motion of one person from a sentence, such as 'a person walks forward and waves'."""

    prompt: str = prompt(needed=True)
    seconds: float | None = seconds(
        "length of each motion: as long as its actions take people; what can go on, such as walking, 5"
    )
    as_one: bool = declare("flag", "one motion of the whole sentence, 'A, then B' too; numbers are not read", False)
    literal: bool = declare(
        "flag", "the words as they are: '3 meters' is no goal, and what is missing is not generated again", False
    )
    sampling: Sampling = group(Sampling(count=1), *SAMPLED, "solver")


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
    literal: bool = like(Generate, "literal", "the first motion, though it does not show what the words say plainly")
    sampling: Sampling = group(Sampling(count=1), "count", "steps", "best_of")


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


@dataclass(frozen=True, kw_only=True)
class _Past(Finish):
    motion: Any = declare("motion", "what is gone on from", needed=True)
    start: float | None = declare("number", "begin at this second of it", low=0, unit="seconds")
    end: float | None = declare("number", "end at this second of it", low=0, unit="seconds")


@dataclass(frozen=True, kw_only=True)
class Held(Checked):
    """A motion that parts of somebody's future are held to."""

    from_time: float = declare("number", "the second of it at which the future begins", 0.0, low=0, unit="seconds")


@dataclass(frozen=True, kw_only=True)
class Predict(_Past):
    """Make motions that may come after a motion."""

    seconds: float = seconds("how far to predict", 2.0, high=DAY)
    person: int = declare("whole", "who goes on, of several people in one motion, counted from 0", 0, low=0, high=7)
    root: bool = declare("flag", "let the person leave the place, which is not as published", True)
    sampling: PredictionSampling = group(PredictionSampling(count=10), *NAMES)


@dataclass(frozen=True, kw_only=True)
class Switch(_Past):
    """Lead from one motion into another."""

    target: Any = declare("motion", "what is led into", needed=True)
    seconds: float = seconds("length of the transition", 1.0, high=30)
    facing: str = declare(
        "word",
        "turn the target to go on as the past faces, or keep its own direction",
        "turned",
        words=("turned", "kept"),
    )
    sampling: PredictionSampling = group(PredictionSampling(count=1), *NAMES)


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


REQUESTS: Mapping[str, type] = {
    "generate": Generate,
    "compose": Compose,
    "control": Control,
    "edit": Edit,
    "predict": Predict,
    "switch": Switch,
    "duet": Duet,
}
