"""People whose motion is put on robots in tests."""

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22


def marching(seconds: float = 1.5, fps: float = 30.0) -> Motion:
    """A person who lifts one foot and then the other, and swings the arms."""
    count = round(seconds * fps)
    phase = 2 * np.pi * np.arange(count) / fps
    turns = np.tile(rot.IDENTITY, (count, 22, 1))

    def bend(joint: str, angles: np.ndarray, axis: tuple[float, float, float] = (1.0, 0.0, 0.0)) -> None:
        turns[:, SMPL22.index(joint)] = rot.rotvec_to_quat(angles[:, None] * np.array(axis))

    for side, lift in (("left", np.sin(phase).clip(0)), ("right", (-np.sin(phase)).clip(0))):
        bend(f"{side}_hip", -0.8 * lift)
        bend(f"{side}_knee", 1.4 * lift)
        bend(f"{side}_ankle", -0.5 * lift)
    bend("left_shoulder", -1.1 + 0.5 * np.sin(phase), (0.0, 0.0, 1.0))
    bend("right_shoulder", 1.1 + 0.5 * np.sin(phase), (0.0, 0.0, 1.0))
    rest = SMPL22.rest_positions()
    root = np.tile(rest[0] - [0, rest[:, 1].min(), 0], (count, 1))
    return Motion(SMPL22, fps, root, turns)


def stepping_aside(spread: float, seconds: float = 2.0, fps: float = 30.0) -> Motion:
    """A person who steps out to the left until the legs are ``spread`` radians apart, and draws the right foot up;
    soles are level."""
    count = round(seconds * fps)
    out = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(count) / (count - 1))
    turns = np.tile(rot.IDENTITY, (count, 22, 1))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        for joint, way in (("hip", sign), ("ankle", -sign)):
            angle = way * spread / 2 * out[:, None] * np.array([0.0, 0.0, 1.0])
            turns[:, SMPL22.index(f"{side}_{joint}")] = rot.rotvec_to_quat(angle)
    places = Motion(SMPL22, fps, np.zeros((count, 3)), turns).positions()
    left, right = (places[:, SMPL22.index(f"{side}_ankle"), 0] for side in ("left", "right"))
    middle = count // 2
    ahead = np.arange(count) < middle  # the right foot stands, and then the left one
    aside = np.where(ahead, right[0] - right, right[0] - right[middle] + left[middle] - left)
    root = np.stack([aside, -places[..., 1].min(axis=1), np.zeros(count)], axis=1)
    return Motion(SMPL22, fps, root, turns)
