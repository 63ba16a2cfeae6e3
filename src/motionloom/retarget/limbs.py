"""Two-bone inverse kinematics in closed form: where the knee (or elbow) goes."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def bend(start: Array, goal: Array, pole: Array, *, upper: float, lower: float) -> tuple[Array, Array]:
    """Middle joint and reached end of a two-bone limb, law of cosines.

    ``start``, ``goal`` (..., 3) metres: the limb's beginning and where its end should be; ``pole`` (..., 3): the
    way the middle joint points out (any length; its part along the limb is ignored). A goal out of reach is
    approached on the straight line to it; one too near is pushed out to the nearest distance the bones allow.
    """
    line = goal - start
    distance = np.linalg.norm(line, axis=-1, keepdims=True)
    along = line / np.maximum(distance, 1e-9)
    reach = np.clip(distance, abs(upper - lower) + 1e-9, upper + lower - 1e-9)
    out = pole - (pole * along).sum(-1, keepdims=True) * along
    out = out / np.maximum(np.linalg.norm(out, axis=-1, keepdims=True), 1e-9)
    forward = (upper**2 - lower**2 + reach**2) / (2 * reach)
    height = np.sqrt(np.maximum(upper**2 - forward**2, 0.0))
    return start + forward * along + height * out, start + reach * along
