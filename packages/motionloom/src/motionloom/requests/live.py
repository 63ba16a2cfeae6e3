"""Somebody who is steered while he moves: how a session begins, and what it is sampled with."""

from dataclasses import dataclass
from typing import Any

from motionloom.requests.fields import Checked, declare, like
from motionloom.requests.sampling import Sampling
from motionloom.requests.shared import Looping, OnRobot

LONGEST_SCRIPT = 3600.0
"""Seconds of a session that is written to files."""


@dataclass(frozen=True, kw_only=True)
class Hello(Checked):
    """How a session begins."""

    seed: int = like(Sampling, "seed", "the same seed makes the same motion")
    fps: float = declare("number", "frames per second that are shown", 20.0, low=1, high=120)
    people: int = declare("whole", "1 or 2", 1, low=1, high=2)
    skeleton: Any = declare("skeleton", "a name, or an object with names, parents and offsets in metres", "smpl22")
    robot: str = declare("text", "a robot of the server: joint angles come too, of its skeleton", "", high=100)
    max_speed: float | None = like(OnRobot, "max_speed")
    avoid_collisions: bool | None = like(OnRobot, "avoid_collisions")
    session: str = declare("text", "the key that the welcome of a session gave, to go on with it", "", high=100)


@dataclass(frozen=True, kw_only=True)
class ScriptKeys(Checked):
    """The keys of a script."""

    seconds: float = declare("number", "how long it is", needed=True, low=0.05, high=LONGEST_SCRIPT, unit="seconds")
    seed: int = like(Sampling, "seed", "the same seed makes the same motion")
    people: int = like(Hello, "people")
    commands: Any = declare("commands", "what is asked when", ())


@dataclass(frozen=True, kw_only=True)
class TimedKeys(Checked):
    """The keys of a command beside its own."""

    at: float = declare("number", "when it is asked", needed=True, low=0, high=LONGEST_SCRIPT, unit="seconds")
    person: int | None = declare("whole", "whom of two, 1 or 2; without it everybody", low=1, high=2)


@dataclass(frozen=True, kw_only=True)
class Live(Looping):
    """The keys of a scripted session."""

    seed: int | None = like(Sampling, "seed", "the same seed makes the same motion: the script's, else 0", default=None)
    fps: float | None = declare("number", "frames per second that are shown: the model's 20", low=1, high=240)
    steps: int = like(Sampling, "steps", "network calls per window", default=8, high=200)
    guidance: float = like(Sampling, "guidance", "strength of the words")
