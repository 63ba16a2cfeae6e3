"""Rows to motions: what every process of a batch does, wherever it runs."""

import hashlib
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from motionloom.bulk.measures import Filter, Judge, Values, find_judge, in_one, measure, measure_two
from motionloom.bulk.on_robot import OnRobot, Save, check_format, on_robot
from motionloom.bulk.row import Order, Sources, hash_adapters, unexpected
from motionloom.core.errors import MotionloomError
from motionloom.core.models.container import PAIRS, weights_digest
from motionloom.core.models.prior import find_weights
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.goals.adapters import parse_adapter
from motionloom.goals.roles import prompts_of
from motionloom.io import load
from motionloom.requests.reading import build_request
from motionloom.requests.sampling import PairSampling, Sampling
from motionloom.requests.tasks import REQUESTS
from motionloom.retarget import RootMode, retarget, to_smpl22
from motionloom.retarget.hands import HandPose, pose_hands
from motionloom.tasks.control import Controlled, evaluate
from motionloom.tasks.run import Models, Plan, Result, run, run_each
from motionloom.tasks.text import GUIDANCE, SOLVER, STEPS, check, check_features

TOGETHER = {"cpu": 8, "cuda": 128}
"""Rows of a network call, by the kind of device."""
FORMATS = ("npz", "csv", "bvh", "glb", "webdataset", "parquet")


@dataclass(frozen=True)
class Options:
    """How the motions of a batch are generated, and what becomes of them; all of it plain values."""

    weights: str = "default"
    """A shipped name or a file."""
    adapters: Sequence[str] = ()
    """What was taught from clips: ``FILE`` or ``FILE:FACTOR``, see `motionloom.goals.adapters.parse_adapter`."""
    pair_weights: str = "duet"
    """The weights for two people: a shipped name or a file."""
    pair_guidance: float = 1.0
    """How firmly two people keep to where that wants them, 0 to 1."""
    device: str = "cpu"
    """Where the network computes: cpu or cuda."""
    best_of: int = 1
    """Seeds that are tried for each motion of a prompt, of rows without it."""
    steps: int = STEPS
    guidance: float = GUIDANCE
    solver: str = SOLVER
    raw: bool = False
    """Leave the feet as the network generated them."""
    loop: float | None = None
    """Seconds at the end of each motion that are sampled anew, so that its beginning can follow; None: it ends as it
    will."""
    fps: float | None = None
    """Frames per second of the files; None: the weights' own."""
    seconds: float = 5.0
    """Length of rows without one."""
    seed: int = 0
    """Seed of rows without one."""
    skeleton: str | None = None
    """A file with the skeleton of rows that name none; None: the 22-joint person."""
    hands: HandPose = "as-is"
    """Pose of the hands; a row whose skeleton has no fingers then fails."""
    root: RootMode | None = None
    """What carries the way on skeletons with a root bone; None: as `motionloom.retarget.retarget` does."""
    robot: str | None = None
    """A robot's model, onto which motions of rows go that name none and no skeleton; None: no robot."""
    robot_map: str | None = None
    max_speed: float | None = None
    """Radians per second that no joint of a robot exceeds, of rows without it."""
    avoid_collisions: bool = False
    format: str = "npz"
    """One of `FORMATS`."""
    shard_rows: int | None = None
    """Rows of a shard, up to `motionloom.bulk.jobs.MOST`; None: as suits the job's size."""
    unit: float = 1.0
    """Metres per unit of BVH files."""
    literal: bool = False
    """Leave numbers in prompts to the network."""
    filter: str | None = None
    """See `motionloom.bulk.measures.Filter`; motions that do not pass are dropped."""
    judge: str | None = None
    """``module:function`` that decides whether a motion obeys its prompt; see `motionloom.bulk.measures.Judge`."""

    def of_motions(self, weights: str) -> dict[str, Any]:
        """What determines every motion of the batch; ``weights``: `hash_weights`."""
        later = {
            "hands": (self.hands, "as-is"),
            "root": (self.root, None),
            "unit": (self.unit, 1.0),
            "literal": (self.literal, False),
            "loop": (self.loop, None),
        }  # left out as they always were: old ids hold
        return {name: value for name, (value, usual) in later.items() if value != usual} | {
            "weights": weights,
            "steps": self.steps,
            "guidance": self.guidance,
            "solver": self.solver,
            "raw": self.raw,
            "fps": self.fps,
        }

    def of_robots(self) -> dict[str, Any]:
        """What no joint of a robot exceeds, and whether its parts are kept apart, of rows without it."""
        return {"max_speed": self.max_speed, "avoid_collisions": self.avoid_collisions}

    def on_robot(self) -> OnRobot | None:
        """The job's robot; raises `MotionloomError` as `motionloom.bulk.on_robot.on_robot` does."""
        if self.robot is None:
            return None
        return on_robot(Path(self.robot), None if self.robot_map is None else Path(self.robot_map))

    def of_duets(self) -> dict[str, Any]:
        """What else determines motions of two people; raises `MotionloomError` for a file that is not there."""
        return {"weights": weights_digest(PAIRS.find(self.pair_weights)), "guidance": self.pair_guidance}


@dataclass(frozen=True, eq=False)
class Made:
    """The motion of a row."""

    people: tuple[Motion, ...]
    """One person, or two in one world."""
    measured: tuple[Values, ...]
    """`motionloom.bulk.measures.MEANING` of each 22-joint person, before it came onto another skeleton; and `ROBOT`."""
    angles: tuple[Save, ...] = ()
    """What writes the joint angles of each, where they are a robot."""

    @property
    def motion(self) -> Motion:
        """The first person's."""
        return self.people[0]

    @property
    def measures(self) -> dict[str, float | bool | None]:
        """Of everybody, as `motionloom.bulk.measures.in_one` calls them."""
        return in_one(self.measured)

    def passes(self, condition: Filter | None) -> bool:
        """Whether everybody in it meets the condition."""
        return condition is None or all(condition.holds(one) for one in self.measured)


def hash_weights(options: Options) -> str:
    """SHA-256 of the weights' file; with adapters a hash of that, of their files and of their factors.

    Raises `MotionloomError` for an adapter that is no file.
    """
    digest = weights_digest(find_weights(options.weights))
    if not options.adapters:
        return digest
    hashes = [digest, *hash_adapters([parse_adapter(one) for one in options.adapters])]
    return hashlib.sha256("\n".join(hashes).encode()).hexdigest()


class Maker:
    """A prior that is ready to generate rows, and its settings.

    ``weights``, ``pair``: what `hash_weights` and `Options.of_duets` must give, where that is known beforehand.
    Raises `MotionloomError` for options that no motion can be generated with.
    """

    def __init__(
        self, options: Options, *, folder: Path, weights: str | None = None, pair: dict[str, Any] | None = None
    ) -> None:
        path, digest, duets = find_weights(options.weights), hash_weights(options), options.of_duets()
        if weights is not None and digest != weights:
            which = f"{path} or an adapter" if options.adapters else str(path)
            raise MotionloomError(f"{which} differs from what this batch is made with; use the same files")
        if pair is not None and duets != pair:
            which = PAIRS.find(options.pair_weights)
            raise MotionloomError(f"{which} differs from what this batch is made with; use the same file")
        self.options = options
        adapters = [parse_adapter(one) for one in options.adapters]
        self.models = Models(path, options.pair_weights, device=options.device, adapters=adapters)
        self.prior = self.models.prior
        check(self.prior, [], steps=options.steps, guidance=options.guidance, solver=options.solver)
        check_features(self.prior)
        self.sources = Sources(
            folder,
            options.of_motions(digest),
            pair=duets,
            fps=self.prior.fps,
            seconds=options.seconds,
            seed=options.seed,
            skeleton=options.skeleton,
            literal=options.literal,
            best_of=options.best_of,
            robot=options.on_robot(),
            limits=options.of_robots(),
        )
        self.judge: Judge | None = find_judge(options.judge) if options.judge else None
        self.together = TOGETHER.get(options.device.partition(":")[0], TOGETHER["cpu"])

    def make(
        self, todo: Sequence[Order], *, begin: Callable[[Order], None] | None = None
    ) -> Iterator[tuple[Order, Made | str]]:
        """Each row with its motion, or with a sentence that says why there is none; rows of like lengths first.

        begin: called before each row, which is then sampled alone. Rows that fail together are tried alone.
        """
        for rows in self._shared(todo, alone=begin is not None):
            if begin is not None:
                begin(rows[0])
            yield from self._try(rows)

    def _shared(self, todo: Sequence[Order], *, alone: bool) -> Iterator[list[Order]]:
        """Rows that are sampled together."""
        together = 1 if alone else self.together
        same: dict[Any, list[Order]] = {}
        for one in sorted(todo, key=lambda one: -one.frames):
            if one.row.task == "generate" and one.timeline is None:
                same.setdefault((-(-one.frames // self.prior.net.config.patch), one.best_of), []).append(one)
        for one in todo:
            if one.row.task == "control":
                same.setdefault((id(one.goal), one.best_of, "control"), []).append(one)
        for rows in same.values():
            yield from (rows[at : at + together] for at in range(0, len(rows), together))
        yield from ([one] for one in todo if one.row.task in ("duet", "export") or one.timeline is not None)

    def _try(self, rows: list[Order]) -> Iterator[tuple[Order, Made | str]]:
        try:
            results: list[tuple[Order, Made | str]] = list(zip(rows, self._make_all(rows), strict=True))
        except MotionloomError as error:
            results = [(rows[0], str(error))]
        except Exception as error:  # a row that breaks the program breaks itself alone
            results = [(rows[0], str(unexpected(error, "it could not be made")))]
        if len(results) == len(rows):
            yield from results
            return
        for row in rows:
            yield from self._try([row])

    def _make_all(self, rows: list[Order]) -> list[Made]:
        for one in rows:
            check_format(self.options.format, robot=one.robot is not None)
        first = rows[0]
        if first.clip is not None:  # a recording as it is
            motion = load(first.clip)
            person = motion if motion.skeleton == SMPL22 else to_smpl22(motion)
            return [self._finished(first, [motion], [measure(person, first.text, self.judge)])]
        if first.row.task in ("control", "compose") and self.options.solver != SOLVER:
            raise MotionloomError(f"the task {first.row.task} is made with the solver {SOLVER}")
        if first.row.task == "duet":
            return [self._duet(first)]
        if first.timeline is not None:
            [result] = run(self._plan(first), self.models)
            _warn(first, result)
            keeps = {} if result.about is None else {"keeps": all(one.kept for one in result.about.amounts)}
            return [self._measured(first, result.people[0], **keeps)]
        results = [one for _, one in run_each([self._plan(one) for one in rows], self.models)]
        for one, result in zip(rows, results, strict=True):
            _warn(one, result)
        return [
            self._measured(one, result.people[0], **_misses(result.about))
            for one, result in zip(rows, results, strict=True)
        ]

    def _plan(self, order: Order) -> Plan:
        options, row, timeline = self.options, order.row, order.timeline
        task = row.task or "generate"
        task = "compose" if task == "generate" and timeline is not None and not timeline.readings else task
        goals = (None, order.goal) if row.whom else (order.goal, None)
        values = {
            "prompt": row.prompt,
            "as_one": (task == "generate" and timeline is None) or None,
            "foot_lock": not options.raw,
            "loop": options.loop is not None,
            "blend": options.loop,
            "person": row.whom,
            "timeline": timeline,
            "goals": order.goal,
            "literal": task == "compose" or None,
        }
        sampling: Any = self._sampling(order, timeline and timeline.guidance)
        if task == "duet":
            sampling = PairSampling(**vars(sampling), pair_guidance=options.pair_guidance)
        return Plan(
            task=task,
            values=build_request(REQUESTS[task], {name: value for name, value in values.items() if value is not None}),
            sampling=sampling,
            seconds=order.frames / self.prior.fps,
            timeline=timeline,
            start=order.start,
            goals=goals,
        )

    def _sampling(self, order: Order, guidance: float | None = None) -> Sampling:
        """How a row is sampled; guidance: of its timeline."""
        options = self.options
        return Sampling(
            steps=options.steps,
            guidance=options.guidance if guidance is None else guidance,
            solver=options.solver,
            seed=order.seed,
            best_of=order.best_of,
            batch_size=self.together if order.timeline is None and order.row.task != "duet" else None,
        )

    def _duet(self, order: Order) -> Made:
        """Two people, one pair at a time: what is sampled beside it would change the last bits."""
        texts = (order.text, order.text) if order.timeline else prompts_of(order.row.words)
        [result] = run(self._plan(order), self.models)
        _warn(order, result)
        duet = result.people[0], result.people[1]
        measured = measure_two(duet, texts, self.judge)
        if order.goal is not None:
            person = order.row.whom
            measured[person] |= _misses(evaluate(duet[person], duet[person], order.goal))
        return self._finished(order, duet, measured)

    def _measured(self, order: Order, motion: Motion, **measured: float) -> Made:
        return self._finished(order, [motion], [{**measure(motion, order.text, self.judge), **measured}])

    def _finished(self, order: Order, people: Sequence[Motion], measured: Sequence[Values]) -> Made:
        if order.robot is not None:
            if self.options.hands != "as-is":
                raise MotionloomError("--hands poses fingers of a skeleton; leave it out with a robot")
            clips = [order.robot.adapt(motion, self.options.fps) for motion in people]
            measured = [{**own, **figures} for own, (_, figures, _) in zip(measured, clips, strict=True)]
            return Made(tuple(one for one, _, _ in clips), tuple(measured), tuple(save for _, _, save in clips))
        if order.target is not None:
            people = [retarget(motion, order.target, root=self.options.root) for motion in people]
        people = [pose_hands(motion, self.options.hands) for motion in people]
        if self.options.fps is not None:
            people = [motion.resample(self.options.fps) for motion in people]
        return Made(tuple(people), tuple(measured))


def _warn(order: Order, result: Result) -> None:
    for line in result.aloft:
        warnings.warn(f"{order.id}: {line}", stacklevel=2)


def _misses(controlled: Controlled | None) -> dict[str, float]:
    """How far a motion is from its goal, in metres; nothing where there is none."""
    return {} if controlled is None else {"error": round(controlled.error, 4), "worst": round(controlled.worst, 4)}
