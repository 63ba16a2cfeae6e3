"""Every task by one function: `run` of a `Plan` gives results, one after the other, whichever interface requested it.

A door reads a request and what it names into a plan; `run` samples, puts the body together, and closes loops; the door
writes. Motions that are sampled in one network call are a group: those of a group that is finished stay where the next
one is interrupted.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from motionloom.core.features.layout import WIDTH
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.predictor import Predictor
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.goals.adapters import Applied
from motionloom.goals.expected import climbs
from motionloom.goals.goal import Goal
from motionloom.goals.hold import FixedJoints
from motionloom.goals.remarks import Remark
from motionloom.goals.segment import Segment
from motionloom.goals.timeline import Timeline, single_segment, with_goals_read
from motionloom.requests.sampling import BATCH
from motionloom.retarget import joints22
from motionloom.tasks import control, duet, edit, long, pair, predict, reattempts, redraw, text, worded
from motionloom.tasks.adapting import adapt, adapted_priors
from motionloom.tasks.sampling import Moves, Progress
from motionloom.tasks.supported import add_support, add_support_between, is_elevated, lowered, remarks_on_air
from motionloom.tasks.unplaced import compose_unplaced
from motionloom.tasks.watching import watching


@dataclass(eq=False)
class Models:
    """What samples, each loaded when it is first needed: a shipped name, a file, or what is loaded already."""

    weights: Any = "default"
    pair_weights: Any = "duet"
    predictor_weights: Any = "predictor"
    device: str = "cpu"
    adapters: Sequence[Applied] = ()
    """Of the prior."""

    @cached_property
    def prior(self) -> Prior:
        """The weights that generate one person from words."""
        if isinstance(self.weights, Prior):
            return self.weights
        return adapt(Prior.load(self.weights, device=self.device), self.adapters)

    def adapted(self, adapters: tuple[Applied, ...]) -> "Models":
        """The same with more adapters of the prior; errors as of `adapt`."""
        if not adapters:
            return self
        return Models(self._others(adapters), self.pair_weights, self.predictor_weights, self.device)

    @cached_property
    def _others(self) -> Callable[[tuple[Applied, ...]], Prior]:
        return adapted_priors(self.prior)

    @cached_property
    def block(self) -> PairBlock:
        """The block that generates two people with one prior."""
        weights = self.pair_weights
        return weights if isinstance(weights, PairBlock) else PairBlock.load(weights, self.prior)

    @cached_property
    def predictor(self) -> Predictor:
        """The weights that predict the next frames."""
        weights = self.predictor_weights
        return weights if isinstance(weights, Predictor) else Predictor.load(weights, device=self.device)


@dataclass(frozen=True, eq=False, kw_only=True)
class Plan:
    """A request of a task, with all the motions and files that it names."""

    task: str
    values: Any
    """The task's request."""
    sampling: Any
    """The request's `Sampling`, with the seed and guidance of its timeline."""
    seconds: float = 0.0
    """Length where no timeline, goal or motion has one."""
    timeline: Timeline | None = None
    start: Motion | None = None
    """What the timeline goes on from."""
    goals: tuple[Goal | None, Goal | None] = (None, None)
    """In the world: of one person, or of the first and the second."""
    adapters: control.Adapters = "none"
    """Networks that see the goals."""
    people: tuple[Motion, ...] = ()
    """The motion that is changed, gone on from or answered; all who are in it."""
    previous: tuple[Motion, Sequence[redraw.Block]] | None = None
    """A motion of an earlier timeline and what it was sampled from: blocks with the same words keep its frames."""
    target: Motion | None = None
    """What is switched to, on the skeleton and at the rate of the first of them; what an edit takes parts of."""
    hold: FixedJoints | None = None
    taught: tuple[Applied, ...] = ()
    """Adapters of the prior for these motions, besides those that the models have."""
    in_pieces: bool = False
    """Whether the one motion of a timeline comes piece by piece, as it is finished, and not as a loop."""

    @property
    def count(self) -> int:
        """Number of motions."""
        return self.sampling.number()

    @property
    def prompt(self) -> str:
        """The words of the request."""
        return getattr(self.values, "prompt", None) or ""


@dataclass(frozen=True, eq=False)
class Result:
    """One motion of a task."""

    people: tuple[Motion, ...]
    number: int = 0
    seed: int = 0
    measures: dict[str, Any] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    """What was missed, a sentence each."""
    aloft: list[str] = field(default_factory=list)
    """Those of them that say that somebody is in the air."""
    notes: list[Remark] = field(default_factory=list)
    """Those of them that are about the words of a block."""
    about: Any = None
    """The task's own result: `Worded` or `Controlled`."""
    blocks: Sequence[redraw.Block] = ()
    """What the blocks of a timeline were sampled from."""


def run(plan: Plan, models: Models, progress: Progress = lambda calls, of: None) -> Iterator[Result]:
    """The motions of a plan as they are finished, loops closed; progress: network calls, or windows, done and in all.

    Raises MotionloomError for an impossible request, as the functions of the tasks do.
    """
    models = models.adapted(plan.taught)
    task, size = (_compose, plan.count) if is_batched(plan) else _TASKS[plan.task]
    size = 1 if plan.timeline is not None and plan.task == "duet" else size
    own, first = plan.task in ("predict", "switch", "duet"), plan.sampling.first
    begin_s = 0.0
    for begin in range(0, plan.count, size):
        some = min(size, plan.count - begin)
        group = replace(plan, sampling=replace(plan.sampling, first=first + begin, count=some))
        moved = partial(_report_group, progress, begin, some, plan.count)
        for number, result in enumerate(task(group, models, moved), start=first + begin):
            seed = plan.sampling.seed + (0 if own else number)
            yield _finished(plan, models, replace(result, number=number, seed=seed), begin_s)
            begin_s += result.people[0].seconds if plan.in_pieces else 0.0


def run_each(
    plans: Sequence[Plan], models: Models, progress: Progress = lambda calls, of: None
) -> Iterator[tuple[int, Result]]:
    """The motions of several plans, sampled in the same network calls: (number of the plan, one of its motions).

    They are of `generate`, all with a timeline or all without one, or of `control` with one goal; of the same adapters,
    and of one sampling but for seeds and counts. A motion depends on its own plan alone, up to the rounding of larger
    matrix products.
    """
    models = models.adapted(plans[0].taught)
    for index, result in _run_rows(plans, models, progress):
        yield index, _finished(plans[index], models, result)


def _finished(plan: Plan, models: Models, result: Result, begin_s: float = 0.0) -> Result:
    """The result with its loop closed, and with a remark on whoever is in the air that nobody asked for.

    begin_s: seconds at which it begins, where it is a piece of the motion.
    """
    result = close_loop(plan, models, result)
    segments = plan.timeline.segments if plan.timeline else ()
    goals = [*plan.goals, *(segment.goal for segment in segments)]
    if any(goal is not None and goal.mask[..., 1].any() for goal in goals):
        return result
    lows = [float(np.percentile(joints22(one)[..., 1].min(axis=1), 5)) for one in plan.people]
    texts = [plan.prompt, *(segment.text for segment in segments)]
    aloft = remarks_on_air(result.people, texts, floor=max(lows, default=0.0), begin_s=begin_s)
    return replace(result, remarks=[*result.remarks, *aloft], aloft=aloft)


def is_batched(plan: Any) -> bool:
    """Whether the motions of a plan are sampled in the same network calls, rather than one after the other."""
    return plan.task in ("compose", "control") and plan.timeline is not None and not plan.timeline.readings


def _report_group(progress: Progress, begin: int, some: int, count: int, calls: int, of: int) -> None:
    """Report how far the whole is by how far a group is."""
    progress(begin * of + some * calls, count * of)


def close_loop(plan: Any, models: Models, result: Result) -> Result:
    """The motion as a loop, where the request is for one; an edit closes its own."""
    values = plan.values
    if plan.task == "edit" or plan.in_pieces or not getattr(values, "loop", False):
        return result
    prompt = plan.timeline.segments[-1].text if plan.timeline else plan.prompt
    prompt = "" if plan.task == "duet" else prompt
    settings: dict[str, Any] = {"guidance": plan.sampling.guidance} if prompt else {}
    settings |= {} if plan.task in ("predict", "switch") else {"steps": plan.sampling.steps}
    settings |= {"foot_lock": values.foot_lock, "seed": plan.sampling.seed + result.number}
    loop = edit.Loop(values.blend)
    with watching(lambda denoised: None):  # what is watched are the motions
        closed = [edit.edit(models.prior, one, prompt, loop, **settings) for one in result.people]
    return replace(result, people=tuple(motion for [motion] in closed))


def chain_progress(progress: Progress, steps: int, rows: int) -> Moves:
    """A callback for the moves of a chain of ``rows`` that reports them as progress."""
    moves = 0

    def moved(more: int) -> None:
        nonlocal moves
        moves += more
        progress(moves, rows * steps)

    return moved


# Each task: results of a group, without their numbers and seeds


def _compose(plan: Plan, models: Models, progress: Progress) -> Iterator[Result]:
    assert plan.timeline is not None
    segments, lock = long.load_segment_adapters(models.prior, plan.timeline.segments), plan.values.foot_lock
    if len(models.prior.mean) != WIDTH and plan.start is None and plan.timeline.path is None and plan.previous is None:
        moves = chain_progress(progress, plan.sampling.steps, plan.count * len(segments))
        made = compose_unplaced(models.prior, segments, foot_lock=lock, sampling=plan.sampling, progress=moves)
        return (Result((motion,)) for motion in made)
    if plan.timeline.path is None and not getattr(plan.values, "literal", True):
        segments = with_goals_read(segments)
    takes = [redraw.Timed(models.prior, segments, plan.timeline.path, one, lock) for one in plan.sampling.each()]
    progress = _Reported(progress)
    if (
        plan.previous is not None
        and plan.count == 1
        and not (_climbs(segments) or is_elevated(plan.previous[0]))
        and (runs := redraw.changed_runs(plan.previous[1], takes[0])) is not None
    ):
        moved = chain_progress(progress, plan.sampling.steps, sum(max(run.end - run.first, 1) for run in runs))
        motion = redraw.resample_runs(takes[0], *plan.previous, runs, moved)
        changed = [block for run in runs for block in range(run.first, run.end)]
        spans = redraw.sampled_frames(takes[0], plan.previous[1], runs)
        result = _held_to_words(plan, takes[0], motion, progress, changed, spans)
        return iter([replace(result, measures={"redrawn": changed})])
    motions = (long.compose_stream if plan.in_pieces else long.compose_takes)(
        models.prior,
        segments,
        start=plan.start,
        path=plan.timeline.path,
        foot_lock=lock,
        sampling=plan.sampling,
        progress=chain_progress(progress, plan.sampling.steps, plan.count * len(segments)),
    )
    if plan.in_pieces:
        return (Result((piece,)) for piece in motions)
    return (_held_to_words(plan, timed, motion, progress) for timed, motion in zip(takes, motions, strict=True))


def _climbs(segments: Sequence[Segment]) -> bool:
    return climbs(segment.text for segment in segments)


@dataclass(eq=False)
class _Reported:
    """Progress that can be repeated, by what is sampled again: whoever listens may cancel."""

    progress: Progress
    last: tuple[int, int] = 0, 1

    def __call__(self, calls: int, of: int) -> None:
        self.last = calls, of
        self.progress(calls, of)

    def repeat(self, moves: int) -> None:
        """Report again how far it was."""
        self.progress(*self.last)


def _held_to_words(
    plan: Plan,
    timed: redraw.Timed,
    motion: Motion,
    progress: _Reported,
    changed: Sequence[int] | None = None,
    spans: Sequence[tuple[int, int]] = (),
) -> Result:
    """The motion of a timeline, blocks that do not show their words sampled again, on the floor or on steps.

    changed, spans: the blocks and frames that were sampled, where not all were. A literal request, and what is longer
    than `reattempts.LONGEST`, stays as it was sampled; so does the height of people whose goals say heights.
    """
    blocks = range(len(timed.segments)) if changed is None else changed
    seconds = sum(timed.segments[i].seconds for i in blocks)
    if getattr(plan.values, "literal", True) or seconds > reattempts.LONGEST:
        on_floor = timed.foot_lock and plan.timeline and not plan.timeline.asks and not _climbs(timed.segments)
        return Result((lowered(motion) if on_floor else motion,), blocks=timed.blocks)
    found = reattempts.reattempt(timed, motion, blocks, start=plan.start, progress=progress.repeat)
    motion, notes = found.motion, found.notes(timed.segments)
    goals = [timed.path, *(segment.goal for segment in timed.segments)]
    if timed.foot_lock and not any(goal is not None and goal.mask[..., 1].any() for goal in goals):
        if changed is None:
            motion = add_support(motion, stairs=_climbs(timed.segments))
        else:
            motion = add_support_between(motion, spans)
    return Result((motion,), remarks=[one.line for one in notes], notes=notes, blocks=timed.blocks)


def _run_one(plan: Plan, models: Models, progress: Progress) -> Iterator[Result]:
    return (result for _, result in _run_rows([plan], models, progress))


def _run_rows(plans: Sequence[Plan], models: Models, progress: Progress) -> Iterator[tuple[int, Result]]:
    first, prior = plans[0], models.prior
    rows = [(index, number) for index, plan in enumerate(plans) for number in plan.sampling.numbers()]
    prompts, seeds = [plans[i].prompt for i, _ in rows], [plans[i].sampling.seed + number for i, number in rows]
    how: dict[str, Any] = {"seeds": seeds, "sampling": first.sampling, "progress": progress}
    results: Iterable[Result]
    if first.task == "control":
        goal, _ = first.goals
        assert goal is not None
        own: dict[str, Any] = {"adapters": first.adapters, "fit": first.values.fit}
        own["foot_lock"] = first.values.foot_lock
        controlled = control.control_each(prior, prompts, goal, **own, **how)
        results = (
            Result((one.motion,), measures={"missed": list(one.missed)}, remarks=list(one.missed), about=one)
            for one in controlled
        )
    elif first.timeline is not None or not first.values.as_one:
        timelines = [plans[i].timeline or single_segment(plans[i].prompt, plans[i].seconds) for i, _ in rows]
        attempts = 1 if first.values.as_one or first.values.literal else reattempts.ATTEMPTS
        how |= {"attempts": attempts, "foot_lock": first.values.foot_lock}
        results = map(_worded_result, worded.generate_timelines(prior, timelines, **how))
    else:
        frames = [text.frames_in(plans[i].seconds, prior.fps) for i, _ in rows]
        features = text.sample_features(prior, prompts, frames, padded=True, **how)
        results = (Result((text.finish(prior, one, foot_lock=first.values.foot_lock),)) for one in features)
    for (index, number), seed, result in zip(rows, seeds, results, strict=True):
        yield index, replace(result, number=number, seed=seed)


def _worded_result(one: worded.Worded) -> Result:
    amounts = [asdict(amount) for amount in one.amounts]
    return Result((one.motion,), measures={"amounts": amounts}, remarks=one.shortfalls, about=one)


def _edit(plan: Plan, models: Models, progress: Progress) -> Iterator[Result]:
    values, people = plan.values, list(plan.people)
    names = ("keep", "between", "loop", "blend", "extend", "strength", "smooth")
    own, options = people[values.person], {name: getattr(values, name) for name in names}
    look = None if values.look is None else np.asarray(values.look)
    if values.look_at is not None:
        look = joints22(people[values.look_at])[:, SMPL22.index("head")]
    changes = edit.changes_from_options(plan.prompt, source=plan.target, look=look, **options)
    how = {"foot_lock": values.foot_lock, "sampling": plan.sampling, "progress": progress}
    for motion in edit.edit(models.prior, own, plan.prompt, changes, **how):
        people[values.person] = motion
        yield Result(tuple(people) if len(motion) == len(own) else (motion,))


def _predict(plan: Plan, models: Models, progress: Progress) -> Iterable[Result]:
    values, past = plan.values, plan.people[0]
    how = {"seconds": values.seconds, "foot_lock": values.foot_lock, "sampling": plan.sampling}
    if plan.task == "switch":
        assert plan.target is not None
        motions = predict.switch(models.predictor, past, plan.target, facing=values.facing, **how)
    else:
        own: dict[str, Any] = {"hold": plan.hold, "root": values.root, "progress": progress}
        motions = predict.predict(models.predictor, past, **own, **how)
    return [Result((motion,)) for motion in motions]


def _duet(plan: Plan, models: Models, progress: Progress) -> Iterable[Result]:
    values, prior, block = plan.values, models.prior, models.block
    how: dict[str, Any] = {"sampling": plan.sampling, "foot_lock": values.foot_lock}
    if plan.timeline is not None:
        segments = long.load_segment_adapters(prior, plan.timeline.segments)
        moved = chain_progress(progress, plan.sampling.steps, len(segments))
        person = values.person
        paths = {"path": plan.timeline.path, "person": person, "other": plan.goals[1 - person]}
        duets = [duet.compose_pair(prior, block, segments, **paths, progress=moved, **how)]
    elif len(plan.people) == 2:
        first, second = plan.people
        duets = pair.complete_pair(
            prior, block, (first, second), plan.prompt, seconds=plan.seconds, progress=progress, **how
        )
    elif plan.people:
        duets = duet.react(prior, block, plan.people[0], plan.prompt, progress=progress, **how)
    else:
        duets = pair.generate_pair(
            prior, block, plan.prompt, seconds=plan.seconds, goals=plan.goals, progress=progress, **how
        )
    return [Result(tuple(two)) for two in duets]


_Task = Callable[[Plan, Models, Progress], Iterable[Result]]
ALL = 10_000
_TASKS: dict[str, tuple[_Task, int]] = {
    "generate": (_run_one, ALL),
    "control": (_run_one, BATCH),
    "edit": (_edit, 1),
    "predict": (_predict, 16),
    "switch": (_predict, 16),
    "duet": (_duet, pair.PAIRS),
}
"""The function of each task, and how many motions it samples together."""
