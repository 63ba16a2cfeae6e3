"""A number that the words say as a goal: how long it takes, where the pelvis goes, where the person faces.

Metres in the ground pose at the beginning: +Z forward, +X left; radians about +Y; 20 frames per second.
"""

import numpy as np

from motionloom.goals.amounts import RADIUS, Amount
from motionloom.goals.goal import FPS, Goal
from motionloom.goals.paths import check_speed
from motionloom.kinematics.counts import Counted, count, foot_moves
from motionloom.motion import ground_pose

BEFORE, AFTER = 0.3, 0.6
"""Seconds of standing around a way or a turn."""
RAMP = 0.4
"""Seconds of setting out, and of stopping."""
TURNING = 75.0
"""Degrees per second of somebody who turns on the spot."""
SLOWEST = 0.5
"""Share of the pace of the words that a way may be slowed to for a longer time; beyond it the person stands still."""
TURN_OFF, WAY_OFF = 10.0, 0.1
"""Degrees (10 of a full turn), and share of a way, by which a motion may miss what was read."""


STROKES: dict[Counted, float] = {
    "jumps": 1.5,
    "hops": 0.9,
    "squats": 2.2,
    "kicks": 1.8,
    "punches": 1.6,
    "bows": 2.5,
    "claps": 0.5,
    "jumping jacks": 1.0,
}
"""Seconds of one stroke; how often they come is measured, and tried again (`motionloom.tasks.worded`)."""
CHAINED = 1.4
"""Seconds from which on a stroke is a segment of its own; quicker ones follow each other in one."""


def seconds_for(amount: Amount) -> float:
    """How long it takes at the pace of the words, standing before and after."""
    if amount.kind == "count":
        assert amount.of is not None
        return amount.size * STROKES[amount.of] + (0.5 if STROKES[amount.of] < CHAINED else 0.0)
    moving = amount.size / TURNING if amount.kind == "turn" else amount.metres / amount.speed
    return round((BEFORE + moving + RAMP + AFTER) * FPS) / FPS


def goal_for(amount: Amount, seconds: float) -> Goal:
    """The goal for one action of ``seconds``: a turn on the spot, or a way of the pelvis and where it is faced.

    A longer time slows the person down to `SLOWEST`, who stands still for the rest; a shorter time is a faster way.
    Raises `MotionloomError` where nobody runs as fast.
    """
    check_speed(np.array([[0.0, 0.0], [0.0, amount.metres]]), np.array([0.0, seconds]))
    frames = round(seconds * FPS)
    goal = Goal.nothing(frames)
    share = _shares(frames, seconds, seconds_for(amount))
    side = 1.0 if amount.direction == "left" else -1.0
    goal.facing_mask[:] = True
    if amount.kind == "turn":
        goal.facing[:] = side * np.radians(amount.size) * share
        return goal
    if amount.kind == "arc":
        angle = np.radians(amount.size) * share
        ahead = -1.0 if amount.backward else 1.0
        x, z = side * RADIUS * (1 - np.cos(angle)), ahead * RADIUS * np.sin(angle)
        goal.facing[:] = side * ahead * angle
    else:
        toward = {"forward": (0.0, 1.0), "backward": (0.0, -1.0), "left": (1.0, 0.0), "right": (-1.0, 0.0)}
        x, z = (amount.metres * share * part for part in toward[amount.direction])
    goal.positions[:, 0, 0], goal.positions[:, 0, 2] = x, z
    goal.mask[:, 0, [0, 2]] = True
    return goal


def _shares(frames: int, seconds: float, natural: float) -> np.ndarray:
    """(frames,) from 0 to 1: the share of a way behind one, setting out and stopping softly."""
    rest = min(1.0, seconds / natural)
    moving = natural - BEFORE - AFTER
    lasting = min(moving / SLOWEST, seconds - rest * (BEFORE + AFTER))
    ramp = min(RAMP, lasting / 2)
    at = (np.arange(frames) / FPS - rest * BEFORE).clip(0, lasting)
    fine = np.linspace(0, lasting, 512)
    speed = np.minimum(1, np.minimum(fine, lasting - fine) / ramp)
    way = np.concatenate([[0], np.cumsum((speed[1:] + speed[:-1]) / 2)])
    return np.interp(at, fine, way / way[-1])


def measured(amount: Amount, positions: np.ndarray, fps: float = FPS) -> float:
    """Degrees turned to the amount's side, metres travelled, steps, or repetitions.

    positions: (frames, 22, 3) metres in the world. Of an arc the turn is measured; of steps to a side those of the foot
    on that side, which the other follows.
    """
    if amount.kind == "count":
        assert amount.of is not None
        return count(amount.of, positions, fps, side=amount.side)
    if amount.kind == "steps":
        moves = foot_moves(positions, fps)
        return moves[("left", "right").index(amount.direction)] if amount.side else sum(moves)
    if amount.kind in ("turn", "arc"):
        facing = np.unwrap([ground_pose(frame).facing for frame in positions])
        against = amount.kind == "arc" and amount.backward
        side = 1.0 if (amount.direction == "left") != against else -1.0
        return float(side * np.degrees(facing[-1] - facing[0]))
    moved = positions[-1, 0] - positions[0, 0]
    return amount.metre * float(np.hypot(moved[0], moved[2]))


def is_met(amount: Amount, size: float) -> bool:
    """Whether the `measured` size is the amount's own, within the tolerance."""
    if amount.kind in ("turn", "arc"):
        return abs(size - amount.size) <= max(TURN_OFF, amount.size / 36)
    return size == amount.size if amount.kind != "way" else abs(size / amount.size - 1) <= WAY_OFF
