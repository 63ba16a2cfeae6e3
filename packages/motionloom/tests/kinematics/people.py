"""Made-up people whose numbers are known in closed form; everything stands on y = 0."""

import numpy as np

from motionloom.core.skeleton import SMPL22
from motionloom.kinematics.physics import J

FPS = 20.0


def standing(seconds: float = 4.0, fps: float = FPS) -> np.ndarray:
    """(frames, 22, 3): the rest pose with the arms hanging, facing +Z, toes at height 0."""
    pose = SMPL22.rest_positions()
    pose = (pose + pose[list(SMPL22.mirror_pairs())] * [-1.0, 1.0, 1.0]) / 2  # both sides exactly alike
    pose[:, 1] -= pose[[7, 8, 10, 11], 1].min()
    for side in ("left", "right"):
        shoulder = pose[J[f"{side}_shoulder"]]
        for joint, drop in (("elbow", 0.27), ("wrist", 0.53)):
            pose[J[f"{side}_{joint}"]] = shoulder - [0.0, drop, 0.0]
    return np.repeat(pose[None], round(seconds * fps), axis=0)


def clock(positions: np.ndarray, fps: float = FPS) -> np.ndarray:
    """(frames, 1, 1) seconds, ready to be added to positions."""
    return (np.arange(len(positions)) / fps)[:, None, None]


def moved(positions: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """The whole body moved by (frames, 3)."""
    return positions + offsets[:, None]


def spun(positions: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """The whole body turned to the left about its pelvis by (frames,) radians."""
    sin, cos = np.sin(angles)[:, None], np.cos(angles)[:, None]
    centre = positions[:, :1] * [1.0, 0.0, 1.0]
    x, y, z = np.moveaxis(positions - centre, -1, 0)
    return np.stack([x * cos + z * sin, y, z * cos - x * sin], axis=-1) + centre


def walking(speed: float, seconds: float = 4.0, *, fps: float = FPS) -> np.ndarray:
    """Straight ahead at a constant speed; feet lifted in turn once a second and exactly still while on the floor."""
    p = standing(seconds, fps)
    t = np.arange(len(p)) / fps
    p = moved(p, np.stack([0 * t, 0 * t, speed * t], axis=-1))
    for side, phase in (("left", 0.0), ("right", 0.5)):
        cycle, share = np.divmod(t + phase, 1.0)
        swing = np.clip(share / 0.5, 0, 1)  # the first half of a cycle is in the air
        place = (cycle - phase + swing - 0.25) * speed
        for joint in (f"{side}_ankle", f"{side}_foot"):
            p[:, J[joint], 2] += place - speed * t
            p[:, J[joint], 1] += 0.2 * np.sin(np.pi * swing)  # over 5 cm one frame after lift-off
        # knees are ahead of the line from hip to ankle, as people's are
        p[:, J[f"{side}_knee"]] = (p[:, J[f"{side}_hip"]] + p[:, J[f"{side}_ankle"]]) / 2 + [0.0, 0.0, 0.05]
    return p


def circling(radius: float, rounds: float, seconds: float = 8.0) -> np.ndarray:
    """On a circle to the left (the centre at +X of the start), facing along the path."""
    p = standing(seconds)
    angle = np.linspace(0, 2 * np.pi * rounds, len(p))
    path = np.stack([radius - radius * np.cos(angle), 0 * angle, radius * np.sin(angle)], axis=-1)
    return moved(spun(p, angle), path)


def jumping(height: float, seconds: float = 4.0, *, gravity: float = 9.81) -> np.ndarray:
    """One ballistic jump of the stiff body in the middle of the clip."""
    p = standing(seconds)
    t = np.arange(len(p)) / FPS - seconds / 2
    rise = np.clip(height - gravity * t**2 / 2, 0.0, None)
    return moved(p, np.stack([0 * t, rise, 0 * t], axis=-1))
