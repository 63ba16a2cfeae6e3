"""DoubleTake: one long motion from many prompts, by two passes over rows that share their ends.

Shafir et al., "Human Motion Diffusion as a Generative Prior" (PriorMDM), 2024, section 3.1. All intervals are rows of
one batch. First take: neighbouring rows are averaged over a handshake after every step, equation 2,

    tau_i = (1 - a) S_{i-1}[-h:] + a S_i[:h],    a_j = j / h

Second take: every transition, with the middles of both its intervals (S_i, tau_i, S_{i+1}), is noised again to T' and
refined, held to the first take by a keep weight per frame (1 - M, ramps of b frames between M_soft and M_hard).

Two modes, both presets of `Keep`: ``published`` gives what the released code gives (keep the handshake, refine only
the ramps, restart at 900 of 1000, padding attended); ``paper`` what the paper describes. States are (repetitions *
intervals, frames, features). What is above `double_take_features` is plain arrays over any denoiser.
`motionloom.tasks.long` is the better default.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Literal, TypedDict, Unpack

import numpy as np

from motionloom.core.defaults import GUIDANCE, LARGEST_SEED, SOLVER, SPACING
from motionloom.core.diffusion import (
    DDPM,
    SOLVERS,
    Constraint,
    Denoiser,
    NoiseSource,
    Schedule,
    Solver,
    State,
    chain,
    handshake,
    inpaint,
    levels,
    restart,
    row_noise,
    run,
)
from motionloom.core.errors import MotionloomError
from motionloom.core.methods.text import guided
from motionloom.core.models.prior import Prior

HANDSHAKE = 20
"""Frames: one second of HumanML3D."""
LEAST_MIDDLE = 10
"""Frames of an interval that neither a handshake nor a ramp may touch."""
LONGEST_CLIP = 196
"""Frames of the longest motion in HumanML3D: more in one interval than any prior trained on it saw."""
LONGEST_ROW, MOST_FRAMES = 2000, 200_000


@dataclass(frozen=True)
class Keep:
    """How much of the first take each frame of a sandwich keeps in the second, 1: all of it."""

    outside: float
    high: float
    """At the end of the ramp that is away from the handshake."""
    low: float
    """Where the ramp would reach the handshake."""
    handshake: float
    sampling: Literal["even", "published"] = "even"
    """At distance d = 1 .. b from the handshake: d / b; ``published``: right (d - 1) / b, and nothing where b < 2."""

    def ramp(self, frames: int, side: Literal["left", "right"]) -> np.ndarray:
        """(frames,) weights by growing distance from the handshake."""
        if self.sampling == "published" and frames < 2:
            return np.full(frames, self.outside, np.float32)
        late = self.sampling == "published" and side == "right"
        distance = np.arange(frames, dtype=np.float32) + (0 if late else 1)
        return self.low + (self.high - self.low) * distance / max(frames, 1)


@dataclass(frozen=True)
class Mode:
    """Everything in which the released code and the paper differ."""

    keep: Keep
    ramp: int
    """Frames, by default."""
    restart: float
    """Share of the levels from which the second take starts."""
    masked: bool
    """Whether attention leaves out frames behind a row's end."""


MODES: dict[str, Mode] = {
    "published": Mode(Keep(1.0, 0.85, 0.0, 1.0, "published"), ramp=20, restart=0.9, masked=False),
    "paper": Mode(Keep(1.0, 0.85, 0.1, 0.1), ramp=10, restart=0.7, masked=True),
}


@dataclass(frozen=True)
class Plan:
    """Which frames belong to what; MotionloomError where lengths, handshakes and ramps do not fit each other."""

    lengths: tuple[int, ...]
    """Frames of each interval, both its handshakes included."""
    handshakes: tuple[int, ...]
    """Frames that interval i shares with interval i + 1."""
    ramps: tuple[int, ...]
    """Frames on either side of handshake i that the second take may change."""
    repetitions: int = 1

    def __post_init__(self) -> None:
        count = len(self.lengths)
        if count < 1 or self.repetitions < 1:
            raise MotionloomError(f"there is nothing to make: {count} intervals, {self.repetitions} repetitions")
        if len(self.handshakes) != count - 1 or len(self.ramps) != count - 1:
            raise MotionloomError(
                f"{count} intervals have {count - 1} transitions; got {len(self.handshakes)} handshakes and "
                f"{len(self.ramps)} ramps: give one number, or one per transition"
            )
        if any(h < 1 for h in self.handshakes) or any(b < 0 for b in self.ramps):
            raise MotionloomError("a handshake has at least one frame and a ramp none or more; ask for such numbers")
        for row, length in enumerate(self.lengths):
            if length < self.least(row):
                raise MotionloomError(
                    f"interval {row + 1} has {length} frames and needs {self.least(row)} for its handshakes, ramps and "
                    f"{LEAST_MIDDLE} frames between them; make it longer, or the handshakes or ramps shorter"
                )
        if max(self.lengths) > LONGEST_ROW or sum(self.lengths) * self.repetitions > MOST_FRAMES:
            raise MotionloomError(
                f"an interval has at most {LONGEST_ROW} frames and all together at most {MOST_FRAMES}; got "
                f"{max(self.lengths)} and {sum(self.lengths) * self.repetitions}: ask for fewer or shorter intervals"
            )

    @staticmethod
    def of(
        lengths: Sequence[int],
        handshake: int | Sequence[int] = HANDSHAKE,
        ramp: int | Sequence[int] = 10,
        *,
        repetitions: int = 1,
    ) -> "Plan":
        """With one handshake and ramp for all transitions, or one for each."""
        several = [
            (value,) * (len(lengths) - 1) if isinstance(value, int) else tuple(value) for value in (handshake, ramp)
        ]
        return Plan(tuple(lengths), several[0], several[1], repetitions)

    def least(self, row: int) -> int:
        """Frames that a row needs; an end without a neighbour counts like the other end, as published."""
        if not self.handshakes:
            return 1
        before, after = max(row - 1, 0), min(row, len(self.handshakes) - 1)
        ends = self.handshakes[before] + self.handshakes[after] + self.ramps[before] + self.ramps[after]
        return ends + LEAST_MIDDLE

    def middle(self, row: int) -> slice:
        """The frames of a row without its handshakes (the first and the last row lose theirs at both ends too)."""
        shared = self.handshakes or (0,)
        return slice(shared[max(row - 1, 0)], self.lengths[row] - shared[min(row, len(shared) - 1)])

    def size(self, row: int) -> int:
        """Frames of `middle`."""
        part = self.middle(row)
        return part.stop - part.start

    @property
    def sandwiches(self) -> tuple[int, ...]:
        """Frames of middle, handshake and middle of each transition."""
        return tuple(self.size(i) + h + self.size(i + 1) for i, h in enumerate(self.handshakes))

    @property
    def width(self) -> int:
        """Frames of the padded sandwiches: 2 (Lmax - 2h) + h for one handshake h, as published."""
        return 2 * max(map(self.size, range(len(self.lengths)))) + max(self.handshakes, default=0)

    @property
    def ends(self) -> list[int]:
        """Where each interval ends in the long motion; transition i has the frames ``ends[i] - h .. ends[i]``."""
        parts = [self.lengths[0], *(n - h for n, h in zip(self.lengths[1:], self.handshakes, strict=True))]
        return list(accumulate(parts))

    def split(self, x: np.ndarray) -> np.ndarray:
        """(repetitions * rows, ...) as (repetitions, rows, ...)."""
        return x.reshape(self.repetitions, -1, *x.shape[1:])


@dataclass(frozen=True, eq=False)
class Takes:
    """All intermediate results; states as described above, transitions in place of intervals."""

    first: State
    sandwich: State
    keep: np.ndarray
    """(transitions, width)"""
    second: State
    rebuilt: State
    unfolded: np.ndarray
    """(repetitions, frames of the long motion, features)"""


def flags(plan: Plan) -> np.ndarray:
    """(rows, longest) integers: 1 on frames that a row shares with another, for networks conditioned on it."""
    marks = np.zeros((len(plan.lengths), max(plan.lengths)), np.int64)
    for i, h in enumerate(plan.handshakes):
        marks[i, plan.lengths[i] - h : plan.lengths[i]] = 1
        marks[i + 1, :h] = 1
    return np.tile(marks, (plan.repetitions, 1))


def handshakes(plan: Plan) -> Constraint:
    """`diffusion.handshake` with a length of its own for every transition, within each repetition."""
    joins = [handshake(plan.lengths[i : i + 2], h) for i, h in enumerate(plan.handshakes)]

    def joined(x: State, level: int) -> State:
        x = np.ascontiguousarray(x).copy()
        for rows in plan.split(x):
            for i, join in enumerate(joins):
                rows[i : i + 2] = join(rows[i : i + 2], level)
        return x

    return joined


def first_take(
    denoise: Denoiser,
    x: State,
    plan: Plan,
    *,
    way: Sequence[int],
    schedule: Schedule,
    noise: NoiseSource,
    solver: Solver = DDPM,
    join: bool = True,
) -> State:
    """Noise at ``way[0]`` to intervals with shared ends; ``join=False`` leaves them alone (second take only)."""
    constrain = handshakes(plan) if join and plan.handshakes else chain()
    return run(denoise, x, levels=way, solver=solver, schedule=schedule, noise=noise, constrain=constrain)


def sandwiches(x: State, plan: Plan) -> State:
    """Middle, handshake (as it ends the earlier row) and middle of each transition, padded with zeros to `width`."""
    rows = plan.split(x)
    result = np.zeros((plan.repetitions, len(plan.handshakes), plan.width, x.shape[2]), x.dtype)
    for i, h in enumerate(plan.handshakes):
        end = plan.lengths[i]
        parts = [rows[:, i, plan.middle(i)], rows[:, i, end - h : end], rows[:, i + 1, plan.middle(i + 1)]]
        result[:, i, : plan.sandwiches[i]] = np.concatenate(parts, axis=1)
    return result.reshape(-1, *result.shape[2:])


def keep_weights(plan: Plan, keep: Keep) -> np.ndarray:
    """(transitions, width): the share of the first take that each frame of a sandwich keeps; 1 on padding."""
    result = np.ones((len(plan.handshakes), plan.width), np.float32)
    for i, (h, b) in enumerate(zip(plan.handshakes, plan.ramps, strict=True)):
        start = plan.size(i)
        result[i, : plan.sandwiches[i]] = keep.outside
        result[i, start - b : start] = keep.ramp(b, "left")[::-1]
        result[i, start : start + h] = keep.handshake
        result[i, start + h : start + h + b] = keep.ramp(b, "right")
    return result


def second_take(
    denoise: Denoiser,
    sandwich: State,
    weights: np.ndarray,
    *,
    way: Sequence[int],
    schedule: Schedule,
    noise: NoiseSource,
    solver: Solver = DDPM,
) -> State:
    """Sandwiches noised to ``way[0]`` and refined, the estimate held to them by ``weights`` (transitions, frames)."""
    repetitions = len(sandwich) // len(weights)
    mask = np.tile(weights.astype(sandwich.dtype), (repetitions, 1))[..., None]
    x = restart(sandwich, schedule, way[0], noise)
    held = inpaint(denoise, sandwich, mask)
    return run(held, x, levels=way, solver=solver, schedule=schedule, noise=noise)


def rebuild(first: State, second: State, plan: Plan) -> State:
    """The first take with handshakes and ramps out of the second; zeros behind each row's end."""
    result = np.zeros_like(first)
    rows, old, new = plan.split(result), plan.split(first), plan.split(second)
    for i, length in enumerate(plan.lengths):
        rows[:, i, :length] = old[:, i, :length]
    for i, (h, b) in enumerate(zip(plan.handshakes, plan.ramps, strict=True)):
        start, end = plan.size(i), plan.lengths[i]
        rows[:, i, end - h - b : end] = new[:, i, start - b : start + h]
        rows[:, i + 1, : h + b] = new[:, i, start : start + h + b]
    return result


def unfold(x: State, plan: Plan) -> np.ndarray:
    """(repetitions, frames, features): row 0 whole, of every further row what lies behind its first handshake."""
    rows = plan.split(x)
    starts = (0, *plan.handshakes)
    parts = [rows[:, i, start:length] for i, (start, length) in enumerate(zip(starts, plan.lengths, strict=True))]
    return np.concatenate(parts, axis=1)


def restarted(way: Sequence[int], schedule: Schedule, share: float) -> list[int]:
    """The end of a walk, from its noisiest level that is not above ``share`` of all levels."""
    return [level for level in way if level <= round(share * schedule.steps)]


class TakeOptions(TypedDict, total=False):
    """Options of `double_take`."""

    solver: Solver
    """Ancestral sampling as published."""
    second_take_only: bool


def double_take(
    first: Denoiser,
    second: Denoiser,
    x: State,
    plan: Plan,
    *,
    mode: Mode,
    way: Sequence[int],
    schedule: Schedule,
    noise: tuple[NoiseSource, NoiseSource],
    **options: Unpack[TakeOptions],
) -> Takes:
    """Both takes; one interval is sampled as ever and has no second take.

    ``first`` has the texts of the rows, ``second`` none; each is bound to the lengths it should know. ``x``: noise
    (repetitions * intervals, longest interval, features) at ``way[0]``. ``noise``: for either take.
    """
    solver, alone = options.get("solver", DDPM), options.get("second_take_only", False)
    take = first_take(first, x, plan, way=way, schedule=schedule, noise=noise[0], solver=solver, join=not alone)
    if not plan.handshakes:
        none = np.zeros((0, 0, take.shape[2]), take.dtype)
        return Takes(take, none, np.zeros((0, 0), take.dtype), none, take, unfold(take, plan))
    inside, weights = sandwiches(take, plan), keep_weights(plan, mode.keep)
    later = restarted(way, schedule, mode.restart)
    refined = second_take(second, inside, weights, way=later, schedule=schedule, noise=noise[1], solver=solver)
    rebuilt = rebuild(take, refined, plan)
    return Takes(take, inside, weights, refined, rebuilt, unfold(rebuilt, plan))


class TakeSettings(TypedDict, total=False):
    """How `double_take_features` samples."""

    steps: int
    """Of the first take (1000); the second restarts at the nearest level at or below the mode's."""
    guidance: float
    solver: str
    spacing: str
    first_take_only: bool
    second_take_only: bool
    soft: float
    """M_soft, 0 to 1: what the ramp keeps beside the handshake; in the paper's mode the handshake keeps as much."""
    hard: float
    """M_hard, 0 to 1: what the ramp keeps at its other end."""
    restart: float
    """T', where the second take starts: a share of all levels, above 0."""


def adjusted(mode: str, *, soft: float | None = None, hard: float | None = None, restart: float | None = None) -> Mode:
    """A mode with another M_soft, M_hard or T' (None: the mode's own), see `TakeSettings`.

    Raises MotionloomError for an unknown mode and for shares that are none.
    """
    if mode not in MODES:
        raise MotionloomError(f"DoubleTake has no mode {mode!r}; there are {', '.join(MODES)}")
    chosen = MODES[mode]
    for name, share in {"soft": soft, "hard": hard, "restart": restart}.items():
        if share is not None and not (0 <= share <= 1 and (share or name != "restart")):  # NaN too
            raise MotionloomError(f"DoubleTake's {name} is a share from 0 to 1, restart above 0; got {share:g}")
    keep = chosen.keep
    low = keep.low if soft is None else soft
    joined = low if keep.handshake == keep.low else keep.handshake
    keep = replace(keep, low=low, handshake=joined, high=keep.high if hard is None else hard)
    return replace(chosen, keep=keep, restart=chosen.restart if restart is None else restart)


def rows_of(frames: Sequence[int], handshake: int) -> list[int]:
    """Row lengths of DoubleTake whose unfolded frames and seams are those of the visible ``frames``."""
    half, rest = handshake // 2, handshake - handshake // 2
    return [n + half * (i > 0) + rest * (i < len(frames) - 1) for i, n in enumerate(frames)]


def double_take_features(
    prior: Prior,
    prompts: Sequence[str],
    frames: Sequence[int],
    *,
    mode: Literal["published", "paper"] = "published",
    handshake: int | Sequence[int] = HANDSHAKE,
    ramp: int | Sequence[int] | None = None,
    seed: int = 0,
    **settings: Unpack[TakeSettings],
) -> tuple[np.ndarray, list[int]]:
    """One long motion. The second take's text is empty, and evaluated once per step.

    Args:
        prior: the weights.
        prompts: one per interval.
        frames: of each interval, its handshakes included, so that the motion has ``sum(frames) - sum(handshakes)``; an
            interval needs two handshakes, two ramps and 10 frames.
        mode: published code or paper.
        handshake: frames, one number or one per transition.
        ramp: the same; None takes the mode's own (20 published, 10 paper).
        settings: see `TakeSettings`; of M_soft, M_hard and T' the mode's own where none is named.

    Returns:
        Features (frames, numbers of the prior), not standardised, and where each interval ends (`Plan.ends`).

    Raises:
        MotionloomError: for requests that cannot be met.
    """
    steps, guidance = settings.get("steps", 1000), settings.get("guidance", GUIDANCE)
    solver, spacing = settings.get("solver", SOLVER), settings.get("spacing", SPACING)
    first_take_only = settings.get("first_take_only", False)
    second_take_only = settings.get("second_take_only", False)
    chosen = adjusted(mode, soft=settings.get("soft"), hard=settings.get("hard"), restart=settings.get("restart"))
    if steps not in range(1, prior.schedule.steps + 1) or solver not in SOLVERS:
        raise MotionloomError(
            f"{steps} steps of {solver!r} cannot be taken; there are 1 to {prior.schedule.steps} steps and the solvers "
            f"{', '.join(SOLVERS)}"
        )
    plan = Plan.of(list(frames), handshake, chosen.ramp if ramp is None else ramp)
    _check(prompts, plan, seed=seed, guidance=guidance, neither=first_take_only and second_take_only)
    count, joins = len(prompts), len(plan.handshakes)
    seeds = [int(word) for word in np.random.SeedSequence(seed).generate_state(count + joins, np.uint64) >> 2]
    known = (plan.lengths, plan.sandwiches) if chosen.masked else (None, None)
    noise = row_noise(seeds[:count], known[0]), row_noise(seeds[count:], known[1])
    x = noise[0](np.empty((count, max(plan.lengths), len(prior.mean)), np.float32))
    first = guided(prior, prompts, guidance, lengths=known[0], flags=flags(plan))
    way, walker = levels(prior.schedule, steps, spacing=spacing), SOLVERS[solver]  # type: ignore[arg-type]
    if first_take_only:
        motions = unfold(
            first_take(first, x, plan, way=way, schedule=prior.schedule, noise=noise[0], solver=walker), plan
        )
    else:
        second = _without_text(prior, joins, known[1])
        motions = double_take(
            first,
            second,
            x,
            plan,
            mode=chosen,
            way=way,
            schedule=prior.schedule,
            noise=noise,
            solver=walker,
            second_take_only=second_take_only,
        ).unfolded
    return prior.to_features(motions[0]), plan.ends


def _without_text(prior: Prior, rows: int, lengths: Sequence[int] | None) -> Denoiser:
    if not rows:
        return lambda x, level: x
    bound = prior.net.bind(prior.condition([""] * rows, list(lengths) if lengths else None).null())
    return lambda x, level: prior.net(x, level, bound)


def _check(prompts: Sequence[str], plan: Plan, *, seed: int, guidance: float, neither: bool) -> None:
    if len(prompts) != len(plan.lengths):
        raise MotionloomError(f"there are {len(plan.lengths)} lengths for {len(prompts)} prompts; give one per prompt")
    if any(not prompt.strip() for prompt in prompts):
        raise MotionloomError("a prompt is empty; say in words what the person does")
    if not 0 <= seed < LARGEST_SEED:
        raise MotionloomError(f"a seed is a whole number from 0 to {LARGEST_SEED - 1}; got {seed}")
    if not np.isfinite(guidance) or abs(guidance) > 100:
        raise MotionloomError(f"a guidance of {guidance:g} makes no motion; usual values are 1 to 7")
    if neither:
        raise MotionloomError("the first take only and the second take only exclude each other; ask for one of them")
    if max(plan.lengths) > LONGEST_CLIP:
        warnings.warn(
            f"an interval has {max(plan.lengths)} frames; the data behind these weights have at most {LONGEST_CLIP}",
            stacklevel=3,
        )
