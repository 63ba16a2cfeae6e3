"""The end of a motion that another one goes on from, as features, and what holds a row to known frames."""

from dataclasses import dataclass

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import FPS
from motionloom.core.features.placed import PlacedMotion
from motionloom.core.ground import GroundPose
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.edits.boundary import joining
from motionloom.edits.steering import Correction
from motionloom.tasks.splice import person_at_20

LOOK_BACK = 20
"""Frames of an older motion that a new one continues from."""


@dataclass(frozen=True, eq=False)
class Past:
    """The end of a motion that a long one goes on from."""

    known: np.ndarray
    """(frames, 263) features of its last frames, not standardised."""
    end: GroundPose
    """Where the person is one frame behind them: at frame 0 of what follows."""
    behind: np.ndarray | None = None
    """(frames, 263) features of the frames that follow the long motion; None: nothing follows it."""
    lead: int = 0
    """Frames that the first piece has more, before its segment begins."""
    trail: int = 0
    """Frames that the last piece has more, behind the end of its segment."""

    @staticmethod
    def of(motion: Motion) -> "Past":
        """Of anybody's motion, as of `last_frames`."""
        placed = last_frames(motion)
        return Past(placed.features, placed.end)


def last_frames(motion: Motion) -> PlacedMotion:
    """The `LOOK_BACK` last frames at 20 per second of anybody's motion; raises `MotionloomError` for a shorter one."""
    positions = person_at_20(motion)
    if len(positions) <= LOOK_BACK:
        raise MotionloomError(
            f"the motion to go on from is {motion.seconds:.2f} s long; at least {LOOK_BACK / FPS:g} s are needed"
        )
    return PlacedMotion.of(positions[-LOOK_BACK - 1 :])


def holding_correction(own: np.ndarray, prior: Prior, length: int, *, last: bool = False) -> Correction:
    """Sets the first frames of a row's estimate (or the last ones) to known ones, the others join them without a jump.

    own: (frames, 263) features, not standardised. length: frames of the row.
    """
    first, end = (0, length - len(own)) if last else (len(own), length)
    held = slice(end, None) if last else slice(0, first)
    known = np.zeros((1, length, own.shape[1]), own.dtype)
    known[:, held] = own
    mask = np.zeros(known.shape, np.bool_)
    mask[:, held] = True
    meet = joining(known, mask, first, end)

    def hold(clean: np.ndarray, level: int) -> np.ndarray:
        features = np.where(mask, known, clean * prior.spread + prior.mean)
        return ((meet(features) - prior.mean) / prior.spread)[0]

    return hold
