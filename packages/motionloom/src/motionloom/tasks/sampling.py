"""How motion is sampled: the two drivers that every task samples with, by a `Sampling`.

`sample` denoises rows of a prior, `sample_chain` rows of a chain whose ends overlap. What a task adds to the loop are
edits of the denoiser (goals, boundaries, the other person) and what it has `Observed`.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, Self, TypeAlias, TypeVar

import numpy as np

from motionloom.core.diffusion import (
    SOLVERS,
    Constraint,
    Denoiser,
    Link,
    NoiseSource,
    State,
    Weight,
    guide,
    inpaint,
    observe,
    restart,
    row_noise,
    staggered,
)
from motionloom.core.diffusion import sample as denoising
from motionloom.core.methods.edit import Observed
from motionloom.core.models.networks.pair import PairSession
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.networks.prior_condition import Condition
from motionloom.core.models.prior import Prior
from motionloom.requests.sampling import Sampling
from motionloom.tasks.best import Chooser, best_candidate, candidate_seeds
from motionloom.tasks.watching import ChainView, LatestEstimates, View

Progress = Callable[[int, int], None]
"""(network calls done, network calls in all)."""

# Rows of one prior


@dataclass(frozen=True, eq=False)
class Rows:
    """Prompt, length and seed of each row of a batch: one entry per row."""

    prompts: Sequence[str]
    """An empty one is no condition."""
    lengths: Sequence[int]
    """Tokens: frames, and the slots before them."""
    seeds: Sequence[int]
    noise: Callable[[Sequence[int]], NoiseSource] = row_noise
    """From seeds to the noise of their rows."""
    slots: int = 0
    """Tokens before the frames: 1 for two people."""
    patch: int = 1
    """Lengths that differ by less share a call: that many frames are a token of the network, so that little is computed
    for padding. A row's sums are computed in the same order whatever is beside it (docs/decisions/0020-bulk.md)."""

    def batches(self, size: int) -> list[list[int]]:
        """Numbers of rows of as many tokens, at most ``size`` in each."""
        by_length: dict[int, list[int]] = {}
        for row, length in enumerate(self.lengths):
            by_length.setdefault(-(-length // self.patch), []).append(row)
        return [rows[i : i + size] for rows in by_length.values() for i in range(0, len(rows), size)]

    def of(self, rows: Sequence[int]) -> "Rows":
        """Some of them."""
        prompts, lengths, seeds = ([part[i] for i in rows] for part in (self.prompts, self.lengths, self.seeds))
        return replace(self, prompts=prompts, lengths=lengths, seeds=seeds)


@dataclass(frozen=True, eq=False)
class Batch:
    """Rows that are denoised together, as an `Edit` sees them."""

    rows: list[int]
    """Their numbers among all."""
    cond: Condition
    seeds: list[int]
    trial: bool = False
    """Whether these are candidates, several of a row: nothing that an edit finds in them is for the row."""


Network: TypeAlias = PriorSession | PairSession
Edit: TypeAlias = Callable[[Denoiser, Batch], Denoiser]
"""Changes the guided denoiser of a batch."""


def sample(
    prior: Prior,
    rows: Rows,
    sampling: Sampling,
    *,
    network: Network | None = None,
    guided: Denoiser | None = None,
    edits: Sequence[Edit] = (),
    observed: Observed | None = None,
    halfway: bool = False,
    corrected: bool = False,
    progress: Progress | None = None,
    view: View | None = None,
    choose: Chooser = best_candidate,
) -> Iterator[tuple[int, State]]:
    """Standardised states (tokens, features) with their rows' numbers, each as soon as its batch is finished.

    A row depends on its own prompt, length and seed alone. network: the prior's own unless given. guided: the guided
    denoiser of all rows, where it is not that of the network alone. edits: of each batch's guided denoiser, after the
    observed part is inserted, the first one first. halfway: stop after half of the
    calls and give the denoised estimates. corrected: rows of one length are given `Prior.smoothed`, with what is
    observed in its place, and through the edits once more, at level 0. view: how each network call is seen by who is
    `watching`; None: nobody can.
    Where the sampling asks for the best of several, ``choose`` finds each motion's seed first (`with_best_seeds`).
    Raises MotionloomError for more steps than the weights have levels.
    """
    way = sampling.levels(prior.schedule, observed.strength if observed else 1.0)
    if sampling.best_of > 1 and not halfway:
        people, total = view.people if view else 1, len(_batches(prior, rows, sampling)) * (len(way) - 1)
        choosing, progress = _split_progress(progress, of=total)
        more: dict[str, Any] = {"network": network, "edits": edits, "observed": observed, "people": people}
        rows = with_best_seeds(prior, rows, sampling, progress=choosing, choose=choose, **more)
    batches, calls = _batches(prior, rows, sampling), 0
    if halfway:
        way = way[: len(way) // 2 + 1]
    for numbers in batches:
        some = rows.of(numbers)
        lengths = list(some.lengths)
        padded = lengths if len(set(lengths)) > 1 else None
        batch = Batch(numbers, prior.condition(list(some.prompts), padded), list(some.seeds))
        cond = batch.cond
        noise = row_noise(batch.seeds, padded) if padded else rows.noise(batch.seeds)
        own = prior.for_words(some.prompts[0])
        net = own.net if network is None else network
        base = guided or guide(net, net.bind(cond), net.bind(cond.null()), strength(own, sampling, some.prompts))
        denoise, constrain = _identity_when_clean(base), None
        if observed is None:
            state = noise(np.empty((len(numbers), max(lengths), len(prior.mean)), np.float32))
        else:
            here = observed.of(numbers)
            denoise = inpaint(denoise, here.values, here.mask)
            state, constrain = _initial_state(prior, here, way[0], noise)
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
        for snapshot in view.report_walk(walk, len(way) - 1, numbers) if view else walk:
            state, calls = snapshot.clean if halfway else snapshot.state, calls + 1
            if progress:
                progress(calls, len(batches) * (len(way) - 1))
        if corrected and not halfway:
            frames = prior.smoothed(state[:, rows.slots :])
            state = denoise(np.concatenate([state[:, : rows.slots], frames], axis=1), 0)
        yield from ((number, one[:length]) for number, one, length in zip(numbers, state, lengths, strict=True))


def _batches(prior: Prior, rows: Rows, sampling: Sampling) -> list[list[int]]:
    """Numbers of rows that are denoised together: of as many tokens, and of words that the same adapters change."""
    batches = []
    for batch in rows.batches(sampling.batch()):
        by_adapters: dict[tuple[int, ...], list[int]] = {}
        for row in batch:
            by_adapters.setdefault(tuple(map(id, prior.left_out(rows.prompts[row]))), []).append(row)
        batches += by_adapters.values()
    return batches


def strength(prior: Prior, sampling: Sampling, prompts: Sequence[str]) -> Weight:
    """The guidance of each prompt by noise level, less of it for what adapters were taught in these words."""
    scale = sampling.strength(prior.schedule)
    if not prior.taught:
        return scale
    shares = prior.guided_shares(prompts)
    return lambda level: eased(scale(level), shares)


def eased(scale: float, shares: np.ndarray) -> np.ndarray:
    """A guidance scale of which shares (rows,) of what it adds to 1 remain; scales up to 1 stay."""
    return scale - (1 - shares) * max(scale - 1, 0.0)


def _identity_when_clean(denoise: Denoiser) -> Denoiser:
    """The denoiser, for which a clean state is its own estimate."""
    return lambda state, level: denoise(state, level) if level else state


def _initial_state(prior: Prior, observed: Observed, level: int, noise: NoiseSource) -> tuple[State, Constraint]:
    """The state at the first level, and what keeps it to what is observed."""
    hold = observe(observed.values, observed.mask, prior.schedule, np.zeros_like if observed.noise_free else noise)
    whole = observed.strength == 1.0
    state = noise(observed.values) if whole else restart(observed.values, prior.schedule, level, noise)
    return hold(state, level), hold


def with_best_seeds(
    prior: Prior,
    rows: Rows,
    sampling: Sampling,
    *,
    network: Network | None = None,
    edits: Sequence[Edit] = (),
    observed: Observed | None = None,
    people: int = 1,
    progress: Progress | None = None,
    choose: Chooser = best_candidate,
) -> Rows:
    """The same rows, each motion with the best of ``sampling.best_of`` seeds (`tasks.best`).

    people: rows of one motion, which lie next to each other. progress: called after each network call with the calls
    done and the calls there are for choosing. The rest as of `sample`.
    """
    count, motions = sampling.best_of, range(0, len(rows.seeds), people)
    of = [row for first in motions for _ in range(count) for row in range(first, first + people)]
    seeds_of_rows = [candidate_seeds(seed, count) for seed in rows.seeds]
    seeds = [seeds_of_rows[row][place // people % count] for place, row in enumerate(of)]
    candidates = sample(
        prior,
        replace(rows.of(of), seeds=seeds),
        sampling,
        network=network,
        edits=[_edit_of_candidates(edit, of) for edit in edits],
        observed=observed and observed.of(of),
        halfway=True,
        progress=progress,
    )
    estimates, chosen = dict(candidates), list(rows.seeds)
    level = sampling.levels(prior.schedule)[0]
    for first in motions:
        own = range(first, first + people)
        states = np.stack([estimates[first * count + place] for place in range(count * people)])
        states = states.reshape(count, people, *states.shape[1:])[:, :, rows.slots :]
        number = choose(prior, rows.of(own).prompts, states, seeds=seeds_of_rows[first], level=level)
        chosen[first : first + people] = [seeds_of_rows[row][number] for row in own]
    return replace(rows, seeds=chosen)


def _edit_of_candidates(edit: Edit, of: Sequence[int]) -> Edit:
    """The edit of rows for candidates; ``of``: the row of each candidate."""
    return lambda denoise, batch: edit(denoise, replace(batch, rows=[of[i] for i in batch.rows], trial=True))


def _split_progress(progress: Progress | None, *, of: int) -> tuple[Progress | None, Progress | None]:
    """What two parts of a job report to, the second of ``of`` calls, so that ``progress`` sees one job."""
    if progress is None:
        return None, None
    before = 0

    def first(calls: int, total: int) -> None:
        nonlocal before
        before = total
        progress(calls, total + of)

    return first, lambda calls, total: progress(before + calls, before + total)


# Rows of a chain


class ChainRow(Protocol):
    """A row of a chain."""

    @property
    def texts(self) -> Sequence[str]:
        """What each person does."""
        ...

    def alone(self) -> Self:
        """The row without its neighbours, for a candidate: what is found in it is not for the row itself."""
        ...

    def motions(self, state: State) -> np.ndarray:
        """(people, frames, features) of a state (length, features), without what belongs to the neighbours."""
        ...

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
"""Called with the number of further row moves; a row takes as many as there are steps."""


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
    choose: Chooser = best_candidate,
) -> Iterator[tuple[R, State]]:
    """Rows of a chain whose ends overlap, each with its clean state (length, features), in order.

    rows: read as sampling gets there; they may be endless. denoise: rows, their states and levels to the denoised
    states. Row i is sampled from ``seed + i``, or from the best of several seeds, by candidates of the row alone.
    batch_size: rows in one call unless ``sampling`` has it. view: how rows make motions and are seen by who is
    `watching`; where they make several, row i of motion m is sampled from ``seed + m + i``.
    """
    way, [first] = sampling.levels(prior.schedule), sampling.seeds(1)
    waiting: dict[int, R] = {}
    moved = progress or (lambda count: None)
    latest = LatestEstimates(view, len(way) - 1)

    def links() -> Iterator[Link]:
        for number, row in enumerate(rows):
            waiting[number] = row
            motion, own = divmod(number, view.each) if view.each else (0, number)
            seeds = candidate_seeds(first + motion + own, sampling.best_of)
            yield Link(row.length, row.overlap, best_seed(row, seeds))

    def best_seed(row: R, seeds: list[int]) -> int:
        if len(seeds) == 1:
            return seeds[0]
        noise, several = row_noise(seeds), [row.alone() for _ in seeds]
        states: list[State] = []
        walk = denoising(
            lambda states, level: np.stack(denoise(several, list(states), [level] * len(seeds))),
            noise(np.empty((len(seeds), row.length, features), np.float32)),
            levels=way[: len(way) // 2 + 1],
            solver=SOLVERS[sampling.solver],
            schedule=prior.schedule,
            noise=noise,
        )
        for snapshot in walk:
            states = list(snapshot.clean)
            moved(0)
        motions = np.stack([row.motions(state) for state in states])
        return seeds[choose(prior, row.texts, motions, seeds=seeds, level=way[0])]

    def reported(numbers: Sequence[int], states: Sequence[State], at: Sequence[int]) -> Sequence[State]:
        some = [waiting[number] for number in numbers]
        denoised = denoise(some, states, at)
        latest.report(numbers, some, denoised, at)
        return denoised

    states_of_rows = staggered(
        links(),
        reported,
        levels=way,
        solver=SOLVERS[sampling.solver],
        schedule=prior.schedule,
        features=features,
        batch_size=sampling.batch(batch_size),
        moved=moved,
    )
    for number, state in enumerate(states_of_rows):
        yield waiting.pop(number), state
