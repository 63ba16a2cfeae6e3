"""Exercise and fighting: counted, sided, fast."""

import numpy as np

from motionloom.kinematics import gestures as g
from motionloom.kinematics import physics as ph
from motionloom_lab.metrics.actions import Measures
from motionloom_lab.metrics.everyday.body import ANKLES, HIPS, KNEES, SHOULDERS, WRISTS, Body, times


def pushups(body: Body) -> Measures:
    """``times``: how often the chest comes up from within 4 cm of its lowest by 12 cm or more. ``plank``: share of the
    time face down with the trunk 50 degrees or more from upright. ``wrists``: metres of the higher wrist over the
    floor, 90th percentile. ``hips``: metres of the pelvis over the floor at the most."""
    chest = body.p[:, 12, 1]
    low = float(np.percentile(chest, 3))
    return {
        "times": times(chest, low + 0.05, low + 0.12),
        "plank": float(((body.front[:, 1] < -0.5) & (body.lean > 50)).mean()),
        "wrists": float(np.percentile(body.p[:, WRISTS, 1].max(axis=1), 90)),
        "hips": float(np.percentile(body.p[:, 0, 1], 95)),
    }


def jumping_jacks(body: Body) -> Measures:
    """``arms``: times both wrists go from below the shoulders to above the head. ``legs``: times the feet go from
    within 12 cm of their closest to 20 cm more, sideways. ``together``: correlation of hands' height and feet's
    distance."""
    up = body.p[:, WRISTS, 1].min(axis=1) - body.p[:, 15, 1]
    feet = np.abs(body.own[:, ANKLES[0], 0] - body.own[:, ANKLES[1], 0])
    closest = float(np.percentile(feet, 5))
    spread = np.std(up) * np.std(feet)
    together = float(np.mean((up - up.mean()) * (feet - feet.mean())) / spread) if spread > 1e-6 else 0.0
    return {
        "arms": times(up, -0.35, 0.0),
        "legs": times(feet, closest + 0.1, closest + 0.22),
        "together": together,
    }


def lunges(body: Body) -> Measures:
    """``lunges``: times the lower knee comes down from 38 cm to 30 cm over the floor. ``split``: leg lengths between
    the ankles along the way the chest faces when the knee is lowest. ``trunk``: degrees the trunk leans, 90th
    percentile."""
    knee = body.p[:, KNEES, 1].min(axis=1)
    gap = np.abs(body.own[:, ANKLES[0], 2] - body.own[:, ANKLES[1], 2]) / body.leg
    low = knee <= np.percentile(knee, 10)
    return {
        "lunges": times(-knee, -0.38, -0.3),
        "split": float(np.median(gap[low])),
        "trunk": float(np.percentile(body.lean, 90)),
    }


def side_lunge(body: Body, side: int) -> Measures:
    """The feet count as wide when the ankles are 0.6 leg lengths or more apart across the chest. ``held``: seconds the
    wanted knee is bent by 50 degrees or more and the other by 30 degrees less, the feet wide. ``other``: seconds of
    the same with the sides exchanged. ``feet``: metres the middle of the ankles goes over the ground. ``trunk``:
    degrees the trunk leans, median."""
    wide = np.abs(body.own[:, ANKLES[0], 0] - body.own[:, ANKLES[1], 0]) > 0.6 * body.leg
    lunges = [wide & (body.knees[:, s] > 50) & (body.knees[:, 1 - s] < body.knees[:, s] - 30) for s in (side, 1 - side)]
    return {
        "held": body.held(lunges[0]),
        "other": body.held(lunges[1]),
        "feet": body.feet_travel,
        "trunk": float(np.median(body.lean)),
    }


def leg_raise(body: Body, side: int) -> Measures:
    """``height``: leg lengths the wanted ankle is above the other at the most, in front of the body with the knee bent
    by less than 50 degrees. ``other``: the same of the other one. ``speed``: m/s of that ankle against the body,
    95th percentile: a leg that is raised is no kick."""
    heights = []
    for foot in (side, 1 - side):
        height = (body.ankles[:, foot] - body.ankles[:, 1 - foot]) / body.leg
        good = (body.knees[:, foot] < 50) & (body.own[:, ANKLES[foot], 2] > 0.15)
        heights.append(float(np.where(good, height, 0.0).max()))
    speed = ph.smooth(g.limb_speed(body.p, body.fps, (ANKLES[side],)), 3)
    return {"height": heights[0], "other": heights[1], "speed": float(np.percentile(speed, 95))}


def knee_raise(body: Body, side: int) -> Measures:
    """``knee``: metres of the wanted knee against its hip at the highest; 0 is level. ``other``: the same of the other
    knee. ``bent``: degrees of the wanted knee then. ``standing``: leg lengths of the pelvis over the floor then."""
    knee = body.p[:, KNEES, 1] - body.p[:, HIPS, 1]
    frame = int(np.argmax(knee[:, side]))
    return {
        "knee": float(knee[frame, side]),
        "other": float(knee[:, 1 - side].max()),
        "bent": float(body.knees[frame, side]),
        "standing": float(body.height[frame]),
    }


def kicks(body: Body, side: int) -> Measures:
    """``height``: leg lengths the wanted ankle is above the other at the most while it is 0.35 leg lengths or more away
    from below the pelvis. ``speed``: m/s of that ankle against the body in the half second before, at the most.
    ``other``: the height of the other ankle in the same way."""
    ankles = body.own[:, ANKLES]
    away = np.linalg.norm(ankles[..., [0, 2]], axis=-1) > 0.35 * body.leg
    height = np.where(away, (ankles[..., 1] - ankles[:, ::-1, 1]) / body.leg, 0.0)
    frame = int(np.argmax(height[:, side]))
    speed = ph.smooth(g.limb_speed(body.p, body.fps, ANKLES), 3)
    before = speed[max(0, frame - round(body.fps / 2)) : frame + 2, side]
    return {
        "height": float(height[frame, side]),
        "speed": float(before.max()),
        "other": float(height[:, 1 - side].max()),
        "lean": float(np.median(body.lean)),
        "pace": float(np.median(body.pace)),
    }


def punches(body: Body, side: int) -> Measures:
    """``thrust``: m/s at which the wanted wrist shoots forward from the body at chest height, at the most: a straight
    punch. ``more``: how much faster than the other wrist. ``stretched``: metres that the wrist gets farther from its
    shoulder in the 0.3 s around it. ``pace``: m/s of the pelvis, median: the arms of a runner do not count."""
    thrust = g.wrist_thrust(body.p, body.fps)
    frame, near = int(np.argmax(thrust[:, side])), round(0.3 * body.fps)
    length = np.linalg.norm(body.p[:, WRISTS[side]] - body.p[:, SHOULDERS[side]], axis=-1)
    before, after = length[max(0, frame - near) : frame + 1], length[frame : frame + near + 1]
    return {
        "thrust": float(thrust[:, side].max()),
        "more": float(thrust[:, side].max() - thrust[:, 1 - side].max()),
        "stretched": float(after.max() - before.min()),
        "pace": float(np.median(body.pace)),
    }


def guards(body: Body) -> Measures:
    """``held``: seconds both wrists stay in front of the body (5 cm or more), from 25 cm below the neck to the crown,
    and within 60 cm of each other. ``upright``: leg lengths of the pelvis over the floor, median."""
    hands = body.p[:, WRISTS, 1]
    high = (hands > body.p[:, 12:13, 1] - 0.25) & (hands < body.p[:, 15:16, 1] + 0.25)
    near = np.linalg.norm(body.p[:, WRISTS[0]] - body.p[:, WRISTS[1]], axis=-1) < 0.6
    return {
        "held": body.held((high & (body.hands[..., 2] > 0.1)).all(axis=1) & near),
        "upright": float(np.median(body.height)),
    }


def ducks(body: Body) -> Measures:
    """``drop``: metres the head is below its place at the start, at the most. ``back``: metres it is below that place
    at the end. ``seconds``: time it spends below half of the drop."""
    head = body.p[:, 15, 1]
    drop = body.at_start(head) - head
    return {
        "drop": float(drop.max()),
        "back": body.at_end(drop),
        "seconds": float((drop > drop.max() / 2).sum() / body.fps),
        "hand": float(body.p[:, WRISTS, 1].min()),
    }
