"""Goal files: what control asks, as JSON that says key by key what is wrong with it.

`docs/control.md` explains the keys, `motionloom.requests.goal` lists them, `motionloom control --schema` prints them as
a JSON Schema.
"""

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.errors import MotionloomError, listed
from motionloom.features.humanml import resample_positions
from motionloom.goals.drawing import read_drawing
from motionloom.goals.fields import Field, value
from motionloom.goals.following import follow, tracks
from motionloom.goals.goal import FPS, Goal, merged, start_of, turn_between
from motionloom.goals.paths import WALKING, curve, lengths_along, root_path, through, turned_to
from motionloom.goals.reach import check_reach
from motionloom.goals.schemas import GOAL_JOINTS
from motionloom.ground import GroundPose
from motionloom.io import load
from motionloom.io.text import read_text
from motionloom.motion import ground_pose
from motionloom.requests import goal as keys
from motionloom.requests.goal import FARTHEST, MAX_FRAMES
from motionloom.retarget import to_smpl22
from motionloom.skeleton import SMPL22

__all__ = ["follow", "read_goal", "root_path"]

MAX_BYTES = 16_000_000
_TIE = 0.05
"""Metres that a path may begin beside the place where the person starts."""


def read_goal(
    source: Path | str | Mapping[str, Any], *, frames: int, fps: float = FPS, folder: Path, metre: float = 1.0
) -> Goal:
    """Read a goal file, or a mapping of the same keys, as the targets of a motion of so many frames.

    The motion takes ``frames / fps`` seconds. Files that a goal file names lie in its own folder or below; those of a
    mapping in ``folder``. The goal's world is metres, +Y up; facing 0 is +Z, positive towards +X. metre: what one metre
    of the 22-joint person, whose goal this becomes, is in the file, such as a robot's `metre`; motions that the file
    names are a person's. Raises `MotionloomError`, naming the key, for what cannot be read, contradicts itself or is
    out of anybody's reach.
    """
    if not 1 <= frames <= MAX_FRAMES:
        raise MotionloomError(f"a goal is read for 1 to {MAX_FRAMES:,} frames; got {frames}")
    if isinstance(source, Mapping):
        return _Reader(frames, fps, folder, metre).goal(Field(source))
    path = Path(source)
    found = _parsed(path)
    if isinstance(found, dict):
        found.pop("$schema", None)  # for editors
    return _Reader(frames, fps, path.parent, metre).goal(Field(found, source=str(path)))


def _parsed(path: Path) -> Any:
    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            twice = Counter(key for key, _ in pairs).most_common(1)[0][0]
            raise MotionloomError(f"{path}: the key {twice[:40]!r} appears twice in one mapping; remove one of them")
        return found

    def constant(word: str) -> float:
        raise MotionloomError(f"{path}: {word} is not a number that anybody can reach; write finite numbers")

    data = read_text(path, max_bytes=MAX_BYTES)
    try:
        return json.loads(data.decode("utf-8"), object_pairs_hook=unique, parse_constant=constant)
    except json.JSONDecodeError as error:
        raise MotionloomError(f"{path}, line {error.lineno}: this is not JSON: {error.msg}") from None
    except UnicodeDecodeError:
        raise MotionloomError(f"{path} is not UTF-8 text; save it as UTF-8") from None
    except RecursionError:
        raise MotionloomError(f"{path}: values lie in each other too deep") from None
    except ValueError as error:
        if isinstance(error, MotionloomError):
            raise
        raise MotionloomError(f"{path}: a number has too many digits") from None


@dataclass(frozen=True)
class _Start:
    """Where the person starts, as far as the file says."""

    position: tuple[float, float] | None = None
    facing: float | None = None


@dataclass(frozen=True)
class _Reader:
    """One goal being read."""

    frames: int
    fps: float
    folder: Path
    metre: float
    people: dict[Path, tuple[np.ndarray, float]] = field(default_factory=dict)
    """Places (frames, 22, 3) and rate of motion files that were read already."""

    @property
    def seconds(self) -> float:
        return self.frames / self.fps

    def goal(self, top: Field) -> Goal:
        given = top.mapping(keys.GOAL)
        if not given:
            top.fail(f"asks for nothing; give it one or several of {listed(keys.GOAL)}")
        start = self.start(given["start"]) if "start" in given else _Start()
        goal, start = self.path(given["path"], start) if "path" in given else (Goal.nothing(self.frames), start)
        placed = start.position is not None or start.facing is not None
        x, z = start.position or (0.0, 0.0)
        origin = GroundPose(x, z, start.facing or 0.0)
        goal = replace(goal, start=origin if placed else None)
        for item in given["poses"].items() if "poses" in given else ():
            goal = self.joined(goal, self.pose(item, goal, origin), item)
        for item in given["joints"].items() if "joints" in given else ():
            goal = self.joined(goal, self.joint(item, goal), item)
        for item in _one_or_many(given.get("follow")):
            found = self.follow(item)
            goal = self.joined(goal, found if goal.start is None else replace(found, start=None), item)
        goal = goal.scaled(1 / self.metre)
        try:
            check_reach(goal)
        except MotionloomError as error:
            top.fail(str(error))
        return goal

    def joined(self, goal: Goal, other: Goal, item: Field) -> Goal:
        try:
            return merged(goal, other)
        except MotionloomError as error:
            item.fail(f"cannot be had with the rest: {error}")

    def start(self, found: Field) -> _Start:
        given = found.mapping(keys.START)
        if not given:
            found.fail(f"says nothing; give it one or both of {listed(keys.START)}")
        return _Start(value(given, keys.START, "position"), _radians(value(given, keys.START, "facing")))

    def times(self, found: Field | None, count: int | None = None) -> list[float] | None:
        """Rising seconds within the motion."""
        if found is None:
            return None
        times = found.numbers(0.0, self.seconds)
        if count is not None and len(times) != count:
            found.fail(f"has {len(times)} times; {count} are needed")
        if (np.diff(times) <= 0).any():
            found.fail("must rise from one time to the next; sort them and drop doubles")
        return times

    def frame(self, time: float) -> int:
        """The frame nearest to a time; the end of the motion is its last frame."""
        return min(round(time * self.fps), self.frames - 1)

    # -- the path

    def path(self, found: Field, start: _Start) -> tuple[Goal, _Start]:
        kinds = [key for key in keys.PATHS if isinstance(found.value, Mapping) and key in found.value]
        if len(kinds) != 1:
            found.mapping(sorted({key for path in keys.PATHS.values() for key in path}))
            found.fail(f"must have one of {listed(list(keys.PATHS))}; got {listed(kinds) if kinds else 'none'}")
        given = found.mapping(keys.PATHS[kinds[0]])
        points, times, span = self.points(given) if "points" in given else self.drawn(found, given, start)
        facing = self.facing(given.get("facing"), len(points) if "points" in given else None)
        if isinstance(facing, list) and "points" not in given:
            times = None
            facing = np.interp(np.linspace(0, 1, len(points)), np.linspace(0, 1, len(facing)), facing).tolist()
        smooth = value(given, keys.PATHS["points"], "smooth")
        try:
            goal = root_path(
                points,
                times,
                frames=self.frames,
                facing=facing,
                fps=self.fps,
                span=span,
                smooth=smooth and "points" in given,
            )
        except MotionloomError as error:
            found.fail(f"cannot be walked: {error}")
        return self.begun(found, goal, start)

    def points(self, given: dict[str, Field]):
        """Points (n, 2), their times or None, and no span."""
        known = keys.PATHS["points"]
        places = value(given, known, "points")
        count = len(places)
        if value(given, known, "closed"):
            if places[0] != places[-1] or count == 1:
                places.append(places[0])
            count = len(places)
        return np.array(places, dtype=np.float64), self.times(given.get("times"), count), None

    def drawn(self, found: Field, given: dict[str, Field], start: _Start):
        """Fine points (n, 2) of a drawing or named curve where the person starts, None, and from when to when."""
        if "svg" in given:
            points = read_drawing(given["svg"].file(self.folder))
            points = points * self.metres(found, given, points)
        else:
            name, size, turn = (value(given, keys.PATHS["curve"], key) for key in ("curve", "size", "turn"))
            points = curve(name, size, turn=turn)
            points = turned_to(points, start.facing or 0.0)
        points = points + (start.position or (0.0, 0.0))
        if np.abs(points).max() > FARTHEST:
            found.fail(f"leads {np.abs(points).max():.0f} m away; {FARTHEST:g} m are the most")
        span = self.times(given.get("times"), 2)
        return points, None, None if span is None else (span[0], span[1])

    def metres(self, found: Field, given: dict[str, Field], points: np.ndarray) -> float:
        """Metres per unit of a drawing; as large as somebody walks in the time where the file does not say."""
        if "width" in given and "scale" in given:
            found.fail("of a drawing has 'width' or 'scale', not both")
        if "scale" in given:
            return value(given, keys.PATHS["svg"], "scale")
        if "width" not in given:
            begin, end = self.times(given.get("times"), 2) or (0.0, self.seconds)
            return self.metre * WALKING * (end - begin) / float(lengths_along(points)[-1])
        across = float(np.ptp(points[:, 0]))
        if across < 1e-6 * np.ptp(points[:, 1]):
            given["width"].fail("cannot be that of a drawing that goes straight up or down; give 'scale' instead")
        return value(given, keys.PATHS["svg"], "width") / across

    def facing(self, found: Field | None, count: int | None) -> str | float | list[float]:
        if found is None:
            return "along"
        if isinstance(found.value, str):
            return found.word(("along", "free"))
        if not isinstance(found.value, list | tuple):
            return found.read(keys.START["facing"])
        degrees = found.read(keys.DIRECTIONS)
        if count is not None and len(degrees) not in (1, count):
            found.fail(f"has {len(degrees)} directions for {count} points; give one per point")
        return degrees[0] if len(degrees) == 1 else degrees

    def begun(self, found: Field, goal: Goal, start: _Start) -> tuple[Goal, _Start]:
        """Put the start on the path's beginning, or check that it is there."""
        first = int(np.flatnonzero(goal.asked[:, 0, 0])[0])
        x, z = goal.positions[first, 0, [0, 2]]
        if start.position is None:
            start = replace(start, position=(float(x), float(z)))
        elif first == 0 and (apart := np.hypot(x - start.position[0], z - start.position[1])) > _TIE:
            found.fail(
                f"begins {apart:.2f} m away from the 'start' at {start.position[0]:g}, {start.position[1]:g}; drop the "
                "start, or let the path begin there"
            )
        own = start_of(goal.crop(first, len(goal))).facing
        if start.facing is None:
            return goal, replace(start, facing=own)
        if first == 0 and goal.facing_asked[0] and abs(turn_between(own, start.facing)) > np.radians(5):
            asked = goal.facing_asked.copy()
            asked[: int(self.fps)] = False  # a second to turn from where the person looks at first
            goal = replace(goal, facing_asked=asked)
        return goal, start

    # -- joints

    def joint(self, item: Field, goal: Goal) -> Goal:
        given = item.mapping(keys.JOINT)
        joints = list(SMPL22.resolve([given["joint"].word(GOAL_JOINTS)]))
        if ("points" in given) == ("every_frame" in given):
            item.fail("needs one of 'points' and 'every_frame'")
        if "every_frame" in given:
            if "curve" in given:
                given["curve"].fail("goes with 'points' only")
            rows = given["every_frame"].items(most=self.frames)
            found = [(frame, row, *self.place(row)) for frame, row in enumerate(rows) if row.value is not None]
            if not found:
                given["every_frame"].fail("has no place in it")
        else:
            found = self.timed(given)
        frames, fields, places, asked = (list(part) for part in zip(*found, strict=True))
        places, asked = np.array(places), np.array(asked)
        if value(given, keys.JOINT, "frame") == "root":
            places = self.from_root(goal, frames, fields, places, asked)
        result = Goal.nothing(self.frames)
        for joint in joints:
            result.positions[frames, joint], result.asked[frames, joint] = places, asked
        return result

    def timed(self, given: dict[str, Field]) -> list[tuple[int, Field, np.ndarray, np.ndarray]]:
        """(frame, field, place, asked) of points with times; of all frames between them if they are a curve."""
        rows = [(row, row.mapping(keys.POINT)) for row in given["points"].items()]
        times = [point["time"].number(0.0, self.seconds) for _, point in rows]
        places = [self.place(point["position"]) for _, point in rows]
        frames = [self.frame(time) for time in times]
        for number in range(1, len(rows)):
            if frames[number] <= frames[number - 1]:
                rows[number][1]["time"].fail(
                    f"must be at least a frame ({1 / self.fps:g} s) after the one before it, {times[number - 1]:g} s; "
                    f"got {times[number]:g}"
                )
        fields = [row for row, _ in rows]
        if not value(given, keys.JOINT, "curve"):
            return [(f, row, *place) for f, row, place in zip(frames, fields, places, strict=True)]
        asked = places[0][1]
        if any((other != asked).any() for _, other in places):
            given["curve"].fail(
                "needs points that all ask for the same coordinates; null must stand in the same places"
            )
        dense = np.arange(frames[0], frames[-1] + 1)
        way = through(np.array([place for place, _ in places]), np.array(frames, float), dense.astype(float))
        return [(int(f), fields[0], place, asked) for f, place in zip(dense, way, strict=True)]

    def place(self, found: Field) -> tuple[np.ndarray, np.ndarray]:
        """(3,) metres and which of them are asked; null is free."""
        items = found.items(least=3, most=3)
        asked = np.array([item.value is not None for item in items])
        if not asked.any() or asked[0] != asked[2]:
            found.fail("must ask for the height y, for x and z together, or for all three; got null elsewhere")
        values = [item.number(-FARTHEST, FARTHEST) if ask else 0.0 for item, ask in zip(items, asked, strict=True)]
        return np.array(values), asked

    def from_root(
        self, goal: Goal, frames: list[int], fields: list[Field], places: np.ndarray, asked: np.ndarray
    ) -> np.ndarray:
        """Places seen from the person to the world, by the path asked at the same frames."""
        world = places.copy()
        for row, frame in enumerate(frames):
            if not asked[row, 0]:
                continue
            if not (goal.asked[frame, 0, 0] and goal.facing_asked[frame]):
                fields[row].fail(
                    f"is asked as seen from the root at {frame / self.fps:.2f} s, where no path says where the root is "
                    "and faces; give a 'path' with a facing over that time, or use the frame 'world'"
                )
            x, _, z = goal.positions[frame, 0]
            world[row] = GroundPose(float(x), float(z), float(goal.facing[frame])).to_world(places[row])
        return world

    # -- other motions

    def person(self, found: Field) -> tuple[np.ndarray, float]:
        """Places (frames, 22, 3) of a motion file on the uniform person, and its rate."""
        path = found.file(self.folder)
        if path not in self.people:
            try:
                motion = load(path)
                self.people[path] = self.metre * to_smpl22(motion).positions(), motion.fps
            except MotionloomError as error:
                found.fail(f"cannot be used: {error}")
        return self.people[path]

    def pose(self, item: Field, goal: Goal, origin: GroundPose) -> Goal:
        given = item.mapping(keys.POSE)
        frame = self.frame(given["time"].number(0.0, self.seconds))
        positions, fps = self.person(given["from"])
        length = len(positions) / fps
        at = given["at"].number(0.0, length) if "at" in given else 0.0
        body = positions[min(round(at * fps), len(positions) - 1)]
        place = origin
        if goal.asked[frame, 0, [0, 2]].all():
            x, _, z = goal.positions[frame, 0]
            facing = goal.facing[frame] if goal.facing_asked[frame] else origin.facing
            place = GroundPose(float(x), float(z), float(facing))
        position, facing = value(given, keys.POSE, "position"), _radians(value(given, keys.POSE, "facing"))
        if position is not None:
            place = replace(place, x=position[0], z=position[1])
        if facing is not None:
            place = replace(place, facing=facing)
        result = Goal.nothing(self.frames)
        result.positions[frame] = place.to_world(ground_pose(body).from_world(body))
        result.asked[frame] = True
        return replace(result, start=place) if frame == 0 else result

    def follow(self, item: Field) -> Goal:
        given = item.mapping(keys.FOLLOW)
        named = given["joints"].items(most=keys.FOLLOW["joints"].many)
        joints = SMPL22.resolve([name.word(GOAL_JOINTS) for name in named])
        positions, fps = self.person(given["from"])
        positions = resample_positions(positions, fps)
        since = given["from_time"].number(0.0, (len(positions) - 1) / FPS) if "from_time" in given else 0.0
        positions = positions[round(since * FPS) :]
        try:
            return tracks(positions, list(joints), frames=self.frames, at=self.times(given.get("times")))
        except MotionloomError as error:
            item.fail(f"cannot be had: {error}")


def _one_or_many(found: Field | None) -> list[Field]:
    if found is None:
        return []
    return [found] if isinstance(found.value, Mapping) else found.items(most=keys.MOST_FOLLOWED)


def _radians(degrees: float | None) -> float | None:
    return None if degrees is None else float(np.radians(degrees))
