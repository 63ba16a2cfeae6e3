"""Two bodies that are sampled are kept out of each other: they may touch, and not be in each other.

Every denoised estimate of a pair is decoded into its one world, and where trunks, heads or legs overlap the people go
apart along the line between their trunks. How far one goes from the other is the mean of a Gaussian process (Rasmussen
& Williams 2006, eq. 2.23), a constant and a slow curve, given what the frames with an overlap need: nobody jumps, and
most of it is the relative pose at the first frame. Arms may cross: what of them is in the other's body when all is
sampled is bent out of it (`out_of_bodies`).
"""

import numpy as np
from numpy.typing import NDArray

from motionloom.core.blending import smoothstep
from motionloom.core.features.pair import PairMotion
from motionloom.kinematics.capsules import ARMS, CAPSULES, RADII, capsule_ends, gaps
from motionloom.kinematics.physics import J

Array = NDArray[np.float64]

COMMON, SLOW, WIDTH = 0.2, 0.12, 20
"""Standard deviations, in metres, of how far one goes from the other all the time and for a while, and the frames of
such a while."""
LOOSE = 0.01
"""Metres: how exactly what a frame needs is done at once."""
ROUNDS, STEPS = 3, 6
"""How often what is left is looked for, and how many steps a frame is moved in until nothing overlaps."""
FAR = 2.2
"""Metres between two people of whom nothing can overlap."""
MOST = 160
"""Frames that are looked at; of more, evenly many."""
EVEN, LONG, NEAR = 7, 81, 0.2
"""Frames over which the line between two trunks is averaged, and those where the trunks are nearer than so many
metres: which of the two is on which side must not change from frame to frame."""
_ASIDE = 0.05
"""Metres that count as being in front of each other where two trunks are in one place."""
_CORE = [number for number in range(len(CAPSULES)) if number not in ARMS]
_TRUNK = [J["pelvis"], J["spine3"]]


def kept_apart(pair: PairMotion, shares: Array, *, still: int = 0, close: tuple[int, int] = (0, 0)) -> PairMotion:
    """The pair, moved apart where bodies overlap; (2,) shares of the way that each one goes, of sum 1 or 0.

    still: frames in which both stay where they are; close: the same from one frame to before another.
    """
    if not shares.any():
        return pair
    shift = shift_apart(pair.places(), still=still, close=close)
    if not shift.any():
        return pair
    return pair.changed(np.concatenate([np.zeros((len(shift), 1)), shift], axis=1), shares)


def shift_apart(places: Array, *, still: int = 0, close: tuple[int, int] = (0, 0)) -> Array:
    """(frames, 2) metres x, z that the second person goes from the first; places (2, frames, 22, 3) metres.

    still, close: as of `kept_apart`.
    """
    frames = places.shape[1]
    shift = np.zeros((frames, 2))
    looked = np.arange(still, frames, -(-(frames - still) // MOST)) if frames > still else np.arange(0)
    looked = looked[(looked < close[0]) | (looked >= close[1])]
    ease = smoothstep((looked - still + 1) / WIDTH) if still else np.ones(len(looked))
    if close[1]:
        ease *= smoothstep(np.maximum(close[0] - looked, looked - close[1] + 1) / WIDTH)
    rest = np.concatenate([np.arange(max(still - 2, 0), still), np.arange(*close, 4)])
    if (np.linalg.norm(places[1, :, 0] - places[0, :, 0], axis=-1) > FAR).all():
        return shift
    ends = [capsule_ends(one[looked])[:, _CORE] for one in places]
    line = _line(places)[looked]
    for _ in range(ROUNDS):
        need = _need(ends[0], ends[1] + np.insert(shift[looked], 1, 0.0, axis=-1)[:, None, None], line)
        need *= ease  # what overlaps already cannot come apart at once
        at = np.flatnonzero(need)
        if not len(at):
            break
        shift[still:] += _slow(frames, looked[at], line[at], need[at], rest)[still:]
    return shift


def _line(places: Array) -> Array:
    """(frames, 2) unit vectors on the ground from the first person's trunk to the second's.

    Where the trunks are almost in one place it is the line around then, and where there is none, ahead of the first.
    """
    trunks = places[:, :, _TRUNK].mean(axis=2)[..., [0, 2]]
    across = places[0, :, J["left_hip"]] - places[0, :, J["right_hip"]]
    ahead = np.stack([-across[:, 2], across[:, 0]], axis=-1).mean(axis=0)
    apart = even(trunks[1] - trunks[0], EVEN)
    around = _unit(even(apart, LONG) + _ASIDE * _unit(ahead))
    sure = (np.linalg.norm(apart, axis=-1, keepdims=True) / NEAR).clip(0.0, 1.0)
    return _unit(sure * apart + (1 - sure) * NEAR * around)


def _unit(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True).clip(1e-9)


def even(values: Array, width: int) -> Array:
    """(frames, 2) averaged over ``width`` frames, an odd number; ends repeated."""
    padded = np.pad(values, ((width // 2, width // 2), (0, 0)), mode="edge")
    return np.stack([np.convolve(column, np.ones(width) / width, "valid") for column in padded.T], axis=-1)


def _need(first: Array, second: Array, line: Array) -> Array:
    """(frames,) metres that the second person must go along the line (frames, 2) until nothing overlaps.

    first, second: (frames, capsules, 2, 3) ends of `_CORE`.
    """
    need = np.zeros(len(line))
    at = np.arange(len(line))
    for _ in range(STEPS):
        moved = second[at] + np.insert(need[at, None] * line[at], 1, 0.0, axis=-1)[:, None, None]
        deep = -gaps(first[at], RADII[_CORE], moved, RADII[_CORE]).min(axis=(1, 2))
        at, deep = at[deep > 1e-3], deep[deep > 1e-3]
        if not len(at):
            break
        need[at] += deep
    return need


def _slow(frames: int, at: NDArray[np.intp], line: Array, need: Array, rest: NDArray[np.intp]) -> Array:
    """(frames, 2) metres: the curve that goes ``need`` along ``line`` at some frames, and nowhere at ``rest``."""
    where = np.concatenate([at, rest, rest])
    ways = np.concatenate([line, *(np.tile(axis, (len(rest), 1)) for axis in np.eye(2))])
    values = np.concatenate([need, np.zeros(2 * len(rest))])
    lag = np.arange(frames)[:, None] - where
    covariance = COMMON**2 + SLOW**2 * np.exp(-0.5 * (lag / WIDTH) ** 2)
    inner = covariance[where] * (ways @ ways.T)
    inner[np.diag_indices_from(inner)] += np.where(np.arange(len(where)) < len(at), LOOSE, 1e-3) ** 2
    curve = covariance @ (np.linalg.solve(inner, values)[:, None] * ways)
    curve *= (need.max() / np.linalg.norm(curve, axis=-1, keepdims=True).clip(1e-9)).clip(max=1.0)
    return np.asarray(curve, dtype=np.float64)
