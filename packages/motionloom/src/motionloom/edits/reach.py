"""Reach: how far a body goes up and down for what is asked of its joints, with its feet on the floor.

Only somebody who jumps leaves the floor, by no more than people do. What is too high is asked as high as they get.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motionloom.goals.goal import Goal
from motionloom.kinematics import costs
from motionloom.kinematics.gestures import airborne

Array = NDArray[np.float64]

REACH = {j: (costs.beside(j, base), metres) for j, (base, metres) in costs.by_number(costs.REACH).items()}
"""Of the joints of limbs: where the limb begins, and metres that it reaches."""
_TIPTOE, _SHRUG, _JUMP = 0.07, 0.05, 0.38
"""Metres that the ankles of somebody who stands go up, the shoulder of a raised arm, and somebody who jumps."""
_FLYING = 0.1
"""Metres that both feet are above the floor of somebody who jumps."""
_HOPELESS = 1.0
"""Metres down beyond which the body does not go along."""


def _straight(line: Array, reach: float) -> Array:
    """(frames,) metres: how high a limb reaches that is asked to go along these lines (frames, 3) from its base."""
    return np.sqrt((reach**2 - (line[:, [0, 2]] ** 2).sum(-1)).clip((0.3 * reach) ** 2))


def room_above(places: Array) -> Array:
    """(frames,) metres that the body can go up while its feet stay on the floor; more for somebody who jumps at all.

    Args:
        places: (frames, 22, 3) metres, +Y up, of somebody who is on the floor in a fifth of the frames or more.
    """
    room = np.full(len(places), np.inf)
    for _, ankle, _ in costs.LEGS:
        base, reach = REACH[ankle]
        line, height = places[:, base] - places[:, ankle], places[:, ankle, 1]
        above = (height - np.percentile(height, 20)).clip(0)
        room = np.minimum(room, (_straight(line, reach) - line[:, 1]).clip(0) - above)
    most = _TIPTOE + (_JUMP if airborne(places, clearance=_FLYING) else 0.0)
    return (room + most).clip(0)


def lowered(goal: Goal, places: Array, room: Array) -> Goal:
    """The goal with what is too high for a body that goes up by ``room`` as high as it gets.

    Where the height of the pelvis is asked all stays: it says by itself that somebody leaves the floor.

    Args:
        goal: in the frame of ``places``.
        places: (frames, 22, 3) metres, +Y up.
        room: (frames,) metres, as of `room_above`.
    """
    above = np.zeros(goal.positions.shape[:2])
    for joint in (np.flatnonzero(goal.mask[:, 1:, 1].any(axis=0)) + 1).tolist():
        base, reach = REACH.get(joint, (joint, costs.TRUNK_SLACK))
        line = np.where(goal.mask[:, joint], goal.positions[:, joint] - places[:, base], 0.0)
        above[:, joint] = (line[:, 1] - _straight(line, reach) - room - _SHRUG).clip(0)
    above[goal.mask[:, 0, 1]] = 0.0
    return replace(goal, positions=goal.positions - above[..., None] * [0, 1, 0]) if above.any() else goal


def out_of_reach(places: Array, goal: Goal) -> Array:
    """(frames,) metres: how far up the body must go so that limbs reach what is above or below them.

    Args:
        places: (frames, 22, 3) metres, +Y up.
        goal: in the same frame.
    """
    need = np.zeros(len(places))
    for joint, (base, reach) in REACH.items():
        asked = goal.mask[:, joint].all(axis=-1, keepdims=True)
        line = np.where(asked, goal.positions[:, joint] - places[:, base], 0.0)
        beyond = np.sign(line[:, 1]) * (np.abs(line[:, 1]) - _straight(line, reach)).clip(0)
        need = np.where(np.abs(beyond) > np.abs(need), beyond, need)
    return np.where(need > -_HOPELESS, need, 0.0)
