"""A body as capsules over the bones of the 22 joints: how near bodies come, and how deep one is in another.

Places are metres, +Y up, in one world.
"""

import numpy as np

from motionloom.core.arrays import true_spans
from motionloom.kinematics.physics import WRISTS, Array, J

DEEP = 0.02
"""Metres of overlap that are no touch any more: skin and cloth give way as much."""
TOGETHER = 400
"""Frames that are measured at once: memory does not grow with the length."""
_HEIGHT = 1.6038
"""Metres: the uniform person as the project draws it."""


def _at(**weights: float) -> tuple[tuple[int, float], ...]:
    return tuple((J[name], weight) for name, weight in weights.items())


def _limb(start: str, end: str, first: float, last: float) -> tuple:
    return _at(**{start: 1.0}), _at(**{end: 1.0}), first, last


def _side(side: str) -> tuple[tuple, ...]:
    bones = (
        ("hip", "knee", 0.0738),
        ("knee", "ankle", 0.0561),
        ("ankle", "foot", 0.0337),
        ("shoulder", "elbow", 0.0481),
        ("elbow", "wrist", 0.0366),
    )
    return tuple(_limb(f"{side}_{a}", f"{side}_{b}", r, 0.74 * r) for a, b, r in bones)


CAPSULES: tuple[tuple, ...] = (
    *_side("left"),
    *_side("right"),
    _limb("spine3", "neck", 0.0417, 0.0309),
    _limb("neck", "head", 0.0237, 0.0175),
    # the head of the drawn figure: a ball of 5.5 % of the height over the head's joint
    (_at(head=1.47, neck=-0.47), _at(head=1.99, neck=-0.99), 0.052 * _HEIGHT, 0.052 * _HEIGHT),
    # the trunk is wider than deep: pelvis and chest lie across, the belly is upright; radii are the drawn half depths
    (_at(left_hip=1.0), _at(right_hip=1.0), 0.050 * _HEIGHT, 0.050 * _HEIGHT),
    (_at(pelvis=1.0), _at(spine3=1.0), 0.055 * _HEIGHT, 0.055 * _HEIGHT),
    (
        _at(spine3=0.5, left_shoulder=0.4, right_shoulder=0.1),
        _at(spine3=0.5, left_shoulder=0.1, right_shoulder=0.4),
        0.050 * _HEIGHT,
        0.050 * _HEIGHT,
    ),
)
"""The body that the project draws (`viz.figure`, `io.body`) as capsules: ends as weighted joints, radii in metres."""
ARMS = (3, 4, 8, 9)
"""Numbers of the capsules that are arms; the others are trunk, head and legs."""
RADII: Array = np.array([capsule[2:] for capsule in CAPSULES])
"""(capsules, 2) metres at both ends, for the uniform person."""


def _weights() -> Array:
    weights = np.zeros((len(CAPSULES), 2, 22))
    for number, capsule in enumerate(CAPSULES):
        for end in (0, 1):
            for joint, weight in capsule[end]:
                weights[number, end, joint] = weight
    return weights


_WEIGHTS = _weights()


def capsule_ends(positions: np.ndarray) -> Array:
    """(frames, capsules, 2, 3) metres: both ends of one person's `CAPSULES` from (frames, 22, 3)."""
    return np.einsum("cej,fjx->fcex", _WEIGHTS, np.asarray(positions, dtype=np.float64))


def gaps(a: Array, radii_a: Array, b: Array, radii_b: Array) -> Array:
    """(frames, n, m) metres between surfaces of capsules (frames, n, 2, 3) and (frames, m, 2, 3); below 0 they overlap.

    Between the closest points of the axes, with the radii there: exact for capsules of one radius, within a
    millimetre or two for these, which taper slowly.
    """
    s, t, apart = closest(a[:, :, None], b[:, None])
    thick = [r[..., 0] + share * (r[..., 1] - r[..., 0]) for r, share in ((radii_a[:, None], s), (radii_b[None], t))]
    return apart - thick[0] - thick[1]


def closest(a: np.ndarray, b: np.ndarray) -> tuple[Array, Array, Array]:
    """Where two line segments (..., 2, 3) are nearest: shares (...) along each and the distance (...).

    Ericson, Real-Time Collision Detection, 2005, section 5.1.9; a segment may be a point.
    """
    d1, d2, r = a[..., 1, :] - a[..., 0, :], b[..., 1, :] - b[..., 0, :], a[..., 0, :] - b[..., 0, :]
    aa, ee, bb = (d1 * d1).sum(-1), (d2 * d2).sum(-1), (d1 * d2).sum(-1)
    c, f = (d1 * r).sum(-1), (d2 * r).sum(-1)
    tiny = 1e-12
    across = aa * ee - bb * bb
    s = np.where(across > tiny, np.clip((bb * f - c * ee) / np.maximum(across, tiny), 0.0, 1.0), 0.0)
    t = np.clip((bb * s + f) / np.maximum(ee, tiny), 0.0, 1.0)
    s = np.where(aa > tiny, np.clip((bb * t - c) / np.maximum(aa, tiny), 0.0, 1.0), 0.0)
    gap = r + s[..., None] * d1 - t[..., None] * d2
    return s, t, np.linalg.norm(gap, axis=-1)


def overlap(first: np.ndarray, second: np.ndarray) -> Array:
    """(frames,) metres: how deep the deepest capsule of one body is in a capsule of the other; 0 where none touch.

    first, second: (frames, 22, 3) metres in one world.
    """
    ends = capsule_ends(first), capsule_ends(second)
    depth = np.zeros(len(ends[0]))
    for start in range(0, len(depth), TOGETHER):
        a, b = (each[start : start + TOGETHER] for each in ends)
        depth[start : start + TOGETHER] = -gaps(a, RADII, b, RADII).min(axis=(1, 2))
    return np.maximum(depth, 0.0)


def overlaps(first: np.ndarray, second: np.ndarray, fps: float) -> list[dict[str, float]]:
    """The stretches in which one body is in the other: ``begin`` and ``end`` in seconds, ``depth`` in metres.

    Shapes as of `overlap`; what is no deeper than `DEEP` is a touch.
    """
    depth = overlap(first, second)
    return [
        {"begin": round(start / fps, 3), "end": round(stop / fps, 3), "depth": round(float(depth[start:stop].max()), 3)}
        for start, stop in true_spans(depth > DEEP)
    ]


def trunk_distance(first: np.ndarray, second: np.ndarray) -> Array:
    """(frames,) metres between the axes of two trunks, from pelvis to neck; shapes as of `overlap`."""
    ends = [np.asarray(one, dtype=np.float64)[:, [J["pelvis"], J["neck"]]] for one in (first, second)]
    return closest(*ends)[2]


def wrist_distance(first: np.ndarray, second: np.ndarray) -> Array:
    """(frames,) metres between the two people's nearest wrists; shapes as of `overlap`."""
    hands = [np.asarray(one, dtype=np.float64)[:, WRISTS] for one in (first, second)]
    return np.asarray(np.linalg.norm(hands[0][:, :, None] - hands[1][:, None], axis=-1).min(axis=(1, 2)))
