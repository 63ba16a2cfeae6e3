"""How good the futures of stochastic motion prediction are: APD, ADE, FDE, MMADE, MMFDE, APDE, CMD and body realism.

Everything is measured per window: ``samples`` (S, F, J, 3) are the futures a system sampled, ``truth`` (F, J, 3) is
what came, ``futures`` (K, F, J, 3) is what came after similar poses, the truth among it. Places are metres from the
root, without the root itself (16 joints in Human3.6M, 14 in HumanEva-I, 21 in AMASS). The norm of APD, ADE, FDE and
their kin is that of the *whole* flattened pose, not a mean over joints: numbers by the other convention are about
fifteen times smaller, so `zero_velocity` belongs beside every result. What cannot be measured raises `MotionloomError`.

Sources: Yuan and Kitani, DLow, ECCV 2020 (APD to MMFDE); Barquero et al., BeLFusion, ICCV 2023 (APDE, CMD);
Tian et al., TransFusion, 2024 (median and worst ADE). Limbs, jerk and seams: `motionloom_lab.metrics.prediction_body`.
"""

from collections.abc import Mapping
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom_lab.metrics.prediction_body import H36M_LIMBS as H36M_LIMBS
from motionloom_lab.metrics.prediction_body import Limbs, angle_error, as_poses, as_window, jerk, seam, stretch
from motionloom_lab.metrics.prediction_body import limbs_of as limbs_of

Array = NDArray[np.float64]
Singles = Literal["all", "skip", "skip_multimodal"]
"""Windows that nothing similar was found for: counted (DLow, HumanMAC, BeLFusion, SkeletonDiffusion), left out
altogether (GSPS), or left out of the multi-modal metrics (CoMusion)."""

_CELLS = 1_000_000
"""Distances held at once (8 MB)."""
_ROUNDING = 1e-9
"""Squared distances by products are this exact, relative to the squared lengths."""


# ---- distances


def apd(samples: np.ndarray) -> float:
    """APD, metres: mean distance of two samples over all their numbers (F J 3); 0 for a single one. Variety."""
    s = as_poses(samples, 4, "samples")
    # from their middle, where products round least: equal samples are 0 apart, and a thousand futures take no minute
    flat = (s - s.mean(axis=0)).reshape(len(s), -1)
    square = np.square(flat).sum(axis=1)
    total, rows = 0.0, max(1, _CELLS // len(s))
    for start in range(0, len(s), rows):
        own = slice(start, start + rows)
        apart = np.maximum(square[own, None] + square - 2 * (flat[own] @ flat.T), 0.0)
        total += float(np.sqrt(apart).sum() - np.sqrt(np.diagonal(apart, start)).sum())
    return total / (len(s) * (len(s) - 1)) if len(s) > 1 else 0.0


def ade(samples: np.ndarray, truth: np.ndarray) -> float:
    """ADE, metres: mean over frames of the distance from the truth, of the sample where it is least."""
    return float(_errors(*as_window(samples, truth)).mean(axis=1).min())


def _errors(samples: Array, truth: Array) -> Array:
    """(S, F) metres."""
    return np.sqrt(np.square(samples - truth).sum(axis=(-2, -1)))


def _multimodal(samples: Array, futures: Array) -> tuple[float, float]:
    """MMADE and MMFDE; by products, since there may be a thousand futures."""
    count, frames = samples.shape[:2]
    # from the middle of the samples, where products round least: coinciding poses come out 1e-7 m apart at most
    middle = samples.mean(axis=0)
    s = (samples - middle).reshape(count, frames, -1).transpose(1, 0, 2)
    ss = np.square(s).sum(axis=-1)[:, :, None]
    mean, last = 0.0, 0.0
    rows = max(1, _CELLS // (count * frames))
    for start in range(0, len(futures), rows):
        y = (futures[start : start + rows] - middle).reshape(-1, frames, s.shape[-1]).transpose(1, 2, 0)
        distance = np.sqrt(np.maximum(ss - 2 * (s @ y) + np.square(y).sum(axis=1)[:, None, :], 0.0))
        mean += float(distance.mean(axis=0).min(axis=0).sum())
        last += float(distance[-1].min(axis=0).sum())
    return mean / len(futures), last / len(futures)


def similar_windows(last_poses: np.ndarray, threshold: float, chunk: int = 256) -> list[NDArray[np.int32]]:
    """For each window the numbers of those whose last observed pose is nearer than ``threshold``, itself included.

    ``last_poses`` (N, D) metres, flattened and without the root; ``threshold`` metres over the whole pose: 0.5 for
    Human3.6M and HumanEva-I, 0.4 for AMASS. ``chunk`` windows are compared with all at a time.
    """
    poses = np.asarray(last_poses)
    if poses.ndim != 2 or poses.size == 0 or poses.dtype.kind != "f" or not np.isfinite(poses).all():
        raise MotionloomError(f"last poses are finite metres (windows, numbers), not {poses.dtype} {poses.shape}.")
    if not (np.isfinite(threshold) and threshold > 0 and chunk >= 1):
        raise MotionloomError(f"the threshold is a distance in metres above 0, not {threshold} (chunk {chunk}).")
    p = poses.astype(np.float64)
    p = p - p.mean(axis=0)
    square = np.square(p).sum(axis=1)
    result: list[NDArray[np.int32]] = []
    for start in range(0, len(p), chunk):
        own = np.arange(start, min(start + chunk, len(p)))
        gap = square[own, None] + square - 2 * (p[own] @ p.T) - threshold**2
        # where products are too inexact beside the threshold, differences decide
        row, column = np.nonzero(np.abs(gap) < _ROUNDING * (square[own, None] + square + threshold**2))
        for few in range(0, len(row), chunk):
            r, c = row[few : few + chunk], column[few : few + chunk]
            gap[r, c] = np.linalg.norm(poses[own[r]] - poses[c].astype(np.float64), axis=1) - threshold
        result += [np.flatnonzero(near < 0).astype(np.int32) for near in gap]
    return result


# ---- movement


def speeds(samples: np.ndarray) -> Array:
    """(F - 1,) metres per frame: mean over samples and joints of how far a joint goes from one frame to the next."""
    s = as_poses(samples, 4, "samples", frames=2)
    return np.linalg.norm(np.diff(s, axis=1), axis=-1).mean(axis=(0, 2))


class CmdTally:
    """CMD: whether predicted motion goes on as lively as real motion of its class, frame for frame."""

    def __init__(self) -> None:
        self._sums: dict[str, Array] = {}
        self._counts: dict[str, int] = {}

    def add(self, name: str, samples: np.ndarray) -> None:
        """Count a window of class ``name`` with its ``samples`` (S, F, J, 3)."""
        self.add_speeds(name, speeds(samples))

    def add_speeds(self, name: str, values: Array) -> None:
        """Count a window of class ``name`` by its `speeds` (F - 1,)."""
        if any(len(values) != len(known) for known in self._sums.values()):
            raise MotionloomError(f"CMD compares futures of one length, and a window of {name!r} has another.")
        self._sums[name] = self._sums.get(name, 0.0) + np.asarray(values, dtype=np.float64)
        self._counts[name] = self._counts.get(name, 0) + 1

    def speeds(self) -> dict[str, float]:
        """Metres per frame by class, mean over windows and frames; of real futures: references of a new data set."""
        return {name: float(total.mean() / self._counts[name]) for name, total in self._sums.items()}

    def result(self, reference: Mapping[str, float] | float) -> float:
        """CMD: mean over the windows of that of their class; ``reference`` metres per frame, by class or for all.

        That of a class: sum over steps t = 1 .. F-1 of (F - t) |mean speed at t - reference|.
        """
        if not isinstance(reference, Mapping):
            reference = dict.fromkeys(self._sums, reference)
        if missing := sorted(self._sums.keys() - reference.keys()):
            raise MotionloomError(f"there is no reference speed for the classes {', '.join(missing[:5])}.")
        if not self._sums:
            raise MotionloomError("CMD was asked of no windows at all.")
        total = 0.0
        for name, speed in self._sums.items():
            count, weights = self._counts[name], np.arange(len(speed), 0, -1)
            total += count * float((weights * np.abs(speed / count - reference[name])).sum())
        return total / sum(self._counts.values())


# ---- what needs no model


def zero_velocity(past: np.ndarray, frames: int) -> Array:
    """(1, frames, J, 3) metres: the last pose of ``past`` (frames, J, 3) held still; every paper's anchor."""
    p = as_poses(past, 3, "the past")
    return np.repeat(p[None, -1:], _count(frames), axis=1)


def constant_velocity(past: np.ndarray, frames: int) -> Array:
    """(1, frames, J, 3) metres: every joint goes on as between the last two frames of ``past`` (frames, J, 3)."""
    p = as_poses(past, 3, "the past", frames=2)
    steps = np.arange(1, _count(frames) + 1)[:, None, None]
    return (p[-1] + steps * (p[-1] - p[-2]))[None]


def _count(frames: int) -> int:
    if frames < 1:
        raise MotionloomError(f"a future has one frame or more, not {frames}.")
    return frames


# ---- all of it


METRICS = (
    *("apd", "ade", "fde", "mmade", "mmfde", "apde", "ade_median", "ade_worst"),
    *("stretch", "stretch_rmse", "jitter", "jitter_rmse", "mae", "jerk", "jerk_peak"),
    *("seam_velocity", "seam_velocity_worst", "seam_acceleration", "seam_acceleration_worst"),
)
"""Numbers of a window in the order of tables; CMD is apart, for it is not a mean of windows (`Tally.cmd`).

Metres: ``apd`` as `apd`; ``ade`` as `ade`, and ``ade_median`` and ``ade_worst`` the same of the median and the worst
sample; ``fde`` the distance from the truth in the last frame, of the sample where it is least; ``mmade`` and ``mmfde``
ADE and FDE against each of the futures, mean over them; ``apde`` how far the variety of the samples is from that of the
futures. The others: `prediction_body`.
"""
MULTIMODAL = ("mmade", "mmfde", "apde")
"""Metrics that ``skip_multimodal`` leaves out for windows with a single future."""


class WindowScores(NamedTuple):
    """Everything measured of one window."""

    futures: int
    """How many real futures the window has, the truth counted."""
    speeds: Array
    """(F - 1,) metres per frame, what CMD is computed from."""
    numbers: dict[str, float]
    """By the name of `METRICS`; what cannot be measured (see `score_window`) is absent."""


def score_window(
    samples: np.ndarray,
    truth: np.ndarray,
    futures: np.ndarray | None = None,
    *,
    fps: float,
    past: np.ndarray | None = None,
    limbs: Limbs | None = None,
) -> WindowScores:
    """All metrics of one window; ``score_window(truth[None], truth, ...)`` is the row of the real motion.

    ``samples`` (S, F, J, 3), ``truth`` (F, J, 3), ``futures`` (K, F, J, 3) with the truth among them (None: only the
    truth), metres, F >= 4, at ``fps`` frames per second. ``past`` (>= 3 frames, J, 3) for the seam; ``limbs`` for the
    body. Without them the seam and the body are absent, as is APDE of a single future.
    """
    s, t = as_window(samples, truth, frames=4)
    y = t[None] if futures is None else as_window(samples, as_poses(futures, 4, "futures"))[1]
    errors, variety, jolt = _errors(s, t), apd(s), jerk(s, fps)
    mean, (mmade, mmfde) = errors.mean(axis=1), _multimodal(s, y)
    numbers = {
        "apd": variety,
        "ade": float(mean.min()),
        "fde": float(errors[:, -1].min()),
        "mmade": mmade,
        "mmfde": mmfde,
        "ade_median": float(np.median(mean)),
        "ade_worst": float(mean.max()),
        "jerk": jolt.mean,
        "jerk_peak": jolt.peak,
    }
    if len(y) > 1:
        numbers["apde"] = abs(variety - apd(y))
    if limbs is not None:
        numbers |= stretch(s, t, limbs)._asdict()
        numbers |= {"mae": angle_error(s, t, limbs)} if limbs.chains else {}
    if past is not None:
        numbers |= {f"seam_{name}": value for name, value in seam(past, s, fps)._asdict().items()}
    return WindowScores(len(y), speeds(s), numbers)


class Average(NamedTuple):
    """A metric over windows."""

    value: float
    n: int
    """Windows it was measured on."""


class Tally:
    """Means over windows, windows of a single future treated by ``singles``; keeps no samples."""

    def __init__(self, singles: Singles = "all") -> None:
        if singles not in get_args(Singles):
            raise MotionloomError(f"singles is one of {', '.join(get_args(Singles))}, not {singles!r}.")
        self.singles: Singles = singles
        self.cmd = CmdTally()
        self._sums: dict[str, float] = {}
        self._counts: dict[str, int] = {}

    def add(self, scores: WindowScores, name: str = "all") -> None:
        """Count a window of class ``name`` (for CMD)."""
        alone = scores.futures == 1
        if alone and self.singles == "skip":
            return
        self.cmd.add_speeds(name, scores.speeds)
        for metric in METRICS:
            value = scores.numbers.get(metric)
            if value is None or (alone and self.singles == "skip_multimodal" and metric in MULTIMODAL):
                continue
            self._sums[metric] = self._sums.get(metric, 0.0) + value
            self._counts[metric] = self._counts.get(metric, 0) + 1

    def averages(self) -> dict[str, Average]:
        """By name of `METRICS`, in that order; metrics that were measured on no window are absent."""
        return {m: Average(self._sums[m] / self._counts[m], self._counts[m]) for m in METRICS if m in self._counts}
