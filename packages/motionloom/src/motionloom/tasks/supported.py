"""Nobody hangs in the air or sinks into the floor: steps under who climbs, the floor under who hovers and under hands.

Each of these leaves a motion that has nothing of the kind as it is.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from motionloom.core.body.feet import clean_feet
from motionloom.core.motion import Motion
from motionloom.edits.fitting import fit
from motionloom.goals.expected import climbs, floating
from motionloom.goals.goal import Goal
from motionloom.kinematics.physics import ANKLES, WRISTS, J, odd, smooth
from motionloom.kinematics.stairs import UP, falls_from_above, hovering, in_the_air
from motionloom.kinematics.stairs import stairs as find_stairs
from motionloom.retarget import joints22

_JUMP = re.compile(r"\b(?:jump|hop|leap)\w*")
SUNK = 0.02
"""Metres by which a hand or the head may be under the floor."""
REST = {WRISTS[0]: 0.02, WRISTS[1]: 0.02, J["head"]: 0.06}
"""Metres over the floor where the joint of a hand, and of the head, comes to lie."""


def remarks_on_air(
    people: Sequence[Motion], texts: Sequence[str], *, floor: float = 0.0, begin_s: float = 0.0
) -> list[str]:
    """A sentence about each person who is in the air for a second or more, where the words are of no climb or jump.

    people: of any humanoid skeleton; floor: metres of its height; begin_s: seconds at which the motions begin.
    """
    if climbs(texts) or any(_JUMP.search(text.lower()) for text in texts):
        return []
    remarks = []
    for number, motion in enumerate(people, start=1):
        places = joints22(motion) - np.array([0.0, floor, 0.0])
        if spans := in_the_air(places, motion.fps):
            whose = f"person {number}" if len(people) > 1 else "the person"
            first, end = max(spans, key=lambda span: span[1] - span[0])
            height = float(np.median(places[first:end, :, 1].min(axis=1)))
            times = f"from {begin_s + first / motion.fps:.1f} to {begin_s + end / motion.fps:.1f} s"
            remarks.append(f"{whose} is {height:.2f} m above the floor {times} with nothing underneath")
    return remarks


def is_elevated(motion: Motion) -> bool:
    """Whether somebody begins or ends above the floor for half a second, as who climbs does."""
    lowest, some = motion.positions()[..., 1].min(axis=1), max(1, round(motion.fps / 2))
    return max(float(np.median(lowest[:some])), float(np.median(lowest[-some:]))) > UP


def add_support(motion: Motion, *, stairs: bool = True) -> Motion:
    """The motion with its feet on steps of one height where it climbs, on the floor where it hovers, its hands above.

    motion: of the 22-joint person at 20 frames per second, on the floor y = 0. stairs: whether there may be steps.
    """
    places = motion.positions()
    if hovering(places, motion.fps) or falls_from_above(places, motion.fps):
        motion = _dropped(motion, np.maximum(places[..., 1].min(axis=1), 0.0))
    elif stairs:
        motion = _on_stairs(motion, places)
    else:
        motion = lowered(motion)
    places, goal = motion.positions(), Goal.nothing(len(motion))
    for joint, rest in REST.items():
        sunk = places[:, joint, 1] < rest - SUNK
        goal.positions[sunk, joint, 1] = rest
        goal.mask[sunk, joint, 1] = True
    return fit(motion, goal) if goal.mask.any() else motion


def add_support_between(motion: Motion, spans: Sequence[tuple[int, int]]) -> Motion:
    """The same in half-open ranges of frames, without steps; the other frames stay bit for bit."""
    supported = add_support(motion, stairs=False)
    frames = np.zeros((len(motion), 1, 1), dtype=bool)
    for first, end in spans:
        frames[first:end] = True
    return replace(
        motion,
        root=np.where(frames[:, 0], supported.root, motion.root),
        rotations=np.where(frames, supported.rotations, motion.rotations),
    )


def lowered(motion: Motion) -> Motion:
    """The motion with whoever floats on the floor (`floating`); the same where nobody does."""
    lowest = motion.positions()[..., 1].min(axis=1)
    drop = np.zeros(len(motion))
    for first, end in floating(motion.positions(), motion.fps):
        drop[first:end] = lowest[first:end]
    return _dropped(motion, drop) if drop.any() else motion


def _on_stairs(motion: Motion, places: np.ndarray) -> Motion:
    flight = find_stairs(places, motion.fps)
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


def _dropped(motion: Motion, drop: np.ndarray) -> Motion:
    """Lowered by metres (frames,), a quarter of a second averaged, and not into the floor."""
    lowest = motion.positions()[..., 1].min(axis=1)
    drop = np.minimum(smooth(drop, odd(motion.fps / 4)), np.maximum(lowest, 0.0))
    return clean_feet(replace(motion, root=motion.root - drop[:, None] * np.array([0.0, 1.0, 0.0])))
