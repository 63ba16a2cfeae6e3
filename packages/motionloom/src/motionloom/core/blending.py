"""Fades: how one thing passes into another. Plain arithmetic, for numpy arrays and torch tensors alike.

``u`` is how far the fade has got, from 0 to 1; what comes back has its shape.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core.arrays import Numbers

Array = NDArray[np.float64]


def smoothstep(u: Numbers) -> Numbers:
    """From 0 to 1, without slope at both ends (a cubic); 0 before and 1 behind."""
    u = u.clip(0, 1)
    return u * u * (3 - 2 * u)


def smootherstep(u: Numbers) -> Numbers:
    """The same without curvature at both ends (a quintic)."""
    u = u.clip(0, 1)
    return u**3 * (10 - 15 * u + 6 * u**2)


def hermite(u: Numbers) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    """Weights of the first value, the first slope, the last value and the last slope of a cubic at ``u``.

    Slopes are changes over the whole stretch.
    """
    return 2 * u**3 - 3 * u**2 + 1, u**3 - 2 * u**2 + u, 3 * u**2 - 2 * u**3, u**3 - u**2


def cubic_decay(u: Any) -> tuple[Any, Any]:
    """Weights of a difference and of its slope (over the whole stretch) that both die down to 0 at ``u`` = 1.

    Added to what comes behind a border, a difference and its slope there are taken up without a jump: "inertialization"
    (Bollo, GDC 2018) with a cubic.
    """
    return (1 - u) ** 2 * (1 + 2 * u), (1 - u) ** 2 * u


def quintic_decay(u: Any) -> tuple[Any, Any]:
    """As `cubic_decay`, without curvature at both ends."""
    return 1 - 10 * u**3 + 15 * u**4 - 6 * u**5, u - 6 * u**3 + 8 * u**4 - 3 * u**5


def shares(count: int) -> Array:
    """(count,) evenly spread numbers strictly between 0 and 1."""
    return np.arange(1, count + 1) / (count + 1)


def crossfade(first: Array, second: Array, u: Array | float) -> Array:
    """``first`` where ``u`` is 0, ``second`` where it is 1, a straight mixture between; ``u`` broadcasts."""
    return first * (1 - u) + second * u
