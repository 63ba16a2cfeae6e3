"""A moving person as the signals that the everyday checks read, each worked out once.

Joint positions are smoothed over three frames. Metres, seconds, degrees; +Y up, the floor at y = 0; sides are numbered
0 (left) and 1 (right). Heights of the pelvis are in leg lengths, so that tall and short people compare.
"""

from functools import cached_property

import numpy as np

from motionloom.kinematics import gestures as g
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array, J

KNEES, HIPS = (J["left_knee"], J["right_knee"]), (J["left_hip"], J["right_hip"])
SHOULDERS, ELBOWS = (J["left_shoulder"], J["right_shoulder"]), (J["left_elbow"], J["right_elbow"])
WRISTS, ANKLES, FEET = ph.WRISTS, ph.ANKLES, ph.FEET
EDGE = 0.5
"""Seconds at both ends over which a posture at the start or at the end is averaged."""


class Body:
    """Signals of one motion. Arguments: ``positions`` (frames, 22, 3) metres, SMPL order; ``fps`` frames per second."""

    def __init__(self, positions: np.ndarray, fps: float) -> None:
        self.unsmoothed: Array = np.asarray(positions, dtype=np.float64)
        self.p: Array = ph.smooth(self.unsmoothed, 3)
        self.fps = float(fps)

    # ---- time ------------------------------------------------------------------------------------------------------

    @property
    def seconds(self) -> float:
        """Length in seconds."""
        return len(self.p) / self.fps

    def part(self, first: float, last: float) -> "Body":
        """The same person between two shares of the time, 0 the first frame and 1 the end."""
        a, b = round(first * len(self.p)), round(last * len(self.p))
        return Body(self.p[a : max(b, a + 2)], self.fps)

    def split(self, frame: int) -> tuple["Body", "Body"]:
        """What comes before a frame and what comes from it on, at least two frames each."""
        at = min(max(frame, 2), len(self.p) - 2)
        return Body(self.p[:at], self.fps), Body(self.p[at:], self.fps)

    def at_start(self, signal: np.ndarray) -> float:
        """Median of a signal over the first half second."""
        return float(np.median(np.asarray(signal)[: max(1, round(EDGE * self.fps))]))

    def at_end(self, signal: np.ndarray) -> float:
        """Median of a signal over the last half second."""
        return float(np.median(np.asarray(signal)[-max(1, round(EDGE * self.fps)) :]))

    def held(self, mask: np.ndarray | np.bool_) -> float:
        """Seconds of the longest unbroken stretch where ``mask`` (frames,) is true."""
        return g.longest(mask) / self.fps

    # ---- where it goes ---------------------------------------------------------------------------------------------

    @cached_property
    def own(self) -> Array:
        """(frames, 22, 3): joints as (left, up, forward) of the person in each frame, from below the pelvis."""
        return ph.in_body(self.p)

    @cached_property
    def heading(self) -> Array:
        """(frames,) degrees turned since the start, to the left positive, averaged over a quarter of a second."""
        angle = np.degrees(ph.smooth(ph.heading(self.p), ph.odd(self.fps / 4)))
        return angle - angle[0]

    @cached_property
    def pace(self) -> Array:
        """(frames,) m/s of the pelvis over the ground, averaged over a quarter of a second."""
        return ph.speed(self.p, self.fps)

    @cached_property
    def way(self) -> Array:
        """(frames, 3) m/s of the pelvis as (left, up, forward) of the person, averaged over a quarter of a second."""
        return ph.smooth(ph.root_velocity_in_heading(self.p, self.fps), ph.odd(self.fps / 4))

    @property
    def travel(self) -> float:
        """Metres walked along the path."""
        return float(self.pace.mean() * self.seconds)

    @property
    def advance(self) -> float:
        """Metres gone in the direction of the chest; backwards is negative."""
        return float(self.way[:, 2].mean() * self.seconds)

    @property
    def leftward(self) -> float:
        """Metres gone to the left of the chest; to the right is negative."""
        return float(self.way[:, 0].mean() * self.seconds)

    @property
    def ahead(self) -> float:
        """Share of the way that goes where the chest points: 1 forwards, -1 backwards."""
        return self.advance / max(self.travel, 0.3)

    @property
    def top(self) -> float:
        """m/s that a tenth of the time exceeds."""
        return float(np.percentile(self.pace, 90))

    @cached_property
    def moving_pace(self) -> float:
        """m/s: median pace while it is above 0.2 m/s; 0 for somebody who stays."""
        moving = self.pace > 0.2
        return float(np.median(self.pace[moving])) if moving.any() else 0.0

    @property
    def wander(self) -> float:
        """Metres: the farthest the pelvis gets from where it began, over the ground."""
        return float(np.linalg.norm((self.p[:, 0] - self.p[0, 0])[:, [0, 2]], axis=-1).max())

    @cached_property
    def feet(self) -> Array:
        """(frames, 3) metres: the middle of the ankles."""
        return self.p[:, ANKLES].mean(axis=1)

    @property
    def feet_travel(self) -> float:
        """Metres: the farthest the middle of the ankles gets from where it began, over the ground."""
        return float(np.linalg.norm((self.feet - self.feet[0])[:, [0, 2]], axis=-1).max())

    # ---- posture ---------------------------------------------------------------------------------------------------

    @cached_property
    def leg(self) -> float:
        """Metres of thigh and shin."""
        return g.leg_length(self.p)

    @cached_property
    def height(self) -> Array:
        """(frames,) leg lengths of the pelvis over the floor: about 1.15 standing, 0.7 on a chair, 0.15 lying."""
        return self.p[:, 0, 1] / self.leg

    @property
    def start(self) -> float:
        """Leg lengths of the pelvis over the floor at the start."""
        return self.at_start(self.height)

    @property
    def end(self) -> float:
        """Leg lengths of the pelvis over the floor at the end."""
        return self.at_end(self.height)

    @cached_property
    def lean(self) -> Array:
        """(frames,) degrees between pelvis-to-neck and the vertical: 0 upright, 90 level, 180 upside down."""
        return np.degrees(g.torso_inclination(self.p))

    @cached_property
    def bend(self) -> Array:
        """(frames,) degrees that pelvis-to-neck leans to the front; to the back is negative."""
        return np.degrees(g.forward_bend(self.p))

    @cached_property
    def knees(self) -> Array:
        """(frames, 2) degrees that the knees are bent."""
        return np.degrees(g.knee_bend(self.p))

    @cached_property
    def across(self) -> Array:
        """(frames, 3) metres: from the right hip and shoulder to the left ones."""
        return self.p[:, HIPS[0]] - self.p[:, HIPS[1]] + self.p[:, SHOULDERS[0]] - self.p[:, SHOULDERS[1]]

    @property
    def axis_across(self) -> Array:
        """(frames, 3): the direction of `across`, about which the trunk turns forwards."""
        return self.across / np.maximum(np.linalg.norm(self.across, axis=-1, keepdims=True), 1e-9)

    @cached_property
    def front(self) -> Array:
        """(frames, 3): the direction the chest faces; y is 1 on the back, -1 face down, 0 upright."""
        front = np.cross(self.across, self.p[:, J["neck"]] - self.p[:, 0])
        return front / np.maximum(np.linalg.norm(front, axis=-1, keepdims=True), 1e-9)

    @cached_property
    def stir(self) -> Array:
        """(frames,) m/s: mean speed of all joints."""
        return np.linalg.norm(ph.velocity(self.p, self.fps), axis=-1).mean(axis=1)

    @cached_property
    def lowest(self) -> Array:
        """(frames,) metres: height of the lowest joint over the floor."""
        return self.p[..., 1].min(axis=1)

    @cached_property
    def ankles(self) -> Array:
        """(frames, 2) metres: heights of the ankles over the floor."""
        return self.p[:, ANKLES, 1]

    @cached_property
    def flights(self) -> list[g.Flight]:
        """Times of less than a second when both feet are 5 cm or more off the floor."""
        return [f for f in g.airborne(self.p) if f.stop - f.start < self.fps]

    # ---- hands -----------------------------------------------------------------------------------------------------

    @cached_property
    def hands(self) -> Array:
        """(frames, 2, 3) metres: wrists as (left, up, forward) of the person, from below the pelvis."""
        return self.own[:, WRISTS]

    @cached_property
    def reach_up(self) -> Array:
        """(frames, 2) metres of the wrists above their shoulders."""
        return self.p[:, WRISTS, 1] - self.p[:, SHOULDERS, 1]

    @cached_property
    def hand_speed(self) -> Array:
        """(frames, 2) m/s of the wrists against the turning and travelling body, over three frames."""
        return ph.smooth(g.limb_speed(self.p, self.fps, WRISTS), 3)

    def spin(self, axis: np.ndarray) -> Array:
        """(frames,) degrees that pelvis-to-neck has turned about ``axis`` (frames, 3) since the start."""
        spine = self.p[:, J["neck"]] - self.p[:, 0]
        spine = spine - (spine * axis).sum(-1, keepdims=True) * axis
        spine = spine / np.maximum(np.linalg.norm(spine, axis=-1, keepdims=True), 1e-9)
        sine = (np.cross(spine[:-1], spine[1:]) * axis[:-1]).sum(-1)
        step = np.degrees(np.arctan2(sine, (spine[:-1] * spine[1:]).sum(-1)))
        return np.concatenate([[0.0], np.cumsum(step)])


def times(signal: np.ndarray, low: float, high: float) -> int:
    """How often a signal goes from ``low`` or less up to ``high`` or more; wiggles between the two do not count."""
    count, ready = 0, False
    for value in np.asarray(signal, dtype=np.float64):
        if value <= low:
            ready = True
        elif value >= high and ready:
            count, ready = count + 1, False
    return count
