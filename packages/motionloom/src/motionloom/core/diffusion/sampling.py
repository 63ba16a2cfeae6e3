"""The sampling loop from noise to data: estimate the clean data, move to a cleaner level, and again.

    noise = row_noise(range(seed, seed + rows))
    x = noise(np.empty((rows, tokens, features), np.float32))
    motion = run(guide(net, text, nothing, 2.5), x, levels=levels(schedule, 20), solver=DpmSolver2M(),
                 schedule=schedule, noise=noise)

There are two places to interfere: the denoiser (an edit of the denoised estimate, `denoisers`) and `constrain` (an
edit of the state after each move, `constraints`).
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from .constraints import Constraint, chain
from .denoisers import Denoiser
from .schedule import NoiseSource, Schedule, State, generator
from .solvers import Solver, Step


class Snapshot(NamedTuple):
    """What there is after one move."""

    level: int
    """The level that was reached."""
    state: State
    clean: State
    """The denoised estimate of the move."""


def sample(
    denoise: Denoiser,
    x: State,
    *,
    levels: Sequence[int],
    solver: Solver,
    schedule: Schedule,
    noise: NoiseSource,
    constrain: Constraint | None = None,
) -> Iterator[Snapshot]:
    """Walk `x`, a state at `levels[0]`, through strictly falling `levels`; one snapshot per move.

    The walk is lazy: stop iterating and it stops. `denoise` sees the levels but the last.
    """
    for level in levels:
        schedule.check(level)
    if not levels or any(s >= t for t, s in pairwise(levels)):
        raise ValueError(f"the levels of a walk must fall strictly, got {list(levels)}")
    return _walk(denoise, x, levels, solver.start(schedule), noise, constrain or chain())


def _walk(
    denoise: Denoiser, x: State, levels: Sequence[int], step: Step, noise: NoiseSource, constrain: Constraint
) -> Iterator[Snapshot]:
    for t, s in pairwise(levels):
        clean = denoise(x, t)
        x = constrain(step(x, clean, t, s, noise), s)
        yield Snapshot(s, x, clean)


def run(
    denoise: Denoiser,
    x: State,
    *,
    levels: Sequence[int],
    solver: Solver,
    schedule: Schedule,
    noise: NoiseSource,
    constrain: Constraint | None = None,
) -> State:
    """The state at the end of `sample`; `x` itself where there is only one level."""
    walk = sample(denoise, x, levels=levels, solver=solver, schedule=schedule, noise=noise, constrain=constrain)
    for snapshot in walk:
        x = snapshot.state
    return x


def restart(clean: State, schedule: Schedule, level: int, noise: NoiseSource) -> State:
    """Clean data taken to `level` with fresh noise: the start of a walk that keeps what this noise leaves of it."""
    return schedule.noised(clean, level, noise(clean))


def row_seed(seed: int, number: int, turn: int = 0) -> int:
    """A seed for one future and one window of it, unlike that of any other."""
    return int(np.random.SeedSequence((seed, number, turn)).generate_state(1, np.uint64)[0] >> np.uint64(1))


def row_noise(seeds: Sequence[int], lengths: Sequence[int] | None = None) -> NoiseSource:
    """Noise that belongs to rows: row i takes it from its own generator, seeded with `seeds[i]`.

    So a row's noise does not depend on the other rows, on their count or order. With `lengths` (valid tokens per row) a
    row has noise for those tokens only and gets zeros behind them, so that its noise does not depend on the padding
    either.
    """
    generators = [generator(seed) for seed in seeds]
    if lengths is not None and len(lengths) != len(generators):
        raise ValueError(f"there are {len(lengths)} lengths for {len(generators)} seeds")

    def noise(like: State) -> State:
        if len(like) != len(generators):
            raise ValueError(f"noise for {len(like)} rows was asked of {len(generators)} seeds: give one seed per row")
        sampled = np.zeros(like.shape, np.float32)
        for row, own in enumerate(generators):
            valid = sampled[row] if lengths is None else sampled[row, : lengths[row]]
            own.standard_normal(dtype=np.float32, out=valid)
        return sampled.astype(like.dtype, copy=False)

    return noise


def masked_noise(noise: NoiseSource, mask: np.ndarray) -> NoiseSource:
    """Noise scaled by (1 - mask): none where the state is to stay noise-free (noise-filtered control, soft too)."""
    return lambda like: noise(like) * (1.0 - mask.astype(like.dtype))
