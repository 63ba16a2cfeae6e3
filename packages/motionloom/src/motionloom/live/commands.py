"""What can be asked of somebody who moves, as values, and the JSON objects that say the same.

In Python directions are radians about +Y (0 is +Z, a quarter turn +X) as everywhere; in JSON they are degrees, as in
goal files. Everything is checked here, so that nothing that comes from outside reaches the planner unchecked.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from motionloom.errors import MotionloomError
from motionloom.goals.paths import FASTEST
from motionloom.goals.reach import HIGHEST
from motionloom.skeleton import SMPL22

LONGEST_TEXT = 500
"""Characters of a prompt."""
MOST_POINTS = 1000
"""Points of a path."""
FARTHEST = 10_000.0
"""Metres from the origin."""
LATEST = 30.0
"""Seconds in which something must be reached."""


@dataclass(frozen=True)
class Say:
    """What is done from now on; an empty text leaves the words to the steering."""

    text: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.text, str) or len(self.text) > LONGEST_TEXT:
            raise MotionloomError(f"what is done is said in words, at most {LONGEST_TEXT} characters of them")
        if not self.text.isascii() and any("\ud800" <= letter <= "\udfff" for letter in self.text):
            raise MotionloomError("what is done is not text: it holds half a letter (a lone surrogate)")
        object.__setattr__(self, "text", " ".join(self.text.split()))


@dataclass(frozen=True)
class Steer:
    """Where to go, how fast and facing where. Without any of the three, steering ends, and so does a path."""

    direction: float | None = None
    """Radians in the world; None: ahead."""
    speed: float | None = None
    """Metres per second; None: as fast as the words go."""
    facing: float | None = None
    """Radians in the world; None: as the words do."""

    def __post_init__(self) -> None:
        for name in ("direction", "speed", "facing"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _number(getattr(self, name), name))
        if self.speed is not None and not 0 <= self.speed <= FASTEST:
            raise MotionloomError(f"a speed of {self.speed:g} m/s cannot be steered; give 0 to {FASTEST:g}")

    @property
    def nothing(self) -> bool:
        """Whether steering ends."""
        return self.direction is None and self.speed is None and self.facing is None


@dataclass(frozen=True)
class Path:
    """Points on the floor to go through, from where the person is; he stops at the last one."""

    points: tuple[tuple[float, float], ...]
    """Metres, x and z in the world."""
    speed: float | None = None
    """Metres per second; None: a walk."""

    def __post_init__(self) -> None:
        try:
            points = tuple(_point(point, "a point of a path", 2) for point in self.points)
        except TypeError:
            raise MotionloomError("a path is a list of points x, z in metres") from None
        if not 1 <= len(points) <= MOST_POINTS:
            raise MotionloomError(f"a path of {len(points)} points cannot be walked; give 1 to {MOST_POINTS}")
        object.__setattr__(self, "points", points)
        if self.speed is not None:
            object.__setattr__(self, "speed", _number(self.speed, "speed"))
            if not 0.1 <= self.speed <= FASTEST:
                raise MotionloomError(f"a path cannot be walked at {self.speed:g} m/s; give 0.1 to {FASTEST:g}")


@dataclass(frozen=True)
class Reach:
    """A joint is at a place in the world, so many seconds from now."""

    joint: str
    position: tuple[float, float, float]
    """Metres."""
    within: float = 0.6
    """Seconds."""

    def __post_init__(self) -> None:
        if not isinstance(self.joint, str):
            raise MotionloomError("a joint is named in words, such as left_wrist")
        SMPL22.index(self.joint)
        object.__setattr__(self, "position", _point(self.position, "a place to reach", 3))
        object.__setattr__(self, "within", _soon(self.within))
        if not -0.5 <= self.position[1] <= HIGHEST:
            raise MotionloomError(f"{self.position[1]:.2f} m is out of anybody's reach; keep below {HIGHEST:g} m")


@dataclass(frozen=True)
class Pose:
    """A whole pose is taken, so many seconds from now, wherever the person is then."""

    places: tuple[tuple[float, float, float], ...]
    """22 places in metres, of a person at the origin who faces +Z with the floor at y = 0."""
    within: float = 0.6
    """Seconds."""

    def __post_init__(self) -> None:
        try:
            places = tuple(_point(place, "a place of a pose", 3) for place in self.places)
        except TypeError:
            raise MotionloomError("a pose is a list of 22 places x, y, z in metres") from None
        if len(places) != len(SMPL22):
            raise MotionloomError(f"a pose has {len(SMPL22)} places, one for each joint; got {len(places)}")
        if np.ptp(np.asarray(places), axis=0).max() > HIGHEST:
            raise MotionloomError("no person takes a pose that is more than 3 m across")
        object.__setattr__(self, "places", places)
        object.__setattr__(self, "within", _soon(self.within))


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


class Taken(NamedTuple):
    """Something that was asked, with the frame that it first changed."""

    frame: int
    """Number of the frame, at the rate that is shown."""
    command: Command
    person: int
    """0, or 1 for the second of two people."""


def _number(value: Any, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | np.floating | np.integer):
        raise MotionloomError(f"{name} must be a number")
    number = float(value) if abs(value) < 1e9 else math.inf
    if not math.isfinite(number):
        raise MotionloomError(f"{name} must be a number below a thousand million")
    return number


def _point(values: Any, what: str, count: int) -> tuple[float, ...]:
    if not isinstance(values, list | tuple | np.ndarray) or len(values) != count:
        raise MotionloomError(f"{what} has {count} numbers, in metres")
    point = tuple(_number(value, what) for value in values)
    if max(map(abs, point)) > FARTHEST:
        raise MotionloomError(f"{what} is more than {FARTHEST:g} m away from the origin; keep nearer")
    return point


def _soon(seconds: Any) -> float:
    value = _number(seconds, "within")
    if not 0.2 <= value <= LATEST:
        raise MotionloomError(f"nobody is asked to be somewhere within {value:g} s; give 0.2 to {LATEST:g}")
    return value


# As JSON


def _degrees(value: Any, name: str) -> float | None:
    return None if value is None else math.radians(_number(value, name))


def _steer(said: Mapping[str, Any]) -> Steer:
    direction, facing = (_degrees(said.get(name), name) for name in ("direction", "facing"))
    return Steer(direction, said.get("speed"), facing)


_KINDS: Mapping[str, tuple[set[str], set[str], Callable[[Mapping[str, Any]], Command]]] = {
    "say": ({"text"}, set(), lambda said: Say(said["text"])),
    "steer": (set(), {"direction", "speed", "facing"}, _steer),
    "path": ({"points"}, {"speed"}, lambda said: Path(said["points"], said.get("speed"))),
    "reach": (
        {"joint", "position"},
        {"within"},
        lambda said: Reach(said["joint"], said["position"], said.get("within", 0.6)),
    ),
    "pose": ({"places"}, {"within"}, lambda said: Pose(said["places"], said.get("within", 0.6))),
}
"""By their "type": the fields that there must be, those that there may be, and what makes the command of them."""


def from_json(said: Any) -> Command:
    """The command that a JSON object says; `MotionloomError` for anything else. Whom it is for says `person_of`."""
    if not isinstance(said, Mapping) or not isinstance(said.get("type"), str):
        raise MotionloomError('a command is a JSON object with a "type"')
    kind = said["type"]
    if kind not in _KINDS:
        raise MotionloomError(f"there is no command {kind[:40]!r}; the commands are {', '.join(_KINDS)}")
    needed, allowed, make = _KINDS[kind]
    if lacking := needed - set(said):
        raise MotionloomError(f"the command {kind} lacks {', '.join(sorted(lacking))}")
    if extra := set(said) - needed - allowed - {"type", "person"}:
        name = min(map(str, extra))[:40]
        raise MotionloomError(f"the command {kind} has no {name!r}; it has {', '.join(sorted(needed | allowed))}")
    return make(said)


def person_of(said: Mapping[str, Any]) -> int | None:
    """Which person a JSON object is for, 0 or 1; None where it names nobody, which is everybody."""
    number = said.get("person")
    if number is None:
        return None
    if isinstance(number, bool) or number not in (1, 2):
        raise MotionloomError("person is 1 or 2; without it what is asked is for everybody")
    return int(number) - 1


def to_json(command: Command) -> dict[str, Any]:
    """What `from_json` reads."""
    if isinstance(command, Say):
        return {"type": "say", "text": command.text}
    if isinstance(command, Steer):
        turns = {name: getattr(command, name) for name in ("direction", "facing")}
        said = {name: round(math.degrees(turn), 9) for name, turn in turns.items() if turn is not None}
        return {"type": "steer", **said, **({} if command.speed is None else {"speed": command.speed})}
    if isinstance(command, Path):
        points = [list(point) for point in command.points]
        return {"type": "path", "points": points, **({} if command.speed is None else {"speed": command.speed})}
    if isinstance(command, Reach):
        place = list(command.position)
        return {"type": "reach", "joint": command.joint, "position": place, "within": command.within}
    return {"type": "pose", "places": [list(place) for place in command.places], "within": command.within}
