"""What a client asks of a job: untrusted JSON to a `JobRequest`, or a sentence that says what is wrong with it.

What a request may contain is in `motionloom.requests`, bounded once more by `Limits`; timelines and goals go through
the readers of the command line, so that the same words are refused with the same sentences.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from motionloom.errors import MotionloomError, listed, meant, quoted
from motionloom.goals.adapters import Applied, parse_adapter
from motionloom.goals.fields import Field
from motionloom.goals.timeline import Timeline, timeline_of
from motionloom.requests.fields import Spec, specs
from motionloom.requests.reading import read, resolve_sampling
from motionloom.requests.tasks import REQUESTS
from motionloom.requests.timeline import SECONDS, usual_seconds
from motionloom.server.limits import Limits
from motionloom.server.project import Project, Stored
from motionloom.server.timelines import timeline_from_json

if TYPE_CHECKING:
    from motionloom.goals.goal import Goal
    from motionloom.motion import Motion
    from motionloom.tasks.redraw import Block

TASKS = tuple(REQUESTS)
LEVELS = Spec("whole", "send the poses as events after so many network calls, or after every one", low=1)
DUET_SECONDS, ADDED_SECONDS = 6.0, 3.0
"""Lengths where nothing is said, those of the command line."""
FEWEST = 4
"""Frames of the shortest motion."""


@dataclass(frozen=True, eq=False)
class JobRequest:
    """One job, checked."""

    task: str
    values: Any
    """The task's request."""
    sampling: Any
    """The request's `Sampling`, with what its timeline says."""
    levels: int = 0
    """Poses are kept for event streams after every so many network calls; 0: not at all."""
    seconds: float = 0.0
    """Length of what is drawn where no timeline and no motion says it."""
    timeline: Timeline | None = None
    goal: "Goal | None" = None
    """In the world."""
    other_goal: "Goal | None" = None
    """Of the other of two people."""
    parts: "tuple[tuple[str, Goal], ...]" = ()
    """The goal item by item, each with its name, such as ``joints[0]``."""
    motion: Stored | None = None
    other: Stored | None = None
    """What is switched to, or what an edit takes parts of."""
    taught: tuple[Applied, ...] = ()
    """Adapters of the prior for this job."""
    kept: "tuple[Motion, list[Block]] | None" = None
    """A motion of an earlier timeline and what it was sampled from."""
    call: "Callable[[Any, Callable[[int, int], None]], Iterator[Any]] | None" = None
    """Draws instead of the task: (models, progress) -> results to keep."""

    @property
    def count(self) -> int:
        """Motions to make."""
        return self.sampling.number()

    @property
    def seed(self) -> int:
        """Of the first of them."""
        return self.sampling.seeds(1)[0]

    @property
    def prompt(self) -> str:
        """What is said, in one line."""
        if self.timeline is not None:
            return "; ".join(" ".join(segment.text.split()) for segment in self.timeline.segments[:20])
        return getattr(self.values, "prompt", None) or ""


def most(task: str, limits: Limits) -> dict[str, float]:
    """The largest numbers that a server takes of the fields of a task."""
    long = task in ("predict", "switch")
    return {
        "seconds": limits.total_seconds if long else limits.seconds,
        "extend": limits.seconds,
        "count": limits.count,
        "steps": limits.steps,
        "prompt": limits.prompt,
        "person": limits.people - 1,
    }


def read_request(body: Any, project: Project, limits: Limits) -> JobRequest:
    """A job's JSON; raises `MotionloomError` or `Refusal` with the sentence for the client."""
    if not isinstance(body, Mapping):
        raise MotionloomError("a job is a JSON object with a 'task' and what that task needs")
    task = body.get("task")
    if task is None:
        raise MotionloomError(f"a job has no 'task'; it is one of {listed(TASKS)}")
    if not isinstance(task, str) or task not in TASKS:
        near = meant(task, TASKS) if isinstance(task, str) else ""
        raise MotionloomError(f"'task' is {quoted(str(task))}{near}; there are {', '.join(TASKS)}")
    given = {str(key): value for key, value in body.items() if value is not None and key not in ("task", "levels")}
    usual = specs(REQUESTS[task])["count"].default
    values = read(
        REQUESTS[task], {"count": min(usual, limits.count)} | given, f"the task {task!r}", most=most(task, limits)
    )
    taught = tuple(_adapter(word, project) for word in getattr(values, "adapter", ()))
    found = JobRequest(task, values, values.sampling, _levels(body.get("levels"), limits), taught=taught)
    return _Reader(given, project, limits).request(found)


def _adapter(word: str, project: Project) -> Applied:
    """An adapter of the project's folder for them, and its factor."""
    path, factor = parse_adapter(word)
    return Field(str(path), "adapter").file(project.adapters), factor


def _levels(value: Any, limits: Limits) -> int:
    """True: every network call; a number: every so many."""
    if value is None or isinstance(value, bool):
        return int(value is not False)
    return replace(LEVELS, high=limits.steps).check(value, "'levels'")


class _Reader:
    """A request whose motions, timelines and goals are being read."""

    def __init__(self, given: dict[str, Any], project: Project, limits: Limits) -> None:
        self.given, self.project, self.limits = given, project, limits

    def request(self, found: JobRequest) -> JobRequest:
        """The request with all that it names."""
        return getattr(self, found.task, lambda found: found)(found)

    def generate(self, found: JobRequest) -> JobRequest:
        values = found.values
        seconds = usual_seconds(values.prompt) if values.seconds is None else values.seconds
        found = replace(found, seconds=seconds)
        if values.as_one or seconds < 0.2:
            return found
        timeline = timeline_of(values.prompt, values.seconds, amounts=not values.literal)
        return replace(found, timeline=timeline) if len(timeline.segments) > 1 or timeline.readings else found

    def compose(self, found: JobRequest) -> JobRequest:
        timeline = timeline_from_json(self.given["timeline"], self.project, self.limits)
        found = replace(found, sampling=resolve_sampling(found.values, timeline, but=self.given))
        parts = () if timeline.path is None else (("path", timeline.path),)
        return replace(
            found, timeline=timeline, goal=timeline.path, parts=parts, kept=self.kept_blocks(timeline, found)
        )

    def control(self, found: JobRequest) -> JobRequest:
        if "timeline" in self.given:
            if "prompt" in self.given or "seconds" in self.given:
                raise MotionloomError("a timeline says its own words and lengths; leave out 'prompt' and 'seconds'")
            timeline = self.given["timeline"]
            if not isinstance(timeline, Mapping) or "path" in timeline:
                raise MotionloomError("'timeline' must be a mapping, without a 'path' of its own beside 'goals'")
            self.given["timeline"] = {**timeline, "path": self.given["goals"]}
            found = self.compose(found)
            return replace(found, parts=self.parts(found.timeline.frames if found.timeline else 0))
        self.needs("prompt")
        return self.with_goal(found, SECONDS)

    def edit(self, found: JobRequest) -> JobRequest:
        if "look_at" in self.given:
            self.motion("motion", found.values.look_at)
        other = self.motion("source") if "source" in self.given else None
        return replace(found, motion=self.motion("motion", found.values.person), other=other)

    def predict(self, found: JobRequest) -> JobRequest:
        self.together(found)
        return replace(found, motion=self.motion("motion", found.values.person))

    def switch(self, found: JobRequest) -> JobRequest:
        self.together(found)
        return replace(found, motion=self.motion("motion"), other=self.motion("target"))

    def duet(self, found: JobRequest) -> JobRequest:
        values = found.values
        kinds = [key for key in ("timeline", "past", "react_to") if key in self.given]
        if len(kinds) > 1:
            raise MotionloomError(f"'{kinds[0]}' and '{kinds[1]}' are different duets; give one of them")
        if kinds != ["react_to"] and values.person > 1:
            raise MotionloomError(f"the two people are 0 and 1; there is no person {values.person}")
        if "goals" in self.given and kinds:
            raise MotionloomError(f"'goals' do not go with '{kinds[0]}'; a timeline has a 'path' of its own")
        if "other_goals" in self.given and (kinds not in ([], ["timeline"]) or not self.has_goals()):
            raise MotionloomError("'other_goals' go with words or a timeline, and with goals of the first person")
        if kinds == ["timeline"]:
            found = self.compose(found)
            assert found.timeline is not None
            return replace(found, other_goal=self.other_goal(found.timeline.frames))
        found = replace(found, sampling=resolve_sampling(values))
        if kinds == ["react_to"]:
            if values.seconds is not None:
                raise MotionloomError("an answer is as long as the motion it answers; leave out 'seconds'")
            return replace(found, motion=self.motion("react_to", values.person))
        if kinds:
            motion = self.motion("past")
            if len(motion.people) != 2:
                raise MotionloomError(f"two people go on from a motion of two; this one has {len(motion.people)}")
            return replace(found, motion=motion, seconds=ADDED_SECONDS if values.seconds is None else values.seconds)
        self.needs("prompt")
        if "goals" in self.given:
            return self.with_goal(found, DUET_SECONDS)
        return replace(found, seconds=DUET_SECONDS if values.seconds is None else values.seconds)

    # -- values

    def needs(self, key: str) -> None:
        if key not in self.given:
            raise MotionloomError(f"this task has no '{key}'; it needs one")

    def together(self, found: JobRequest) -> None:
        seconds, count = found.values.seconds, found.count
        if not seconds * count <= self.limits.total_seconds:
            raise MotionloomError(
                f"{count} times {seconds:g} s cannot be drawn at once; ask for at most {self.limits.total_seconds:g} s"
            )

    def motion(self, key: str, person: int = 0) -> Stored:
        motion = self.project.motion(self.given[key])
        if person >= len(motion.people):
            raise MotionloomError(f"the motion has {len(motion.people)} people, counted from 0; got person {person}")
        return motion

    def kept_blocks(self, timeline: Timeline, found: JobRequest) -> "tuple[Motion, list[Block]] | None":
        """What blocks may keep of an earlier motion; what goes on from elsewhere, or is a loop, is all sampled."""
        from motionloom.tasks.redraw import blocks_from

        if "kept_from" not in self.given:
            return None
        motion = self.motion("kept_from")
        blocks = blocks_from(motion.about.get("blocks"), len(motion.people[0]))
        free = timeline.start is None and not found.values.loop and len(motion.people) == 1
        return (motion.people[0], blocks) if free and blocks else None

    # -- goals

    def with_goal(self, found: JobRequest, usual: float) -> JobRequest:
        """The request with its length and goals."""
        seconds = usual if found.values.seconds is None else found.values.seconds
        frames = max(round(seconds * 20), FEWEST)
        goal = self.goal("goals", frames)
        return replace(found, seconds=seconds, goal=goal, parts=self.parts(frames), other_goal=self.other_goal(frames))

    def has_goals(self) -> bool:
        """Whether anything is asked of the person of a duet."""
        timeline = self.given.get("timeline")
        return "goals" in self.given or (isinstance(timeline, Mapping) and "path" in timeline)

    def other_goal(self, frames: int) -> "Goal | None":
        """The goals of the other of two people."""
        return self.goal("other_goals", frames) if "other_goals" in self.given else None

    def goal(self, key: str, frames: int) -> "Goal":
        """The goals of a key."""
        from motionloom.goals.goal_file import read_goal

        value = self.given[key]
        if not isinstance(value, Mapping):
            Field(value, key).wrong("a mapping, as a goal file holds it")
        return read_goal(value, frames=frames, folder=self.project.motions)

    def parts(self, frames: int) -> "tuple[tuple[str, Goal], ...]":
        """The goal's items, each as a goal of its own: what only it asks."""
        from motionloom.goals.goal import Goal
        from motionloom.goals.goal_file import read_goal

        value, folder = self.given["goals"], self.project.motions
        base = {key: value[key] for key in ("start", "path") if key in value}
        path = read_goal(base, frames=frames, folder=folder) if base else Goal.nothing(frames)
        found = [("path", path)] if "path" in base else []
        for key in ("joints", "poses", "follow"):
            items = value.get(key) or []
            for number, item in enumerate([items] if isinstance(items, Mapping) else items):
                own = read_goal({**base, key: [item]}, frames=frames, folder=folder)
                found.append((f"{key}[{number}]", replace(own, mask=own.mask & ~path.mask)))
        return tuple(found)
