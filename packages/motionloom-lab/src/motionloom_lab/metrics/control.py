"""How far a motion is from what control asked of it, on plain arrays.

The definitions of the GMD and OmniControl line of work (Karunratanakul et al. 2023; Xie et al. 2024): mean error,
location failure and trajectory failure over the asked pairs of joint and frame, in the world.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionloom.errors import MotionloomError
from motionloom.kinematics import physics

Array = NDArray[np.float64]

NEAR, FAR = 0.2, 0.5
"""Metres: beyond them a pair of joint and frame has failed, in either of the two usual counts."""


@dataclass(frozen=True)
class ControlError:
    """Of several motions, over all asked pairs of joint and frame."""

    pairs: int
    error: float
    """cm: mean distance from the asked place. Every pair counts the same, so long motions weigh more."""
    worst: float
    """cm: the largest."""
    beyond_20: float
    """Share of pairs more than 20 cm off (location failure at 20 cm)."""
    beyond_50: float
    """Share of pairs more than 50 cm off (location failure at 50 cm)."""
    sequences: float
    """Share of motions with a pair more than 50 cm off (trajectory failure), among those with a pair at all."""


def distances(positions: ArrayLike, wanted: ArrayLike, asked: ArrayLike) -> Array:
    """(frames, joints) metres from the asked places, nan where nothing is asked.

    ``positions`` and ``wanted`` (frames, joints, 3) metres in one world; ``asked`` (frames, joints, 3) flags. Only the
    asked coordinates count: a path on the ground asks x and z of the pelvis. MotionloomError for other shapes, and for
    numbers that are not finite where something is asked.
    """
    made, goal, flags = np.asarray(positions, float), np.asarray(wanted, float), np.asarray(asked, bool)
    if made.ndim != 3 or made.shape[-1] != 3 or not made.shape == goal.shape == flags.shape:
        raise MotionloomError(
            f"places, targets and flags are (frames, joints, 3) alike; got {made.shape}, {goal.shape}, {flags.shape}"
        )
    apart = np.subtract(made, goal, out=np.zeros(made.shape), where=flags)
    if not np.isfinite(apart).all():
        raise MotionloomError("the asked places or the motion have numbers that are not finite (NaN or infinity)")
    return np.where(flags.any(axis=-1), np.linalg.norm(apart, axis=-1), np.nan)


def control_error(motions: Sequence[ArrayLike]) -> ControlError | None:
    """The numbers of several motions, each as its (frames, joints) `distances`; None where nothing is asked at all."""
    found = [apart[~np.isnan(apart)] for apart in (np.asarray(one, float) for one in motions)]
    found = [apart for apart in found if apart.size]
    if not found:
        return None
    every = np.concatenate(found)
    return ControlError(
        pairs=int(every.size),
        error=float(100 * every.mean()),
        worst=float(100 * every.max()),
        beyond_20=float((every > NEAR).mean()),
        beyond_50=float((every > FAR).mean()),
        sequences=float(np.mean([(apart > FAR).any() for apart in found])),
    )


def of_root(motions: Sequence[Array]) -> ControlError | None:
    """`control_error` of joint 0 alone; None where it is never asked."""
    return control_error([apart[:, :1] for apart in motions])


def of_joints(motions: Sequence[Array]) -> ControlError | None:
    """`control_error` of all joints but the root; None where none is asked."""
    return control_error([apart[:, 1:] for apart in motions])


def feature_error(features: Sequence[ArrayLike], known: Sequence[ArrayLike], masks: Sequence[ArrayLike]) -> float:
    """Mean absolute difference of the controlled numbers, each (frames, width); nan where none is controlled.

    Numbers of several units are only to be mixed when they are standardised: then the answer is in standard deviations.
    """
    apart = [
        np.abs(np.asarray(a, float) - np.asarray(b, float))[np.asarray(m, bool)]
        for a, b, m in zip(features, known, masks, strict=True)
    ]
    every = np.concatenate(apart) if apart else np.zeros(0)
    return float(every.mean()) if every.size else float("nan")


def facing_error(positions: ArrayLike, real: ArrayLike, asked: ArrayLike) -> Array:
    """Degrees between the ways two bodies of (frames, 22, 3) face, in those of the (frames,) where it is asked."""
    flags = np.asarray(asked, bool)
    turn = physics.heading(np.asarray(positions, float)) - physics.heading(np.asarray(real, float))
    return np.abs(np.degrees((turn + np.pi) % (2 * np.pi) - np.pi))[flags]
