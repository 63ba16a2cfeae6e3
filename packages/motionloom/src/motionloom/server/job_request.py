"""What a client requests of a job: untrusted JSON to a `JobRequest`, or a sentence that says what is wrong with it.

What a request may contain is in `motionloom.requests`, bounded once more by `Limits`; timelines and goals go through
the readers of the command line, so that the same words are refused with the same sentences.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from motionloom.core.errors import MotionloomError, listed, meant, quoted
from motionloom.goals.adapters import Applied, parse_adapter
from motionloom.goals.fields import Field
from motionloom.goals.sequence import usual_seconds
from motionloom.goals.timeline import Timeline, timeline_of
from motionloom.requests.fields import Spec, specs
from motionloom.requests.reading import read, resolve_sampling
from motionloom.requests.tasks import REQUESTS
from motionloom.requests.timeline import SECONDS
from motionloom.server.limits import Limits
from motionloom.server.project import Project, Stored
from motionloom.server.timelines import timeline_from_json

if TYPE_CHECKING:
    from motionloom.core.motion import Motion
    from motionloom.goals.goal import Goal
    from motionloom.tasks.redraw import Block

TASKS = tuple(REQUESTS)
LEVELS = Spec("whole", "send the poses as events after so many network calls, or after every one", low=1)
DUET_SECONDS, ADDED_SECONDS = 6.0, 3.0
"""Lengths where a request has none, those of the command line."""
FEWEST = 4
"""Frames of the shortest motion."""


@dataclass(frozen=True, eq=False)
class JobRequest:
    """One job, checked."""

    task: str
    values: Any
    """The task's request."""
    sampling: Any
    """The request's `Sampling`, with that of its timeline."""
    levels: int = 0
    """Poses are kept for event streams after every so many network calls; 0: not at all."""
    seconds: float = 0.0
    """Length of what is generated where no timeline and no motion gives it."""
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
    previous: "tuple[Motion, list[Block]] | None" = None
    """A motion of an earlier timeline and what it was sampled from."""
    call: "Callable[[Any, Callable[[int, int], None]], Iterator[Any]] | None" = None
    """Runs instead of the task: (models, progress) -> results to keep."""

    @property
    def count(self) -> int:
        """Number of motions."""
        return self.sampling.number()

    @property
    def seed(self) -> int:
        """Of the first of them."""
        return self.sampling.seeds(1)[0]

    @property
    def prompt(self) -> str:
        """The words, in one line."""
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
    fields = {str(key): value for key, value in body.items() if value is not None and key not in ("task", "levels")}
    usual = specs(REQUESTS[task])["count"].default
    values = read(
        REQUESTS[task], {"count": min(usual, limits.count)} | fields, f"the task {task!r}", most=most(task, limits)
    )
    taught = tuple(_adapter(word, project) for word in getattr(values, "adapter", ()))
    job = JobRequest(task, values, values.sampling, _levels(body.get("levels"), limits), taught=taught)
    return getattr(_Reader(fields, project, limits), task)(job)


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
    """Reads the motions, timelines and goals that a job names; one method for each task."""

    def __init__(self, body: dict[str, Any], project: Project, limits: Limits) -> None:
        self.body, self.project, self.limits = body, project, limits

    def generate(self, job: JobRequest) -> JobRequest:
        values = job.values
        seconds = usual_seconds(values.prompt) if values.seconds is None else values.seconds
        job = replace(job, seconds=seconds)
        if values.as_one or seconds < 0.2:
            return job
        timeline = timeline_of(values.prompt, values.seconds, amounts=not values.literal)
        return replace(job, timeline=timeline) if len(timeline.segments) > 1 or timeline.readings else job

    def compose(self, job: JobRequest) -> JobRequest:
        timeline = timeline_from_json(self.body["timeline"], self.project, self.limits)
        job = replace(job, sampling=resolve_sampling(job.values, timeline, but=self.body))
        parts = () if timeline.path is None else (("path", timeline.path),)
        previous = self.previous_blocks(timeline, job)
        return replace(job, timeline=timeline, goal=timeline.path, parts=parts, previous=previous)

    def control(self, job: JobRequest) -> JobRequest:
        if "timeline" in self.body:
            if "prompt" in self.body or "seconds" in self.body:
                raise MotionloomError("a timeline says its own words and lengths; leave out 'prompt' and 'seconds'")
            timeline = self.body["timeline"]
            if not isinstance(timeline, Mapping) or "path" in timeline:
                raise MotionloomError("'timeline' must be a mapping, without a 'path' of its own beside 'goals'")
            self.body["timeline"] = {**timeline, "path": self.body["goals"]}
            job = self.compose(job)
            return replace(job, parts=self.parts(job.timeline.frames if job.timeline else 0))
        self.needs_prompt()
        return self.with_goal(job, SECONDS)

    def edit(self, job: JobRequest) -> JobRequest:
        if "look_at" in self.body:
            self.motion("motion", job.values.look_at)
        other = self.motion("source") if "source" in self.body else None
        return replace(job, motion=self.motion("motion", job.values.person), other=other)

    def predict(self, job: JobRequest) -> JobRequest:
        self.together(job)
        return replace(job, motion=self.motion("motion", job.values.person))

    def switch(self, job: JobRequest) -> JobRequest:
        self.together(job)
        return replace(job, motion=self.motion("motion"), other=self.motion("target"))

    def duet(self, job: JobRequest) -> JobRequest:
        values = job.values
        kinds = [key for key in ("timeline", "past", "react_to") if key in self.body]
        if len(kinds) > 1:
            raise MotionloomError(f"'{kinds[0]}' and '{kinds[1]}' are different duets; give one of them")
        if kinds != ["react_to"] and values.person > 1:
            raise MotionloomError(f"the two people are 0 and 1; there is no person {values.person}")
        if "goals" in self.body and kinds:
            raise MotionloomError(f"'goals' do not go with '{kinds[0]}'; a timeline has a 'path' of its own")
        if "other_goals" in self.body and (kinds not in ([], ["timeline"]) or not self.has_goals()):
            raise MotionloomError("'other_goals' go with words or a timeline, and with goals of the first person")
        if kinds == ["timeline"]:
            job = self.compose(job)
            assert job.timeline is not None
            return replace(job, other_goal=self.other_goal(job.timeline.frames))
        job = replace(job, sampling=resolve_sampling(values))
        if kinds == ["react_to"]:
            if values.seconds is not None:
                raise MotionloomError("an answer is as long as the motion it answers; leave out 'seconds'")
            return replace(job, motion=self.motion("react_to", values.person))
        if kinds:
            motion = self.motion("past")
            if len(motion.people) != 2:
                raise MotionloomError(f"two people go on from a motion of two; this one has {len(motion.people)}")
            return replace(job, motion=motion, seconds=ADDED_SECONDS if values.seconds is None else values.seconds)
        self.needs_prompt()
        if "goals" in self.body:
            return self.with_goal(job, DUET_SECONDS)
        return replace(job, seconds=DUET_SECONDS if values.seconds is None else values.seconds)

    # -- values

    def needs_prompt(self) -> None:
        if "prompt" not in self.body:
            raise MotionloomError("this task has no 'prompt'; it needs one")

    def together(self, job: JobRequest) -> None:
        seconds, count = job.values.seconds, job.count
        if not seconds * count <= self.limits.total_seconds:
            raise MotionloomError(
                f"{count} times {seconds:g} s cannot be drawn at once; ask for at most {self.limits.total_seconds:g} s"
            )

    def motion(self, key: str, person: int = 0) -> Stored:
        motion = self.project.motion(self.body[key])
        if person >= len(motion.people):
            raise MotionloomError(f"the motion has {len(motion.people)} people, counted from 0; got person {person}")
        return motion

    def previous_blocks(self, timeline: Timeline, job: JobRequest) -> "tuple[Motion, list[Block]] | None":
        """What blocks may keep of an earlier motion; what goes on from elsewhere, or is a loop, is all sampled."""
        from motionloom.tasks.redraw import blocks_from

        if "kept_from" not in self.body:
            return None
        motion = self.motion("kept_from")
        blocks = blocks_from(motion.about.get("blocks"), len(motion.people[0]))
        free = timeline.start is None and not job.values.loop and len(motion.people) == 1
        return (motion.people[0], blocks) if free and blocks else None

    # -- goals

    def with_goal(self, job: JobRequest, usual: float) -> JobRequest:
        """The job with its length and goals."""
        seconds = usual if job.values.seconds is None else job.values.seconds
        frames = max(round(seconds * 20), FEWEST)
        goal = self.goal("goals", frames)
        return replace(job, seconds=seconds, goal=goal, parts=self.parts(frames), other_goal=self.other_goal(frames))

    def has_goals(self) -> bool:
        """Whether the person of a duet has goals."""
        timeline = self.body.get("timeline")
        return "goals" in self.body or (isinstance(timeline, Mapping) and "path" in timeline)

    def other_goal(self, frames: int) -> "Goal | None":
        """The goals of the other of two people."""
        return self.goal("other_goals", frames) if "other_goals" in self.body else None

    def goal(self, key: str, frames: int) -> "Goal":
        """The goals of a key."""
        from motionloom.goals.goal_file import read_goal

        value = self.body[key]
        if not isinstance(value, Mapping):
            Field(value, key).wrong("a mapping, as a goal file holds it")
        return read_goal(value, frames=frames, folder=self.project.motions)

    def parts(self, frames: int) -> "tuple[tuple[str, Goal], ...]":
        """The goal's items, each as a goal of its own: what only it constrains."""
        from motionloom.goals.goal import Goal
        from motionloom.goals.goal_file import read_goal

        value, folder = self.body["goals"], self.project.motions
        base = {key: value[key] for key in ("start", "path") if key in value}
        path = read_goal(base, frames=frames, folder=folder) if base else Goal.nothing(frames)
        goals = [("path", path)] if "path" in base else []
        for key in ("joints", "poses", "follow"):
            items = value.get(key) or []
            for number, item in enumerate([items] if isinstance(items, Mapping) else items):
                own = read_goal({**base, key: [item]}, frames=frames, folder=folder)
                goals.append((f"{key}[{number}]", replace(own, mask=own.mask & ~path.mask)))
        return tuple(goals)
