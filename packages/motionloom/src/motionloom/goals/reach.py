"""What nobody can do: goals too far, too high or too fast for any body."""

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.skeleton import SMPL22
from motionloom.goals.goal import FPS, Goal
from motionloom.goals.paths import check_speed

HIGHEST, LONGEST_REACH = 3.0, 1.3
"""Metres: no joint of a person gets higher above the floor, or further from the pelvis."""


def check_reach(goal: Goal) -> None:
    """MotionloomError, naming joint and time, for a goal that no person meets.

    The pelvis moves at most at `motionloom.goals.paths.FASTEST`, also from where the person starts; joints stay below
    `HIGHEST` and, where the pelvis has a target in the same frame, within `LONGEST_REACH` of it.
    """
    places = goal.positions[:, 0, ::2].copy()
    known = np.array(goal.mask[:, 0, 0] & goal.mask[:, 0, 2])
    if goal.start is not None and not known[0]:
        places[0], known[0] = (goal.start.x, goal.start.z), True
    at = np.flatnonzero(known)
    check_speed(places[at], at / FPS)
    tall = np.where(goal.mask[..., 1], goal.positions[..., 1], 0.0)
    _check(tall, HIGHEST, "high", f"below {HIGHEST:g} m")
    flat = np.linalg.norm(goal.positions[..., ::2] - places[:, None], axis=-1)
    up = np.where(goal.mask[..., 1] & goal.mask[:, :1, 1], goal.positions[..., 1] - goal.positions[:, :1, 1], 0.0)
    both = goal.mask[..., 0] & goal.mask[..., 2] & known[:, None]
    far = np.where(both, np.hypot(flat, up), 0.0)
    _check(far, LONGEST_REACH, "away from where the pelvis is then", f"within {LONGEST_REACH:g} m of it")


def _check(distance: np.ndarray, limit: float, what: str, advice: str) -> None:
    if distance.max() <= limit:
        return
    frame, joint = divmod(int(distance.argmax()), len(SMPL22))
    raise MotionloomError(
        f"asks for {SMPL22.names[joint]} at {frame / FPS:.2f} s {distance.max():.2f} m {what}, out of anybody's reach; "
        f"keep it {advice}"
    )
