"""How much signal and how much noise a state holds at each level.

    x_l = signal[l] * x_0 + noise[l] * z,    z ~ N(0, I),    signal² + noise² = 1

Level 0 is clean data (signal 1, noise 0); level T is almost pure noise. Published code counts t = 0 ... T-1
without the clean level: published t is level t + 1, its `alphas_cumprod[t]` is `signal[t + 1] ** 2`.

The tables are float64. `Schedule.at` gives Python floats, which leave the type of the arrays they multiply alone.
"""

import bisect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

State: TypeAlias = np.ndarray
"""What is denoised: (rows, tokens, features). Only the first axis, the rows of a batch, has a meaning here."""

NoiseSource: TypeAlias = Callable[[State], State]
"""Standard normal noise of the shape and type of its argument."""


def generator(seed: int) -> np.random.Generator:
    """Where the noise of one seed comes from: PCG64 (O'Neill 2014), the same on every machine."""
    return np.random.Generator(np.random.PCG64(seed))


SPACINGS = ("index", "early", "quadratic", "snr")
"""Ways to choose the levels of a short walk, see `levels`."""


@dataclass(frozen=True, eq=False)
class Schedule:
    """A variance-preserving noise schedule of T levels above clean."""

    name: str
    betas: np.ndarray
    """(T,) float64: entry l - 1 is the share of the variance that going from level l - 1 to l replaces by noise."""

    @property
    def steps(self) -> int:
        """T, also the number of the noisiest level."""
        return len(self.betas)

    @cached_property
    def alpha_bar(self) -> np.ndarray:
        """(T+1,) float64: the share of the variance that is signal, 1 at level 0."""
        return np.concatenate([[1.0], np.cumprod(1.0 - self.betas)])

    @cached_property
    def signal(self) -> np.ndarray:
        """(T+1,) float64, falling from 1."""
        return np.sqrt(self.alpha_bar)

    @cached_property
    def noise(self) -> np.ndarray:
        """(T+1,) float64, rising from 0."""
        return np.sqrt(1.0 - self.alpha_bar)

    @cached_property
    def _pairs(self) -> list[tuple[float, float]]:
        return list(zip(self.signal.tolist(), self.noise.tolist()))

    def at(self, level: int) -> tuple[float, float]:
        """Signal and noise of one level."""
        self.check(level)
        return self._pairs[level]

    def log_snr(self, level: int) -> float:
        """Half the logarithm of the signal-to-noise ratio, log(signal / noise): +inf at level 0."""
        signal, noise = self.at(level)
        if noise == 0.0:
            return math.inf
        return math.log(signal / noise) if signal > 0.0 else -math.inf

    def noised(self, clean: State, level: int | np.ndarray, noise: State) -> State:
        """Clean data taken to a level with the given noise (Ho et al. 2020, eq. 4).

        `level` is one number, or whole numbers (rows,), one for each row.
        """
        if isinstance(level, int):
            a, b = self.at(level)
            return a * clean + b * noise
        self.check(int(level.min()))
        self.check(int(level.max()))
        shape = (-1,) + (1,) * (clean.ndim - 1)
        a, b = (table.astype(clean.dtype)[level].reshape(shape) for table in (self.signal, self.noise))
        return a * clean + b * noise

    def check(self, level: int) -> None:
        """Raise ValueError where there is no such level."""
        if not 0 <= level <= self.steps:
            raise ValueError(f"no level {level}; the {self.name} schedule has levels 0 (clean) to {self.steps}")


def from_betas(name: str, betas: Sequence[float] | np.ndarray) -> Schedule:
    """A schedule from its T betas, each in (0, 1]."""
    table = np.array(betas, dtype=np.float64)
    if table.ndim != 1 or not len(table) or not ((table > 0) & (table <= 1)).all():
        raise ValueError(f"the betas of schedule {name!r} must be a list of numbers in (0, 1]")
    return Schedule(name, table)


def cosine(steps: int) -> Schedule:
    """The cosine schedule (Nichol & Dhariwal 2021, eq. 17), betas cut at 0.999."""
    return _from_signal("cosine", steps, lambda u: math.cos((u + 0.008) / 1.008 * math.pi / 2) ** 2)


def sqrt(steps: int) -> Schedule:
    """The square-root schedule (Li et al. 2022, "Diffusion-LM"), betas cut at 0.999: much noise already at level 1."""
    return _from_signal("sqrt", steps, lambda u: 1 - math.sqrt(u + 1e-4))


def sigmoid(steps: int) -> Schedule:
    """The sigmoid schedule (Jabri et al. 2022) from -3 to 3 at temperature 0.7, betas cut at 0.999."""

    def logistic(x: float) -> float:
        return 1 / (1 + math.exp(-x / 0.7))

    return _from_signal("sigmoid", steps, lambda u: logistic(3) - logistic(6 * u - 3))


def _from_signal(name: str, steps: int, share: Callable[[float], float]) -> Schedule:
    """The schedule whose share of signal at time u in [0, 1] is proportional to ``share(u)``."""
    _check_steps(steps)
    return from_betas(name, [min(max(1 - share((i + 1) / steps) / share(i / steps), 0.0), 0.999) for i in range(steps)])


def linear(steps: int) -> Schedule:
    """The linear schedule (Ho et al. 2020), 1e-4 ... 0.02 at 1000 steps, scaled by 1000 / steps and cut at 0.999."""
    _check_steps(steps)
    scale = 1000 / steps
    return from_betas("linear", np.linspace(scale * 1e-4, scale * 0.02, steps).clip(max=0.999))


SCHEDULES: Mapping[str, Callable[[int], Schedule]] = MappingProxyType(
    {"cosine": cosine, "linear": linear, "sqrt": sqrt, "sigmoid": sigmoid}
)
"""Schedules by the names that recipes and weight files use: from a number of levels."""


def levels(schedule: Schedule, steps: int, *, spacing: str = "index") -> list[int]:
    """A walk of `steps` moves from the noisiest level T down to 0: `steps + 1` strictly falling levels.

    "index": evenly spaced levels ("trailing" in diffusers; it starts at T, as Lin et al. 2024 recommend).
    "early": levels T (1 - (i / steps)²), denser near pure noise, where the motion is decided.
    "quadratic": evenly spaced roots of the level (Song et al. 2021, D.3), denser near clean data. On normal data of
    narrow and wide spread alike it keeps the spread best in 10 to 50 moves of DPM-Solver++(2M) on the cosine schedule.
    "snr": evenly spaced in log(signal / noise) from T to 1, then 0 (the spacing of the DPM-Solver paper).
    """
    top = schedule.steps
    if not 1 <= steps <= top:
        raise ValueError(f"cannot take {steps} steps over {top} levels: ask for 1 to {top}")
    if spacing == "index":
        goals = [top * (steps - i) / steps for i in range(steps)]
    elif spacing == "early":
        goals = [top * (1 - (i / steps) ** 2) for i in range(steps)]
    elif spacing == "quadratic":
        goals = [top * ((steps - i) / steps) ** 2 for i in range(steps)]
    elif spacing == "snr":
        goals = _even_in_log_snr(schedule, steps)
    else:
        raise ValueError(f"no spacing {spacing!r}; there are {', '.join(SPACINGS)}")
    result = [top]
    for i, level in enumerate(goals[1:], start=1):
        # stay below the last level, and leave one level for every step that is still to come
        result.append(max(min(round(level), result[-1] - 1), steps - i))
    return [*result, 0]


def _even_in_log_snr(schedule: Schedule, steps: int) -> list[float]:
    falling = [-schedule.log_snr(level) for level in range(1, schedule.steps + 1)]  # rises with the level
    first = 0 if steps > 1 else len(falling) - 1
    high = next(i for i in range(len(falling) - 1, -1, -1) if math.isfinite(falling[i]))
    goals = [falling[high] + (falling[first] - falling[high]) * i / max(steps - 1, 1) for i in range(steps)]
    places = (min(bisect.bisect_left(falling, goal), high) for goal in goals)
    nearest = (p - 1 if p and goal - falling[p - 1] < falling[p] - goal else p for p, goal in zip(places, goals))
    return [place + 1.0 for place in nearest]


def _check_steps(steps: int) -> None:
    if steps < 1:
        raise ValueError(f"a schedule needs at least one step, got {steps}")
