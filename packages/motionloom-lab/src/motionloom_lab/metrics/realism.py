"""Realism of motions as a row of numbers each, and groups of motions compared.

A generated group is compared with real clips of the same kind: 20 frames per second, the uniform person, the floor at
y = 0. A number may be up to 1.5 times the real one, or smaller than anybody can see.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motionloom.core.reading import read_table
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array

LIMIT = 1.5
"""How many times the real number is still taken for real."""


@dataclass(frozen=True)
class Number:
    """One number of realism."""

    name: str
    meaning: str
    unseen: float
    """At or below this nobody sees it, however small the real number is."""
    both_ways: bool = False
    """True where too little is as wrong as too much."""
    typical: bool = False
    """Median over clips instead of the mean: a few clips on ladders must not speak for all."""


NUMBERS: tuple[Number, ...] = tuple(
    Number(name, **row) for name, row in read_table("motionloom_lab.suites", "realism.toml").items()
)


def realism(positions: np.ndarray, fps: float) -> dict[str, float]:
    """The numbers of `NUMBERS` for one clip; ``positions`` (frames, 22, 3) metres, the floor at y = 0."""
    p = np.asarray(positions, dtype=np.float64)
    skate, jerk, pace = ph.foot_skate(p, fps), ph.jerk(p, fps), ph.speed(p, fps)
    limbs = np.linalg.norm(ph.velocity(ph.in_body(p)[:, [*ph.WRISTS, *ph.ANKLES]], fps), axis=-1)
    return {
        "skate_ratio": skate.ratio,
        "skate_speed": skate.contact_speed,
        "skate_weighted": skate.weighted,
        "penetration": 100 * ph.penetration(p),
        "float": 100 * ph.float_height(p),
        "jerk": jerk.mean,
        "jerk_peak": jerk.peak,
        "bone_error": 1000 * ph.bone_length_error(p),
        "speed_median": float(np.median(pace)),
        "speed_fast": float(np.percentile(pace, 90)),
        "limb_speed": float(limbs.mean()),
    }


def average(clips: Sequence[Array], fps: float) -> dict[str, float]:
    """Mean of each number over clips, weighted by length; the median where the number is ``typical``."""
    if not clips:
        return {number.name: float("nan") for number in NUMBERS}
    rows = [realism(clip, fps) for clip in clips]
    weights = np.array([len(clip) for clip in clips], dtype=np.float64)
    columns = {n: np.array([row[n.name] for row in rows]) for n in NUMBERS}
    return {n.name: float(np.median(v) if n.typical else np.average(v, weights=weights)) for n, v in columns.items()}


@dataclass(frozen=True)
class Comparison:
    """One number of generated motions beside the real one."""

    number: Number
    generated: float
    real: float

    @property
    def ratio(self) -> float:
        """Generated over real; infinite where the real number is 0."""
        if self.real == 0:
            return 1.0 if self.generated == 0 else float("inf")
        return self.generated / self.real

    @property
    def passes(self) -> bool:
        """Within `LIMIT` of real (either way where too little is wrong as well), or too small to see."""
        if abs(self.generated - self.real * self.number.both_ways) <= self.number.unseen:
            return True
        return self.ratio <= LIMIT and (not self.number.both_ways or self.ratio >= 1 / LIMIT)


def compare(generated: dict[str, float], real: dict[str, float]) -> list[Comparison]:
    """Every number of two averages."""
    return [Comparison(number, generated[number.name], real[number.name]) for number in NUMBERS]


def speed_distance(generated: Sequence[Array], real: Sequence[Array], fps: float) -> float:
    """m/s: Wasserstein-1 distance of the pelvis speeds of all frames of two groups of clips."""
    levels = (np.arange(200) + 0.5) / 200
    quantiles = [np.quantile(np.concatenate([ph.speed(c, fps) for c in clips]), levels) for clips in (generated, real)]
    return float(np.abs(quantiles[0] - quantiles[1]).mean())
