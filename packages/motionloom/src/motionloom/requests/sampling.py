"""How motion is sampled: the part that the requests of every task share."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, Self, TypeAlias, TypedDict

from motionloom.core.defaults import GUIDANCE, LARGEST_GUIDANCE, LARGEST_SEED, SOLVER, SPACING, STEPS
from motionloom.core.errors import MotionloomError
from motionloom.requests.fields import Checked, declare, like

if TYPE_CHECKING:
    from motionloom.core.diffusion import Schedule

LATE_GUIDANCE = 3.0
"""The factor of `rising`."""
_FIRST_AND_THEN = 1 / 3, 4 / 3
"""Of two people: the factors of what guidance adds, where it is decided who stands where and behind that."""
BATCH = 8
"""Rows in one network call."""
SOLVERS = ("ddpm", "ddim", "dpm2m", "dpm2m-sde")
SPACINGS = ("index", "early", "quadratic", "snr")
"""Names in `motionloom.core.diffusion`, which is loaded with NumPy."""
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
    best_of: int


class PredictionSettings(Settings, total=False):
    """The same for predictors."""

    temperature: float


class PairSettings(Settings, total=False):
    """The same for two people."""

    pair_guidance: float
    bodies: bool


@dataclass(frozen=True)
class Sampling(Checked):
    """How motion is sampled. The device is that of the weights (``Prior.load(device="cuda")``).

    Guidance is classifier-free (Ho & Salimans 2022). Raises MotionloomError for values that nothing is sampled with.
    """

    steps: int = declare("whole", "network calls per motion: fewer is faster", STEPS, low=1, high=100_000)
    solver: str = declare("word", "how the noise is taken away", SOLVER, words=SOLVERS)
    spacing: str = declare(
        "word", "how the steps are spread over the noise levels; on early ones, guidance rises", SPACING, words=SPACINGS
    )
    guidance: float = declare(
        "number",
        "strength of the text: 0 ignores it",
        GUIDANCE,
        low=-LARGEST_GUIDANCE,
        high=LARGEST_GUIDANCE,
        hint="usually 1 to 7",
    )
    seed: Seed = declare(
        "whole", "the first motion's seed, the next have the next", 0, low=0, high=LARGEST_SEED - 1, pair=True
    )
    count: int | None = declare("whole", "motions to make", low=1, high=10_000)
    first: int = declare(
        "whole", "number of the first motion, so that very many are made in several calls", 0, low=0, high=LARGEST_SEED
    )
    batch_size: int | None = declare("whole", "rows in one network call at most", low=1)
    best_of: int = declare(
        "whole",
        "of each motion begin so many and keep the one that does most of what its words allow to check",
        1,
        low=1,
        high=16,
    )

    @classmethod
    def of(cls, sampling: Self | None, settings: Mapping[str, Any]) -> Self:
        """``sampling``, or the defaults, with single settings changed.

        Raises TypeError for a setting that there is not, and MotionloomError for what cannot be.
        """
        known = [field.name for field in fields(cls)]
        for name in settings:
            if name not in known:
                close = get_close_matches(name, known, n=1)
                hint = f"did you mean {close[0]!r}?" if close else f"the settings are {', '.join(known)}"
                raise TypeError(f"there is no setting {name!r}; {hint}")
        if sampling is not None and type(sampling) is not cls:
            raise MotionloomError(f"this is sampled with a {cls.__name__}; got a {type(sampling).__name__}")
        return replace(sampling or cls(), **settings)

    def levels(self, schedule: "Schedule", strength: float = 1.0) -> list[int]:
        """The falling noise levels of a sampling run; below a ``strength`` of 1 only those up to that share of all.

        Raises MotionloomError for more steps than there are levels.
        """
        from motionloom.core.diffusion import levels

        if self.steps > schedule.steps:
            raise MotionloomError(f"{self.steps} steps cannot be taken; these weights take 1 to {schedule.steps}")
        all_of_them = levels(schedule, self.steps, spacing=self.spacing)
        least = max(1, round(all_of_them[0] * strength))
        return sorted({round(level * strength) for level in all_of_them} | {0, least}, reverse=True)

    def strength(self, schedule: "Schedule", guidance: float | None = None) -> "Callable[[int], float]":
        """The guidance, or another one, by noise level: with early spacing it rises towards the end (`rising`)."""
        from motionloom.core.diffusion import rising

        scale = self.guidance if guidance is None else guidance
        return rising(scale, schedule.steps, LATE_GUIDANCE if self.spacing == "early" else 1)

    def seeds(self, count: int) -> list[int]:
        """The seeds of ``count`` motions of one person."""
        if isinstance(self.seed, tuple):
            raise MotionloomError(f"one person has one seed; got {self.seed}")
        return [self.seed + self.first + number for number in range(count)]

    def each(self) -> "list[Self]":
        """For each motion how it is sampled alone, so that it becomes the same."""
        return [replace(self, count=1, first=self.first + number) for number in range(self.number())]

    def number(self, usual: int = 1) -> int:
        """How many motions to generate."""
        return self.count or usual

    def numbers(self, usual: int = 1) -> range:
        """The numbers of the motions to generate."""
        return range(self.first, self.first + self.number(usual))

    def alone(self) -> Self:
        """The same for one motion, and no more; raises MotionloomError for a greater count."""
        if self.number() > 1:
            raise MotionloomError(f"one motion is made by a call of this; call it {self.count} times, with other seeds")
        return self

    def batch(self, usual: int = BATCH) -> int:
        """Rows in one network call."""
        return self.batch_size or usual


@dataclass(frozen=True)
class PredictionSampling(Sampling):
    """How futures are sampled (docs/decisions/0015): predictors take fewer steps and no guidance by default.

    Few steps sample too little variety, and a person who goes on from its own calm comes to rest; so the noise at the
    start has a standard deviation above 1, the temperature.
    """

    steps: int = like(Sampling, "steps", default=5)
    solver: str = like(Sampling, "solver", default="dpm2m")
    spacing: str = like(Sampling, "spacing", default="index")
    guidance: float = like(Sampling, "guidance", "strength of what is known", default=1.0, hint="usually about 1")
    temperature: float = declare(
        "number", "livelier and more varied above 1, calmer below", 1.1, low=0, high=2, hint="usually about 1"
    )


@dataclass(frozen=True)
class PairSampling(Sampling):
    """How two people are sampled (docs/decisions/0016, 0041)."""

    pair_guidance: float = declare(
        "number",
        "how firmly two people keep to where the block wants them: 0 lets them drift apart, as published",
        1.0,
        low=0,
        high=1,
    )
    bodies: bool = declare(
        "flag", "keep bodies out of each other, and bring hands together that the words say meet", True
    )

    def strength(self, schedule: "Schedule", guidance: float | None = None) -> "Callable[[int], float]":
        """The guidance, or another one, by noise level: with early spacing less where it is decided who stands where.

        What it adds to 1 is a third as much above four fifths of the levels, and four thirds below; it does not rise in
        the end as for one person, since people come into each other then.
        """
        scale = self.guidance if guidance is None else guidance
        first, then = _FIRST_AND_THEN if self.spacing == "early" else (1.0, 1.0)
        decided = 0.8 * schedule.steps
        return lambda level: scale + max(scale - 1, 0.0) * ((first if level > decided else then) - 1)
