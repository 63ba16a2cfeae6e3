"""A `Request` to motions, by the functions that the command line calls; and where its poses stand while it is drawn."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.errors import MotionloomError
from motionloom.goals.goal import Goal, start_of
from motionloom.motion import Motion, ground_pose
from motionloom.retarget import to_smpl22
from motionloom.server.asking import Request
from motionloom.tasks import duet, long, pair, text
from motionloom.tasks.control import control
from motionloom.tasks.edit import changes_asked, edit
from motionloom.tasks.predict import predict, switch
from motionloom.tasks.sampling import Sampling
from motionloom.tasks.splice import concatenated
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


def draw(models: Models, request: Request, progress: Progress) -> Iterator[Result]:
    """The motions of a request, one after the other as they are finished."""
    if request.call is not None:
        return request.call(models, progress)
    if at_once(request):
        return _composed(models, request, progress)
    return _TASKS[request.task](models, request, progress)


def shared(request: Request) -> dict[str, Any]:
    """The options that every task has, as its function names them; those that are not asked are left out."""
    given = {"steps": request.steps, "guidance": request.guidance}
    return {name: value for name, value in given.items() if value is not None}


def batch_key(request: Request) -> tuple[Any, ...] | None:
    """Requests of one key may be drawn in one network call; None: this one is drawn alone."""
    if request.task != "generate" or request.timeline is not None or request.call is not None:
        return None
    return text.frames_in(request.options["seconds"], RATE), request.steps, request.guidance


def at_once(request: Request) -> bool:
    """Whether the motions of a request are drawn in the same network calls, rather than one after the other."""
    timeline = request.timeline
    return request.call is None and request.task != "duet" and timeline is not None and not timeline.readings


def draw_together(models: Models, requests: Sequence[Request], progress: Progress) -> Iterator[tuple[int, Result]]:
    """`generate` for several requests of one `batch_key`: (index of the request, one of its motions).

    A motion depends on its prompt and its seed alone, up to the rounding of larger matrix products.
    """
    rows = [(index, number) for index, request in enumerate(requests) for number in range(request.count)]
    frames = text.frames_in(requests[0].options["seconds"], models.prior.fps)
    made = text.sample_features(
        models.prior,
        [requests[index].options["prompt"] for index, _ in rows],
        [frames] * len(rows),
        seeds=[requests[index].seed + number for index, number in rows],
        progress=progress,
        **shared(requests[0]),
    )
    for (index, number), features in zip(rows, made, strict=True):
        motion = text.finish(models.prior, features)
        yield index, Result(number, (motion,), requests[index].seed + number)


def _composed(models: Models, request: Request, progress: Progress) -> Iterator[Result]:
    timeline = request.timeline
    assert timeline is not None
    start = None if timeline.start is None else _loaded(timeline.start)
    made = long.compose_takes(
        models.prior,
        timeline.segments,
        count=request.count,
        seed=request.seed,
        start=start,
        path=timeline.path,
        progress=_moves(progress, request, len(timeline.segments), 0),
        **shared(request),
    )
    for number, motion in enumerate(made):
        yield Result(number, (motion,), request.seed + number, measured(motion, request.parts))


def _worded(models: Models, request: Request, progress: Progress) -> Iterator[Result]:
    """A sentence with numbers that are kept."""
    assert request.timeline is not None
    sampling = Sampling.of(None, {"seed": request.seed} | shared(request))
    asked = [request.timeline] * request.count
    for number, one in enumerate(draw_worded(models.prior, asked, sampling=sampling, progress=progress)):
        measures = {"amounts": [asdict(amount) for amount in one.amounts]}
        yield Result(number, (one.motion,), request.seed + number, measures)


def _controlled(models: Models, request: Request, progress: Progress) -> Iterator[Result]:
    assert request.goal is not None
    made = control(
        models.prior,
        request.options["prompt"],
        request.goal,
        count=request.count,
        seed=request.seed,
        progress=progress,
        **shared(request),
    )
    for number, one in enumerate(made):
        measures = measured(one.motion, request.parts) | {"missed": list(one.missed)}
        yield Result(number, (one.motion,), request.seed + number, measures)


def _edited(models: Models, request: Request, progress: Progress) -> Iterator[Result]:
    assert request.motion is not None
    options, people = request.options, request.motion.people
    given = {name: options[name] for name in ("blend", "strength") if options[name] is not None}
    prompt = options["prompt"] or ""
    changes = changes_asked(
        prompt,
        keep=options["keep"],
        between=options["redraw"],
        loop=options["loop"],
        extend=options["extend"] or 0.0,
        **given,
    )
    made = edit(
        models.prior,
        people[options["person"]],
        prompt,
        changes,
        count=request.count,
        seed=request.seed,
        progress=progress,
        **shared(request),
    )
    for number, motion in enumerate(made):
        all_people = list(people)
        all_people[options["person"]] = motion
        whole = all_people if len(motion) == len(people[options["person"]]) else [motion]
        yield Result(number, tuple(whole), request.seed + number)


def _predicted(models: Models, request: Request, progress: Progress) -> Iterator[Result]:
    assert request.motion is not None
    options = request.options
    given = {"temperature": options["temperature"]} if options["temperature"] is not None else {}
    made = predict(
        models.predictor,
        cropped(request.motion.people[options["person"]], options),
        count=request.count,
        seconds=options["seconds"],
        seed=request.seed,
        progress=progress,
        **given,
        **shared(request),
    )
    for number, motion in enumerate(made):
        yield Result(number, (motion,), request.seed)


def _switched(models: Models, request: Request, progress: Progress) -> Iterator[Result]:
    assert request.motion is not None
    assert request.other is not None
    past, target = cropped(request.motion.people[0], request.options), request.other.people[0]
    if past.skeleton != target.skeleton:
        past, target = to_smpl22(past), to_smpl22(target)
    made = switch(
        models.predictor,
        past,
        target.resample(past.fps),
        count=request.count,
        seconds=request.options["seconds"],
        seed=request.seed,
        facing=request.options["facing"],
        **shared(request),
    )
    for number, motion in enumerate(made):
        yield Result(number, (motion,), request.seed)


def _duet(models: Models, request: Request, progress: Progress) -> Iterator[Result]:
    if request.timeline is not None:
        yield from _composed_pair(models, request, progress)
        return
    options, prior, block = request.options, models.prior, models.block
    given: dict[str, Any] = {"count": request.count, "seed": request.seed, "progress": progress} | shared(request)
    if options["together"] is not None:
        given["pair_guidance"] = options["together"]
    said = options["prompt"] or ""
    if request.motion is None:
        goals = (None, request.goal) if options["person"] else (request.goal, None)
        made = pair.generate_pair(prior, block, said, seconds=options["seconds"], goals=goals, **given)
    elif options["past"]:
        first, second = request.motion.people
        made = pair.complete_pair(prior, block, (first, second), said, seconds=options["seconds"], **given)
    else:
        made = duet.react(prior, block, request.motion.people[options["person"] or 0], said, **given)
    for number, two in enumerate(made):
        yield Result(number, tuple(two), request.seed, measured(two[options["person"] or 0], request.parts))


def _composed_pair(models: Models, request: Request, progress: Progress) -> Iterator[Result]:
    timeline, person = request.timeline, request.options["person"] or 0
    assert timeline is not None
    if timeline.start is not None:
        raise MotionloomError("two people do not go on from one 'start'; leave it out, or give 'past'")
    given = {} if request.options["together"] is None else {"pair_guidance": request.options["together"]}
    for number in range(request.count):
        moves = _moves(progress, request, len(timeline.segments), number)
        blocks = list(
            duet.compose_pair(
                models.prior,
                models.block,
                timeline.segments,
                seed=request.seed + number,
                path=timeline.path,
                person=person,
                progress=moves,
                **given,
                **shared(request),
            )
        )
        two = (concatenated(*[one for one, _ in blocks]), concatenated(*[other for _, other in blocks]))
        yield Result(number, two, request.seed + number, measured(two[person], request.parts))


_TASKS: dict[str, Callable[[Models, Request, Progress], Iterator[Result]]] = {
    "generate": _worded,
    "control": _controlled,
    "edit": _edited,
    "predict": _predicted,
    "switch": _switched,
    "duet": _duet,
}


def _moves(progress: Progress, request: Request, segments: int, number: int) -> Callable[[int], None]:
    """The progress of a long motion, which is counted in moves of rows."""
    steps = request.steps or text.STEPS
    done = number * segments * steps

    def moved(more: int) -> None:
        nonlocal done
        done += more
        progress(done, request.count * segments * steps)

    return moved


def _loaded(path: Any) -> Motion:
    from motionloom.io import load

    return load(path)


def cropped(motion: Motion, options: dict[str, Any]) -> Motion:
    """The stretch of a motion that 'start' and 'end' name."""
    start, end = options["start"], options["end"]
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


def placed(request: Request, poses: Array) -> Array:
    """Poses (people, frames, 22, 3) of `watching` in the world of the finished motion."""
    if request.goal is None:
        return poses
    place, person = start_of(request.goal), request.options["person"] or 0
    if request.task != "duet":
        return place.to_world(poses)
    return place.to_world(ground_pose(poses[person, 0]).from_world(poses))
