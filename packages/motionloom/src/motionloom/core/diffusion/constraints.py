"""Edits of the state, just after it reached a level.

observe    holds part of the state to known data at that level's noise
handshake  makes the end of each row and the beginning of the next the same (long motion)
chain      one after the other
"""

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from .bases import Basis
from .denoisers import mix
from .schedule import NoiseSource, Schedule, State

Constraint: TypeAlias = Callable[[State, int], State]
"""(state, the level it has just reached) -> edited state, of the same shape."""


def observe(
    known: State, mask: np.ndarray, schedule: Schedule, noise: NoiseSource, *, basis: Basis | None = None
) -> Constraint:
    """Where `mask` is 1 (True) the state becomes signal * known + sigma * noise(known), at the level it reached.

    With normal noise it is the known half of RePaint (Lugmayr et al. 2022, eq. 8a). With `noise=np.zeros_like`
    it is the noise-filtered sampling of PriorMDM's fine-tuned control, where the network is shown the goal without
    noise. A soft mask mixes linearly. The loop does not edit the starting state: call the constraint on it first.

    With a ``basis``, `known` and the state are coefficients and `mask` is over time, (..., frames, features): both are
    mixed in time and taken back, which drops what the basis does not keep (DCT-Completion; Chen et al. 2023, eq. 7).
    """

    def held(x: State, level: int) -> State:
        noised = schedule.noised(known, level, noise(known))
        if basis is None:
            return mix(x, noised, mask)
        return basis.to_spectrum(mix(basis.to_time(x), basis.to_time(noised), mask))

    return held


def handshake(lengths: Sequence[int], overlap: int) -> Constraint:
    """Makes the last `overlap` valid tokens of each row equal the first `overlap` tokens of the next row.

    Both become (1 - a) * previous + a * next with a = 0, 1/overlap, ... (DoubleTake's first take; Shafir et al.
    2023, section 4.1), for one pair of rows after the other. `lengths` are the valid tokens of the rows.
    """
    if overlap < 1 or any(length < overlap for length in lengths):
        raise ValueError(f"a handshake of {overlap} tokens must be positive and fit into rows of {list(lengths)}")

    def joined(x: State, level: int) -> State:
        if len(lengths) != len(x) or max(lengths) > x.shape[1]:
            raise ValueError(f"lengths {list(lengths)} do not fit a state of {len(x)} rows of {x.shape[1]} tokens")
        x = x.copy()
        a = (np.arange(overlap, dtype=x.dtype) / overlap).reshape((-1,) + (1,) * (x.ndim - 2))
        for row in range(1, len(lengths)):
            end = slice(lengths[row - 1] - overlap, lengths[row - 1])
            shared = (1.0 - a) * x[row - 1, end] + a * x[row, :overlap]
            x[row - 1, end] = shared
            x[row, :overlap] = shared
        return x

    return joined


def chain(*constraints: Constraint) -> Constraint:
    """The constraints one after the other, the first one first; none at all leaves the state alone."""

    def all_of_them(x: State, level: int) -> State:
        for constrain in constraints:
            x = constrain(x, level)
        return x

    return all_of_them
