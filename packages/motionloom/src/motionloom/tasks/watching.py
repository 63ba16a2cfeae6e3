"""Watching a motion while it is denoised: after each network call, the poses that the network predicts for clean data.

    def show(denoised: Denoised) -> None:
        print(denoised.move, "of", denoised.of, denoised.positions().shape)

    with watching(show):
        generate(prior, ["a person jumps"])

Whatever samples (every function of `motionloom.tasks`) reports to the callback of the `watching` block that it runs in.
The poses are decoded only where `Denoised.positions` is called, so watching costs nothing unless one looks. An
exception that the callback raises ends the sampling: that is how a motion is cancelled between two network calls.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from motionloom.core.diffusion.sampling import Snapshot

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Denoised:
    """What one network call predicted."""

    move: int
    """Number of the move in its walk, from 1."""
    of: int
    """Moves of the walk; an edit of several stretches, or a batch of several lengths, takes several walks."""
    rows: tuple[int, ...]
    """Numbers of the motions that are sampled together in this walk; else 0."""
    decode: Callable[[], np.ndarray]
    """Gives what `positions` gives; any float type."""
    begin: float = 0.0
    """Seconds of the motion at which the poses begin: where a part of a motion is sampled, that part is shown."""

    def positions(self) -> Array:
        """(rows, people, frames, 22, 3) metres, +Y up; bones may breathe.

        Seen from where the (first) person starts, at the origin and facing +Z; `edit` shows its window, and `predict`
        and `switch` what is behind the past, in the world.
        """
        return np.asarray(self.decode(), dtype=np.float64)


OnDenoised = Callable[[Denoised], None]
MOST_SEGMENTS = 64
"""Segments of a long motion that are shown while it is sampled."""
_callback: ContextVar[OnDenoised | None] = ContextVar("motionloom_on_denoised", default=None)


@contextmanager
def watching(on_denoised: OnDenoised) -> Iterator[None]:
    """Call ``on_denoised`` after each network call of whatever is sampled inside the block, in the same thread.

    Generators (`compose_stream`, `compose_pair_stream`) sample while they are read: read them inside the block.
    """
    token = _callback.set(on_denoised)
    try:
        yield
    finally:
        _callback.reset(token)


@dataclass(frozen=True)
class View:
    """How the states of a task are looked at."""

    poses: Callable[[np.ndarray], np.ndarray]
    """Denoised states (rows, tokens, features) to (motions, people, frames, 22, 3)."""
    people: int = 1
    """Rows of one motion, which lie next to each other."""
    begin: float = 0.0
    """As of `Denoised`."""

    def report_walk(self, walk: Iterator[Snapshot], of: int, rows: Sequence[int]) -> Iterator[Snapshot]:
        """The snapshots of a walk of ``of`` moves, each reported before it is handed on; rows: their numbers."""
        motions = [row // self.people for row in rows[:: self.people]]
        for move, snapshot in enumerate(walk, start=1):
            report(move, of, motions, lambda snapshot=snapshot: self.poses(snapshot.clean), begin=self.begin)
            yield snapshot


def report(move: int, of: int, rows: Sequence[int], decode: Callable[[], np.ndarray], *, begin: float = 0.0) -> None:
    """Report one network call to whoever watches; nothing happens where nobody does."""
    callback = _callback.get()
    if callback is not None:
        callback(Denoised(move, of, tuple(rows), decode, begin))


R = TypeVar("R")


@dataclass(frozen=True)
class ChainView(Generic[R]):
    """How the rows of a chain make long motions, and how these are looked at while rows are at different levels."""

    part: Callable[[R, np.ndarray, int], Any]
    """A row, its denoised state and the level of that to the part that is stored of it."""
    poses: Callable[[list[Any]], np.ndarray]
    """The stored parts of rows, from the first one on and in order, to (people, frames, 22, 3)."""
    each: int | None = None
    """Rows of one motion where the chain is several of them, which share nothing; None: all are of one."""
    begin: float = 0.0
    """As of `Denoised`."""


class LatestEstimates(Generic[R]):
    """The newest prediction for each segment of a long motion.

    It is stored only where somebody watches, for the newest `MOST_SEGMENTS` segments; so memory stays bounded.
    """

    def __init__(self, view: ChainView[R], steps: int) -> None:
        self.view, self.steps, self.each = view, steps, view.each
        self.parts: dict[int, Any] = {}
        self.calls: Counter[int] = Counter()

    def report(
        self, numbers: Sequence[int], rows: Sequence[R], states: Sequence[np.ndarray], at: Sequence[int]
    ) -> None:
        """Take in what was predicted for some rows, and report the motions that begin with their first row."""
        if _callback.get() is None:
            return
        for number, row, state, level in zip(numbers, rows, states, at, strict=True):
            self.parts[number] = self.view.part(row, state, level)
        self.calls.update(numbers)
        for old in sorted(self.parts)[:-MOST_SEGMENTS]:
            del self.parts[old], self.calls[old]
        for motion in sorted({self._motion(number) for number in numbers}):
            own = sorted(number for number in self.parts if self._motion(number) == motion)
            if own and own[0] == motion * (self.each or 0):
                parts = [self.parts[number] for number in own]
                report(
                    min(self.calls[number] for number in own),
                    self.steps,
                    [motion],
                    lambda parts=parts: self.view.poses(parts)[None],
                    begin=self.view.begin,
                )

    def _motion(self, number: int) -> int:
        return number // self.each if self.each else 0
