"""At which frames of a clip a training window may begin: where somebody rests, or goes on as before.

A window that begins in the middle of a leap or of a stroke teaches that motions begin so, whatever the words say.
"""

import numpy as np

from motionloom.core.features.layout import FPS, LAYOUT
from motionloom.kinematics.physics import Array

SLOW, LIMBS = 0.4, 1.0
"""Metres per second of the pelvis, and of hands and feet against it, of somebody who rests."""
STEADY, SWINGING = 0.25, 2.5
"""Share by which the pace of a steady gait changes within a second; metres per second of its hands at most."""
AIR, LOW = 0.12, 0.6
"""Metres of the lowest foot of somebody in the air; of the pelvis of somebody low, whose feet may be up."""
_AHEAD, _AROUND = round(1.0 * FPS), 3
_FEET, _HANDS = (7, 8, 10, 11), (20, 21)


def may_begin(features: np.ndarray) -> np.ndarray:
    """Whether a window may begin at each frame.

    features: (frames, 263) of a clip, not standardised. Returns (frames,) of bool.
    """
    pace = _even(np.linalg.norm(features[:, LAYOUT["root_velocity"]].astype(np.float64), axis=-1) * FPS)
    height = features[:, LAYOUT["root_height"]][:, 0]
    climb = np.abs(np.gradient(height)) * FPS if len(height) > 1 else np.zeros(1)
    moves = features[:, LAYOUT["joint_velocity"]].reshape(len(features), 22, 3).astype(np.float64) * FPS
    against = np.linalg.norm(moves - moves[:, :1], axis=-1)
    hands, feet = against[:, _HANDS].max(axis=-1), against[:, _FEET].max(axis=-1)
    lowest = np.min([features[:, LAYOUT["ric"]][:, 3 * (joint - 1) + 1] for joint in _FEET], axis=0)
    grounded = (lowest < AIR) | (height < LOW)
    rests = (pace < SLOW) & (climb < SLOW) & (np.maximum(hands, feet) < LIMBS)
    ahead = np.lib.stride_tricks.sliding_window_view(np.pad(pace, (0, _AHEAD), mode="edge"), _AHEAD + 1)
    change = np.abs(ahead - pace[:, None]).max(axis=-1)
    goes_on = (pace >= SLOW) & (change < STEADY * pace) & (hands < SWINGING)
    return np.asarray((rests | goes_on) & grounded)


def _even(values: Array) -> Array:
    """The means over the frames around each, in which the strokes of single steps do not show."""
    size = 2 * _AROUND + 1
    padded = np.pad(values, _AROUND, mode="edge")
    return np.convolve(padded, np.full(size, 1 / size), "valid")


def nearest(allowed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The last allowed frame up to each frame, and the first from it on; -1, and the number of frames, for none.

    allowed: (frames,) of bool.
    """
    numbers = np.arange(len(allowed))
    before = np.maximum.accumulate(np.where(allowed, numbers, -1))
    behind = np.minimum.accumulate(np.where(allowed, numbers, len(allowed))[::-1])[::-1]
    return before, behind
