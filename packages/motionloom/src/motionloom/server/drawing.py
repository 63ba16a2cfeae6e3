"""A `JobRequest` to motions, by the functions that the command line calls, and its poses while they are computed."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.errors import MotionloomError
from motionloom.goals.goal import Goal, start_of
from motionloom.motion import Motion, ground_pose
from motionloom.retarget import to_smpl22
from motionloom.server.job_request import JobRequest
from motionloom.tasks import duet, long, pair, text
from motionloom.tasks.control import control
from motionloom.tasks.edit import changes_asked, close, edit
from motionloom.tasks.predict import predict, switch
from motionloom.tasks.splice import concatenated
from motionloom.tasks.watching import watching
from motionloom.tasks.worded import draw as draw_worded
from motionloom.weights.pair import PairBlock
from motionloom.weights.predictor import Predictor
from motionloom.weights.prior import Prior

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]

RATE = 20.0


@dataclass(eq=False)
class Models:
    """What draws, loaded once; the block for two people and the predictor when they are first needed."""

    prior: Prior
    _block: PairBlock | None = None
    _predictor: Predictor | None = None

    @property
    def block(self) -> PairBlock:
        """What makes two people of one prior."""
        self._block = self._block or PairBlock.load("duet", self.prior)
        return self._block

    @property
    def predictor(self) -> Predictor:
        """What says what comes next."""
        self._predictor = self._predictor or Predictor.load()
        return self._predictor


@dataclass(frozen=True, eq=False)
class Result:
    """One motion of a job."""

    number: int
    people: tuple[Motion, ...]
    seed: int
    measures: dict[str, Any] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    """What was missed, a sentence each."""


def draw(models: Models, request: JobRequest, progress: Progress) -> Iterator[Result]:
    """The motions of a request, one after the other as they are finished."""
    if request.call is not None:
        return request.call(models, progress)
    made = _composed if at_once(request) else _TASKS[request.task]
    return _closed(models, request, made(models, request, progress))


def _closed(models: Models, request: JobRequest, results: Iterable[Result]) -> Iterator[Result]:
    """The motions, as loops where the request says so; an edit makes its own."""
    if request.task == "edit" or not getattr(request.values, "loop", False):
        yield from results
        return
    said = request.timeline.segments[-1].text if request.timeline else request.prompt
    said = "" if request.task == "duet" else said
    how = {"blend": request.values.blend, "foot_lock": request.values.foot_lock}
    settings: dict[str, Any] = {"guidance": request.sampling.guidance} if said else {}
    settings |= {} if request.task in ("predict", "switch") else {"steps": request.sampling.steps}
    for result in results:
        seed = request.seed + result.number
        with watching(lambda denoised: None):  # what is watched are the motions
            people = [close(models.prior, one, said, seed=seed, **how, **settings) for one in result.people]
        yield replace(result, people=tuple(people))


def batch_key(request: JobRequest) -> tuple[Any, ...] | None:
    """Requests of one key may be drawn in one network call; None: this one is drawn alone."""
    if request.task != "generate" or request.call is not None or request.timeline is not None:
        return None
    alike = replace(request.sampling, seed=0, count=1)
    return text.frames_in(request.seconds, RATE), alike, request.values.best_of, request.values.foot_lock


def at_once(request: JobRequest) -> bool:
    """Whether the motions of a request are drawn in the same network calls, rather than one after the other."""
    timeline = request.timeline
    return request.call is None and request.task != "duet" and timeline is not None and not timeline.readings


def draw_together(models: Models, requests: Sequence[JobRequest], progress: Progress) -> Iterator[tuple[int, Result]]:
    """`generate` for several requests of one `batch_key`: (index of the request, one of its motions).

    A motion depends on its prompt and its seed alone, up to the rounding of larger matrix products.
    """
    rows = [(index, number) for index, request in enumerate(requests) for number in range(request.count)]
    frames = text.frames_in(requests[0].seconds, models.prior.fps)
    values = requests[0].values
    made = text.sample_features(
        models.prior,
        [requests[index].prompt for index, _ in rows],
        [frames] * len(rows),
        seeds=[requests[index].seed + number for index, number in rows],
        best_of=values.best_of,
        sampling=requests[0].sampling,
        progress=progress,
    )
    for (index, number), features in zip(rows, made, strict=True):
        motion = text.finish(models.prior, features, foot_lock=values.foot_lock)
        drawn = Result(number, (motion,), requests[index].seed + number)
        yield from ((index, result) for result in _closed(models, requests[index], [drawn]))


def _composed(models: Models, request: JobRequest, progress: Progress) -> Iterator[Result]:
    timeline = request.timeline
    assert timeline is not None
    start = None if timeline.start is None else _loaded(timeline.start)
    made = long.compose_takes(
        models.prior,
        timeline.segments,
        start=start,
        path=timeline.path,
        foot_lock=request.values.foot_lock,
        sampling=request.sampling,
        progress=_moves(progress, request, len(timeline.segments), 0),
    )
    for number, motion in enumerate(made):
        yield Result(number, (motion,), request.seed + number, measured(motion, request.parts))


def _worded(models: Models, request: JobRequest, progress: Progress) -> Iterator[Result]:
    """A sentence with numbers that are kept."""
    assert request.timeline is not None
    asked = [request.timeline] * request.count
    lock = request.values.foot_lock
    made = draw_worded(models.prior, asked, foot_lock=lock, sampling=request.sampling, progress=progress)
    for number, one in enumerate(made):
        measures = {"amounts": [asdict(amount) for amount in one.amounts]}
        yield Result(number, (one.motion,), request.seed + number, measures, one.shortfalls)


def _controlled(models: Models, request: JobRequest, progress: Progress) -> Iterator[Result]:
    assert request.goal is not None
    made = control(
        models.prior,
        request.prompt,
        request.goal,
        fit=request.values.fit,
        foot_lock=request.values.foot_lock,
        sampling=request.sampling,
        progress=progress,
    )
    for number, one in enumerate(made):
        measures = measured(one.motion, request.parts) | {"missed": list(one.missed)}
        yield Result(number, (one.motion,), request.seed + number, measures, list(one.missed))


def _edited(models: Models, request: JobRequest, progress: Progress) -> Iterator[Result]:
    assert request.motion is not None
    values, people = request.values, request.motion.people
    changes = changes_asked(
        request.prompt,
        keep=values.keep,
        between=values.between,
        loop=values.loop,
        blend=values.blend,
        extend=values.extend,
        strength=values.strength,
    )
    own = people[values.person]
    made = edit(
        models.prior,
        own,
        request.prompt,
        changes,
        foot_lock=values.foot_lock,
        sampling=request.sampling,
        progress=progress,
    )
    for number, motion in enumerate(made):
        all_people = list(people)
        all_people[values.person] = motion
        yield Result(number, tuple(all_people if len(motion) == len(own) else [motion]), request.seed + number)


def _predicted(models: Models, request: JobRequest, progress: Progress) -> Iterator[Result]:
    assert request.motion is not None
    values = request.values
    made = predict(
        models.predictor,
        cropped(request.motion.people[values.person], values),
        seconds=values.seconds,
        root=values.root,
        foot_lock=values.foot_lock,
        sampling=values.sampling,
        progress=progress,
    )
    for number, motion in enumerate(made):
        yield Result(number, (motion,), request.seed)


def _switched(models: Models, request: JobRequest, progress: Progress) -> Iterator[Result]:
    assert request.motion is not None
    assert request.other is not None
    past, target = cropped(request.motion.people[0], request.values), request.other.people[0]
    if past.skeleton != target.skeleton:
        past, target = to_smpl22(past), to_smpl22(target)
    made = switch(
        models.predictor,
        past,
        target.resample(past.fps),
        seconds=request.values.seconds,
        facing=request.values.facing,
        foot_lock=request.values.foot_lock,
        sampling=request.values.sampling,
    )
    for number, motion in enumerate(made):
        yield Result(number, (motion,), request.seed)


def _duet(models: Models, request: JobRequest, progress: Progress) -> Iterator[Result]:
    if request.timeline is not None:
        yield from _composed_pair(models, request, progress)
        return
    values, prior, block = request.values, models.prior, models.block
    given: dict[str, Any] = {"sampling": request.sampling, "foot_lock": values.foot_lock, "progress": progress}
    if request.motion is None:
        goals = (None, request.goal) if values.person else (request.goal, None)
        made = pair.generate_pair(prior, block, request.prompt, seconds=request.seconds, goals=goals, **given)
    elif values.past is not None:
        first, second = request.motion.people
        made = pair.complete_pair(prior, block, (first, second), request.prompt, seconds=request.seconds, **given)
    else:
        made = duet.react(prior, block, request.motion.people[values.person], request.prompt, **given)
    for number, two in enumerate(made):
        measures = {} if request.goal is None else measured(two[values.person], request.parts)
        yield Result(number, tuple(two), request.seed, measures)


def _composed_pair(models: Models, request: JobRequest, progress: Progress) -> Iterator[Result]:
    timeline, person = request.timeline, request.values.person
    assert timeline is not None
    if timeline.start is not None:
        raise MotionloomError("two people do not go on from one 'start'; leave it out, or give 'past'")
    for number in range(request.count):
        blocks = list(
            duet.compose_pair(
                models.prior,
                models.block,
                timeline.segments,
                path=timeline.path,
                person=person,
                foot_lock=request.values.foot_lock,
                sampling=replace(request.sampling, seed=request.seed + number, count=1),
                progress=_moves(progress, request, len(timeline.segments), number),
            )
        )
        two = (concatenated(*[one for one, _ in blocks]), concatenated(*[other for _, other in blocks]))
        yield Result(number, two, request.seed + number, measured(two[person], request.parts))


_TASKS: dict[str, Callable[[Models, JobRequest, Progress], Iterator[Result]]] = {
    "generate": _worded,
    "control": _controlled,
    "edit": _edited,
    "predict": _predicted,
    "switch": _switched,
    "duet": _duet,
}


def _moves(progress: Progress, request: JobRequest, segments: int, number: int) -> Callable[[int], None]:
    """The progress of a long motion, which is counted in moves of rows."""
    steps = request.sampling.steps
    done = number * segments * steps

    def moved(more: int) -> None:
        nonlocal done
        done += more
        progress(done, request.count * segments * steps)

    return moved


def _loaded(path: Any) -> Motion:
    from motionloom.io import load

    return load(path)


def cropped(motion: Motion, values: Any) -> Motion:
    """The stretch of a motion that 'start' and 'end' name."""
    start, end = values.start, values.end
    if start is None and end is None:
        return motion
    return motion.crop(start or 0.0, min(motion.seconds, motion.seconds if end is None else end))


def measured(motion: Motion, parts: Iterable[tuple[str, Goal]]) -> dict[str, Any]:
    """How far a motion is from each part of its goal: mean and worst in centimetres, and when it is worst."""
    positions, found = None, {}
    for name, goal in parts:
        asked = goal.asked.any(axis=-1)
        if not asked.any() or len(goal) != len(motion):
            continue
        positions = motion.positions() if positions is None else positions
        away = np.linalg.norm(np.where(goal.asked, positions - goal.positions, 0.0), axis=-1)
        worst = int(away.max(axis=1).argmax())
        found[name] = {
            "mean_cm": round(100 * float(away[asked].mean()), 2),
            "worst_cm": round(100 * float(away.max()), 2),
            "worst_at": round(worst / motion.fps, 3),
        }
    return {"goals": found} if found else {}


def placed(request: JobRequest, poses: Array) -> Array:
    """Poses (people, frames, 22, 3) of `watching` in the world of the finished motion."""
    if request.goal is None:
        return poses
    place = start_of(request.goal)
    if request.task != "duet":
        return place.to_world(poses)
    return place.to_world(ground_pose(poses[request.values.person, 0]).from_world(poses))
