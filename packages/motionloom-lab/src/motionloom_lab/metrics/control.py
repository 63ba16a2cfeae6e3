"""How far a motion is from its targets, on plain arrays.

The definitions of the GMD and OmniControl line of work (Karunratanakul et al. 2023; Xie et al. 2024): mean error,
location failure and trajectory failure over the pairs of joint and frame with a target, in the world.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionloom.core.errors import MotionloomError
from motionloom.kinematics import physics

Array = NDArray[np.float64]

NEAR, FAR = 0.2, 0.5
"""Metres: beyond them a pair of joint and frame has failed, in either of the two usual counts."""


@dataclass(frozen=True)
class ControlError:
    """Of several motions, over all pairs of joint and frame with a target."""

    pairs: int
    error: float
    """cm: mean distance from the target. Every pair counts the same, so long motions weigh more."""
    worst: float
    """cm: the largest."""
    beyond_20: float
    """Share of pairs more than 20 cm off (location failure at 20 cm)."""
    beyond_50: float
    """Share of pairs more than 50 cm off (location failure at 50 cm)."""
    sequences: float
    """Share of motions with a pair more than 50 cm off (trajectory failure), among those with a pair at all."""


def distances(positions: ArrayLike, targets: ArrayLike, mask: ArrayLike) -> Array:
    """(frames, joints) metres from the targets, nan where there are none.

    ``positions`` and ``targets`` (frames, joints, 3) metres in one world; ``mask`` (frames, joints, 3) flags. Only the
    flagged coordinates count: of a path on the ground x and z of the pelvis. MotionloomError for other shapes, and for
    numbers that are not finite where something is flagged.
    """
    places, goal, flags = np.asarray(positions, float), np.asarray(targets, float), np.asarray(mask, bool)
    if places.ndim != 3 or places.shape[-1] != 3 or not places.shape == goal.shape == flags.shape:
        raise MotionloomError(
            f"places, targets and flags are (frames, joints, 3) alike; got {places.shape}, {goal.shape}, {flags.shape}"
        )
    apart = np.subtract(places, goal, out=np.zeros(places.shape), where=flags)
    if not np.isfinite(apart).all():
        raise MotionloomError("the asked places or the motion have numbers that are not finite (NaN or infinity)")
    return np.where(flags.any(axis=-1), np.linalg.norm(apart, axis=-1), np.nan)


def control_error(motions: Sequence[ArrayLike]) -> ControlError | None:
    """The numbers of several motions, each as its (frames, joints) `distances`; None where no target is."""
    parts = [apart[~np.isnan(apart)] for apart in (np.asarray(one, float) for one in motions)]
    parts = [apart for apart in parts if apart.size]
    if not parts:
        return None
    every = np.concatenate(parts)
    return ControlError(
        pairs=int(every.size),
        error=float(100 * every.mean()),
        worst=float(100 * every.max()),
        beyond_20=float((every > NEAR).mean()),
        beyond_50=float((every > FAR).mean()),
        sequences=float(np.mean([(apart > FAR).any() for apart in parts])),
    )


def of_root(motions: Sequence[Array]) -> ControlError | None:
    """`control_error` of joint 0 alone; None where it has no target."""
    return control_error([apart[:, :1] for apart in motions])


def of_joints(motions: Sequence[Array]) -> ControlError | None:
    """`control_error` of all joints but the root; None where none has a target."""
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


def facing_error(positions: ArrayLike, real: ArrayLike, mask: ArrayLike) -> Array:
    """Degrees between the ways two bodies of (frames, 22, 3) face, in those of the (frames,) of the mask."""
    flags = np.asarray(mask, bool)
    turn = physics.heading(np.asarray(positions, float)) - physics.heading(np.asarray(real, float))
    return np.abs(np.degrees((turn + np.pi) % (2 * np.pi) - np.pi))[flags]
