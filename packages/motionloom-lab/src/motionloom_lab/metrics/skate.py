"""Foot skate in the three definitions that papers print side by side; always print that of real motion with it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from motionloom.core.errors import MotionloomError
from motionloom.kinematics import physics
from motionloom_lab.metrics.transitions import joints

_STILL, _LOW = 0.01, 0.02
"""Metres: a toe that moves less in a frame, or is lower over the floor, is in contact."""


@dataclass(frozen=True)
class Skate:
    """The definitions do not agree with one another: compare each only with itself."""

    share: float
    """Share of frames with a toe below 5 cm that moves more than 2.5 cm a frame (at 20 fps), in the step and on a
    five-frame average: GMD (Karunratanakul et al., 2023), OmniControl (Xie et al., 2024). The published average counts
    nothing beyond both ends as standing still; here the ends average what is there."""
    speed: float
    """Mean horizontal speed of the toes in cm/s while they are below 5 cm: NVIDIA's Kimodo."""
    slide: float
    """`slide`: mm per frame at contact, Motius."""


def skate(positions: ArrayLike, fps: float, *, floor: float = 0.0) -> Skate:
    """All three for one clip: ``positions`` (T, 22, 3) metres, +Y up; ``floor`` metres, for the first two.

    The third takes the lowest toe of the clip for the floor, as published.
    """
    if not (np.isfinite(fps) and fps > 0):
        raise MotionloomError(f"frames per second must be a positive number, not {fps}.")
    p = joints(np.asarray(positions)[None], 2)[0]
    feet = physics.foot_skate(p, fps, floor=floor)
    return Skate(feet.ratio, feet.contact_speed, slide(p))


def slide(positions: ArrayLike, *, floor: float | None = None) -> float:
    """mm per frame: mean horizontal step of a toe in contact, mean of left and right; (T, 22, 3) metres, T at least 2.

    A toe is in contact in a frame where its next step (in space) is under 1 cm or it is under 2 cm over ``floor``
    (default: the lowest toe of the clip). The last frame has the step of the one before; a toe that is never in
    contact counts 0. Per frame, so only clips of one frame rate are comparable (published: 20 fps). The joint-level
    protocol of the Motius leaderboard (after MBench), 2026.
    """
    toes = joints(np.asarray(positions)[None], 2)[0][:, physics.TOES]
    height = toes[..., 1] - (toes[..., 1].min() if floor is None else floor)
    steps = np.diff(toes, axis=0)
    steps = np.concatenate([steps, steps[-1:]])
    contact = (np.linalg.norm(steps, axis=-1) < _STILL) | (height < _LOW)
    across = np.linalg.norm(steps[..., [0, 2]], axis=-1)
    return float(1000 * ((across * contact).sum(axis=0) / np.maximum(contact.sum(axis=0), 1)).mean())
