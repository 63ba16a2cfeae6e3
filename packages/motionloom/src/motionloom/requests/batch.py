"""`batch`: the columns of a row, and the options of all rows of a job."""

from dataclasses import dataclass
from typing import Any

from motionloom.requests.export import OnSkeleton
from motionloom.requests.fields import declare, like
from motionloom.requests.sampling import PairSampling, Sampling
from motionloom.requests.shared import LONGEST_LINE, Finish, OnRobot
from motionloom.requests.tasks import Generate

TASKS = ("generate", "control", "compose", "duet", "export")


@dataclass(frozen=True, kw_only=True)
class RowKeys(OnRobot):
    """The columns of one row."""

    task: str | None = declare("word", "what is made; without it what the other columns mean", words=TASKS)
    prompt: str | None = like(Generate, "prompt", needed=False)
    seconds: float | None = like(Generate, "seconds")
    seed: int | None = like(Sampling, "seed", "the same seed makes the same motion", default=None)
    best_of: int | None = like(Sampling, "best_of", default=None)
    timeline: str | None = declare("text", "name of a timeline file", high=LONGEST_LINE)
    goal: Any = declare("goal", "name of a goal file, or a mapping of its keys")
    motion: str | None = declare("text", "name of a file with a recording, which is put on", high=LONGEST_LINE)
    person: int | None = declare("whole", "whose the goal is of two people, or a timeline's path", low=1, high=2)
    skeleton: str | None = declare("text", "file with the skeleton that the motion is put on", high=LONGEST_LINE)
    id: str | None = declare("text", "name of the motion's files", high=LONGEST_LINE)


@dataclass(frozen=True, kw_only=True)
class Batch(Finish, OnRobot):
    """Options of all rows."""

    seconds: float = like(Generate, "seconds", "length of rows that do not say", default=5.0)
    seed: int = like(Sampling, "seed", "seed of rows that do not say, of the first variant")
    guidance: float = like(Sampling, "guidance")
    steps: int = like(Sampling, "steps")
    solver: str = like(Sampling, "solver")
    pair_guidance: float = like(PairSampling, "pair_guidance")
    literal: bool = like(Generate, "literal")
    best_of: int = like(Sampling, "best_of")
    root: str | None = like(OnSkeleton, "root")
    hands: str = like(OnSkeleton, "hands", default="as-is")
    variants: int | None = declare("whole", "motions per line of --prompts, of seeds 0 to N - 1", low=1)
