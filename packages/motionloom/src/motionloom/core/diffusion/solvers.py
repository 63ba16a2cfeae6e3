"""One move: from a state at level t and an estimate of the clean data to a state at a cleaner level s.

Write a, b for signal and noise (`schedule`), D for the denoised estimate, z for fresh noise, and let

    r = (a_t b_s) / (a_s b_t) = exp(-h),    h = log(a_s / b_s) - log(a_t / b_t),

h being the length of the step in log-SNR; r = 0 for a step to clean data.

**DDIM(eta)** (Song et al. 2021, eq. 12) keeps the part of the noise that the estimate implies, e = (x - a_t D) / b_t:

    x_s = a_s D + b_s sqrt(1 - eta² + eta² r²) e + eta b_s sqrt(1 - r²) z

eta = 0 is the deterministic DDIM. eta = 1 is ancestral sampling (DDPM, Ho et al. 2020, eq. 7): between neighbouring
levels it has the published posterior mean and its fixed small variance, b_s² (1 - r²) = beta_t b_s² / b_t². Over wider
steps it is the same posterior q(x_s | x_t, x_0 = D).

**DPM-Solver++(2M)** (Lu et al. 2022, algorithm 2) extrapolates the estimate along log-SNR with the estimate D' of the
move before, of length h'; eta = 1 is its SDE variant:

    D2  = D + (h / 2h') (D - D')
    x_s = (b_s / b_t) r^eta x + a_s (1 - r^(1 + eta)) D2 + b_s sqrt(1 - r^(2 eta)) z

The first move has no D' and the move to level 0 has h = inf: both use D2 = D, and are DDIM moves for eta 0 and 1.

A solver is a value that may be shared; `start` opens one run and returns its step function, which alone
remembers anything. The estimate it is handed may have been edited (guidance, inpainting): it cannot tell.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple, Protocol, TypeAlias, runtime_checkable

from .schedule import NoiseSource, Schedule, State

Step: TypeAlias = Callable[[State, State, int, int, NoiseSource], State]
"""(state, estimate of the clean data, its level t, cleaner level s, noise) -> state at s."""


@runtime_checkable
class Solver(Protocol):
    """A way to move between levels."""

    def start(self, schedule: Schedule) -> Step:
        """The step function of one new run."""
        ...


class Move(NamedTuple):
    """x_s = clean * D + state * x_t + noise * z."""

    clean: float
    state: float
    noise: float


def _check_eta(eta: float) -> None:
    if not 0.0 <= eta <= 1.0:
        raise ValueError(f"eta must lie between 0 (deterministic) and 1 (ancestral), got {eta}")


@dataclass(frozen=True)
class Ddim:
    """DDIM(eta); eta = 1 is ancestral sampling. It samples noise once in every step if eta > 0, else never.

    The noise of a last step to level 0 has no effect but is sampled, as in the published samplers, so that their
    streams of noise can be replayed.
    """

    eta: float = 0.0

    def __post_init__(self) -> None:
        _check_eta(self.eta)

    def move(self, schedule: Schedule, t: int, s: int) -> Move:
        """The three factors of one move."""
        (a_t, b_t), (a_s, b_s) = schedule.at(t), schedule.at(s)
        r = _decay(schedule, t, s)
        factor = b_s * math.sqrt(1.0 - self.eta**2 + (self.eta * r) ** 2) / b_t
        return Move(a_s - factor * a_t, factor, self.eta * b_s * math.sqrt(1.0 - r * r))

    def start(self, schedule: Schedule) -> Step:
        """See `Solver.start`."""

        def step(x: State, clean: State, t: int, s: int, noise: NoiseSource) -> State:
            move = self.move(schedule, t, s)
            mean = move.clean * clean + move.state * x
            return mean + move.noise * noise(x) if self.eta > 0.0 else mean

        return step


@dataclass(frozen=True)
class DpmSolver2M:
    """DPM-Solver++(2M): second order in the length of the steps, one call per step; eta = 1 is its SDE variant."""

    eta: float = 0.0

    def __post_init__(self) -> None:
        _check_eta(self.eta)

    def start(self, schedule: Schedule) -> Step:
        """See `Solver.start`."""
        before: tuple[State, float] | None = None  # the estimate and the length of the move before this one

        def step(x: State, clean: State, t: int, s: int, noise: NoiseSource) -> State:
            nonlocal before
            h = schedule.log_snr(s) - schedule.log_snr(t)
            ahead = _extrapolate(clean, before, h)
            before = clean, h
            b_t, (a_s, b_s) = schedule.at(t)[1], schedule.at(s)
            r = _decay(schedule, t, s)
            mean = (b_s / b_t * r**self.eta) * x + a_s * (1.0 - r ** (1.0 + self.eta)) * ahead
            if self.eta == 0.0:
                return mean
            return mean + b_s * math.sqrt(1.0 - r ** (2.0 * self.eta)) * noise(x)

        return step


DDPM = Ddim(eta=1.0)
"""Ancestral sampling."""

SOLVERS: Mapping[str, Solver] = MappingProxyType(
    {"ddpm": DDPM, "ddim": Ddim(), "dpm2m": DpmSolver2M(), "dpm2m-sde": DpmSolver2M(eta=1.0)}
)
"""Solvers by the names that commands and recipes use."""


def _extrapolate(clean: State, before: tuple[State, float] | None, h: float) -> State:
    if before is None or math.isinf(h) or math.isinf(before[1]):
        return clean
    last, length = before
    return clean + (h / (2.0 * length)) * (clean - last)


def _decay(schedule: Schedule, t: int, s: int) -> float:
    """exp(-h), by ratios: it stays right where signal or noise is 0."""
    (a_t, b_t), (a_s, b_s) = schedule.at(t), schedule.at(s)
    if t <= s:
        raise ValueError(f"a step must go to a cleaner level, not from {t} to {s}")
    return (a_t * b_s) / (a_s * b_t)
