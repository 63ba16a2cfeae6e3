"""How motion is sampled: one value for all settings, checked once, and the two drivers that every task samples with.

`sample` denoises rows of a prior, `sample_chain` rows of a chain whose ends overlap. What a task adds to the loop are
edits of the denoiser (goals, boundaries, the other person) and what it has `Observed`.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from typing import Any, Protocol, Self, TypeAlias, TypedDict, TypeVar

import numpy as np

from motionloom.diffusion import (
    SOLVERS,
    SPACINGS,
    Denoiser,
    Link,
    NoiseSource,
    Schedule,
    State,
    guide,
    inpaint,
    levels,
    observe,
    restart,
    row_noise,
    staggered,
)
from motionloom.diffusion import sample as denoising
from motionloom.errors import MotionloomError
from motionloom.runtime.pair import PairSession
from motionloom.runtime.prior_condition import Condition
from motionloom.tasks.watching import ChainView, Latest, View
from motionloom.weights.prior import Prior

STEPS, SOLVER, SPACING, GUIDANCE = 24, "ddpm", "early", 2.5
"""How motions are sampled unless asked otherwise (docs/decisions/0008)."""
BATCH = 8
"""Rows in one network call."""
LARGEST_SEED = 2**62
LARGEST_GUIDANCE = 100

Progress = Callable[[int, int], None]
"""(network calls done, network calls in all)."""
Seed: TypeAlias = int | tuple[int, int]


class Settings(TypedDict, total=False):
    """The settings of `Sampling` as keywords of a task: ``generate(prior, "walks", steps=12, seed=3)``."""

    steps: int
    solver: str
    spacing: str
    guidance: float
    seed: Seed
    count: int | None
    first: int
    batch_size: int | None


class PredictionSettings(Settings, total=False):
    """The same for predictors."""

    temperature: float


class PairSettings(Settings, total=False):
    """The same for two people."""

    pair_guidance: float
    bodies: bool


@dataclass(frozen=True)
class Sampling:
    """How motion is sampled. The device is that of the weights (``Prior.load(device="cuda")``).

    Raises MotionloomError for values that nothing can be sampled with.
    """

    steps: int = STEPS
    """Network calls per motion, 1 to the levels of the weights' schedule."""
    solver: str = SOLVER
    """One of `diffusion.SOLVERS`: ddim, ddpm, dpm2m, dpm2m-sde."""
    spacing: str = SPACING
    """How the steps are spread over the noise levels, one of `diffusion.SPACINGS`."""
    guidance: float = GUIDANCE
    """Classifier-free guidance (Ho & Salimans 2022): 0 ignores the condition, 1 is the network as trained."""
    seed: Seed = 0
    """Motion i is sampled from ``seed + i``. Two people may have one each."""
    count: int | None = None
    """Motions to make, of each prompt; None: what the task makes by itself, 1, or 10 futures."""
    first: int = 0
    """Number of the first of them, so that very many can be made in several calls."""
    batch_size: int | None = None
    """Rows in one network call at most, pairs where two people are sampled; None: what the task takes by itself."""

    def __post_init__(self) -> None:
        if self.solver not in SOLVERS:
            raise MotionloomError(f"no solver {self.solver!r}; there are {', '.join(SOLVERS)}")
        if self.spacing not in SPACINGS:
            raise MotionloomError(f"no spacing {self.spacing!r}; there are {', '.join(SPACINGS)}")
        if not _whole(self.steps) or self.steps < 1:
            raise MotionloomError(f"{self.steps} steps cannot be taken; ask for 1 or more")
        if not np.isfinite(self.guidance) or abs(self.guidance) > LARGEST_GUIDANCE:
            raise MotionloomError(f"a guidance of {self.guidance:g} makes no motion; usual values are 1 to 7")
        for seed in self.seed if isinstance(self.seed, tuple) else (self.seed,):
            if not _whole(seed) or not 0 <= seed < LARGEST_SEED:
                raise MotionloomError(f"a seed is a whole number from 0 to below 2**62; got {seed}")
        if self.count is not None and (not _whole(self.count) or self.count < 1):
            raise MotionloomError(f"nothing to make: a count of {self.count}; ask for 1 or more")
        if not _whole(self.first) or not 0 <= self.first < LARGEST_SEED:
            raise MotionloomError(f"the first motion has a number from 0 to below 2**62; got {self.first}")
        if self.batch_size is not None and (not _whole(self.batch_size) or self.batch_size < 1):
            raise MotionloomError(f"a batch has 1 row or more; got a batch_size of {self.batch_size}")

    @classmethod
    def of(cls, sampling: Self | None, settings: Mapping[str, Any]) -> Self:
        """``sampling``, or the defaults, with single settings changed.

        Raises TypeError for a setting that there is not, and MotionloomError for what cannot be.
        """
        known = [field.name for field in fields(cls)]
        for name in settings:
            if name not in known:
                close = get_close_matches(name, known, n=1)
                meant = f"did you mean {close[0]!r}?" if close else f"the settings are {', '.join(known)}"
                raise TypeError(f"there is no setting {name!r}; {meant}")
        if sampling is not None and type(sampling) is not cls:
            raise MotionloomError(f"this is sampled with a {cls.__name__}; got a {type(sampling).__name__}")
        return replace(sampling or cls(), **settings)

    def levels(self, schedule: Schedule, strength: float = 1.0) -> list[int]:
        """The falling noise levels of a sampling run; below a ``strength`` of 1 only those up to that share of all.

        Raises MotionloomError for more steps than there are levels.
        """
        if self.steps > schedule.steps:
            raise MotionloomError(f"{self.steps} steps cannot be taken; these weights take 1 to {schedule.steps}")
        all_of_them = levels(schedule, self.steps, spacing=self.spacing)
        least = max(1, round(all_of_them[0] * strength))
        return sorted({round(level * strength) for level in all_of_them} | {0, least}, reverse=True)

    def seeds(self, count: int) -> list[int]:
        """The seeds of ``count`` motions of one person."""
        if isinstance(self.seed, tuple):
            raise MotionloomError(f"one person has one seed; got {self.seed}")
        return [self.seed + self.first + number for number in range(count)]

    def number(self, usual: int = 1) -> int:
        """How many motions to make."""
        return self.count or usual

    def numbers(self, usual: int = 1) -> range:
        """The numbers of the motions to make."""
        return range(self.first, self.first + self.number(usual))

    def alone(self) -> Self:
        """The same where one motion is made, and no more; raises MotionloomError for a greater count."""
        if self.number() > 1:
            raise MotionloomError(f"one motion is made by a call of this; call it {self.count} times, with other seeds")
        return self

    def batch(self, usual: int = BATCH) -> int:
        """Rows in one network call."""
        return self.batch_size or usual


@dataclass(frozen=True)
class PredictionSampling(Sampling):
    """How futures are sampled (docs/decisions/0015): predictors take fewer steps and no guidance unless asked."""

    steps: int = 5
    solver: str = "dpm2m"
    spacing: str = "index"
    guidance: float = 1.0
    temperature: float = 1.1
    """Standard deviation of the noise at the start, 0 to 2: few steps sample too little variety, and a person who
    goes on from its own calm comes to rest."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 <= self.temperature <= 2:
            raise MotionloomError(f"the temperature is 0 to 2, usually about 1; got {self.temperature:g}")


@dataclass(frozen=True)
class PairSampling(Sampling):
    """How two people are sampled."""

    pair_guidance: float = 1.0
    """How far every denoised estimate of the two is moved to the relative pose that the block estimates, 0 (not at all;
    as published) to 1."""
    bodies: bool = True
    """Whether bodies are kept out of each other, and hands that the words say meet are brought together."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 <= self.pair_guidance <= 1:
            raise MotionloomError(f"two people are kept together by 0 (not at all) to 1; got {self.pair_guidance:g}")


def _whole(number: object) -> bool:
    return isinstance(number, int | np.integer) and not isinstance(number, bool)


# Rows of one prior


@dataclass(frozen=True, eq=False)
class Rows:
    """What is asked of each row of a batch: one entry per row."""

    prompts: Sequence[str]
    """An empty one asks for nothing in particular."""
    lengths: Sequence[int]
    """Tokens: frames, and one more for two people."""
    seeds: Sequence[int]
    noise: Callable[[Sequence[int]], NoiseSource] = row_noise
    """From seeds to the noise of their rows."""

    def batches(self, size: int) -> list[list[int]]:
        """Numbers of rows of equal length, at most ``size`` in each."""
        by_length: dict[int, list[int]] = {}
        for row, length in enumerate(self.lengths):
            by_length.setdefault(length, []).append(row)
        return [rows[i : i + size] for rows in by_length.values() for i in range(0, len(rows), size)]


@dataclass(frozen=True, eq=False)
class Batch:
    """Rows that are denoised together, as an `Edit` sees them."""

    rows: list[int]
    """Their numbers among all."""
    cond: Condition
    seeds: list[int]


Edit: TypeAlias = Callable[[Denoiser, Batch], Denoiser]
"""Changes the guided denoiser of a batch."""


@dataclass(frozen=True, eq=False)
class Observed:
    """Part of the states that is given (inpainting)."""

    values: np.ndarray
    """(rows, tokens, features), standardised; read where the mask is True."""
    mask: np.ndarray
    """The same shape, bool."""
    noise_free: bool = False
    """The network sees what is given without noise (Shafir et al. 2024, section 3.3), else at the noise of its level
    (RePaint, Lugmayr et al. 2022)."""
    strength: float = 1.0
    """Share of the noise levels that the values are taken to, and sampled back from (SDEdit, Meng et al. 2022)."""

    def of(self, rows: Sequence[int]) -> "Observed":
        """Those of some rows."""
        return replace(self, values=self.values[rows], mask=self.mask[rows])


def sample(
    prior: Prior,
    rows: Rows,
    sampling: Sampling,
    *,
    network: PairSession | None = None,
    edits: Sequence[Edit] = (),
    observed: Observed | None = None,
    halfway: bool = False,
    progress: Progress | None = None,
    view: View | None = None,
) -> Iterator[tuple[int, State]]:
    """Standardised states (tokens, features) with their rows' numbers, each as soon as its batch is finished.

    A row depends on its own prompt, length and seed alone. network: the prior's own unless given. edits: of each
    batch's guided denoiser, after what is observed was put in, the first one first. halfway: stop after half of the
    calls and give the denoised estimates. view: how each network call is seen by who is `watching`; None: nobody can.
    Raises MotionloomError for more steps than the weights have levels.
    """
    net = prior.net if network is None else network
    way = sampling.levels(prior.schedule, observed.strength if observed else 1.0)
    batches, done = rows.batches(sampling.batch()), 0
    if halfway:
        way = way[: len(way) // 2 + 1]
    for numbers in batches:
        batch = Batch(numbers, prior.condition([rows.prompts[i] for i in numbers]), [rows.seeds[i] for i in numbers])
        noise, constrain = rows.noise(batch.seeds), None
        denoise = guide(net, net.bind(batch.cond), net.bind(batch.cond.null()), sampling.guidance)
        if observed is None:
            shape = len(numbers), rows.lengths[numbers[0]], len(prior.mean)
            state = noise(np.empty(shape, np.float32))
        else:
            here = observed.of(numbers)
            denoise = inpaint(denoise, here.values, here.mask)
            shown = np.zeros_like if here.noise_free else noise
            constrain = observe(here.values, here.mask, prior.schedule, shown)
            whole = here.strength == 1.0
            state = noise(here.values) if whole else restart(here.values, prior.schedule, way[0], noise)
            state = constrain(state, way[0])
        for edit in edits:
            denoise = edit(denoise, batch)
        walk = denoising(
            denoise,
            state,
            levels=way,
            solver=SOLVERS[sampling.solver],
            schedule=prior.schedule,
            noise=noise,
            constrain=constrain,
        )
        for snapshot in view.reported(walk, len(way) - 1, numbers) if view else walk:
            state, done = snapshot.clean if halfway else snapshot.state, done + 1
            if progress:
                progress(done, len(batches) * (len(way) - 1))
        yield from zip(numbers, state, strict=True)


def smooth(features: np.ndarray) -> np.ndarray:
    """(..., frames, numbers) weighted 1/6, 2/3, 1/6 along time, ends repeated.

    A network whose tokens hold several frames makes each token smooth and leaves small steps between them.
    """
    before = np.concatenate([features[..., :1, :], features[..., :-1, :]], axis=-2)
    after = np.concatenate([features[..., 1:, :], features[..., -1:, :]], axis=-2)
    return (before + 4 * features + after) / 6


def to_features(prior: Prior, states: np.ndarray) -> np.ndarray:
    """Standardised states (..., frames, features) to features, smoothed where tokens hold several frames."""
    features = states * prior.std + prior.mean
    return smooth(features) if prior.net.config.patch > 1 else features


# Rows of a chain


class ChainRow(Protocol):
    """A row of a chain."""

    @property
    def length(self) -> int:
        """Frames."""
        ...

    @property
    def overlap(self) -> int:
        """Frames shared with the next row."""
        ...


R = TypeVar("R", bound=ChainRow)
Moves = Callable[[int], None]
"""Called with how many more row moves were made; a row takes as many as there are steps."""


def sample_chain(
    prior: Prior,
    rows: Iterable[R],
    denoise: Callable[[Sequence[R], Sequence[State], Sequence[int]], Sequence[State]],
    sampling: Sampling,
    *,
    features: int,
    batch_size: int,
    view: ChainView[R],
    progress: Moves | None = None,
) -> Iterator[tuple[R, State]]:
    """Rows of a chain whose ends overlap, each with its clean state (length, features), in order.

    rows: read as sampling gets there; they may be endless. denoise: rows, their states and levels to the denoised
    states. Row i is sampled from ``seed + i``. batch_size: rows in one call unless ``sampling`` says it. view: how
    rows make motions and are seen by who is `watching`; where they make several, row i of motion m is sampled from
    ``seed + m + i``.
    """
    way, [first] = sampling.levels(prior.schedule), sampling.seeds(1)
    waiting: dict[int, R] = {}
    seen = Latest(view, len(way) - 1)

    def links() -> Iterator[Link]:
        for number, row in enumerate(rows):
            waiting[number] = row
            motion, own = divmod(number, view.each) if view.each else (0, number)
            yield Link(row.length, row.overlap, first + motion + own)

    def reported(numbers: Sequence[int], states: Sequence[State], at: Sequence[int]) -> Sequence[State]:
        some = [waiting[number] for number in numbers]
        denoised = denoise(some, states, at)
        seen.report(numbers, some, denoised, at)
        return denoised

    made = staggered(
        links(),
        reported,
        levels=way,
        solver=SOLVERS[sampling.solver],
        schedule=prior.schedule,
        features=features,
        batch_size=sampling.batch(batch_size),
        moved=progress or (lambda count: None),
    )
    for number, state in enumerate(made):
        yield waiting.pop(number), state
