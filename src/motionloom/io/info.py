"""What a motion file holds, in numbers a person can check at a glance."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.errors import MotionloomError
from motionloom.motion import Motion
from motionloom.retarget.anatomy import read_body
from motionloom.retarget.transfer import joints22
from motionloom.skeleton import SMPL22, Skeleton
from motionloom.viz.figure import body_height, body_start

Array = NDArray[np.float64]

_FAMILIES = (
    ("SMPL-22", set(SMPL22.names)),
    ("CMU (ASF/AMC)", {"root", "lhipjoint", "lfemur", "ltibia", "upperback", "lowerneck", "rhumerus"}),
    ("Daz (CMU as BVH)", {"hip", "abdomen", "chest", "lButtock", "lThigh", "lShin", "rForeArm"}),
    ("Bandai Namco", {"joint_Root", "Hips", "UpperLeg_L", "LowerLeg_L", "Toes_L", "UpperArm_R"}),
    ("Mixamo", {"mixamorig:Hips", "mixamorig:LeftUpLeg", "mixamorig:RightForeArm"}),
    ("Unreal", {"pelvis", "thigh_l", "calf_l", "upperarm_r", "lowerarm_r"}),
    ("Rigify", {"DEF-spine", "DEF-thigh.L", "DEF-shin.L", "DEF-forearm.R"}),
    ("MotionBuilder", {"Hips", "LeftUpLeg", "LeftLeg", "LeftFoot", "RightForeArm"}),
)


@dataclass(frozen=True)
class Info:
    """Facts about one motion; lengths in metres, time in seconds."""

    skeleton: str
    """Family of the skeleton, guessed by its joint names, or ``unknown``."""
    joints: int
    ends: int
    """How many of the joints are mere bone tips."""
    names: tuple[str, ...]
    frames: int
    fps: float
    seconds: float
    height: float
    """How tall the body stands."""
    path: float
    """Length of the root's way over the floor."""
    travel: float
    """Distance on the floor from the root's first to its last place."""
    lowest: tuple[float, float, float]
    """Smallest x, y, z of any joint at any time."""
    highest: tuple[float, float, float]
    """Largest x, y, z."""
    floor: float
    """Height of the lowest joint, 2nd percentile over time: where the feet stand."""
    problems: tuple[str, ...]
    """What looks wrong, one sentence each."""


def describe(motion: Motion) -> Info:
    """Measure a motion and look for common faults."""
    places = motion.positions()
    start = body_start(motion.skeleton, places)
    body, person = places[:, start:], _person(motion, start)
    way = body[:, 0] if person is None else person[:, 0]
    ground = way[:, [0, 2]]
    if person is not None:
        height = body_height(SMPL22, person)
    else:
        height = body_height(motion.skeleton, places) if body.shape[1] > 1 else 0.0
    floor = float(np.percentile(body[..., 1].min(axis=1), 2))
    low, high = (tuple(float(v) for v in f(body, axis=(0, 1))) for f in (np.min, np.max))
    return Info(
        skeleton=family(motion.skeleton),
        joints=len(motion.skeleton),
        ends=len(motion.skeleton.ends),
        names=motion.skeleton.names,
        frames=len(motion),
        fps=motion.fps,
        seconds=motion.seconds,
        height=height,
        path=float(np.linalg.norm(np.diff(ground, axis=0), axis=-1).sum()),
        travel=float(np.linalg.norm(ground[-1] - ground[0])),
        lowest=low,  # type: ignore[arg-type]
        highest=high,  # type: ignore[arg-type]
        floor=floor,
        problems=tuple(_problems(motion, body, way, height, floor)),
    )


def _person(motion: Motion, start: int) -> Array | None:
    """(frames, 22, 3) metres: the person, where joints that are no body (a root bone, controls) are above it."""
    try:
        pelvis = read_body(motion.skeleton).drivers[0]
    except MotionloomError:
        return None
    return None if pelvis in (None, start) else joints22(motion)


def family(skeleton: Skeleton) -> str:
    """The family of skeletons these joint names belong to, or ``unknown``."""
    return next((name for name, some in _FAMILIES if some <= set(skeleton.names)), "unknown")


def _problems(motion: Motion, body: Array, way: Array, height: float, floor: float) -> list[str]:
    found = []
    spans = np.median(np.ptp(body, axis=1), axis=0)
    if spans[2] > 2 * spans[1] and height > 0.5:
        found.append("the body lies or Z is up in the file (a person who stands is long in Y); --up z turns it")
    elif not 0.6 <= height <= 2.6:
        found.append(f"the body is {height:.3g} m tall; if it is a person, give the file's unit with --unit")
    elif abs(floor) > 0.15:
        found.append(f"the lowest joint is at {floor:+.2f} m, so the feet are not on the floor at 0")
    if len(motion) < 2:
        found.append("there is one frame only, a pose")
    if not 10 <= motion.fps <= 500:
        found.append(f"{motion.fps:g} frames per second is unusual")
    step = np.linalg.norm(np.diff(way, axis=0), axis=-1) * motion.fps
    if len(step) and step.max() > 15:
        found.append(f"the root jumps at frame {int(step.argmax()) + 1} ({step.max():.0f} m/s)")
    turn = _largest_turn(motion)
    if turn[0] > np.radians(100):
        name = motion.skeleton.names[turn[2]]
        found.append(f"{name!r} turns by {np.degrees(turn[0]):.0f} degrees from frame {turn[1]} to {turn[1] + 1}")
    if motion.translations is not None and _stretch(motion) > 0.01:
        found.append(f"bones change their length by up to {_stretch(motion):.2f} m")
    return found


def _largest_turn(motion: Motion) -> tuple[float, int, int]:
    """Largest change of one joint's rotation between neighbouring frames: radians, frame, joint."""
    if len(motion) < 2:
        return 0.0, 0, 0
    change = rot.multiply(rot.inverse(motion.rotations[:-1]), motion.rotations[1:])
    angle = 2 * np.arccos(np.clip(np.abs(change[..., 0]), 0, 1))
    frame, joint = np.unravel_index(int(angle.argmax()), angle.shape)
    return float(angle[frame, joint]), int(frame), int(joint)


def _stretch(motion: Motion) -> float:
    """Metres by which bones change, leaving out the travelling child of a still root."""
    assert motion.translations is not None
    lengths = np.linalg.norm(motion.translations, axis=-1)[:, 1:]
    parents = np.array(motion.skeleton.parents[1:])
    return float(np.ptp(lengths[:, parents != 0], axis=0).max(initial=0.0))
