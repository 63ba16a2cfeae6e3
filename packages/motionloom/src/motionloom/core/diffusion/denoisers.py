"""Denoisers, which estimate the clean data x_0, and edits of their estimates: functions from denoisers to denoisers.

A denoiser answers E[x_0 | x_level]; everything it is conditioned on was bound before the sampler's loop. Here
are the ways to bind and to edit:

    guide       u + s (c - u)                    classifier-free guidance (Ho & Salimans 2022), one network call
    rising      s that grows where little noise is left
    inpaint     (1 - m) denoised + m known          hard (m is 0 or 1) and soft
    from_noise  (x - noise * e) / signal         a network that predicts the noise e
    blend       sum of w_i denoised_i            several models, e.g. DiffusionBlending
"""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias, TypeVar

import numpy as np

from .schedule import Schedule, State

Denoiser: TypeAlias = Callable[[State, int], State]
"""(state, its level) -> estimate of the clean data, of the same shape."""

Weight: TypeAlias = float | np.ndarray | Callable[[int], float | np.ndarray]
"""A factor of an estimate: a number, an array that broadcasts to the state, or either as a function of the level."""

C = TypeVar("C")


def join_rows(first: Any, second: Any) -> Any:
    """The rows of two conditions, one after the other: arrays, None, and (named) tuples of such."""
    if isinstance(first, np.ndarray):
        return np.concatenate([first, second])
    if isinstance(first, tuple):
        parts = [join_rows(a, b) for a, b in zip(first, second, strict=True)]
        return type(first)(*parts) if hasattr(first, "_fields") else tuple(parts)
    if first is None and second is None:
        return None
    raise TypeError(f"cannot join the rows of {type(first).__name__} and {type(second).__name__}: give `join`")


def guide(
    net: Callable[[State, int, C], State],
    cond: C,
    null: C,
    scale: Weight,
    *,
    join: Callable[[C, C], C] = join_rows,
) -> Denoiser:
    """Classifier-free guidance, u + scale * (c - u), as one call of `net` on a doubled batch.

    `net(state, level, condition)` answers the clean data; `cond` and `null` hold one entry per row, with all that
    belongs to rows inside them (also lengths), because the network is shown (conditional rows, unconditional
    rows). `join` puts one condition behind another; it is called once, here. `scale` is a number or an array
    (rows,), or either as a function of the level. Where every scale is 1 only the conditional pass is run, where
    every scale is 0 only the unconditional one; a row with scale 0 or 1 gets exactly that pass's answer beside any
    other rows.
    """
    if callable(scale):
        both = join(cond, null)
        return lambda x, level: guide(net, cond, null, scale(level), join=lambda *_: both)(x, level)
    scales = np.asarray(scale, dtype=np.float64).reshape(-1)
    if not np.isfinite(scales).all():
        raise ValueError("the guidance scale must be finite")
    for only, bound in ((0.0, null), (1.0, cond)):
        if (scales == only).all():
            return lambda x, level: net(x, level, bound)
    both = join(cond, null)

    def guided(x: State, level: int) -> State:
        if len(scales) not in (1, len(x)):
            raise ValueError(f"there are {len(scales)} guidance scales for {len(x)} rows: give one, or one per row")
        conditional, plain = np.split(net(np.concatenate([x, x]), level, both), 2)
        s = scales.astype(x.dtype).reshape((-1,) + (1,) * (x.ndim - 1))
        return lerp(plain, conditional, s)

    return guided


def rising(scale: float, levels: int, factor: float) -> Callable[[int], float]:
    """A guidance scale by level: what it adds to 1 is ``factor`` times as much below a tenth of the ``levels``.

    Above three tenths it is ``scale``, in between it is interpolated; scales up to 1 stay as they are. What the motion
    is has been decided before; how lively its details are has not (growing scales: Wang et al. 2024, *Analysis of
    Classifier-Free Guidance Weight Schedulers*).
    """

    def at(level: int) -> float:
        late = min(max(1.5 - 5 * level / levels, 0.0), 1.0)
        return scale + max(scale - 1, 0.0) * (factor - 1) * late

    return at


def lerp(first: np.ndarray, second: np.ndarray, share: np.ndarray) -> np.ndarray:
    """first + share * (second - first), exact where the share is 0 or 1; it may be larger. The three broadcast."""
    change = second - first
    return np.where(share < 0.5, first + share * change, second - (1 - share) * change)


def inpaint(denoise: Denoiser, known: State, mask: np.ndarray) -> Denoiser:
    """Holds the estimate to `known` where `mask` is 1 (True), leaves it alone at 0, mixes linearly in between."""
    return lambda x, level: mix(denoise(x, level), known, mask)


def mix(free: State, known: State, mask: np.ndarray) -> State:
    """(1 - mask) * free + mask * known; a boolean mask selects. The three broadcast."""
    if mask.dtype == np.bool_:
        return np.where(mask, known, free)
    return (1.0 - mask) * free + mask * known


def from_noise(net: Callable[[State, int], np.ndarray], schedule: Schedule) -> Denoiser:
    """The denoiser of a network that predicts the noise in the state (Ho et al. 2020, eq. 15)."""

    def denoise(x: State, level: int) -> State:
        signal, noise = schedule.at(level)
        return (x - noise * net(x, level)) / signal

    return denoise


def blend(denoisers: Sequence[Denoiser], weights: Sequence[Weight]) -> Denoiser:
    """The weighted sum of several denoised estimates; the weights are used as they are (usually they sum to 1)."""
    if not denoisers or len(denoisers) != len(weights):
        raise ValueError(f"blending needs one weight per denoiser, got {len(weights)} for {len(denoisers)}")

    def blended(x: State, level: int) -> State:
        total = np.zeros_like(x)
        for denoise, weight in zip(denoisers, weights):
            total = total + (weight(level) if callable(weight) else weight) * denoise(x, level)
        return total

    return blended
