"""Whether predicted bodies stay bodies: limbs of one length, joints that bend as they do, no jerk, no step at the seam.

``samples`` (S, F, J, 3) are sampled futures, ``truth`` (F, J, 3) is what came; metres from the root, without
the root itself. Limb metrics: Curreli et al., Nonisotropic Gaussian Diffusion for Realistic 3D Human Motion Prediction
(SkeletonDiffusion), CVPR 2025, as its code computes them. What cannot be measured raises `MotionloomError`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.reading import read_table
from motionloom.kinematics import physics

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Limbs:
    """Lines between joints whose length and angles are looked at; joints are numbered without the root."""

    pairs: tuple[tuple[int, int], ...]
    """(from, to) of each limb."""
    chains: tuple[tuple[int, ...], ...]
    """Numbers of limbs that follow one another; angles are between neighbours of a chain."""

    def __post_init__(self) -> None:
        joints_ok = all(len(pair) == 2 and pair[0] != pair[1] and min(pair) >= 0 for pair in self.pairs)
        chains_ok = all(len(c) >= 2 and min(c) >= 0 and max(c) < len(self.pairs) for c in self.chains)
        if not (self.pairs and joints_ok and chains_ok):
            raise MotionloomError("limbs are pairs of different joints, and chains are two or more numbers of limbs.")

    @property
    def joints(self) -> int:
        """Joints that a pose must have at least."""
        return 1 + max(max(pair) for pair in self.pairs)

    @property
    def angles(self) -> tuple[tuple[int, int], ...]:
        """(limb, limb) of every angle, in the order of the chains."""
        return tuple(pair for chain in self.chains for pair in pairwise(chain))


_H36M = read_table("motionloom_lab.papers", "benchmarks.toml")["h36m"]
H36M_LIMBS = Limbs(tuple((a, b) for a, b in _H36M["limbs"]), tuple(map(tuple, _H36M["chains"])))
"""The limbs of the 16 joints of Human3.6M as SkeletonDiffusion's published evaluation has them."""


def limbs_of(parents: Sequence[int]) -> Limbs:
    """The limbs of a skeleton whose joint 0 is the root (``parents[0] == -1``), numbered without the root.

    As in `H36M_LIMBS` the root's children are joined to one another, and every other joint to its parent. A chain runs
    from the line between two of the root's children down to every tip; each bend is counted once, at a branch for each
    arm. This rule is this project's: angle errors by it compare with one another, not with published ones.
    """
    tree = len(parents) > 2 and parents[0] == -1 and all(0 <= p < j for j, p in enumerate(parents) if j)
    if not tree:
        raise MotionloomError("limbs need the parents of at least three joints, each after its parent, the root first.")
    tops = [j - 1 for j, p in enumerate(parents) if p == 0]
    between = [(a, b) for n, a in enumerate(tops) for b in tops[n + 1 :]]
    bones = [(p - 1, j - 1) for j, p in enumerate(parents) if p > 0]
    pairs = tuple(between + bones)
    chains: list[tuple[int, ...]] = []
    for n, top in enumerate(tops):
        beside = [between.index((min(top, o), max(top, o))) for o in [tops[n - 1 if n else 1 % len(tops)]] if o != top]
        _follow(pairs, len(between), top, beside, chains)
    return Limbs(pairs, tuple(chains))


def _follow(
    pairs: tuple[tuple[int, int], ...], first: int, joint: int, chain: list[int], result: list[tuple[int, ...]]
) -> None:
    """Add the chains that go on from ``joint`` with ``chain`` behind it; ``first`` is the first bone of ``pairs``."""
    out = [n for n in range(first, len(pairs)) if pairs[n][0] == joint]
    if not out and len(chain) > 1:
        result.append(tuple(chain))
    for n, limb in enumerate(out):
        _follow(pairs, first, pairs[limb][1], [*(chain if n == 0 else chain[-1:]), limb], result)


class Stretch(NamedTuple):
    """Limbs against their real mean length, in percent of it; means over limbs and samples."""

    stretch: float
    """Between the mean length of a sample and the real one (the published code, not the paper's wording)."""
    stretch_rmse: float
    """Root of the mean square over frames of what the length is off."""
    jitter: float
    """Mean change of length from one frame to the next."""
    jitter_rmse: float
    """Root of the mean square of that change."""


def stretch(samples: np.ndarray, truth: np.ndarray, limbs: Limbs) -> Stretch:
    """How constant limbs are in ``samples`` (S, F, J, 3), and as long as in ``truth`` (F, J, 3); F >= 2."""
    s, t = as_window(samples, truth, frames=2)
    real = _lengths(t, limbs).mean(axis=0)
    if not (real > 0).all():
        raise MotionloomError("a limb of the real motion has no length, so nothing can be given in percent of it.")
    length = _lengths(s, limbs)
    change = np.diff(length, axis=1)
    errors = (
        np.abs(length.mean(axis=1) - real),
        np.sqrt(np.square(length - real).mean(axis=1)),
        np.abs(change).mean(axis=1),
        np.sqrt(np.square(change).mean(axis=1)),
    )
    return Stretch(*(float(100 * (values / real).mean()) for values in errors))


def angle_error(samples: np.ndarray, truth: np.ndarray, limbs: Limbs) -> float:
    """MAE, degrees: error of the angles between consecutive limbs, mean over frames and angles, of the best sample."""
    s, t = as_window(samples, truth)
    if not limbs.chains:
        raise MotionloomError("these limbs have no chains, so there are no angles between them.")
    return float(np.degrees(np.abs(_bends(s, limbs) - _bends(t, limbs)).mean(axis=(1, 2)).min()))


def _vectors(poses: Array, limbs: Limbs) -> Array:
    """(..., limbs, 3) metres, from the first joint of each limb to the second."""
    if poses.shape[-2] < limbs.joints:
        raise MotionloomError(f"the limbs are those of {limbs.joints} joints, but poses have {poses.shape[-2]}.")
    start, end = zip(*limbs.pairs)
    return poses[..., list(end), :] - poses[..., list(start), :]


def _lengths(poses: Array, limbs: Limbs) -> Array:
    return np.linalg.norm(_vectors(poses, limbs), axis=-1)


def _bends(poses: Array, limbs: Limbs) -> Array:
    """(..., angles) radians."""
    vectors = _vectors(poses, limbs)
    units = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
    one, two = zip(*limbs.angles)
    cos = (units[..., list(one), :] * units[..., list(two), :]).sum(axis=-1)
    return np.arccos(np.clip(cos, -1.0, 1.0))


def jerk(samples: np.ndarray, fps: float) -> physics.Jerk:
    """m/s^3: third difference of joint places, mean and largest over frames and joints; means over samples. F >= 4."""
    s = as_poses(samples, 4, "samples", frames=4)
    each = [physics.jerk(sample, as_rate(fps)) for sample in s]
    return physics.Jerk(float(np.mean([j.mean for j in each])), float(np.mean([j.peak for j in each])))


class Seam(NamedTuple):
    """What jumps where the future sets in; a real clip is not 0 here, so its own values belong beside."""

    velocity: float
    """m/s: jump of velocity, mean over joints."""
    velocity_worst: float
    """m/s: of the joint where it is largest."""
    acceleration: float
    """m/s^2: jump of acceleration, mean over joints."""
    acceleration_worst: float
    """m/s^2: of the joint where it is largest."""


def seam(past: np.ndarray, samples: np.ndarray, fps: float) -> Seam:
    """The step from ``past`` (>= 3 frames, J, 3) into ``samples`` (S, F, J, 3), means over samples.

    A joint's jump of velocity is the largest second difference, its jump of acceleration the largest third difference
    among those that have frames on both sides, so that a jump one frame late is seen too. A future that goes on at
    constant velocity has neither, one that goes on at constant acceleration no jump of acceleration.
    """
    p, s = as_poses(past, 3, "the past", frames=3)[-3:], as_poses(samples, 4, "samples")
    if p.shape[1] != s.shape[2]:
        raise MotionloomError(f"the past has {p.shape[1]} joints and the samples have {s.shape[2]}.")
    around = np.concatenate([np.broadcast_to(p, (len(s), *p.shape)), s[:, :2]], axis=1)
    bends = np.linalg.norm(np.diff(around[:, 1:], n=2, axis=1), axis=-1).max(axis=1) * as_rate(fps)
    jolts = np.linalg.norm(np.diff(around, n=3, axis=1), axis=-1).max(axis=1) * fps**2
    return Seam(*(float(v) for x in (bends, jolts) for v in (x.mean(), x.max(axis=1).mean())))


def as_poses(values: np.ndarray, dims: int, what: str, *, frames: int = 1) -> Array:
    poses = np.asarray(values)
    if poses.ndim != dims or poses.shape[-1] != 3 or poses.size == 0 or poses.dtype.kind != "f":
        axes = "(samples, frames, joints, 3)" if dims == 4 else "(frames, joints, 3)"
        raise MotionloomError(f"{what} must be places {axes} in metres, not {poses.dtype} {poses.shape}.")
    if poses.shape[-3] < frames:
        raise MotionloomError(f"{what} must have {frames} frames or more to be measured, not {poses.shape[-3]}.")
    if not np.isfinite(poses).all():
        raise MotionloomError(f"{what} hold numbers that are not finite: check where they come from.")
    return np.asarray(poses, dtype=np.float64)


def as_window(samples: np.ndarray, real: np.ndarray, *, frames: int = 1) -> tuple[Array, Array]:
    """Samples and what they are compared with, (F, J, 3) or (K, F, J, 3), of the same frames and joints."""
    s = as_poses(samples, 4, "samples", frames=frames)
    t = as_poses(real, 4 if np.ndim(real) == 4 else 3, "the real motion")
    if s.shape[1:] != t.shape[-3:]:
        raise MotionloomError(f"samples are {s.shape[1:]} (frames, joints, 3) and the real motion is {t.shape[-3:]}.")
    return s, t


def as_rate(fps: float) -> float:
    if not (np.isfinite(fps) and fps > 0):
        raise MotionloomError(f"fps is frames per second above 0, not {fps}.")
    return fps
