"""How the trunk of somebody who falls or rolls turns: positions (frames, 22, 3) metres, SMPL order, +Y up."""

import numpy as np

from motionloom.kinematics.gestures import torso_inclination
from motionloom.kinematics.physics import Array, J

FLAT = np.radians(60)
"""Inclination of the trunk above which somebody lies."""


def faces_up(p: Array, fps: float) -> float:
    """How far up the chest faces in the last quarter of a second: above 0 on the back, below on the belly."""
    across = p[:, J["left_shoulder"]] - p[:, J["right_shoulder"]]
    return float(np.cross(across, p[:, J["neck"]] - p[:, 0])[-max(1, round(fps / 4)) :, 1].mean())


def _trunk_turns(p: Array) -> Array:
    """(frames - 1, 3) radians between frames about the trunk's left, up and front."""
    left, up = p[:, J["left_shoulder"]] - p[:, J["right_shoulder"]], p[:, J["neck"]] - p[:, 0]
    up = up / np.linalg.norm(up, axis=-1, keepdims=True)
    left = left - (left * up).sum(-1, keepdims=True) * up
    left = left / np.maximum(np.linalg.norm(left, axis=-1, keepdims=True), 1e-9)
    front = np.cross(left, up)
    about_left = (np.diff(up, axis=0) * front[:-1]).sum(-1)
    about_up = (np.diff(front, axis=0) * left[:-1]).sum(-1)
    return np.stack([about_left, about_up], axis=-1)


def pitch(p: Array) -> float:
    """Radians by which the trunk turns heels over head, forwards."""
    return float(_trunk_turns(p)[:, 0].sum())


def log_roll(p: Array) -> float:
    """Radians by which somebody who lies turns to the left about the spine."""
    lies = torso_inclination(p)[:-1] > FLAT
    return float(_trunk_turns(p)[lies, 1].sum())
