"""How motion is sampled: the two drivers that every task samples with, as a `Sampling` says.

`sample` denoises rows of a prior, `sample_chain` rows of a chain whose ends overlap. What a task adds to the loop are
edits of the denoiser (goals, boundaries, the other person) and what it has `Observed`.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, TypeAlias, TypeVar

import numpy as np

from motionloom.diffusion import (
    SOLVERS,
    Denoiser,
    Link,
    NoiseSource,
    State,
    guide,
    inpaint,
    observe,
    restart,
    row_noise,
    staggered,
)
from motionloom.diffusion import sample as denoising
from motionloom.requests.sampling import Sampling
from motionloom.runtime.pair import PairSession
from motionloom.runtime.prior_condition import Condition
from motionloom.tasks.watching import ChainView, Latest, View
from motionloom.weights.prior import Prior

Progress = Callable[[int, int], None]
"""(network calls done, network calls in all)."""

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
