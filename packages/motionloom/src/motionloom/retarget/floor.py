"""Where the ground is, by what planted feet say.

Recorded floors are never quite level: across a CMU walk of four metres planted toes drift up or down by as much
as 5 cm, and the two feet of one body differ by a centimetre. So the ground is a plane per foot, with one small
slope, fitted to the places of slow, low toes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.retarget.axes import FEET, TOES

Array = NDArray[np.float64]

SLOW = 0.3
"""Metres per second below which a low toe counts as planted."""
NEAR = 0.12
"""Metres above the lowest toe within which a slow toe may be planted."""
STEEPEST = 0.025
"""Slopes above this are stairs or hills and no fault of the recording: they stay."""
AIRBORNE = 0.25
"""Metres: a clip whose feet are never lower than this (hanging, climbing) keeps y = 0 as its floor."""


@dataclass(frozen=True, eq=False)
class Stance:
    """The ground under a clip, in the source's world."""

    levels: Array
    """(2,) metres: height of the planted left and right toe joint above the origin of the plane."""
    slope: Array
    """(2,) rise of the ground per metre along x and z."""
    flat: NDArray[np.bool_]
    """(frames, 2) whether the left and the right foot stands flat: toe planted, ankle still."""
    airborne: bool = False
    """Whether the feet are never on the ground, which then is y = 0."""

    def ground(self, points: Array) -> Array:
        """(..., 2) height under points (..., 3) at which the left and the right toe joint are planted."""
        return self.levels + (points[..., [0, 2]] @ self.slope)[..., None]

    def on_floor(self, height: float, *, slack: float) -> "Stance":
        """The stance where the floor is known to be y = 0, on which toes stand at ``height``.

        Feet that never come as low are in the air or on something, and stay there. Where planted feet are lower by
        more than ``slack``, they are on another floor after all.
        """
        if not self.airborne and float(self.levels.min()) < height - slack:
            return self
        near = self.levels < height + slack
        return Stance(np.full(2, height), np.zeros(2), self.flat & near)

    def under(self, toes: Array) -> Array:
        """(..., 2) height of the ground under the left and right toe (..., 2, 3)."""
        return self.levels + toes[..., [0, 2]] @ self.slope


def read_stance(places: Array, fps: float) -> Stance:
    """Measure planted feet in (frames, 22, 3) metres."""
    toes = places[:, TOES]
    heights, slow = toes[..., 1], _speed(toes, fps) < SLOW
    flat = slow & (_speed(places[:, FEET], fps) < SLOW)
    lowest = float(np.percentile(heights.min(axis=1), 5))
    planted = slow & (heights < lowest + NEAR)
    if lowest > AIRBORNE:
        return Stance(np.zeros(2), np.zeros(2), planted & False, airborne=True)
    if planted.sum() < 3:
        return Stance(np.full(2, lowest), np.zeros(2), planted & flat)
    levels, slope = _plane(toes, planted)
    if np.linalg.norm(slope) > STEEPEST:
        levels, slope = _plane(toes, planted, level=True)
    above = heights - Stance(levels, slope, flat).under(toes)
    return Stance(levels, slope, planted & flat & (above < 0.03))


def _speed(points: Array, fps: float) -> Array:
    """Metres per second of (frames, joints, 3)."""
    if len(points) < 2:
        return np.zeros(points.shape[:2])
    return np.linalg.norm(np.gradient(points, axis=0), axis=-1) * fps


def _plane(toes: Array, planted: NDArray[np.bool_], *, level: bool = False) -> tuple[Array, Array]:
    """Least absolute deviations by reweighting, held back towards equal feet and level ground."""
    frames, feet = np.nonzero(planted)
    points = toes[frames, feet]
    middle = points.mean(axis=0)
    rows = np.zeros((len(points), 4))
    rows[np.arange(len(points)), feet] = 1.0
    if not level:
        rows[:, 2:] = (points - middle)[:, [0, 2]]
    hold = np.array([[0.1, -0.1, 0, 0], [0, 0, 0.2, 0], [0, 0, 0, 0.2]])
    weight = np.ones(len(points))
    answer = np.zeros(4)
    for _ in range(20):
        total = weight.sum()
        left = np.einsum("ni,n,nj->ij", rows, weight, rows) + total * hold.T @ hold
        left += np.eye(4) * 1e-9 * total
        # a foot never planted takes the other's level: the first row of `hold` says so
        right = np.einsum("ni,n,n->i", rows, weight, points[:, 1])
        answer = np.linalg.solve(left, right)
        weight = 1.0 / np.maximum(np.abs(points[:, 1] - rows @ answer), 0.003)
    slope = answer[2:]
    return answer[:2] - float(middle[[0, 2]] @ slope), slope


def level(places: Array, fps: float) -> Array:
    """(frames, 22, 3) with the ground made level at y = 0: heights change by the fitted plane, nothing else does."""
    under = read_stance(places, fps).ground(places).mean(axis=-1)
    return places - under[..., None] * np.array([0.0, 1.0, 0.0])
