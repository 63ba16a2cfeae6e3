"""Places to reach and poses to take: when windows are asked for them, and what is walked to first.

A window knows of what is asked of its own frames. So what is to be reached later waits until it is near in time, and
what is out of anybody's reach until somebody stands before it.
"""

import math
from dataclasses import dataclass

from motionloom.features.layout import FPS
from motionloom.goals.paths import WALKING
from motionloom.ground import GroundPose
from motionloom.live.commands import Path, Pose, Reach

NEAR, NEAR_POSE = 50, 20
"""Frames before its time from which on a place to reach is asked of windows, and a pose, which is taken where somebody
is by then."""
SOON, OFF = 12, 15
"""Frames in which something is reached by somebody who has come to it, and those in which he gets going."""
HURRY = 2.2
"""Metres per second with which somebody goes to a place at most, where that brings him there in time."""
ARMS = {"wrist": 0.7, "elbow": 0.5, "foot": 0.6, "ankle": 0.6, "knee": 0.4}
"""Metres on the floor between the pelvis and what a joint reaches without a step."""
ELSE = 0.3
"""The same of the other joints."""
BEFORE = 0.25
"""Metres nearer than that somebody goes who goes to a place."""
LUNGE, PACE = 0.3, 1.0
"""Metres, and metres a second, by which a body goes along with what it reaches for: a lean, and a step or two."""


@dataclass(frozen=True, eq=False)
class Target:
    """Something that waits for its time."""

    command: Reach | Pose
    due: int
    """The frame in which it is to be so."""
    near: bool = False
    """Somebody has gone to it."""

    @property
    def first(self) -> int:
        """The frame from which on it is asked of windows."""
        return self.due - (NEAR if isinstance(self.command, Reach) else NEAR_POSE)


def too_far(command: Reach, place: GroundPose) -> float:
    """Metres that somebody at a place is too far away to reach without a step; 0 where he is near enough."""
    x, _, z = command.position
    return max(0.0, math.hypot(x - place.x, z - place.z) - _arm(command.joint))


def within_reach(command: Reach, place: GroundPose, frames: int) -> bool:
    """Whether somebody who will be at a place so many frames from now reaches it with what a body can do until then."""
    return too_far(command, place) <= LUNGE + PACE * frames / FPS


def same_place(one: GroundPose, other: GroundPose, frames: int) -> bool:
    """Whether somebody gets from one place to another in so many frames by what a body can do at once."""
    return math.hypot(one.x - other.x, one.z - other.z) <= LUNGE + PACE * frames / FPS


def must_go(command: Reach, place: GroundPose, frames: int) -> bool:
    """Whether somebody at a place who is to reach something so many frames from now walks there from now on."""
    return too_far(command, place) / WALKING >= (frames - NEAR) / FPS


def way_to(command: Reach, place: GroundPose, frames: int) -> Path:
    """The way from a place to where a thing is reached from: at a walk, or faster where that is in time."""
    x, _, z = command.position
    away = math.hypot(x - place.x, z - place.z)
    left = max(0.0, 1 - max(0.0, _arm(command.joint) - BEFORE) / max(away, 1e-6))
    needed = away * left / max((frames - SOON - OFF) / FPS, 0.05)
    end = place.x + (x - place.x) * left, place.z + (z - place.z) * left
    return Path((end,), needed if WALKING < needed <= HURRY else WALKING)


def _arm(joint: str) -> float:
    return ARMS.get(joint.rsplit("_", 1)[-1], ELSE)
