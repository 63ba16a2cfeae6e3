"""What a motion file holds, in numbers a person can check at a glance."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.retarget.anatomy import read_body
from motionloom.retarget.fidelity import compare
from motionloom.retarget.transfer import joints22, to_smpl22
from motionloom.viz.figure import body_height, body_start

Array = NDArray[np.float64]

_FAMILIES = {
    "SMPL-22": " ".join(SMPL22.names),
    "CMU (ASF/AMC)": "root lhipjoint lfemur ltibia upperback lowerneck rhumerus",
    "Daz (CMU as BVH)": "hip abdomen chest lButtock lThigh lShin rForeArm",
    "Bandai Namco": "joint_Root Hips UpperLeg_L LowerLeg_L Toes_L UpperArm_R",
    "Mixamo": "mixamorig:Hips mixamorig:LeftUpLeg mixamorig:RightForeArm",
    "Unreal": "pelvis thigh_l calf_l upperarm_r lowerarm_r",
    "Rigify": "DEF-spine DEF-thigh.L DEF-shin.L DEF-forearm.R",
    "SOMA (Kimodo)": "Hips Spine1 Chest Neck1 LeftLeg LeftShin RightForeArm",
    "MotionBuilder": "Hips LeftUpLeg LeftLeg LeftFoot RightForeArm",
}
"""Some of the joints of each, by which it is known."""
_ENOUGH = 20_000
"""Frames, from all over the motion, by which a body's build is measured."""
_COPIED = 1200
"""Frames, from the beginning, that are put on the 22-joint person and compared."""
_BLOCK = 4096
"""Frames that are looked at together."""


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
    """Measure a motion and look for common faults, in memory that hardly grows with its length."""
    few = motion.thinned(_ENOUGH)
    places = few.positions()
    start = body_start(motion.skeleton, places)
    person = _person(few, start)
    if person is not None:
        height = body_height(SMPL22, person)
    else:
        height = body_height(motion.skeleton, places) if len(motion.skeleton) - start > 1 else 0.0
    tracks = [_track(motion.frames(k, k + _BLOCK), start, person is not None) for k in range(0, len(motion), _BLOCK)]
    way, low, high = (np.concatenate(parts) for parts in zip(*tracks))
    ground, floor = way[:, [0, 2]], float(np.percentile(low[:, 1], 2))
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
        lowest=tuple(low.min(axis=0).tolist()),
        highest=tuple(high.max(axis=0).tolist()),
        floor=floor,
        problems=tuple(_problems(motion, high - low, way, height, floor)),
    )


def _track(motion: Motion, start: int, is_person: bool) -> tuple[Array, Array, Array]:
    """(frames, 3) metres: the pelvis or the joint where the body begins, and the two corners of the box around it."""
    body = motion.positions()[:, start:]
    way = joints22(motion)[:, 0] if is_person else body[:, 0].copy()
    return way, body.min(axis=1), body.max(axis=1)


def _person(motion: Motion, start: int) -> Array | None:
    """(frames, 22, 3) metres: the person, where joints that are no body (a root bone, controls) are above it."""
    try:
        pelvis = read_body(motion.skeleton).drivers[0]
    except MotionloomError:
        return None
    return None if pelvis in (None, start) else joints22(motion)


def family(skeleton: Skeleton) -> str:
    """The family of skeletons these joint names belong to, or ``unknown``."""
    names = set(skeleton.names)
    known = (name for name, some in _FAMILIES.items() if names.issuperset(some.split()))
    return next(known, "unknown")


def _problems(motion: Motion, spans: Array, way: Array, height: float, floor: float) -> list[str]:
    problems = []
    spans = np.median(spans, axis=0)
    if spans[2] > 2 * spans[1] and height > 0.5:
        problems.append("the body lies; if it should not, another axis is up in the file (--up z, --up x, --up y-down)")
    elif not 0.6 <= height <= 2.6:
        problems.append(f"the body is {height:.3g} m tall; if it is a person, give the file's unit with --unit")
    elif abs(floor) > 0.15:
        problems.append(f"the lowest joint is at {floor:+.2f} m, so the feet are not on the floor at 0")
    if len(motion) < 2:
        problems.append("there is one frame only, a pose")
    if not 10 <= motion.fps <= 500:
        problems.append(f"{motion.fps:g} frames per second is unusual")
    step = np.linalg.norm(np.diff(way, axis=0), axis=-1) * motion.fps
    if len(step) and step.max() > 15:
        problems.append(f"the root jumps at frame {int(step.argmax()) + 1} ({step.max():.0f} m/s)")
    turn = _largest_turn(motion)
    if turn[0] > np.radians(100):
        name = motion.skeleton.names[turn[2]]
        problems.append(f"{name!r} turns by {np.degrees(turn[0]):.0f} degrees from frame {turn[1]} to {turn[1] + 1}")
    if motion.translations is not None and _stretch(motion) > 0.01:
        problems.append(f"bones change their length by up to {_stretch(motion):.2f} m")
    if faults := _copy_faults(motion.frames(0, _COPIED)):
        problems.append(f"on the 22-joint person its body does not do what was recorded: {', '.join(faults[:4])}")
    return problems


def _copy_faults(motion: Motion) -> list[str]:
    """What is wrong with the motion on the 22-joint person, if it is a person's."""
    try:
        person = to_smpl22(motion)
    except MotionloomError:
        return []
    return compare(joints22(motion), person.positions()).faults()


def _largest_turn(motion: Motion) -> tuple[float, int, int]:
    """Largest change of one joint's rotation between neighbouring frames: radians, frame, joint."""
    largest = 0.0, 0, 0
    for at in range(0, len(motion) - 1, _BLOCK):
        turns = motion.rotations[at : at + _BLOCK + 1]
        change = rot.multiply(rot.inverse(turns[:-1]), turns[1:])
        angle = 2 * np.arccos(np.clip(np.abs(change[..., 0]), 0, 1))
        frame, joint = np.unravel_index(int(angle.argmax()), angle.shape)
        if angle[frame, joint] > largest[0]:
            largest = float(angle[frame, joint]), at + int(frame), int(joint)
    return largest


def _stretch(motion: Motion) -> float:
    """Metres by which bones change, leaving out the travelling child of a still root."""
    assert motion.translations is not None
    shortest = np.full(len(motion.skeleton) - 1, np.inf)
    longest = np.zeros(len(motion.skeleton) - 1)
    for at in range(0, len(motion), _BLOCK):
        lengths = np.linalg.norm(motion.translations[at : at + _BLOCK, 1:], axis=-1)
        shortest = np.minimum(shortest, lengths.min(axis=0))
        longest = np.maximum(longest, lengths.max(axis=0))
    parents = np.array(motion.skeleton.parents[1:])
    return float((longest - shortest)[parents != 0].max(initial=0.0))
