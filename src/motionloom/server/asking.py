"""What a client asks of a job: untrusted JSON to a `Request`, or a sentence that says what is wrong with it.

Numbers are bounded by `Limits`; timelines and goals go through the readers of the command line, so that the same words
are refused with the same sentences.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from motionloom.errors import MotionloomError
from motionloom.goals.fields import Field, listed
from motionloom.goals.timeline import Timeline, read_timeline, timeline_of
from motionloom.io.lined_yaml import meant, read_lined
from motionloom.server.causes import keys_at
from motionloom.server.limits import Limits
from motionloom.server.project import Project, Stored

if TYPE_CHECKING:
    from motionloom.goals.goal import Goal

COMMON = ("task", "seed", "count", "steps", "guidance", "levels")
KEYS = {
    "generate": ("prompt", "seconds", "as_one", "literal"),
    "compose": ("timeline",),
    "control": ("prompt", "seconds", "goals", "timeline"),
    "edit": ("motion", "person", "prompt", "redraw", "keep", "loop", "blend", "extend", "strength"),
    "predict": ("motion", "person", "seconds", "start", "end", "temperature"),
    "switch": ("motion", "to", "seconds", "facing", "start", "end"),
    "duet": ("prompt", "timeline", "seconds", "past", "react_to", "goals", "person", "together"),
}
TASKS = tuple(KEYS)
SECONDS, DUET_SECONDS, ADDED_SECONDS, FUTURE_SECONDS, GAP_SECONDS = 5.0, 6.0, 3.0, 2.0, 1.0
"""Lengths where nothing is said, those of the command line."""
FEWEST = 4
"""Frames of the shortest motion."""
MAX_SEED = 2**62 - 1000


@dataclass(frozen=True, eq=False)
class Request:
    """One job, checked: what is not asked has its default."""

    task: str
    seed: int
    count: int
    steps: int | None
    guidance: float | None
    levels: int
    """Poses are kept for event streams after every so many network calls; 0: not at all."""
    options: dict[str, Any]
    """The task's own values, by the names of `KEYS`."""
    timeline: Timeline | None = None
    goal: "Goal | None" = None
    """In the world."""
    parts: "tuple[tuple[str, Goal], ...]" = ()
    """The goal item by item, each with its name, such as ``joints[0]``."""
    motion: Stored | None = None
    other: Stored | None = None
    """What is switched to."""
    call: "Callable[[Any, Callable[[int, int], None]], Iterator[Any]] | None" = None
    """Draws instead of the task: (models, progress) -> results to keep."""

    @property
    def prompt(self) -> str:
        """What is said, in one line."""
        if self.timeline is not None:
            return "; ".join(" ".join(segment.text.split()) for segment in self.timeline.segments[:20])
        return self.options.get("prompt") or ""


def read_request(body: Any, project: Project, limits: Limits) -> Request:
    """A job's JSON; raises `MotionloomError` or `Refusal` with the sentence for the client."""
    if not isinstance(body, Mapping):
        raise MotionloomError("a job is a JSON object with a 'task' and what that task needs")
    given: dict[str, Field] = {str(key): Field(value, str(key)) for key, value in body.items() if value is not None}
    if "task" not in given:
        raise MotionloomError(f"a job has no 'task'; it is one of {listed(TASKS)}")
    task = given["task"].word(TASKS)
    known = (*COMMON, *KEYS[task])
    for key in given:
        if key not in known:
            raise MotionloomError(f"the task {task!r} has no {key[:40]!r}{meant(key, known)}; it has {listed(known)}")
    return _Reader(given, project, limits).request(task)


class _Reader:
    """One request being read."""

    def __init__(self, given: dict[str, Field], project: Project, limits: Limits) -> None:
        self.given, self.project, self.limits = given, project, limits

    def request(self, task: str) -> Request:
        options = {
            "prompt": self.prompt(),
            "seconds": self.seconds(task),
            "as_one": self.flag("as_one"),
            "literal": self.flag("literal"),
            "keep": self.words("keep"),
            "redraw": self.spans(),
            "loop": self.flag("loop"),
            "blend": self.number("blend", 0.0, 60.0),
            "extend": self.number("extend", 0.0, self.limits.seconds),
            "strength": self.number("strength", 0.0, 1.0),
            "person": self.whole("person", 0, self.limits.people - 1),
            "start": self.number("start", 0.0, 1e6),
            "end": self.number("end", 0.0, 1e6),
            "temperature": self.number("temperature", 0.0, 2.0),
            "together": self.number("together", 0.0, 1.0),
            "facing": self.facing(),
        }
        common: dict[str, Any] = {
            "task": task,
            "seed": self.whole("seed", 0, MAX_SEED) or 0,
            "count": self.whole("count", 1, self.limits.count) or 1,
            "steps": self.whole("steps", 1, self.limits.steps),
            "guidance": self.number("guidance", -100.0, 100.0),
            "levels": self.levels(),
            "options": options,
        }
        return getattr(self, task)(common, options)

    # -- the tasks

    def generate(self, common: dict[str, Any], options: dict[str, Any]) -> Request:
        self.needs("prompt")
        timeline = None
        seconds = options["seconds"]
        options["seconds"] = SECONDS if seconds is None else seconds
        if not options["as_one"] and options["seconds"] >= 0.2:
            found = timeline_of(options["prompt"], seconds, amounts=not options["literal"])
            timeline = found if len(found.segments) > 1 or found.readings else None
        return Request(**common, timeline=timeline)

    def compose(self, common: dict[str, Any], options: dict[str, Any]) -> Request:
        self.needs("timeline")
        timeline = read_timeline_json(self.given["timeline"].value, self.project, self.limits)
        if "seed" not in self.given and timeline.seed is not None:
            common["seed"] = min(timeline.seed, MAX_SEED)
        if common["guidance"] is None:
            common["guidance"] = timeline.guidance
        return Request(**common, timeline=timeline, goal=timeline.path, parts=self.whole_goal(timeline.path))

    def control(self, common: dict[str, Any], options: dict[str, Any]) -> Request:
        if "timeline" in self.given:
            if "prompt" in self.given or "seconds" in self.given:
                raise MotionloomError("a timeline says its own words and lengths; leave out 'prompt' and 'seconds'")
            self.needs("goals")
            timeline = self.given["timeline"].value
            if not isinstance(timeline, Mapping) or "path" in timeline:
                raise MotionloomError("'timeline' must be a mapping, without a 'path' of its own beside 'goals'")
            self.given["timeline"] = Field({**timeline, "path": self.given["goals"].value}, "timeline")
            request = self.compose(common, options)
            frames = request.timeline.frames if request.timeline else 0
            return Request(**common, timeline=request.timeline, goal=request.goal, parts=self.parts(frames))
        self.needs("prompt", "goals")
        options["seconds"] = SECONDS if options["seconds"] is None else options["seconds"]
        frames = max(round(options["seconds"] * 20), FEWEST)
        return Request(**common, goal=self.goal(frames), parts=self.parts(frames))

    def edit(self, common: dict[str, Any], options: dict[str, Any]) -> Request:
        motion = self.motion("motion")
        self.check_person(motion, options)
        return Request(**common, motion=motion)

    def predict(self, common: dict[str, Any], options: dict[str, Any]) -> Request:
        motion = self.motion("motion")
        self.check_person(motion, options)
        options["seconds"] = FUTURE_SECONDS if options["seconds"] is None else options["seconds"]
        self.together(options["seconds"], common["count"])
        return Request(**common, motion=motion)

    def switch(self, common: dict[str, Any], options: dict[str, Any]) -> Request:
        options["seconds"] = GAP_SECONDS if options["seconds"] is None else options["seconds"]
        self.together(options["seconds"], common["count"])
        return Request(**common, motion=self.motion("motion"), other=self.motion("to"))

    def duet(self, common: dict[str, Any], options: dict[str, Any]) -> Request:
        kinds = [key for key in ("timeline", "past", "react_to") if key in self.given]
        if len(kinds) > 1:
            raise MotionloomError(f"'{kinds[0]}' and '{kinds[1]}' are different duets; give one of them")
        if options["person"] not in (None, 0, 1):
            raise MotionloomError(f"the two people are 0 and 1; there is no person {options['person']}")
        if "goals" in self.given and kinds:
            raise MotionloomError(f"'goals' do not go with '{kinds[0]}'; a timeline has a 'path' of its own")
        if kinds == ["timeline"]:
            return self.compose(common, options)
        options["past"] = kinds == ["past"]
        if kinds:
            return Request(**common, motion=self.given_people(options))
        self.needs("prompt")
        options["seconds"] = DUET_SECONDS if options["seconds"] is None else options["seconds"]
        if "goals" not in self.given:
            return Request(**common)
        frames = max(round(options["seconds"] * 20), FEWEST)
        return Request(**common, goal=self.goal(frames), parts=self.parts(frames))

    def given_people(self, options: dict[str, Any]) -> Stored:
        """The motion of both that a duet goes on from, or of the one whom the second person answers."""
        motion = self.motion("past" if options["past"] else "react_to")
        if not options["past"]:
            if options["seconds"] is not None:
                raise MotionloomError("an answer is as long as the motion it answers; leave out 'seconds'")
            self.check_person(motion, options)
        elif len(motion.people) != 2:
            raise MotionloomError(f"two people go on from a motion of two; this one has {len(motion.people)}")
        else:
            options["seconds"] = ADDED_SECONDS if options["seconds"] is None else options["seconds"]
        return motion

    # -- values

    def needs(self, *keys: str) -> None:
        for key in keys:
            if key not in self.given:
                raise MotionloomError(f"this task has no '{key}'; it needs {listed(keys)}")

    def number(self, key: str, low: float, high: float) -> float | None:
        return self.given[key].number(low, high) if key in self.given else None

    def whole(self, key: str, low: int, high: int) -> int | None:
        if key not in self.given:
            return None
        value = self.given[key].value
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            self.given[key].fail(f"must be a whole number from {low} to {high}; got {str(value)[:40]}")
        return value

    def seconds(self, task: str) -> float | None:
        """The length that is asked for; what the network draws at once is shorter than futures and gaps together."""
        longest = self.limits.total_seconds if task in ("predict", "switch") else self.limits.seconds
        found = self.number("seconds", 0.0, longest)
        if found == 0:
            self.given["seconds"].fail(f"must be more than 0 and at most {longest:g}; got 0")
        return found

    def flag(self, key: str, *, missing: bool = False) -> bool:
        return self.given[key].flag() if key in self.given else missing

    def levels(self) -> int:
        """True: every network call; a number: every so many."""
        if isinstance(self.given["levels"].value if "levels" in self.given else True, bool):
            return int(self.flag("levels", missing=True))
        return self.whole("levels", 1, self.limits.steps) or 1

    def prompt(self) -> str | None:
        if "prompt" not in self.given:
            return None
        found = self.given["prompt"].value
        if not isinstance(found, str):
            self.given["prompt"].wrong("text")
        if not found.strip():
            raise MotionloomError("a prompt is empty; say in words what the person does")
        if len(found) > self.limits.prompt:
            raise MotionloomError(f"a prompt has {len(found):,} characters; say it in at most {self.limits.prompt:,}")
        return found

    def words(self, key: str) -> tuple[str, ...]:
        if key not in self.given:
            return ()
        found = self.given[key].items(least=0, most=100)
        if not all(isinstance(item.value, str) for item in found):
            raise MotionloomError(f"'{key}' must be a list of words")
        return tuple(item.value for item in found)

    def spans(self) -> tuple[tuple[float, float], ...]:
        if "redraw" not in self.given:
            return ()
        rows = self.given["redraw"].items(least=0, most=50)
        pairs = [row.numbers(0.0, 1e6, least=2, most=2) for row in rows]
        return tuple((first, last) for first, last in pairs)

    def facing(self) -> str:
        return self.given["facing"].word(("turned", "kept")) if "facing" in self.given else "turned"

    def together(self, seconds: float, count: int) -> None:
        if not 0 < seconds * count <= self.limits.total_seconds:
            raise MotionloomError(
                f"{count} times {seconds:g} s cannot be drawn at once; ask for at most {self.limits.total_seconds:g} s"
            )

    def motion(self, key: str) -> Stored:
        self.needs(key)
        return self.project.motion(self.given[key].value)

    def check_person(self, motion: Stored, options: dict[str, Any]) -> None:
        person = options["person"] or 0
        if person >= len(motion.people):
            raise MotionloomError(f"the motion has {len(motion.people)} people, counted from 0; got person {person}")
        options["person"] = person

    # -- goals

    def goal(self, frames: int) -> "Goal":
        from motionloom.goals.goal_file import read_goal

        value = self.given["goals"].value
        if not isinstance(value, Mapping):
            self.given["goals"].wrong("a mapping, as a goal file holds it")
        return read_goal(value, frames=frames, folder=self.project.motions)

    def parts(self, frames: int) -> "tuple[tuple[str, Goal], ...]":
        """The goal's items, each as a goal of its own: what only it asks."""
        from motionloom.goals.goal import Goal
        from motionloom.goals.goal_file import read_goal

        value, folder = self.given["goals"].value, self.project.motions
        base = {key: value[key] for key in ("start", "path") if key in value}
        path = read_goal(base, frames=frames, folder=folder) if base else Goal.nothing(frames)
        found = [("path", path)] if "path" in base else []
        for key in ("joints", "poses", "follow"):
            items = value.get(key) or []
            for number, item in enumerate([items] if isinstance(items, Mapping) else items):
                own = read_goal({**base, key: [item]}, frames=frames, folder=folder)
                found.append((f"{key}[{number}]", _without(own, path)))
        return tuple(found)

    def whole_goal(self, goal: "Goal | None") -> "tuple[tuple[str, Goal], ...]":
        return () if goal is None else (("path", goal),)


def _without(goal: "Goal", other: "Goal") -> "Goal":
    """What ``goal`` asks and ``other`` does not."""
    from dataclasses import replace

    return replace(goal, asked=goal.asked & ~other.asked)


# Timelines


class _Quoting(yaml.SafeDumper):
    """Writes in quotes what is not plain words: other readers of YAML know other numbers ("0o7", "INF")."""


def _quoted(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    plain = re.fullmatch(r"(?!(?i:inf|nan|infinity)$)[^\W\d_][^\W\d_]*(?:[ _][^\W\d_]+)*", text)
    style = None if plain else '"'
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Quoting.add_representer(str, _quoted)


def timeline_yaml(value: Any) -> str:
    """A timeline's JSON as the text of its YAML file."""
    if not isinstance(value, Mapping):
        raise MotionloomError("a timeline is a mapping with 'segments', as its YAML file is")
    return yaml.dump(_plain(value), Dumper=_Quoting, sort_keys=False, allow_unicode=True, width=120)


def read_timeline_text(text: str, project: Project, limits: Limits) -> Timeline:
    """A timeline file's text through the command line's reader; files that it names are motions of the project."""
    with _as_file(text, project) as place:
        timeline = read_timeline(place)
    if timeline.seconds > limits.total_seconds:
        raise MotionloomError(
            f"the timeline takes {timeline.seconds:g} s; at most {limits.total_seconds:g} s are made in one job"
        )
    if any(segment.adapters for segment in timeline.segments):
        raise MotionloomError("a timeline of the server has no 'adapters'; run it with motionloom compose")
    return timeline


def timeline_json(text: str, project: Project, limits: Limits) -> Any:
    """A timeline file's text as the JSON that `timeline_yaml` takes, once it has been read as a timeline."""
    read_timeline_text(text, project, limits)
    with _as_file(text, project) as place:
        return read_lined(place).plain()


class TimelineError(MotionloomError):
    """What is wrong with a timeline, and where: a page shows it at the block or goal that it belongs to."""

    def __init__(self, sentence: str, where: str) -> None:
        super().__init__(sentence)
        self.where = where
        """Keys from the outside in, such as ``segments[1].goal.joints[0]``; empty where no line is known."""


@contextmanager
def _as_file(text: str, project: Project) -> Iterator[Path]:
    """The text as a file beside the motions, whose name is not in what goes wrong."""
    place = project.motions / f".{project.part().name}.yaml"
    try:
        place.write_text(text, encoding="utf-8")
        yield place
    except MotionloomError as error:
        raise TimelineError(str(error).replace(str(place), "the timeline"), keys_at(place, str(error))) from None
    except UnicodeEncodeError:
        raise MotionloomError("the timeline holds characters that are no text; write it in UTF-8") from None
    finally:
        place.unlink(missing_ok=True)


def read_timeline_json(value: Any, project: Project, limits: Limits) -> Timeline:
    """The same from JSON."""
    return read_timeline_text(timeline_yaml(value), project, limits)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    return [_plain(inner) for inner in value] if isinstance(value, list) else value
