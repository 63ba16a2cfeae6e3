"""Watching a motion while it is denoised: after each network call, the poses that the network predicts for clean data.

    def show(denoised: Denoised) -> None:
        print(denoised.done, "of", denoised.of, denoised.positions().shape)

    with watching(show):
        generate(prior, ["a person jumps"])

Whatever draws (every function of `motionloom.tasks`) reports to the callback of the `watching` block that it runs in.
The poses are decoded only where `Denoised.positions` is called, so watching costs nothing unless one looks. An
exception that the callback raises ends the drawing: that is how a motion is cancelled between two network calls.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.diffusion.sampling import Snapshot

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Denoised:
    """What one network call predicted."""

    done: int
    """Moves made of this walk, from 1."""
    of: int
    """Moves of the walk; an edit of several stretches, or a batch of several lengths, takes several walks."""
    rows: tuple[int, ...]
    """Numbers of the motions that are drawn together in this walk (duets: within their batch of 8); else 0."""
    decode: Callable[[], np.ndarray]
    """Gives what `positions` gives; any float type."""

    def positions(self) -> Array:
        """(rows, people, frames, 22, 3) metres, +Y up; bones may breathe.

        Seen from where the (first) person starts, at the origin and facing +Z; `edit` shows its window, and `predict`
        and `switch` what is behind the past, in the world.
        """
        return np.asarray(self.decode(), dtype=np.float64)


OnDenoised = Callable[[Denoised], None]
SHOWN = 64
"""Segments of a long motion that are shown while it is drawn."""
_callback: ContextVar[OnDenoised | None] = ContextVar("motionloom_on_denoised", default=None)


@contextmanager
def watching(on_denoised: OnDenoised) -> Iterator[None]:
    """Call ``on_denoised`` after each network call of whatever is drawn inside the block, in the same thread.

    Generators (`compose`, `compose_pair`) draw while they are read: read them inside the block.
    """
    token = _callback.set(on_denoised)
    try:
        yield
    finally:
        _callback.reset(token)


def reported(
    walk: Iterator[Snapshot], of: int, rows: Sequence[int], decode: Callable[[Snapshot], np.ndarray]
) -> Iterator[Snapshot]:
    """The snapshots of a walk of ``of`` moves, each reported before it is handed on.

    decode: a snapshot's clean data to (rows, people, frames, 22, 3).
    """
    for done, snapshot in enumerate(walk, start=1):
        report(done, of, rows, lambda snapshot=snapshot: decode(snapshot))
        yield snapshot


def report(done: int, of: int, rows: Sequence[int], decode: Callable[[], np.ndarray]) -> None:
    """Tell whoever watches of one network call; nothing happens where nobody does."""
    callback = _callback.get()
    if callback is not None:
        callback(Denoised(done, of, tuple(rows), decode))


class Latest:
    """The newest prediction for each segment of a long motion, whose rows are at different levels at the same time.

    It is kept only where somebody watches, for at most `SHOWN` segments, the newest ones; so memory stays bounded.
    """

    def __init__(self, steps: int) -> None:
        self.steps = steps
        self.parts: dict[int, Any] = {}
        self.calls: Counter[int] = Counter()

    def add(self, numbers: Sequence[int], parts: Sequence[Any]) -> None:
        """Take in what was predicted for some segments."""
        if _callback.get() is None:
            return
        self.parts.update(zip(numbers, parts, strict=True))
        self.calls.update(numbers)
        for old in sorted(self.parts)[:-SHOWN]:
            del self.parts[old], self.calls[old]

    def report(self, decode: Callable[[list[Any]], np.ndarray]) -> None:
        """Tell of what is there, in order; decode gives (people, frames, 22, 3) of it, from segment 0 on only."""
        if self.parts and min(self.parts) == 0:
            parts = [self.parts[number] for number in sorted(self.parts)]
            report(min(self.calls.values()), self.steps, [0], lambda: decode(parts)[None])
