"""What one row of a job asks for, and the id that follows from it."""

import hashlib
import json
import re
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.errors import MotionloomError
from motionloom.goals.fields import Field
from motionloom.goals.goal import FPS, Goal
from motionloom.goals.goal_file import read_goal
from motionloom.goals.roles import MARK, prompts_of
from motionloom.goals.segment import LONGEST
from motionloom.goals.timeline import SHORTEST, Timeline, read_timeline, timeline_of
from motionloom.io import load
from motionloom.motion import Motion
from motionloom.skeleton import SMPL22, Skeleton
from motionloom.tasks.text import LARGEST_SEED, frames_in

FORMAT = 2
"""Version of what an id means, and of how shards are laid out."""
COLUMNS = ("task", "prompt", "seconds", "seed", "timeline", "goal", "person", "skeleton", "id")
TASKS = ("generate", "control", "compose", "duet")
_ELSEWHERE = ("edit", "predict", "switch")
"""Tasks that begin with a clip: a batch does none of them."""
MAX_CHARACTERS = 20_000
MAX_DUET = 3600.0
"""Seconds of a timeline of two people."""
_NAME = re.compile(r"[A-Za-z0-9_-]{1,100}")
_KEPT = 64
"""Files named by rows that are kept in memory."""


@dataclass(frozen=True)
class Row:
    """One row of a job as it is written, checked by itself; the files it names are not yet read."""

    task: str
    prompt: str
    """Empty where there is a timeline, which says what happens."""
    seconds: float | None
    seed: int | None
    timeline: str | None = None
    goal: str | dict[str, Any] | None = None
    person: int = 1
    """Whose the goal is, or a timeline's path and goals: of two people the first (1) or the second (2)."""
    skeleton: str | None = None
    name: str | None = None
    """The user's own ``id``: the name of the motion's files."""

    @property
    def names_files(self) -> bool:
        """Whether what it asks also depends on what other files hold."""
        return self.timeline is not None or self.goal is not None or self.skeleton is not None


@dataclass(frozen=True, eq=False)
class Asked:
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

    @property
    def id(self) -> str:
        """The row's own id, else the key: how the motion's files are called."""
        return self.row.name or self.key

    @property
    def text(self) -> str:
        """What the motion shows, in words."""
        if self.timeline is None or self.row.prompt:
            return self.row.prompt
        return "; ".join(" ".join(segment.text.split()) for segment in self.timeline.segments)[:MAX_CHARACTERS]


class Unexpected(MotionloomError):
    """A row that the program fails at, where a sentence should say what is wrong with the row."""


def unexpected(error: Exception, what: str = "it cannot be read") -> Unexpected:
    """Any exception as the error of the row that it came of."""
    return Unexpected(f"{what} ({type(error).__name__}: {' '.join(str(error).split())[:200]})")


def parse(raw: bytes) -> Row:
    """The row that the bytes of a JSON object ask for; raises `MotionloomError` for what cannot be."""
    try:
        return _parsed(raw)
    except MotionloomError:
        raise
    except Exception as error:
        raise unexpected(error) from error


def _parsed(raw: bytes) -> Row:
    row = _columns(raw)
    prompt, timeline, skeleton, name = (_text(row, key) for key in ("prompt", "timeline", "skeleton", "id"))
    goal = _goal(row.get("goal"))
    task = _task(_text(row, "task"), goal is not None, timeline is not None)
    if timeline is None and not (prompt or "").strip():
        raise MotionloomError("the row has no prompt; say in words what the person does")
    if timeline is not None and (prompt is not None or "seconds" in row):
        raise MotionloomError("a row with a timeline has no prompt and no seconds; write them into the timeline")
    _check_words(task, prompt or "")
    if name is not None and not _NAME.fullmatch(name):
        raise MotionloomError(f"the id {name[:40]!r} cannot name a file; use at most 100 letters, digits, '_' and '-'")
    person = _person(row, task, alone=goal is None and timeline is None)
    return Row(task, prompt or "", _seconds(row), _seed(row), timeline, goal, person, skeleton, name)


def _columns(raw: bytes) -> dict[str, Any]:
    """The columns of a row that hold something."""
    try:
        row = json.loads(raw)
    except (ValueError, RecursionError) as error:
        raise MotionloomError(f"the row is no JSON ({error}); write one object per line") from None
    if not isinstance(row, dict):
        raise MotionloomError('the row is no JSON object; write one object per line, such as {"prompt": "..."}')
    row = {key: value for key, value in row.items() if value is not None}
    if unknown := [key for key in row if key not in COLUMNS]:
        raise MotionloomError(
            f"the row has the unknown column {unknown[0][:40]!r}; the columns are {', '.join(COLUMNS)}"
        )
    return row


def _goal(goal: Any) -> str | dict[str, Any] | None:
    """The name of a goal file, or a mapping of its keys, which in a CSV file is text."""
    if goal is not None and not isinstance(goal, str | dict):
        raise MotionloomError("'goal' must be the name of a goal file or a mapping of its keys")
    return _mapping(goal) if isinstance(goal, str) and goal.lstrip().startswith("{") else goal


def _task(given: str | None, goal: bool, timeline: bool) -> str:
    meant = "duet" if given == "duet" else "compose" if timeline else "control" if goal else "generate"
    if goal and timeline:
        raise MotionloomError("the row has a goal and a timeline; write the goal into the timeline")
    if given in _ELSEWHERE:
        raise MotionloomError(
            f"a batch does not {given}, since that begins with a clip: 'motionloom {given} --count' makes many of one"
        )
    if given is not None and given not in TASKS:
        raise MotionloomError(f"no task {given[:40]!r}; there are {', '.join(TASKS)}")
    if given is not None and given != meant:
        needs = {"compose": "a timeline", "control": "a goal", "generate": "neither goal nor timeline"}
        raise MotionloomError(f"the task {given} needs {needs[given]}, and the row asks for {meant}")
    return meant


def _check_words(task: str, words: str) -> None:
    """Refuse words for two people that one would get, and those that are not for both."""
    if task == "duet":
        prompts_of(words)
    elif MARK in words:
        raise MotionloomError(f"the prompt {words[:60]!r} has words for two people; give the row the task duet")


def _person(row: dict[str, Any], task: str, *, alone: bool) -> int:
    value = row.get("person")
    if value is None:
        return 1
    if isinstance(value, bool) or value not in (1, 2):
        raise MotionloomError(f"'person' must be 1 or 2; got {str(value)[:40]!r}")
    if task != "duet" or alone:
        raise MotionloomError("'person' says whose a goal or a timeline's path is, in rows of the task duet")
    return int(value)


def _text(row: dict[str, Any], key: str) -> str | None:
    value = row.get(key)
    if value is None:
        return None
    if isinstance(value, int) and not isinstance(value, bool) and key == "id":
        return str(value)
    if not isinstance(value, str) or len(value) > MAX_CHARACTERS:
        raise MotionloomError(f"'{key}' must be text of at most {MAX_CHARACTERS:,} characters")
    return value


def _mapping(text: str) -> dict[str, Any]:
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise MotionloomError(f"'goal' is no JSON ({error})") from None
    return value


def _seconds(row: dict[str, Any]) -> float | None:
    value = row.get("seconds")
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise MotionloomError(f"'seconds' must be a number; got {str(value)[:40]!r}")
    try:
        return float(value)
    except OverflowError:
        digits = len(str(abs(value)))
        raise MotionloomError(f"'seconds' is a number of {digits:,} digits; ask for at most {LONGEST:g}") from None


def _seed(row: dict[str, Any]) -> int | None:
    value = row.get("seed")
    if value is None:
        return None
    whole = isinstance(value, int) or (isinstance(value, float) and value.is_integer())
    if isinstance(value, bool) or not whole or not 0 <= value < LARGEST_SEED:
        raise MotionloomError(f"'seed' must be a whole number from 0 to below 2**62; got {str(value)[:40]!r}")
    return int(value)


class Sources:
    """Reads the files that rows name, each once while it is in use, and gives rows their ids."""

    def __init__(
        self,
        folder: Path,
        common: Mapping[str, Any],
        *,
        pair: Mapping[str, Any] | None = None,
        fps: float = FPS,
        seconds: float = 5.0,
        seed: int = 0,
        skeleton: str | None = None,
        literal: bool = False,
    ) -> None:
        """``folder``: where these files lie, or below. ``common``: what determines every motion (weights, settings).

        pair: what else determines motions of two people. fps: of the weights. seconds, seed, skeleton: of rows that do
        not say; a skeleton may lie anywhere. literal: no numbers are read in prompts.
        """
        self.literal = literal
        self.folder, self.fps, self.seconds, self.seed, self.skeleton = folder, fps, seconds, seed, skeleton
        self._pair = dict(pair or {})
        self._common = json.dumps({**common, "format": FORMAT}, sort_keys=True)
        self._cache: OrderedDict[Any, Any] = OrderedDict()

    def ask(self, row: Row) -> Asked:
        """The row with the files it names; raises `MotionloomError` for what is wrong in them."""
        try:
            return self._ask(row)
        except MotionloomError:
            raise
        except Exception as error:
            raise unexpected(error) from error

    def _ask(self, row: Row) -> Asked:
        timeline = start = goal = None
        seed = self.seed if row.seed is None else row.seed
        if row.timeline is not None:
            timeline = self._read("timeline", row.timeline, read_timeline)
            start = None if timeline.start is None else self._kept("start", timeline.start, load)
            _check_timeline(row.task, timeline)
            seed = next(s for s in (row.seed, timeline.seed, self.seed) if s is not None)
            frames = timeline.frames
        elif (timeline := self._worded(row)) is not None:
            frames = timeline.frames
        else:
            frames = frames_in(self.seconds if row.seconds is None else row.seconds, self.fps)
        if isinstance(row.goal, dict):
            goal = read_goal(row.goal, frames=frames, folder=self.folder)
        elif row.goal is not None:
            goal = self._read("goal", row.goal, lambda path: read_goal(path, frames=frames, folder=path.parent), frames)
        target = self._skeleton(row.skeleton, Field(row.skeleton, "skeleton")) if row.skeleton else None
        if row.skeleton is None and self.skeleton is not None:
            target = self._skeleton(self.skeleton, None)
        said = {
            "common": self._common,
            "task": row.task,
            "prompt": row.prompt,
            "frames": frames,
            "seed": seed,
            "goal": goal and digest_goal(goal),
            "timeline": timeline and digest_timeline(timeline, start),
            "skeleton": target and digest_skeleton(target),
        }
        if row.task == "duet":
            said |= {"pair": self._pair, "person": row.person}
        key = hashlib.sha256(json.dumps(said, sort_keys=True).encode("utf-8", "surrogatepass")).hexdigest()[:32]
        return Asked(row, key, frames, seed, goal, timeline, start, target)

    def _worded(self, row: Row) -> Timeline | None:
        """The row's prompt as a timeline, where numbers in it are kept; as long as they need where no time is said."""
        if row.task != "generate" or self.literal or self.fps != FPS or not row.prompt.strip():
            return None
        if row.seconds is not None and not SHORTEST <= row.seconds <= LONGEST:
            return None
        found = timeline_of(row.prompt, row.seconds, amounts=True)
        return found if found.readings else None

    def _skeleton(self, name: str, field: Field | None) -> Skeleton | None:
        if name.lower() == "smpl22":
            return None
        path = Path(name) if field is None else field.file(self.folder)
        return self._kept("skeleton", path, _read_skeleton)

    def _read(self, column: str, name: str, read: Callable[[Path], Any], *more: Any) -> Any:
        return self._kept(column, Field(name, column).file(self.folder), read, *more)

    def _kept(self, column: str, path: Path, read: Callable[[Path], Any], *more: Any) -> Any:
        about = path.stat()
        key = (column, str(path), about.st_size, about.st_mtime_ns, *more)
        if key not in self._cache:
            self._cache[key] = read(path)
            if len(self._cache) > _KEPT:
                self._cache.popitem(last=False)
        return self._cache[key]


def _check_timeline(task: str, timeline: Timeline) -> None:
    """Refuse before anything is drawn what two people, or one, cannot do."""
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


def hash_adapters(adapters: Sequence[tuple[Path, float]]) -> list[str]:
    """Hash and factor of each file; raises `MotionloomError` for one that is not there."""
    for path, _ in adapters:
        if not path.is_file():
            raise MotionloomError(f"there is no adapter {path}; name a file that 'motionloom teach' made")
    return [f"{hash_file(path)} {factor!r}" for path, factor in adapters]


def digest_goal(goal: Goal) -> str:
    """Hash of what a goal asks; what is not asked does not count."""
    where = np.where(goal.asked, goal.positions, 0.0)
    facing = np.where(goal.facing_asked, goal.facing, 0.0)
    return _digest(where, goal.asked, facing, goal.facing_asked, None if goal.start is None else astuple(goal.start))


def digest_timeline(timeline: Timeline, start: Motion | None) -> str:
    """Hash of what a timeline asks, the motion it goes on from included."""
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
