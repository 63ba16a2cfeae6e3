"""Commands for a live motion, as values, and the JSON objects that hold the same.

In Python directions are radians about +Y (0 is +Z, a quarter turn +X) as everywhere; in JSON they are degrees, as in
goal files. Everything is checked here, so that nothing that comes from outside reaches the planner unchecked.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.skeleton import SMPL22
from motionloom.goals.paths import FASTEST
from motionloom.goals.reach import HIGHEST
from motionloom.requests.fields import Checked, Spec, declare
from motionloom.requests.reading import read

LONGEST_TEXT = 500
"""Characters of a prompt."""
TURN = Spec("number", "degrees in the world", low=-1e9, high=1e9, unit="degrees")


def _angle(help: str) -> Any:
    return declare("number", help, low=-1e9, high=1e9, unit="radians")


def _places(help: str, size: int, many: int = 0) -> Any:
    return declare("number", help, needed=True, size=size, many=many, low=-10_000, high=10_000, unit="metres")


def _within() -> Any:
    return declare("number", "from now", 0.6, low=0.2, high=30, unit="seconds")


@dataclass(frozen=True)
class Say(Checked):
    """What is done from now on; an empty text leaves the words to the steering."""

    text: str = declare(
        "text",
        "what is done from now on; an empty text leaves the words to the steering",
        needed=True,
        high=LONGEST_TEXT,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "text", " ".join(self.text.split()))


@dataclass(frozen=True)
class Steer(Checked):
    """Where to go, how fast and facing where. Without any of the three, steering ends, and so does a path."""

    direction: float | None = _angle("where to, in the world; without it ahead")
    speed: float | None = declare(
        "number", "how fast; without it as fast as the words go", low=0, high=FASTEST, unit="m/s"
    )
    facing: float | None = _angle("in the world; without it as the words do")

    @property
    def nothing(self) -> bool:
        """Whether steering ends."""
        return self.direction is None and self.speed is None and self.facing is None


@dataclass(frozen=True)
class Path(Checked):
    """Points on the floor to go through, from where the person is; he stops at the last one."""

    points: tuple[tuple[float, float], ...] = _places("x and z in the world", 2, 1000)
    speed: float | None = declare("number", "how fast; without it a walk", low=0.1, high=FASTEST, unit="m/s")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.points:
            raise MotionloomError("points must be a list of at most 1000; got an empty one, and nobody walks that")


@dataclass(frozen=True)
class Reach(Checked):
    """A joint is at a place in the world, so many seconds from now."""

    joint: str = declare("text", "a joint, such as left_wrist", needed=True, high=100)
    position: tuple[float, float, float] = _places("where, in the world", 3)
    within: float = _within()

    def __post_init__(self) -> None:
        super().__post_init__()
        SMPL22.index(self.joint)
        if not -0.5 <= self.position[1] <= HIGHEST:
            raise MotionloomError(f"{self.position[1]:.2f} m is out of anybody's reach; keep below {HIGHEST:g} m")


@dataclass(frozen=True)
class Pose(Checked):
    """A whole pose is taken, so many seconds from now, wherever the person is then."""

    places: tuple[tuple[float, float, float], ...] = _places(
        "22 places of a person at the origin who faces +Z with the floor at y = 0", 3, len(SMPL22)
    )
    within: float = _within()

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.places) != len(SMPL22):
            raise MotionloomError(f"a pose has {len(SMPL22)} places, one for each joint; got {len(self.places)}")
        if np.ptp(np.asarray(self.places), axis=0).max() > HIGHEST:
            raise MotionloomError("no person takes a pose that is more than 3 m across")


Command: TypeAlias = Say | Steer | Path | Reach | Pose


def scaled(command: Command, size: float) -> Command:
    """The same with places and speeds ``size`` times as large, for somebody whose legs are: words, directions, times
    and poses stay.

    Raises `MotionloomError` where nobody does that.
    """
    if size == 1.0 or isinstance(command, Say | Pose):
        return command
    try:
        if isinstance(command, Reach):
            x, y, z = command.position
            return replace(command, position=(size * x, size * y, size * z))
        speed = None if command.speed is None else size * command.speed
        if isinstance(command, Steer):
            return replace(command, speed=speed)
        return replace(command, points=tuple((size * x, size * z) for x, z in command.points), speed=speed)
    except MotionloomError as error:
        raise MotionloomError(f"{error}; that is of the person, {size:.2f} times as large as the robot") from None


class FrameCommand(NamedTuple):
    """A command, with the frame that it first changed."""

    frame: int
    """Number of the frame, at the rate that is shown."""
    command: Command
    person: int
    """0, or 1 for the second of two people."""


# As JSON


COMMANDS: Mapping[str, type] = {"say": Say, "steer": Steer, "path": Path, "reach": Reach, "pose": Pose}
"""By their "type"."""
TURNS = ("direction", "facing")


def from_json(message: Any) -> Command:
    """The command in a JSON object; `MotionloomError` for anything else. Its person is that of `person_of`."""
    if not isinstance(message, Mapping) or not isinstance(message.get("type"), str):
        raise MotionloomError('a command is a JSON object with a "type"')
    kind = message["type"]
    if kind not in COMMANDS:
        raise MotionloomError(f"there is no command {kind[:40]!r}; the commands are {', '.join(COMMANDS)}")
    values = {key: value for key, value in message.items() if key not in ("type", "person")}
    for name in TURNS:
        if kind == "steer" and values.get(name) is not None:
            values[name] = math.radians(TURN.check(values[name], repr(name)))
    return read(COMMANDS[kind], values, f"the command {kind}")


def person_of(message: Mapping[str, Any]) -> int | None:
    """Which person a JSON object is for, 0 or 1; None where it names nobody, which is everybody."""
    number = message.get("person")
    if number is None:
        return None
    if isinstance(number, bool) or number not in (1, 2):
        raise MotionloomError("person is 1 or 2; without it what is asked is for everybody")
    return int(number) - 1


def to_json(command: Command) -> dict[str, Any]:
    """What `from_json` reads."""
    [kind] = [name for name, one in COMMANDS.items() if type(command) is one]
    values = {one.name: getattr(command, one.name) for one in fields(command)}
    turned = {name: round(math.degrees(values[name]), 9) for name in TURNS if values.get(name) is not None}
    return {"type": kind, **{name: _plain(value) for name, value in (values | turned).items() if value is not None}}


def _plain(value: Any) -> Any:
    return [_plain(one) for one in value] if isinstance(value, tuple) else value
