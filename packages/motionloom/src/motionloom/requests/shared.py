"""What the requests of several tasks share."""

from dataclasses import dataclass
from typing import Any

from motionloom.requests.fields import Checked, declare

LONGEST = 60.0
"""Seconds: beyond this one prompt is no longer one action."""
LONGEST_PROMPT = 2_000
"""Characters of a prompt, for every interface: the longest of HumanML3D has 897."""
LONGEST_LINE = 20_000
"""Characters of other texts, such as names of files."""
SAMPLED = ("seed", "count", "guidance", "steps", "best_of")
"""Fields of sampling that most tasks have."""


def prompt(help: str = "what the person does, such as 'a person walks'", *, needed: bool = False) -> Any:
    """A field with words for the network."""
    return declare("text", help, high=LONGEST_PROMPT, hint="say in words what the person does", needed=needed)


def seconds(help: str, default: float | None = None, *, high: float = LONGEST) -> Any:
    """A field with a length."""
    return declare("number", help, default, low=0, high=high, above=True, unit="seconds")


@dataclass(frozen=True, kw_only=True)
class OnRobot(Checked):
    """A humanoid robot that motions are put on, and how."""

    robot: str | None = declare("text", "a humanoid robot's model: joint angles are made", high=LONGEST_LINE)
    robot_map: str | None = declare("text", "JSON file: which joints of the robot are which", high=LONGEST_LINE)
    max_speed: float | None = declare(
        "number", "speed that no joint of the robot exceeds; without it the model's", low=0.1, high=1000, unit="rad/s"
    )
    avoid_collisions: bool | None = declare("flag", "keep the robot's parts out of each other")


@dataclass(frozen=True, kw_only=True)
class Looping(Checked):
    """What becomes of the end of a motion that was sampled."""

    loop: bool = declare("flag", "make the end meet the beginning", False)
    blend: float = declare("number", "seconds drawn anew for a loop", 1.0, low=0, high=LONGEST, unit="seconds")


@dataclass(frozen=True, kw_only=True)
class Adapted(Checked):
    """What was taught from clips, put into the prior."""

    adapter: tuple[str, ...] = declare(
        "text",
        "what 'motionloom teach' made: FILE for sentences like what it was taught, FILE:FACTOR for all",
        (),
        high=LONGEST_LINE,
        many=16,
    )


@dataclass(frozen=True, kw_only=True)
class Finish(Looping):
    """What becomes of the whole."""

    foot_lock: bool = declare("flag", "keep planted feet still, and feet above the floor", True)
