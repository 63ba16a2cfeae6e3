"""A `JobRequest` to motions, by `motionloom.tasks.run`; remarks on its words, and its poses while they are computed."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion, ground_pose
from motionloom.goals.goal import Goal, start_of
from motionloom.goals.remarks import Remark, numbers_read, parts_read
from motionloom.io import load
from motionloom.retarget import to_smpl22
from motionloom.server.job_request import JobRequest
from motionloom.tasks import run as tasks
from motionloom.tasks import text
from motionloom.tasks.direct_edits import is_only_head_free
from motionloom.tasks.remarks import remarks_on_words
from motionloom.tasks.run import Models, Plan, Result, run, run_each
from motionloom.tasks.sampling import Progress

Array = NDArray[np.float64]

RATE = 20.0
MOST_TEXTS = 64
"""Texts of one job that are looked at for remarks."""


def draw(models: Models, request: JobRequest, progress: Progress) -> Iterator[Result]:
    """The motions of a request, one after the other as they are finished."""
    if request.call is not None:
        yield from request.call(models, progress)
        return
    person = request.values.person if request.task == "duet" else 0
    for result in run(plan_of(request), models, progress):
        measures = {} if request.goal is None else measured(result.people[person], request.parts)
        yield replace(result, measures=measures | result.measures)


def plan_of(request: JobRequest) -> Plan:
    """The plan of a request, with the motions that it names."""
    timeline, values = request.timeline, request.values
    goals = (request.goal, request.other_goal)
    if request.task == "duet" and values.person == 1:
        goals = (request.other_goal, request.goal)
    people = list(request.motion.people) if request.motion else []
    if request.task == "predict" or getattr(values, "react_to", None) is not None:
        people = [people[values.person]]
    if request.task == "duet" and timeline is not None and timeline.start is not None:
        raise MotionloomError("two people do not go on from one 'start'; leave it out, or give 'past'")
    target = None
    if request.task in ("predict", "switch"):
        people = [cropped(people[0], values)]
    if request.task == "edit" and request.other is not None:
        target = request.other.people[0]
    elif request.other is not None:
        past, target = people[0], request.other.people[0]
        if past.skeleton != target.skeleton:
            past, target = to_smpl22(past), to_smpl22(target)
        people, target = [past], target.resample(past.fps)
    return Plan(
        task=request.task,
        values=values,
        sampling=request.sampling,
        seconds=request.seconds,
        timeline=timeline,
        start=None if timeline is None or timeline.start is None else load(timeline.start),
        goals=goals,
        people=tuple(people),
        target=target,
        taught=request.taught,
        previous=request.previous,
    )


def remarks_of(models: Models, request: JobRequest) -> list[Remark]:
    """Remarks on the words of a request: numbers and actions read in them, words that nobody learned.

    Raises `MotionloomError` where a text cannot be encoded.
    """
    if request.call is not None or request.task in ("predict", "switch"):
        return []
    timeline, prior = request.timeline, models.prior
    texts = [request.prompt] if timeline is None else [segment.text for segment in timeline.segments]
    texts = list(dict.fromkeys(texts))[:MOST_TEXTS]
    if request.task == "edit" and is_only_head_free(request.values.keep):
        return []
    if request.task == "duet":
        return remarks_on_words(prior, texts, block=models.block)
    read = [] if timeline is None or request.task != "generate" else [numbers_read(timeline), parts_read(timeline)]
    remarks = [Remark(request.prompt, line) for line in read if line]
    heads = request.task == "generate" and not request.values.literal
    return remarks + remarks_on_words(prior, texts, heads=heads)


def batch_key(request: JobRequest) -> tuple[Any, ...] | None:
    """Requests of one key may be sampled in one network call; None: this one is sampled alone."""
    if request.task != "generate" or request.call is not None or request.timeline is not None:
        return None
    alike = replace(request.sampling, seed=0, count=1)
    values = request.values
    once = values.as_one or values.literal  # nothing is generated again
    return text.frames_in(request.seconds, RATE), alike, values.foot_lock, once, request.taught


def at_once(request: JobRequest) -> bool:
    """Whether the motions of a request are sampled in the same network calls, rather than one after the other."""
    return request.call is None and tasks.is_batched(request)


def draw_together(models: Models, requests: Sequence[JobRequest], progress: Progress) -> Iterator[tuple[int, Result]]:
    """`generate` for several requests of one `batch_key`: (index of the request, one of its motions).

    A motion depends on its prompt and its seed alone, up to the rounding of larger matrix products.
    """
    return run_each([plan_of(request) for request in requests], models, progress)


def cropped(motion: Motion, values: Any) -> Motion:
    """The stretch of a motion that 'start' and 'end' name."""
    start, end = values.start, values.end
    if start is None and end is None:
        return motion
    return motion.crop(start or 0.0, min(motion.seconds, motion.seconds if end is None else end))


def measured(motion: Motion, parts: Iterable[tuple[str, Goal]]) -> dict[str, Any]:
    """How far a motion is from each part of its goal: mean and worst in centimetres, and when it is worst."""
    positions, distances = None, {}
    for name, goal in parts:
        mask = goal.mask.any(axis=-1)
        if not mask.any() or len(goal) != len(motion):
            continue
        positions = motion.positions() if positions is None else positions
        away = np.linalg.norm(np.where(goal.mask, positions - goal.positions, 0.0), axis=-1)
        worst = int(away.max(axis=1).argmax())
        distances[name] = {
            "mean_cm": round(100 * float(away[mask].mean()), 2),
            "worst_cm": round(100 * float(away.max()), 2),
            "worst_at": round(worst / motion.fps, 3),
        }
    return {"goals": distances} if distances else {}


def placed(request: JobRequest, poses: Array) -> Array:
    """Poses (people, frames, 22, 3) of `watching` in the world of the finished motion."""
    if request.goal is None:
        return poses
    place = start_of(request.goal)
    if request.task != "duet":
        return place.to_world(poses)
    return place.to_world(ground_pose(poses[request.values.person, 0]).from_world(poses))
