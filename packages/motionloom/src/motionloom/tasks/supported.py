"""Nobody hangs in the air or sinks into the floor: steps under who climbs, the floor under who hovers and under hands.

Each of these leaves a motion that has nothing of the kind as it is.
"""

from dataclasses import replace

import numpy as np

from motionloom.edits.fitting import fit
from motionloom.goals.goal import Goal
from motionloom.kinematics.feet import clean_feet
from motionloom.kinematics.physics import ANKLES, WRISTS, J, odd, smooth
from motionloom.kinematics.stairs import hovering, stairs
from motionloom.motion import Motion

SUNK = 0.02
"""Metres by which a hand or the head may be under the floor."""
REST = {WRISTS[0]: 0.02, WRISTS[1]: 0.02, J["head"]: 0.06}
"""Metres over the floor where the joint of a hand, and of the head, comes to lie."""


def add_support(motion: Motion) -> Motion:
    """The motion with its feet on steps of one height where it climbs, on the floor where it hovers, its hands above.

    motion: of the 22-joint person at 20 frames per second, on the floor y = 0.
    """
    places = motion.positions()
    moved = _grounded if hovering(places, motion.fps) else _on_stairs
    motion = moved(motion, places)
    places, goal = motion.positions(), Goal.nothing(len(motion))
    for joint, rest in REST.items():
        sunk = places[:, joint, 1] < rest - SUNK
        goal.positions[sunk, joint, 1] = rest
        goal.mask[sunk, joint, 1] = True
    return fit(motion, goal) if goal.mask.any() else motion


def _on_stairs(motion: Motion, places: np.ndarray) -> Motion:
    flight = stairs(places, motion.fps)
    if flight is None:
        return motion
    goal = Goal.nothing(len(motion))
    lift, known = np.zeros(len(motion)), np.zeros(len(motion), dtype=bool)
    for hold, level in zip(flight.holds, flight.levels, strict=True):
        ankle, frames = ANKLES[hold.side], slice(hold.first, hold.end)
        off = level * flight.rise - hold.height
        goal.positions[frames, ankle] = np.median(places[frames, ankle], axis=0) + np.array([0.0, off, 0.0])
        goal.mask[frames, ankle] = True
        lift[frames], known[frames] = off, True
    at = np.arange(len(motion))
    lift = smooth(np.interp(at, at[known], lift[known]), odd(motion.fps / 2))
    return fit(replace(motion, root=motion.root + lift[:, None] * np.array([0.0, 1.0, 0.0])), goal)


def _grounded(motion: Motion, places: np.ndarray) -> Motion:
    """Lowered by as much as the lowest joint is above the floor, a quarter of a second averaged."""
    drop = smooth(np.maximum(places[..., 1].min(axis=1), 0.0), odd(motion.fps / 4))
    return clean_feet(replace(motion, root=motion.root - drop[:, None] * np.array([0.0, 1.0, 0.0])))
