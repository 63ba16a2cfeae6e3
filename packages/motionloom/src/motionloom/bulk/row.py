"""The request of one row of a job, and the id that follows from it."""

import hashlib
import json
import re
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import KW_ONLY, astuple, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.bulk.on_robot import OnRobot, on_robot
from motionloom.core.errors import MotionloomError
from motionloom.core.files.text import parse_json
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.goals.fields import Field
from motionloom.goals.goal import FPS, Goal
from motionloom.goals.goal_file import read_goal
from motionloom.goals.roles import MARK, prompts_of
from motionloom.goals.timeline import SHORTEST, Timeline, read_timeline, timeline_of
from motionloom.io import load
from motionloom.requests.batch import RowKeys
from motionloom.requests.reading import read
from motionloom.requests.shared import LONGEST, LONGEST_LINE
from motionloom.tasks.text import frames_in

FORMAT = 2
"""Version of what an id means, and of how shards are laid out."""
_ELSEWHERE = ("edit", "predict", "switch")
"""Tasks that begin with a clip: a batch does none of them."""
MAX_DUET = 3600.0
"""Seconds of a timeline of two people."""
_NAME = re.compile(r"[A-Za-z0-9_-]{1,100}")
CACHED = 64
"""Files named by rows, and as many prompts and goals, that are kept in memory."""


@dataclass(frozen=True, kw_only=True)
class Row(RowKeys):
    """One row of a job as it is written, checked by itself; the files it names are not yet read."""

    @property
    def words(self) -> str:
        """The prompt; empty where there is a timeline, which has the words."""
        return self.prompt or ""

    @property
    def whom(self) -> int:
        """The person of the goal, or of a timeline's path and goals: the first (0) or the second (1)."""
        return (self.person or 1) - 1

    @property
    def names_files(self) -> bool:
        """Whether its motion also depends on what other files hold."""
        return any(one is not None for one in (self.timeline, self.goal, self.skeleton, self.motion, self.robot))


@dataclass(frozen=True, eq=False)
class Order:
    """A row with everything that determines its motion."""

    row: Row
    key: str
    """Hash of all that determines the motion, 32 hexadecimal digits."""
    frames: int
    """At the weights' own rate."""
    seed: int
    goal: Goal | None = None
    timeline: Timeline | None = None
    start: Motion | None = None
    """What a timeline goes on from."""
    target: Skeleton | None = None
    best_of: int = 1
    """Seeds that are tried."""
    clip: Path | None = None
    """The recording of a row that has one."""
    robot: OnRobot | None = None
    """What the motion is put on instead of a skeleton."""

    @property
    def id(self) -> str:
        """The row's own id, else the key: how the motion's files are called."""
        return self.row.id or self.key

    @property
    def text(self) -> str:
        """What the motion shows, in words."""
        if self.timeline is None or self.row.prompt:
            return self.row.words or self.row.motion or ""
        return "; ".join(" ".join(segment.text.split()) for segment in self.timeline.segments)[:LONGEST_LINE]


class Unexpected(MotionloomError):
    """A row that the program fails at, where the row should have been refused with a sentence."""


def unexpected(error: Exception, what: str = "it cannot be read") -> Unexpected:
    """Any exception as the error of the row that it came of."""
    return Unexpected(f"{what} ({type(error).__name__}: {' '.join(str(error).split())[:200]})")


@contextmanager
def explained(what: str = "it cannot be read") -> Iterator[None]:
    """Any exception within is `unexpected`, unless it is a `MotionloomError` already."""
    try:
        yield
    except MotionloomError:
        raise
    except Exception as error:
        raise unexpected(error, what) from error


@explained()
def parse(raw: bytes) -> Row:
    """The row in the bytes of a JSON object; raises `MotionloomError` for what cannot be."""
    row = _columns(raw)
    goal = _goal(row.get("goal"))
    if row.get("task") in _ELSEWHERE:
        raise MotionloomError(
            f"a batch does not {row['task']}, since that begins with a clip: 'motionloom {row['task']} --count' makes "
            "many of one"
        )
    if type(row.get("id")) is int:
        row["id"] = str(row["id"])
    keys = read(Row, row, "the row")
    task = _task(keys.task, goal is not None, keys.timeline is not None, keys.motion is not None)
    if keys.timeline is None and keys.prompt is None and keys.motion is None:
        raise MotionloomError("the row has no prompt; say in words what the person does")
    if keys.timeline is not None and (keys.prompt is not None or keys.seconds is not None):
        raise MotionloomError("a row with a timeline has no prompt and no seconds; write them into the timeline")
    _check_words(task, keys.prompt or "")
    if keys.id is not None and not _NAME.fullmatch(keys.id):
        raise MotionloomError(
            f"the id {keys.id[:40]!r} cannot name a file; use at most 100 letters, digits, '_' and '-'"
        )
    if keys.person is not None and (task != "duet" or (goal is None and keys.timeline is None)):
        raise MotionloomError("'person' says whose a goal or a timeline's path is, in rows of the task duet")
    if keys.motion is not None and (keys.seconds, keys.seed, keys.best_of) != (None, None, None):
        raise MotionloomError("a row with a motion draws nothing; leave out its seconds, seed and best_of")
    if keys.skeleton is not None and (keys.robot, keys.max_speed, keys.avoid_collisions) != (None, None, None):
        raise MotionloomError("the row has a skeleton, and columns of a robot; leave one of them out")
    return replace(keys, task=task, goal=goal)


def _columns(raw: bytes) -> dict[str, Any]:
    """The columns of a row that hold something."""
    try:
        row = parse_json(raw, "the row")
    except MotionloomError as error:
        raise MotionloomError(f"{error}; write one object per line") from None
    if not isinstance(row, dict):
        raise MotionloomError('the row is no JSON object; write one object per line, such as {"prompt": "..."}')
    return {key: value for key, value in row.items() if value is not None}


def _goal(goal: Any) -> str | dict[str, Any] | None:
    """The name of a goal file, or a mapping of its keys, which in a CSV file is text."""
    if goal is not None and not isinstance(goal, str | dict):
        raise MotionloomError("'goal' must be the name of a goal file or a mapping of its keys")
    if not (isinstance(goal, str) and goal.lstrip().startswith("{")):
        return goal
    return parse_json(goal, "'goal'")


def _task(task: str | None, goal: bool, timeline: bool, motion: bool) -> str:
    kind = "duet" if task == "duet" else "compose" if timeline else "control" if goal else "generate"
    if motion and (goal or timeline or task not in (None, "export")):
        raise MotionloomError("a row with a motion is of the task export, without a goal and a timeline")
    kind = "export" if motion else kind
    if goal and timeline:
        raise MotionloomError("the row has a goal and a timeline; write the goal into the timeline")
    if task is not None and task != kind:
        needs = {
            "compose": "a timeline",
            "control": "a goal",
            "generate": "neither goal nor timeline",
            "export": "a motion",
        }
        raise MotionloomError(f"the task {task} needs {needs[task]}, and the row asks for {kind}")
    return kind


def _check_words(task: str, words: str) -> None:
    """Refuse words for two people that one would get, and those that are not for both."""
    if task == "duet":
        prompts_of(words)
    elif MARK in words:
        raise MotionloomError(f"the prompt {words[:60]!r} has words for two people; give the row the task duet")


@dataclass(eq=False)
class Sources:
    """Reads the files that rows name, each once while it is in use, and gives rows their ids."""

    folder: Path
    """Where these files lie, or below."""
    common: Mapping[str, Any]
    """What determines every motion: weights, settings."""
    _: KW_ONLY
    pair: Mapping[str, Any] = field(default_factory=dict)
    """What else determines motions of two people."""
    fps: float = FPS
    """Of the weights."""
    seconds: float = 5.0
    """This and what follows is of rows without it."""
    seed: int = 0
    skeleton: str | None = None
    """May lie anywhere."""
    literal: bool = False
    """No numbers are read in prompts."""
    best_of: int = 1
    robot: OnRobot | None = None
    """Of rows that name no skeleton either."""
    limits: Mapping[str, Any] = field(default_factory=dict)
    """``max_speed`` and ``avoid_collisions`` of a robot."""

    def __post_init__(self) -> None:
        self._common = json.dumps({**self.common, "format": FORMAT}, sort_keys=True)
        self._files, self._texts = _Cache(), _Cache()

    @explained()
    def ask(self, row: Row) -> Order:
        """The row with the files it names; raises `MotionloomError` for what is wrong in them."""
        timeline = start = clip = None
        goal: tuple[Goal | None, str | None] = (None, None)
        robot = self._robot(row)
        metre = 1.0 if robot is None else robot.metre
        seed = self.seed if row.seed is None else row.seed
        if row.timeline is not None:
            timeline = self._read("timeline", row.timeline, lambda path: read_timeline(path, metre), metre)
            start = None if timeline.start is None else self._cached("start", timeline.start, load)
            _check_timeline(row.task or "", timeline)
            seed = next(s for s in (row.seed, timeline.seed, self.seed) if s is not None)
            frames, digest = timeline.frames, digest_timeline(timeline, start)
        elif row.motion is not None:
            frames, clip, digest = 0, Field(row.motion, "motion").file(self.folder), None
        else:
            timeline, digest = self._worded(row, metre)
            length = self.seconds if row.seconds is None else row.seconds
            frames = frames_in(length, self.fps) if timeline is None else timeline.frames
        if row.goal is not None:
            goal = self._goal(row.goal, frames, metre)
        target = self._target(row, robot)
        facts = {
            "common": self._common,
            "task": row.task,
            "prompt": row.words,
            "frames": frames,
            "seed": seed,
            "goal": goal[1],
            "timeline": digest,
            "skeleton": target and digest_skeleton(target),
        }
        facts |= {} if clip is None else {"motion": hash_file(clip)}  # left out as they always were: old ids hold
        facts |= {} if robot is None else {"robot": robot.determined()}
        best_of = 1 if clip is not None else self.best_of if row.best_of is None else row.best_of
        if best_of > 1:
            facts["best_of"] = best_of
        if row.task == "duet":
            facts |= {"pair": dict(self.pair), "person": row.whom + 1}
        key = hashlib.sha256(json.dumps(facts, sort_keys=True).encode("utf-8", "surrogatepass")).hexdigest()[:32]
        return Order(row, key, frames, seed, goal[0], timeline, start, target, best_of, clip, robot)

    def _target(self, row: Row, robot: OnRobot | None) -> Skeleton | None:
        """What the motion is put on: the row's skeleton or, without that and a robot, the job's."""
        if row.skeleton:
            return self._skeleton(row.skeleton, Field(row.skeleton, "skeleton"))
        if robot is None and row.skeleton is None and self.skeleton is not None:
            return self._skeleton(self.skeleton, None)
        return None

    def _worded(self, row: Row, metre: float) -> tuple[Timeline | None, str | None]:
        """The row's prompt as a timeline, where numbers in it are kept or actions follow each other, and its hash.

        It is as long as the numbers need where no time is given. Many rows have the same words: they are read once.
        """
        if row.task != "generate" or self.literal or self.fps != FPS or not row.words.strip():
            return None, None
        if row.seconds is not None and not SHORTEST <= row.seconds <= LONGEST:
            return None, None
        words = (row.words, row.seconds, metre)

        def read_words() -> tuple[Timeline | None, str | None]:
            timeline = timeline_of(row.words, row.seconds, amounts=True, metre=metre)
            one = not timeline.readings and len(timeline.segments) == 1
            return (None, None) if one else (timeline, digest_timeline(timeline, None))

        return self._texts.of(words, read_words)

    def _goal(self, goal: str | dict[str, Any], frames: int, metre: float) -> tuple[Goal, str]:
        """A goal and its hash; rows with the same goal share it."""

        def read(source: Any, folder: Path) -> tuple[Goal, str]:
            parsed = read_goal(source, frames=frames, folder=folder, metre=metre)
            return parsed, digest_goal(parsed)

        if isinstance(goal, str):
            return self._read("goal", goal, lambda path: read(path, path.parent), frames, metre)
        return self._texts.of((json.dumps(goal), frames, metre), lambda: read(goal, self.folder))

    def _robot(self, row: Row) -> OnRobot | None:
        """The robot that the row's motion is put on; what the row leaves out is the job's."""
        own = {"max_speed": row.max_speed, "avoid_collisions": row.avoid_collisions}
        limits = {**self.limits, **{name: value for name, value in own.items() if value is not None}}
        if row.robot is None:
            if row.robot_map is not None or (self.robot is None and any(one is not None for one in own.values())):
                raise MotionloomError("columns about a robot go with a 'robot' of the row; name its model")
            return None if self.robot is None or row.skeleton is not None else replace(self.robot, **limits)
        mapped = None if row.robot_map is None else Field(row.robot_map, "robot_map").file(self.folder)
        return replace(self._read("robot", row.robot, lambda path: on_robot(path, mapped), str(mapped)), **limits)

    def _skeleton(self, name: str, field: Field | None) -> Skeleton | None:
        if name.lower() == "smpl22":
            return None
        path = Path(name) if field is None else field.file(self.folder)
        return self._cached("skeleton", path, _read_skeleton)

    def _read(self, column: str, name: str, read: Callable[[Path], Any], *more: Any) -> Any:
        return self._cached(column, Field(name, column).file(self.folder), read, *more)

    def _cached(self, column: str, path: Path, read: Callable[[Path], Any], *more: Any) -> Any:
        about = path.stat()
        key = (column, str(path), about.st_size, about.st_mtime_ns, *more)
        return self._files.of(key, lambda: read(path))


class _Cache(OrderedDict[Any, tuple[Any, MotionloomError | None]]):
    """The values of the last requests, by their sources; what was refused is refused again unread."""

    def of(self, key: Any, make: Callable[[], Any]) -> Any:
        """The value of a key, computed where it is not kept; raises what ``make`` raises."""
        if key not in self:
            try:
                self[key] = make(), None
            except MotionloomError as error:
                self[key] = None, error
            if len(self) > CACHED:
                self.popitem(last=False)
        self.move_to_end(key)
        value, error = self[key]
        if error is not None:
            raise error.with_traceback(None)
        return value


def _check_timeline(task: str, timeline: Timeline) -> None:
    """Refuse before anything is sampled what two people, or one, cannot do."""
    for segment in timeline.segments:
        _check_words(task, segment.text)
    if task != "duet":
        return
    if timeline.start is not None:
        raise MotionloomError("two people do not go on from one 'start'; leave it out of the timeline")
    if timeline.seconds > MAX_DUET:
        raise MotionloomError(f"two people do at most {MAX_DUET:g} s of a timeline; got {timeline.seconds:g}")


def _read_skeleton(path: Path) -> Skeleton:
    if path.suffix.lower() == ".asf":
        from motionloom.io.asf import load_skeleton

        return load_skeleton(path)
    return load(path).skeleton


def _digest(*parts: Any) -> str:
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.dtype}{part.shape}".encode())
            digest.update(np.ascontiguousarray(part).tobytes())
        else:
            digest.update(repr(part).encode("utf-8", "surrogatepass"))
        digest.update(b"|")
    return digest.hexdigest()


def hash_file(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def hash_adapters(adapters: Sequence[tuple[Path, float | None]]) -> list[str]:
    """Hash and factor of each file; raises `MotionloomError` for one that is not there."""
    for path, _ in adapters:
        if not path.is_file():
            raise MotionloomError(f"there is no adapter {path}; name a file that 'motionloom teach' made")
    return [f"{hash_file(path)} {factor!r}" for path, factor in adapters]


def digest_goal(goal: Goal) -> str:
    """Hash of what a goal constrains; what is free does not count."""
    where = np.where(goal.mask, goal.positions, 0.0)
    facing = np.where(goal.facing_mask, goal.facing, 0.0)
    return _digest(where, goal.mask, facing, goal.facing_mask, None if goal.start is None else astuple(goal.start))


def digest_timeline(timeline: Timeline, start: Motion | None) -> str:
    """Hash of a timeline, the motion it goes on from included."""
    segments = [
        (
            *(s.text, s.seconds, s.guidance, s.transition, None if s.goal is None else digest_goal(s.goal)),
            *hash_adapters(s.adapters),
        )
        for s in timeline.segments
    ]
    known = () if start is None else (digest_skeleton(start.skeleton), start.fps, start.root, start.rotations)
    return _digest(segments, timeline.guidance, timeline.path and digest_goal(timeline.path), *known)


def digest_skeleton(skeleton: Skeleton) -> str:
    """Hash of a skeleton's joints and bones."""
    return "smpl22" if skeleton == SMPL22 else _digest(skeleton.names, skeleton.parents, skeleton.offsets)
