"""Goal files: the targets of control as JSON, whose mistakes are reported key by key.

`docs/control.md` explains the keys, `motionloom.requests.goal` lists them, `motionloom control --schema` prints them as
a JSON Schema.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core.errors import MotionloomError, listed
from motionloom.core.features.humanml import resample_positions
from motionloom.core.files.text import parse_json, read_text
from motionloom.core.ground import GroundPose
from motionloom.core.motion import Motion, ground_pose
from motionloom.core.skeleton import SMPL22
from motionloom.goals.drawing import read_drawing
from motionloom.goals.fields import Field, value
from motionloom.goals.goal import FPS, Goal, merged, start_of, turn_between
from motionloom.goals.paths import WALKING, curve, lengths_along, root_path, through, turned_to
from motionloom.goals.reach import check_reach
from motionloom.goals.schemas import GOAL_JOINTS
from motionloom.io import load
from motionloom.requests import goal as keys
from motionloom.requests.goal import FARTHEST, MAX_FRAMES
from motionloom.retarget import to_smpl22

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
    values = parse_json(read_text(path, max_bytes=MAX_BYTES), path)
    if isinstance(values, dict):
        values.pop("$schema", None)  # for editors
    return _Reader(frames, fps, path.parent, metre).goal(Field(values, source=str(path)))


@dataclass(frozen=True)
class _Start:
    """Where the person starts, as far as the file has it."""

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
        entries = top.mapping(keys.GOAL)
        if not entries:
            top.fail(f"asks for nothing; give it one or several of {listed(keys.GOAL)}")
        start = self.start(entries["start"]) if "start" in entries else _Start()
        goal, start = self.path(entries["path"], start) if "path" in entries else (Goal.nothing(self.frames), start)
        placed = start.position is not None or start.facing is not None
        x, z = start.position or (0.0, 0.0)
        origin = GroundPose(x, z, start.facing or 0.0)
        goal = replace(goal, start=origin if placed else None)
        for item in entries["poses"].items() if "poses" in entries else ():
            goal = self.joined(goal, self.pose(item, goal, origin), item)
        for item in entries["joints"].items() if "joints" in entries else ():
            goal = self.joined(goal, self.joint(item, goal), item)
        for item in _one_or_many(entries.get("follow")):
            followed = self.follow(item)
            goal = self.joined(goal, followed if goal.start is None else replace(followed, start=None), item)
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

    def start(self, item: Field) -> _Start:
        entries = item.mapping(keys.START)
        if not entries:
            item.fail(f"says nothing; give it one or both of {listed(keys.START)}")
        return _Start(value(entries, keys.START, "position"), _radians(value(entries, keys.START, "facing")))

    def times(self, item: Field | None, count: int | None = None) -> list[float] | None:
        """Rising seconds within the motion."""
        if item is None:
            return None
        times = item.numbers(0.0, self.seconds)
        if count is not None and len(times) != count:
            item.fail(f"has {len(times)} times; {count} are needed")
        if (np.diff(times) <= 0).any():
            item.fail("must rise from one time to the next; sort them and drop doubles")
        return times

    def frame(self, time: float) -> int:
        """The frame nearest to a time; the end of the motion is its last frame."""
        return min(round(time * self.fps), self.frames - 1)

    # -- the path

    def path(self, item: Field, start: _Start) -> tuple[Goal, _Start]:
        kinds = [key for key in keys.PATHS if isinstance(item.value, Mapping) and key in item.value]
        if len(kinds) != 1:
            item.mapping(sorted({key for path in keys.PATHS.values() for key in path}))
            item.fail(f"must have one of {listed(list(keys.PATHS))}; got {listed(kinds) if kinds else 'none'}")
        entries = item.mapping(keys.PATHS[kinds[0]])
        points, times, span = self.points(entries) if "points" in entries else self.drawing_points(item, entries, start)
        facing = self.facing(entries.get("facing"), len(points) if "points" in entries else None)
        if isinstance(facing, list) and "points" not in entries:
            times = None
            facing = np.interp(np.linspace(0, 1, len(points)), np.linspace(0, 1, len(facing)), facing).tolist()
        smooth = value(entries, keys.PATHS["points"], "smooth")
        try:
            goal = root_path(
                points,
                times,
                frames=self.frames,
                facing=facing,
                fps=self.fps,
                span=span,
                smooth=smooth and "points" in entries,
            )
        except MotionloomError as error:
            item.fail(f"cannot be walked: {error}")
        return self.align_start(item, goal, start)

    def points(self, entries: dict[str, Field]):
        """Points (n, 2), their times or None, and no span."""
        known = keys.PATHS["points"]
        places, closed = (value(entries, known, name) for name in ("points", "closed"))
        if closed and (places[0] != places[-1] or len(places) == 1):
            places.append(places[0])
        return np.array(places, dtype=np.float64), self.times(entries.get("times"), len(places)), None

    def drawing_points(self, item: Field, entries: dict[str, Field], start: _Start):
        """Fine points (n, 2) of a drawing or named curve where the person starts, None, and from when to when."""
        if "svg" in entries:
            points = read_drawing(entries["svg"].file(self.folder))
            points = points * self.metres(item, entries, points)
        else:
            name, size, turn = (value(entries, keys.PATHS["curve"], key) for key in ("curve", "size", "turn"))
            points = curve(name, size, turn=turn)
            points = turned_to(points, start.facing or 0.0)
        points = points + (start.position or (0.0, 0.0))
        if np.abs(points).max() > FARTHEST:
            item.fail(f"leads {np.abs(points).max():.0f} m away; {FARTHEST:g} m are the most")
        span = self.times(entries.get("times"), 2)
        return points, None, None if span is None else (span[0], span[1])

    def metres(self, item: Field, entries: dict[str, Field], points: np.ndarray) -> float:
        """Metres per unit of a drawing; as large as somebody walks in the time where the file has no width."""
        if "width" in entries and "scale" in entries:
            item.fail("of a drawing has 'width' or 'scale', not both")
        if "scale" in entries:
            return value(entries, keys.PATHS["svg"], "scale")
        if "width" not in entries:
            begin, end = self.times(entries.get("times"), 2) or (0.0, self.seconds)
            return self.metre * WALKING * (end - begin) / float(lengths_along(points)[-1])
        across = float(np.ptp(points[:, 0]))
        if across < 1e-6 * np.ptp(points[:, 1]):
            entries["width"].fail("cannot be that of a drawing that goes straight up or down; give 'scale' instead")
        return value(entries, keys.PATHS["svg"], "width") / across

    def facing(self, item: Field | None, count: int | None) -> str | float | list[float]:
        if item is None:
            return "along"
        if isinstance(item.value, str):
            return item.word(("along", "free"))
        if not isinstance(item.value, list | tuple):
            return item.read(keys.START["facing"])
        degrees = item.read(keys.DIRECTIONS)
        if count is not None and len(degrees) not in (1, count):
            item.fail(f"has {len(degrees)} directions for {count} points; give one per point")
        return degrees[0] if len(degrees) == 1 else degrees

    def align_start(self, item: Field, goal: Goal, start: _Start) -> tuple[Goal, _Start]:
        """Put the start on the path's beginning, or check that it is there."""
        first = int(np.flatnonzero(goal.mask[:, 0, 0])[0])
        x, z = goal.positions[first, 0, [0, 2]]
        if start.position is None:
            start = replace(start, position=(float(x), float(z)))
        elif first == 0 and (apart := np.hypot(x - start.position[0], z - start.position[1])) > _TIE:
            item.fail(
                f"begins {apart:.2f} m away from the 'start' at {start.position[0]:g}, {start.position[1]:g}; drop the "
                "start, or let the path begin there"
            )
        own = start_of(goal.crop(first, len(goal))).facing
        if start.facing is None:
            return goal, replace(start, facing=own)
        if first == 0 and goal.facing_mask[0] and abs(turn_between(own, start.facing)) > np.radians(5):
            mask = goal.facing_mask.copy()
            mask[: int(self.fps)] = False  # a second to turn from where the person looks at first
            goal = replace(goal, facing_mask=mask)
        return goal, start

    # -- joints

    def joint(self, item: Field, goal: Goal) -> Goal:
        entries = item.mapping(keys.JOINT)
        joints = list(SMPL22.resolve([entries["joint"].word(GOAL_JOINTS)]))
        if ("points" in entries) == ("every_frame" in entries):
            item.fail("needs one of 'points' and 'every_frame'")
        if "every_frame" in entries:
            if "curve" in entries:
                entries["curve"].fail("goes with 'points' only")
            rows = entries["every_frame"].items(most=self.frames)
            targets = [(frame, row, *self.place(row)) for frame, row in enumerate(rows) if row.value is not None]
            if not targets:
                entries["every_frame"].fail("has no place in it")
        else:
            targets = self.timed_points(entries)
        frames, fields, places, masks = (list(part) for part in zip(*targets, strict=True))
        places, masks = np.array(places), np.array(masks)
        if value(entries, keys.JOINT, "frame") == "root":
            places = self.from_root(goal, frames, fields, places, masks)
        result = Goal.nothing(self.frames)
        for joint in joints:
            result.positions[frames, joint], result.mask[frames, joint] = places, masks
        return result

    def timed_points(self, entries: dict[str, Field]) -> list[tuple[int, Field, np.ndarray, np.ndarray]]:
        """(frame, field, place, mask) of points with times; of all frames between them if they are a curve."""
        rows = [(row, row.mapping(keys.POINT)) for row in entries["points"].items()]
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
        if not value(entries, keys.JOINT, "curve"):
            return [(f, row, *place) for f, row, place in zip(frames, fields, places, strict=True)]
        mask = places[0][1]
        if any((other != mask).any() for _, other in places):
            entries["curve"].fail(
                "needs points that all ask for the same coordinates; null must stand in the same places"
            )
        dense = np.arange(frames[0], frames[-1] + 1)
        way = through(np.array([place for place, _ in places]), np.array(frames, float), dense.astype(float))
        return [(int(f), fields[0], place, mask) for f, place in zip(dense, way, strict=True)]

    def place(self, item: Field) -> tuple[np.ndarray, np.ndarray]:
        """(3,) metres and the mask of the coordinates that have a target; null is free."""
        coordinates = item.items(least=3, most=3)
        mask = np.array([coordinate.value is not None for coordinate in coordinates])
        if not mask.any() or mask[0] != mask[2]:
            item.fail("must ask for the height y, for x and z together, or for all three; got null elsewhere")
        values = [
            one.number(-FARTHEST, FARTHEST) if has_target else 0.0
            for one, has_target in zip(coordinates, mask, strict=True)
        ]
        return np.array(values), mask

    def from_root(
        self, goal: Goal, frames: list[int], fields: list[Field], places: np.ndarray, masks: np.ndarray
    ) -> np.ndarray:
        """Places seen from the person to the world, by the path's targets at the same frames."""
        world = places.copy()
        for row, frame in enumerate(frames):
            if not masks[row, 0]:
                continue
            if not (goal.mask[frame, 0, 0] and goal.facing_mask[frame]):
                fields[row].fail(
                    f"is asked as seen from the root at {frame / self.fps:.2f} s, where no path says where the root is "
                    "and faces; give a 'path' with a facing over that time, or use the frame 'world'"
                )
            x, _, z = goal.positions[frame, 0]
            world[row] = GroundPose(float(x), float(z), float(goal.facing[frame])).to_world(places[row])
        return world

    # -- other motions

    def person(self, item: Field) -> tuple[np.ndarray, float]:
        """Places (frames, 22, 3) of a motion file on the uniform person, and its rate."""
        path = item.file(self.folder)
        if path not in self.people:
            try:
                motion = load(path)
                self.people[path] = self.metre * to_smpl22(motion).positions(), motion.fps
            except MotionloomError as error:
                item.fail(f"cannot be used: {error}")
        return self.people[path]

    def pose(self, item: Field, goal: Goal, origin: GroundPose) -> Goal:
        entries = item.mapping(keys.POSE)
        frame = self.frame(entries["time"].number(0.0, self.seconds))
        positions, fps = self.person(entries["from"])
        length = len(positions) / fps
        at = entries["at"].number(0.0, length) if "at" in entries else 0.0
        body = positions[min(round(at * fps), len(positions) - 1)]
        place = origin
        if goal.mask[frame, 0, [0, 2]].all():
            x, _, z = goal.positions[frame, 0]
            facing = goal.facing[frame] if goal.facing_mask[frame] else origin.facing
            place = GroundPose(float(x), float(z), float(facing))
        position, facing = value(entries, keys.POSE, "position"), _radians(value(entries, keys.POSE, "facing"))
        if position is not None:
            place = replace(place, x=position[0], z=position[1])
        if facing is not None:
            place = replace(place, facing=facing)
        result = Goal.nothing(self.frames)
        result.positions[frame] = place.to_world(ground_pose(body).from_world(body))
        result.mask[frame] = True
        return replace(result, start=place) if frame == 0 else result

    def follow(self, item: Field) -> Goal:
        entries = item.mapping(keys.FOLLOW)
        named = entries["joints"].items(most=keys.FOLLOW["joints"].many)
        joints = SMPL22.resolve([name.word(GOAL_JOINTS) for name in named])
        positions, fps = self.person(entries["from"])
        positions = resample_positions(positions, fps)
        since = entries["from_time"].number(0.0, (len(positions) - 1) / FPS) if "from_time" in entries else 0.0
        positions = positions[round(since * FPS) :]
        try:
            return tracks(positions, list(joints), frames=self.frames, at=self.times(entries.get("times")))
        except MotionloomError as error:
            item.fail(f"cannot be had: {error}")


def _one_or_many(item: Field | None) -> list[Field]:
    if item is None:
        return []
    return [item] if isinstance(item.value, Mapping) else item.items(most=keys.MOST_FOLLOWED)


def _radians(degrees: float | None) -> float | None:
    return None if degrees is None else float(np.radians(degrees))


# Other motions as goals: where the joints of a recording are, for somebody else to follow


def follow(motion: Motion, joints: Sequence[str], *, frames: int, at: Sequence[float] | None = None) -> Goal:
    """The places of joints (or groups) of a motion of any humanoid, as a goal of so many frames at 20 fps.

    The motion is put on the uniform person first; places are those in its world, and the goal starts where its person
    stands. at: seconds, each within the motion; None: every frame that the motion has. Raises `MotionloomError` for
    an unknown joint or a time that either of the two does not have.
    """
    chosen = list(SMPL22.resolve(joints))
    positions = resample_positions(to_smpl22(motion).positions(), motion.fps)
    return tracks(positions, chosen, frames=frames, at=at)


def tracks(positions: np.ndarray, joints: Sequence[int], *, frames: int, at: Sequence[float] | None) -> Goal:
    """`follow` for joints, by number, of places (n, 22, 3) at 20 fps."""
    known = min(len(positions), frames)
    if at is None:
        rows = np.arange(known)
    else:
        rows = np.array([round(time * FPS) for time in at], dtype=int)
        if len(rows) == 0 or rows.min() < 0 or rows.max() > known:
            raise MotionloomError(
                f"a motion can be followed at 0 to {(known - 1) / FPS:g} s here; got "
                f"{', '.join(f'{t:g}' for t in at[:20]) or 'none'}"
            )
        rows = np.minimum(rows, known - 1)
    goal = Goal.nothing(frames)
    for joint in joints:
        goal.positions[rows, joint] = positions[rows, joint]
        goal.mask[rows, joint] = True
    return replace(goal, start=ground_pose(positions[0]))
