"""What is wrong with a clip before anything is learned from it: too short, floating, wrong unit, nothing moves."""

from dataclasses import dataclass

import numpy as np

from motionloom.errors import MotionloomError
from motionloom.features.layout import FPS
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array
from motionloom.motion import Motion
from motionloom.retarget import joints22
from motionloom.retarget.anatomy import read_body
from motionloom_train.data.examples import uniform_positions

SHORTEST = 0.7
"""Seconds of the shortest clip that shows an action."""
LEGS = (0.4, 1.4)
"""Metres of thigh and shin: children to giants."""
FACTORS = (0.01, 0.001, 0.1, 0.0254, 100.0, 1000.0, 10.0, 39.37)
"""By which a unit is commonly wrong."""
STILL = 0.06
"""Metres: if no joint ever gets further from where it was than this, nothing happens."""
OVER_FLOOR, SHARE_IN_AIR = 0.12, 0.4
"""Metres over the lowest point of the clip, and the share of frames, beyond which somebody floats."""
FAR_FROM_FLOOR = 0.25
"""Metres between the lowest point of a clip and y = 0 that are worth a word."""
LEAP = 15.0
"""Metres per second of the pelvis: faster than anybody runs."""
SLIDES = 0.35
"""`FootSkate.ratio` beyond which feet slide: recorded walks have less than a tenth."""


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong with a clip."""

    sentence: str
    fatal: bool
    """True where nothing sensible can be learned; else it is a thing to look at."""


def check_clip(motion: Motion) -> list[Finding]:
    """What is wrong with a clip, the fatal first; empty for a good one.

    motion: as read, in metres. Sizes and places are judged on the clip's own joints, movement on the uniform person.
    Raises `MotionloomError` for a skeleton that is no person's.
    """
    leg = read_body(motion.skeleton).leg
    own = joints22(motion)
    found = [_unit(leg), _length(motion)]
    if not any(one and one.fatal for one in found):
        uniform = uniform_positions(motion)
        found += [_movement(uniform), _leaps(own / max(leg, 1e-9) * 0.85, motion.fps), _up(uniform)]
        found += [_floating(uniform), _floor(own), _sliding(uniform)]
    return sorted((one for one in found if one), key=lambda one: not one.fatal)


def check_file(motion_or_error: Motion | MotionloomError) -> list[Finding]:
    """`check_clip` of what a reader gave; what could not be read is a finding too."""
    if isinstance(motion_or_error, MotionloomError):
        return [Finding(str(motion_or_error), fatal=True)]
    try:
        return check_clip(motion_or_error)
    except MotionloomError as error:
        return [Finding(str(error), fatal=True)]


def _unit(leg: float) -> Finding | None:
    if LEGS[0] <= leg <= LEGS[1]:
        return None
    near = next((factor for factor in FACTORS if LEGS[0] <= leg * factor <= LEGS[1]), None)
    advice = "" if near is None else f"; in a unit {near:g} times as large they would be {leg * near:.2f} m (--unit)"
    return Finding(f"its legs are {leg:.3g} m long, so the unit of length is wrong{advice}", fatal=True)


def _length(motion: Motion) -> Finding | None:
    if motion.seconds >= SHORTEST:
        return None
    return Finding(f"it is {motion.seconds:.2f} s short; at least {SHORTEST:g} s show an action", fatal=True)


def _movement(uniform: Array) -> Finding | None:
    reach = np.linalg.norm(uniform - np.median(uniform, axis=0), axis=-1).max()
    if reach >= STILL:
        return None
    return Finding(f"nothing moves: no joint gets {100 * STILL:.0f} cm away from its place", fatal=True)


def _leaps(own: Array, fps: float) -> Finding | None:
    speed = np.linalg.norm(np.diff(own[:, 0], axis=0), axis=-1) * fps
    if not len(speed) or speed.max() <= LEAP:
        return None
    second = int(speed.argmax()) / fps
    return Finding(
        f"the body leaps {speed.max() / fps:.2f} m from one frame to the next at {second:.2f} s; cut the clip there",
        fatal=True,
    )


def _up(uniform: Array) -> Finding | None:
    trunk = uniform[:, 12] - uniform[:, 0]
    rise = trunk[:, 1] / np.maximum(np.linalg.norm(trunk, axis=-1), 1e-9)
    if np.percentile(rise, 90) > 0.3:
        return None
    return Finding(
        "the body lies or hangs all the time; if it should stand, the file has another axis up (--up z)", False
    )


def _floating(uniform: Array) -> Finding | None:
    lowest = uniform[..., 1].min(axis=1)
    share = float((lowest - np.percentile(lowest, 1) > OVER_FLOOR).mean())
    if share <= SHARE_IN_AIR:
        return None
    return Finding(
        f"it floats: for {100 * share:.0f} % of the time no part of the body is within {100 * OVER_FLOOR:.0f} cm of "
        "the floor; the floor is not level, or what is climbed on is missing",
        fatal=False,
    )


def _floor(own: Array) -> Finding | None:
    height = float(np.percentile(own[..., 1].min(axis=1), 2))
    if abs(height) <= FAR_FROM_FLOOR:
        return None
    where = "above" if height > 0 else "below"
    return Finding(f"its floor is {abs(height):.2f} m {where} y = 0; it is put onto the floor", fatal=False)


def _sliding(uniform: Array) -> Finding | None:
    skate = ph.foot_skate(uniform, FPS, floor=ph.floor_height(uniform))
    if skate.ratio <= SLIDES:
        return None
    return Finding(
        f"feet slide on the floor in {100 * skate.ratio:.0f} % of the frames, and that is learned too; lock them first",
        fatal=False,
    )
