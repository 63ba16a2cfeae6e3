"""Steps of a recorded gait, and the same steps placed elsewhere: stances, foothold by foothold, and time of its own.

A *stance* is a stretch in which a foot is on the floor. A manner moves every stance as a rigid whole (`moved_feet`), so
a foot that stood still in the recording stands still in what is made of it; in between the two placements are blended
by the share of the way that the recorded foot has covered.
"""

from dataclasses import dataclass

import numpy as np

from motionloom.core.body.feet import correction, planted_feet
from motionloom.core.features import humanml as hml
from motionloom.core.skeleton import SMPL22
from motionloom.kinematics import physics as ph
from motionloom.kinematics.gestures import true_spans
from motionloom.kinematics.physics import Array
from motionloom.retarget import limbs

FEET = ((1, 4, 7, 10, 1.0), (2, 5, 8, 11, -1.0))
"""Hip, knee, ankle, toes and the sign of outward along +X: left, right."""
LENGTHS = SMPL22.bone_lengths()
Spans = tuple[tuple[tuple[int, int], ...], tuple[tuple[int, int], ...]]
"""Half-open frames of the stances of the left foot and the right one."""


@dataclass(frozen=True, eq=False)
class Gait:
    """A body and its steps."""

    places: Array
    """(frames, 22, 3) metres, on bones of the uniform person's lengths."""
    planted: np.ndarray
    """(frames, 4) bool: left ankle, left toes, right ankle, right toes are on the floor and still."""
    fps: float

    @property
    def spans(self) -> Spans:
        """Stances of both feet, of three frames and more."""
        left, right = (
            tuple(s for s in true_spans(self.planted[:, 2 * i : 2 * i + 2].any(axis=1)) if s[1] - s[0] > 2)
            for i in (0, 1)
        )
        return left, right

    @property
    def standing(self) -> np.ndarray:
        """(frames, 2) bool: the left foot stands, the right foot stands."""
        return np.stack([self.planted[:, :2].any(axis=1), self.planted[:, 2:].any(axis=1)], axis=-1)

    def support(self) -> Array:
        """(frames,) from -1, where the right leg alone carries the body, to 1, the left one; smooth."""
        stands = self.standing.astype(float)
        return ph.smooth(ph.smooth(stands[:, 0] - stands[:, 1], 5), 3)

    def stride(self) -> Array:
        """(frames,) from -1 (the left foot is ahead) to 1 (the right one), by the distance of the ankles."""
        ahead = ph.in_body(self.places)[:, [8, 7], 2] @ np.array([1.0, -1.0])
        return ahead / max(float(np.percentile(np.abs(ahead), 95)), 0.15)


def read_gait(places: Array, fps: float) -> Gait:
    """The steps of (frames, 22, 3) metres, whose planted feet are locked to where they stand."""
    planted = planted_feet(places, fps)
    locked = places.copy()
    for i, (_, _, ankle, toes, _) in enumerate(FEET):
        moved = correction(places[:, ankle], places[:, toes], planted[:, 2 * i : 2 * i + 2], fps, level=True)
        locked[:, [ankle, toes]] += moved[:, None]
    return Gait(with_bones(locked, locked[:, [7, 8]], locked[:, [10, 11]]), planted, fps)


def retimed(gait: Gait, rate: Array) -> Gait:
    """The gait with ``rate`` (frames,) seconds of the recording in one second at every frame of it."""
    rate = ph.smooth(rate, 5)
    passed = np.concatenate([[0.0], np.cumsum(2 / (rate[1:] + rate[:-1]))])
    at = np.interp(np.arange(int(passed[-1]) + 1), passed, np.arange(len(rate)))
    places = hml.positions_at(gait.places, at)
    places = with_bones(places, places[:, [7, 8]], places[:, [10, 11]])
    return Gait(places, gait.planted[np.round(at).astype(int)], gait.fps)


def moved_feet(gait: Gait, point: Array, spans: tuple[tuple[int, int], ...], put: Array, turn: Array) -> Array:
    """A joint (frames, 3) of a foot, each stance of which goes as a rigid whole to where it belongs.

    Args:
        gait: the steps as recorded.
        point: (frames, 3) metres, the joint as recorded.
        spans: stances of its foot.
        put: (stances, 2, 3) metres: from where to where a stance goes on the ground.
        turn: (stances,) radians by which it turns there, to the left.

    Returns:
        (frames, 3) metres.
    """
    images = [ph.turned(point - a, -t) + b for (a, b), t in zip(put, turn, strict=True)]
    result = images[0].copy()
    for k, (start, stop) in enumerate(spans):
        result[start:] = images[k][start:]
        if k + 1 < len(spans):
            after = spans[k + 1][0]
            way = point[stop - 1 : after + 1]
            covered = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0)[:, [0, 2]], axis=-1))])
            share = (covered / max(float(covered[-1]), 1e-6))[:, None]
            swing = slice(stop - 1, after + 1)
            result[swing] = images[k][swing] * (1 - share) + images[k + 1][swing] * share
    return result


def with_bones(places: Array, ankles: Array, toes: Array, ahead: Array | None = None) -> Array:
    """(frames, 22, 3) metres with bones of the uniform person's lengths: trunk and arms keep their directions, legs
    reach their ankles where they are long enough.

    Args:
        places: (frames, 22, 3) metres.
        ankles, toes: (frames, 2, 3) metres, where the feet belong.
        ahead: (frames, 2, 3), where knees point that are straight; None: as the feet do.
    """
    result = places.copy()
    for joint in range(1, 22):
        parent = SMPL22.parents[joint]
        if joint not in (4, 5, 7, 8, 10, 11):
            bone = places[:, joint] - places[:, parent]
            result[:, joint] = result[:, parent] + LENGTHS[joint] * limbs.unit(bone)
    for i, (hip, knee, ankle, toe, _) in enumerate(FEET):
        foot = limbs.unit(toes[:, i] - ankles[:, i])
        level = limbs.unit(foot * [1, 0, 1]) if ahead is None else ahead[:, i]
        line = limbs.unit(ankles[:, i] - result[:, hip])
        bent = limbs.beside(places[:, knee] - places[:, hip], limbs.unit(places[:, ankle] - places[:, hip]))
        pole = bent / 0.02 + limbs.beside(level, line)
        upper, lower = float(LENGTHS[knee]), float(LENGTHS[ankle])
        result[:, knee], result[:, ankle] = limbs.bend(result[:, hip], ankles[:, i], pole, upper=upper, lower=lower)
        result[:, toe] = result[:, ankle] + LENGTHS[toe] * foot
    return result
