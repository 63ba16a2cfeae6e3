"""Whether a body is a person's: the pelvis in line with the trunk, the trunk as long as it is, joints within limits.

A motion may do all that its words say with a body that nobody has: the pelvis folded back under a trunk that is half as
long, a knee that bends forwards. Limits are those of recorded people in all they do, lying, crawling, sitting, bowing
and cartwheels included (docs/evaluate.md), with a little room.

Every function takes ``positions`` (frames, 22, 3) in metres, SMPL joint order, +Y up.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.kinematics.physics import Array, J

PELVIS, PELVIS_BENT = 45.0, 65.0
"""Degrees between pelvis and trunk: of somebody upright or stretched out, and of one whose hips or back are bent."""
BENT = 60.0
"""Degrees between a thigh and the trunk, 0 in one line, from which on the hips are bent."""
TRUNK = 0.6
"""Shortest way from the hips to the shoulders, in lengths of the spine between them."""
HEAD = 0.7
"""Shortest way from the hips to the head, in the same lengths."""
UPRIGHT = 45.0
"""Degrees: somebody whose trunk leans less has the head above the hips by `ABOVE` lengths of the spine."""
ABOVE = 0.3
KNEE, KNEE_BACK, ELBOW = 170.0, 30.0, 165.0
"""Degrees: how far knees bend, and bend to the front; how far elbows bend."""
SHORT = 0.05
"""Lengths of the spine: a pelvis nearer to the middle of the hips, as some skeletons have it, is in line."""
ENOUGH = 0.9
"""Share of the frames in which a whole body is whole."""
RESTING, LOWEST_SHOULDERS = 0.45, 0.22
"""Lengths of the spine: both wrists of arms that hang are so far below the shoulders; shoulders at rest are less below
the neck."""


@dataclass(frozen=True, eq=False)
class Angles:
    """The bends of a body, in degrees."""

    pelvis: Array
    """(frames,) between the lines from the middle of the hips to the pelvis and to the middle of the shoulders."""
    spine: Array
    """(frames,) between the lower half of the back (hips to the middle joint of the spine) and the upper (to the neck).
    """
    neck: Array
    """(frames,) between the line from hips to shoulders (middles) and the one from there to the head."""
    knees: Array
    """(frames, 2) 0 straight; minus where the knee bends to the front, as nobody's does."""
    elbows: Array
    """(frames, 2) 0 straight."""


def angles(positions: np.ndarray) -> Angles:
    """The bends of a body in every frame."""
    p = np.asarray(positions, dtype=np.float64)
    hips, shoulders = p[:, _HIPS].mean(axis=1), p[:, _SHOULDERS].mean(axis=1)
    thighs, shins = p[:, _KNEES] - p[:, _HIPS], p[:, _ANKLES] - p[:, _KNEES]
    trunk = shoulders - hips
    knees = _between(thighs, shins)
    # a bird's leg: knee and ankle bend the same way round, and the knee's hinge points to the other side of the hips
    hinge = np.cross(thighs, shins)
    ahead = np.cross(shins, p[:, _TOES] - p[:, _ANKLES])
    left = (p[:, _HIPS[0]] - p[:, _HIPS[1]])[:, None]
    forwards = (_between(hinge, ahead) < 60.0) & (_between(hinge, left) > 120.0)
    return Angles(
        pelvis=_between(p[:, 0] - hips, trunk),
        spine=_between(p[:, J["spine2"]] - hips, p[:, J["neck"]] - p[:, J["spine2"]]),
        neck=_between(trunk, p[:, J["head"]] - shoulders),
        knees=np.where(forwards, -knees, knees),
        elbows=_between(p[:, _ELBOWS] - p[:, _SHOULDERS], p[:, _WRISTS] - p[:, _ELBOWS]),
    )


def shoulders_below(positions: np.ndarray) -> Array:
    """(n,) lengths of the spine down from the neck joint to the middle of the shoulders, where both arms hang.

    Of people fitted to the 22 joints it is 0.11 to 0.18.
    """
    p = np.asarray(positions, dtype=np.float64)
    back = _spine(p)
    below, hang = _below_neck(p, back)
    return below[hang] / back


def whole_frames(positions: np.ndarray) -> NDArray[np.bool_]:
    """(frames,) bool: whether the body is a person's in each."""
    broken = np.stack(list(broken_frames(positions).values()))
    return np.asarray(~broken.any(axis=0), dtype=np.bool_)


def broken_frames(positions: np.ndarray) -> dict[str, NDArray[np.bool_]]:
    """(frames,) bool by what is wrong: ``pelvis``, ``trunk``, ``head``, ``knees``, ``elbows``, ``shoulders``."""
    p = np.asarray(positions, dtype=np.float64)
    bend = angles(p)
    hips, shoulders, head = p[:, _HIPS].mean(axis=1), p[:, _SHOULDERS].mean(axis=1), p[:, J["head"]]
    trunk = shoulders - hips
    back, rise = _spine(p), np.linalg.norm(p[:, 0] - hips, axis=-1)
    lean = _between(trunk, np.array([0.0, 1.0, 0.0]))
    at_hips = _between(hips[:, None] - p[:, _KNEES], trunk[:, None]).max(axis=1)
    bent = (at_hips > BENT) | (lean > UPRIGHT)
    length = np.linalg.norm(head - hips, axis=-1)
    below, hang = _below_neck(p, back)
    faults = {
        "pelvis": (bend.pelvis > np.where(bent, PELVIS_BENT, PELVIS)) & (rise > SHORT * back),
        "trunk": np.linalg.norm(trunk, axis=-1) < TRUNK * back,
        "head": (length < HEAD * back) | ((lean < UPRIGHT) & ((head - hips)[:, 1] < ABOVE * back)),
        "knees": ((bend.knees > KNEE) | (bend.knees < -KNEE_BACK)).any(axis=1),
        "elbows": (bend.elbows > ELBOW).any(axis=1),
        "shoulders": hang & (below > LOWEST_SHOULDERS * back),
    }
    return {name: np.asarray(frames, dtype=np.bool_) for name, frames in faults.items()}


def wholeness(positions: np.ndarray) -> float:
    """Share of the frames in which the body is a person's; `ENOUGH` of them make a whole one."""
    return float(whole_frames(positions).mean())


_HIPS, _KNEES = (J["left_hip"], J["right_hip"]), (J["left_knee"], J["right_knee"])
_ANKLES, _TOES = (J["left_ankle"], J["right_ankle"]), (J["left_foot"], J["right_foot"])
_SHOULDERS, _ELBOWS = (J["left_shoulder"], J["right_shoulder"]), (J["left_elbow"], J["right_elbow"])
_WRISTS = (J["left_wrist"], J["right_wrist"])
_BACK = (0, J["spine1"], J["spine2"], J["spine3"], J["neck"])


def _below_neck(p: Array, back: float) -> tuple[Array, NDArray[np.bool_]]:
    """(frames,) metres down the trunk from the neck to the middle of the shoulders, and whether both arms hang."""
    up, shoulders = p[:, J["neck"]] - p[:, 0], p[:, _SHOULDERS].mean(axis=1)
    up = up / np.maximum(np.linalg.norm(up, axis=-1, keepdims=True), 1e-9)
    hang = (((shoulders[:, None] - p[:, _WRISTS]) * up[:, None]).sum(axis=-1) > RESTING * back).all(axis=1)
    return ((p[:, J["neck"]] - shoulders) * up).sum(axis=-1), np.asarray(hang, dtype=np.bool_)


def _spine(p: Array) -> float:
    """Metres along the joints from pelvis to neck, median over the frames."""
    steps = np.linalg.norm(np.diff(p[:, _BACK], axis=1), axis=-1)
    return float(np.median(steps.sum(axis=1)))


def _between(a: Array, b: Array) -> Array:
    """Degrees between vectors (..., 3); 0 where one has no length."""
    across = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.degrees(np.arctan2(across, (a * b).sum(axis=-1)))
