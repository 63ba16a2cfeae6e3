"""How smooth transitions are: peak jerk, area under the jerk, and the step across a seam.

Barquero et al., Seamless Human Motion Composition with Blended Positional Encodings (FlowMDM), CVPR 2024, as its code
computes them. Units are metres per frame cubed (no division by the time step), so numbers of one frame rate, window
length and skeleton are comparable, and no others. `motionloom.kinematics.physics.jerk` is the per-second kind.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from motionloom.core.errors import MotionloomError
from motionloom_lab.metrics.retrieval import Array

JERK_HUMANML3D = 0.033031363
"""Mean jerk of real HumanML3D clips (20 fps), m/frame^3; windows of 60 frames."""
JERK_BABEL = 0.016383045
"""Mean jerk of real BABEL clips (30 fps), m/frame^3; windows of 30 frames."""
_JOINTS = 22


def sequence_jerk(positions: ArrayLike, lengths: Sequence[int] | None = None) -> Array:
    """(B, T - 3) m/frame^3: sum over x, y, z of the absolute third difference, largest of the 22 joints.

    ``positions`` (B, T, 22, 3) metres; ``lengths`` (B,) are the valid frames of each (default: all). Entry n belongs to
    frames n .. n + 3; entries from ``length - 3`` on are 0.
    """
    p = joints(positions, 4)
    valid = _lengths(lengths, p)
    third = np.abs(np.diff(p, n=3, axis=1)).sum(axis=-1).max(axis=-1)
    return np.where(np.arange(third.shape[1]) < valid[:, None] - 3, third, 0.0)


def jerk_curve(positions: ArrayLike, lengths: Sequence[int] | None = None) -> Array:
    """(T - 3,) m/frame^3: `sequence_jerk` averaged over the B transitions, the zeros of short ones included."""
    return sequence_jerk(positions, lengths).mean(axis=0)


def mean_jerk(positions: ArrayLike, lengths: Sequence[int] | None = None) -> float:
    """m/frame^3: mean of `sequence_jerk` over the valid frames, the reference that a new data set needs."""
    p = joints(positions, 4)
    return float(sequence_jerk(p, lengths).sum() / (_lengths(lengths, p) - 3).sum())


def peak_jerk(curve: ArrayLike) -> float:
    """PJ, m/frame^3: the largest value of an averaged curve; good where it is near that of real motion."""
    return float(_curve(curve).max())


def area_under_jerk(curve: ArrayLike, reference: float) -> float:
    """AUJ, m/frame^3: sum over frames of |curve - reference|, the mean jerk of real motion; down is better."""
    if not (np.isfinite(reference) and reference >= 0):
        raise MotionloomError(f"the reference jerk is a length of real motion, not {reference}.")
    return float(np.abs(_curve(curve) - reference).sum())


def transition_distance(positions: ArrayLike, seams: Sequence[int]) -> Array:
    """(seams,) metres: mean over joints of the step between the last frame before and the first frame of a seam.

    ``positions`` (T, 22, 3) metres; a seam is the number of the first frame of the later part. Athanasiou et al.,
    TEACH, 3DV 2022.
    """
    p = joints(np.asarray(positions)[None], 2)[0]
    at = np.asarray(seams)
    if at.ndim != 1 or at.size == 0 or at.dtype.kind not in "iu" or at.min() < 1 or at.max() >= len(p):
        raise MotionloomError(f"seams are frame numbers from 1 to {len(p) - 1}, not {list(np.ravel(at))[:5]}.")
    return np.linalg.norm(p[at] - p[at - 1], axis=-1).mean(axis=-1)


def joints(positions: ArrayLike, frames: int) -> Array:
    """``positions`` as (B, T, 22, 3) float64, at least one sequence of ``frames`` frames, finite; else a complaint."""
    p = np.asarray(positions)
    if p.ndim != 4 or p.shape[2:] != (_JOINTS, 3) or len(p) == 0 or p.dtype.kind not in "fiu":
        raise MotionloomError(f"positions are metres (sequences, frames, {_JOINTS}, 3), not {p.dtype} {p.shape}.")
    if p.shape[1] < frames:
        raise MotionloomError(f"positions have {p.shape[1]} frames where at least {frames} are needed.")
    if not np.isfinite(p).all():
        raise MotionloomError("positions hold numbers that are not finite: check what was generated.")
    return p.astype(np.float64)


def _lengths(lengths: Sequence[int] | None, positions: Array) -> np.ndarray:
    frames = positions.shape[1]
    valid = np.full(len(positions), frames) if lengths is None else np.asarray(lengths)
    if valid.shape != (len(positions),) or valid.dtype.kind not in "iu" or valid.min() < 4 or valid.max() > frames:
        raise MotionloomError(f"lengths are {len(positions)} frame counts from 4 to {frames}, not {lengths}.")
    return valid


def _curve(curve: ArrayLike) -> Array:
    values = np.asarray(curve, dtype=np.float64)
    if values.ndim != 1 or values.size == 0 or not np.isfinite(values).all():
        raise MotionloomError(f"a jerk curve is one finite number per frame, not {values.shape}.")
    return values
