"""The walk of a chain of rows whose ends overlap, of any number of rows in constant memory.

Long motion is a chain of rows; the last frames of a row are the first frames of the next. At each level the two
copies of an overlap become (1 - a) * previous + a * next with a = 0, 1/h, ... (DoubleTake's handshake; Shafir et al.
2024, eq. 2). Two things differ from `constraints.handshake` over one batch of all rows:

* Both copies get the *same* noise, at the start and in each move. Averaging independent noise would shrink its spread
  to 0.7 in the middle of the overlap; equal states and equal noise make the average one of the estimates alone.
* A row may go from step k to k + 1 as soon as its two neighbours have reached step k. Nothing else ties rows together,
  so rows of a long chain walk at different levels, a bounded number of them at a time, first ones first, and each is
  handed out when it and the next one are clean. Which rows happen to share a network call changes nothing.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from .denoisers import lerp
from .schedule import NoiseSource, Schedule, State, generator
from .solvers import Solver, Step


@dataclass(frozen=True)
class Link:
    """A row of the chain."""

    length: int
    """Frames."""
    overlap: int
    """Frames shared with the next row; of no meaning for the last one."""
    seed: int


@dataclass(eq=False)
class _Row:
    link: Link
    step: Step
    generator: np.random.Generator
    state: State
    moves: int = 0
    """Moves so far."""
    sampled: dict[int, State] = field(default_factory=dict)
    """The row's own noise by the move it is for (0: the start), as long as it or the next row needs it."""
    draws: int = 0

    def noise(self, move: int, features: int) -> State:
        """(length, features) sampled in order, so that the noise of a move does not depend on who needs it first."""
        while self.draws <= move:
            self.sampled[self.draws] = self.generator.standard_normal((self.link.length, features), np.float32)
            self.draws += 1
        return self.sampled[move]

    def moved(self) -> None:
        """One move more; of the noise up to it the next row needs the overlap, of what lies further back nothing."""
        self.moves += 1
        for old in [move for move in self.sampled if move <= self.moves]:
            used = self.sampled.pop(old)
            if old >= self.moves - 1:
                self.sampled[old] = used[-max(self.link.overlap, 1) :].copy()


RowsDenoiser = Callable[[Sequence[int], Sequence[State], Sequence[int]], Sequence[State]]
"""(numbers of rows, their states (length, features), their levels) -> estimates of their clean data."""


def staggered(
    links: Iterable[Link],
    denoise: RowsDenoiser,
    *,
    levels: Sequence[int],
    solver: Solver,
    schedule: Schedule,
    features: int,
    batch_size: int = 16,
    moved: Callable[[int], None] = lambda rows: None,
) -> Iterator[State]:
    """Clean rows (length, features) in order, overlaps included twice; the copies of an overlap are equal.

    ``links`` is read as the walk gets there. ``batch_size``: rows per network call at most. ``moved`` is called with
    how many rows moved. Raises ValueError where the overlaps of a row do not fit into it, and for levels that do not
    fall.
    """
    if len(levels) < 2 or any(s >= t for t, s in pairwise(levels)) or batch_size < 1:
        raise ValueError(f"a walk needs falling levels and a row per call, got {list(levels)} and {batch_size} rows")
    return _Chain(links, denoise, levels, solver, schedule, features, batch_size, moved).walk()


class _Chain:
    def __init__(
        self,
        links: Iterable[Link],
        denoise: RowsDenoiser,
        levels: Sequence[int],
        solver: Solver,
        schedule: Schedule,
        features: int,
        batch_size: int,
        moved: Callable[[int], None],
    ) -> None:
        self.links, self.denoise, self.levels = iter(links), denoise, levels
        self.solver, self.schedule = solver, schedule
        self.features, self.batch_size, self.moved = features, batch_size, moved
        self.rows: dict[int, _Row] = {}
        self.ended = False

    def walk(self) -> Iterator[State]:
        last, first = len(self.levels) - 1, 0
        self._admit()
        while self.rows:
            if ready := self._ready():
                self._move(ready)
            while first in self.rows and self.rows[first].moves == last and self._neighbour_done(first, last):
                yield self.rows.pop(first).state
                first += 1

    def _neighbour_done(self, number: int, last: int) -> bool:
        following = self.rows.get(number + 1)
        return following.moves == last if following else self.ended

    def _admit(self) -> bool:
        """Take the next row of the chain, if there is one."""
        link = None if self.ended else next(self.links, None)
        if link is None:
            self.ended = True
            return False
        number = max(self.rows, default=-1) + 1
        before = self.rows.get(number - 1)
        if before is not None:
            self._check(number - 1, before.link, link)
        row = _Row(link, self.solver.start(self.schedule), generator(link.seed), np.empty(0))
        self.rows[number] = row
        row.state = self._noise(number, 0)
        return True

    def _check(self, number: int, link: Link, following: Link) -> None:
        """Whether a row can share what it says, now that there is a row behind it."""
        earlier = self.rows.get(number - 1)
        shared = earlier.link.overlap if earlier else 0
        if link.overlap < 0 or link.length < shared + link.overlap or following.length < link.overlap:
            raise ValueError(
                f"row {number} of {link.length} frames cannot share {shared} with the row before and {link.overlap} "
                f"with the {following.length} of the row behind"
            )

    def _ready(self) -> list[int]:
        """The first rows whose neighbours are as far as they are."""
        ready: list[int] = []
        number, most = min(self.rows), self.batch_size
        while len(ready) < most and (number in self.rows or (number == max(self.rows) + 1 and self._admit())):
            row = self.rows[number]
            if number + 1 not in self.rows:
                self._admit()
            near = (self.rows.get(number - 1), self.rows.get(number + 1))
            if row.moves < len(self.levels) - 1 and all(one is None or one.moves >= row.moves for one in near):
                ready.append(number)
            number += 1
        return ready

    def _move(self, numbers: Sequence[int]) -> None:
        rows = [self.rows[number] for number in numbers]
        at = [self.levels[row.moves] for row in rows]
        cleans = self.denoise(numbers, [row.state for row in rows], at)
        for number, row, clean, level in zip(numbers, rows, cleans, at, strict=True):
            noise = self._noise_of(number, row.moves + 1)
            row.state = row.step(row.state, clean, level, self.levels[row.moves + 1], noise)
            row.moved()
        for number in numbers:
            self._shake(number - 1, number)
            if number + 1 not in numbers:
                self._shake(number, number + 1)
        self.moved(len(numbers))

    def _shake(self, left: int, right: int) -> None:
        """Make the copies of an overlap equal, if both rows are there and equally far."""
        a, b = self.rows.get(left), self.rows.get(right)
        if a is None or b is None or a.moves != b.moves or not a.link.overlap:
            return
        h = a.link.overlap
        weight = (np.arange(h, dtype=a.state.dtype) / h)[:, None]
        shared = lerp(a.state[-h:], b.state[:h], weight)
        a.state = np.concatenate([a.state[:-h], shared])
        b.state = np.concatenate([shared, b.state[h:]])

    def _noise_of(self, number: int, move: int) -> NoiseSource:
        return lambda like: self._noise(number, move).astype(like.dtype, copy=False)

    def _noise(self, number: int, move: int) -> State:
        """The row's noise for a move: its own, but that of the row before where they overlap."""
        row, before = self.rows[number], self.rows.get(number - 1)
        own = row.noise(move, self.features)
        if before is None or not before.link.overlap:
            return own
        h = before.link.overlap
        return np.concatenate([before.noise(move, self.features)[-h:], own[h:]])
