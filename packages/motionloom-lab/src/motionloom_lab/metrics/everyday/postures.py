"""Postures and their changes, all from before the change to after it; what happens on the ground; stairs and
ladders."""

import numpy as np

from motionloom.kinematics import gestures as g
from motionloom.kinematics import physics as ph
from motionloom_lab.metrics.actions import Measures
from motionloom_lab.metrics.everyday.body import ANKLES, KNEES, WRISTS, Body, times


def seat(body: Body, *, at_end: bool = True) -> Measures:
    """How somebody sits in the last half second (or the first one). ``seat``: leg lengths of the pelvis over the lower
    ankle. ``trunk``: degrees the trunk leans. ``feet``: metres of the higher ankle over the floor. ``feet_ahead``:
    leg lengths of the ankles in front of the pelvis."""
    pick = body.at_end if at_end else body.at_start
    ahead = body.own[:, ANKLES, 2].mean(axis=1) / body.leg
    return {
        "seat": pick(g.pelvis_height(body.p)),
        "trunk": pick(body.lean),
        "feet": pick(body.ankles.max(axis=1)),
        "feet_ahead": pick(ahead),
    }


def stands_up(body: Body) -> Measures:
    """As `seat` at the start. ``rest``: m/s of the pelvis then. ``upright``: degrees the trunk leans at the end.
    ``knees``: degrees of the knee that is bent more then."""
    return {
        "rest": body.at_start(body.pace),
        "upright": body.at_end(body.lean),
        "knees": body.at_end(body.knees.max(axis=1)),
        **seat(body, at_end=False),
    }


def sits_and_stands(body: Body) -> Measures:
    """``seat``: at its lowest. ``feet_ahead``: leg lengths of the ankles in front of the pelvis then. ``sat``: seconds
    below 0.9 leg lengths without going anywhere (0.4 m/s)."""
    ahead = body.own[:, ANKLES, 2].mean(axis=1) / body.leg
    low = body.height <= np.percentile(body.height, 10)
    return {
        "seat": float(np.percentile(body.height, 5)),
        "feet_ahead": float(np.median(ahead[low])),
        "sat": body.held((body.height < 0.9) & (body.pace < 0.4)),
    }


def lying(body: Body, *, at_end: bool = True) -> Measures:
    """How somebody lies in the last half second (or the first one). ``pelvis``, ``chest``, ``head``: metres over the
    floor. ``trunk``: degrees between the trunk and the vertical."""
    pick = body.at_end if at_end else body.at_start
    return {
        "pelvis": pick(body.p[:, 0, 1]),
        "chest": pick(body.p[:, 9, 1]),
        "head": pick(body.p[:, 15, 1]),
        "trunk": pick(body.lean),
    }


def lies_down(body: Body) -> Measures:
    """As `lying` at the end. ``plunge``: m/s of the pelvis downwards at the most, over a quarter of a second."""
    down = -ph.smooth(ph.velocity(body.p[:, 0, 1], body.fps), ph.odd(body.fps / 4))
    return {"plunge": float(down.max()), **lying(body)}


def gets_up(body: Body) -> Measures:
    """As `lying` at the start. ``upright``: degrees the trunk leans at the end."""
    return {"upright": body.at_end(body.lean), **lying(body, at_end=False)}


def lies_on_the_back(body: Body) -> Measures:
    """As `lying`, and ``face_up``: how far the chest faces up, median: 1 on the back, -1 face down. ``rest``: m/s of
    the joints, mean."""
    return {**lying(body), "face_up": float(np.median(body.front[:, 1])), "rest": float(body.stir.mean())}


def sits_on_the_floor(body: Body) -> Measures:
    """``pelvis``: metres over the floor, median. ``held``: seconds below 0.35 m with the trunk within 45 degrees of
    upright."""
    low = (body.p[:, 0, 1] < 0.35) & (body.lean < 45)
    return {"pelvis": float(np.median(body.p[:, 0, 1])), "held": body.held(low)}


def kneels_down(body: Body) -> Measures:
    """``knee``: metres of the lower knee over the floor at the lowest, held for half a second. ``pelvis``: metres over
    the floor then. ``trunk``: degrees the trunk leans then."""
    height = body.p[:, KNEES, 1].min(axis=1)
    at = height <= np.percentile(height, 12)
    return {
        "knee": float(np.percentile(height, 12)),
        "pelvis": float(np.median(body.p[at, 0, 1])),
        "trunk": float(np.median(body.lean[at])),
    }


def goes_low(body: Body) -> Measures:
    """``low``: at its lowest (5th percentile). ``feet_ahead``: leg lengths of the ankles in front of the pelvis then.
    ``knees``: degrees of the straighter knee then."""
    low = body.height <= np.percentile(body.height, 10)
    ahead = body.own[:, ANKLES, 2].mean(axis=1) / body.leg
    return {
        "low": float(np.percentile(body.height, 5)),
        "feet_ahead": float(np.median(ahead[low])),
        "knees": float(np.median(body.knees.min(axis=1)[low])),
    }


def bows(body: Body) -> Measures:
    """``stroke``: m/s of the wrists against the body, 98th percentile. ``bend``: degrees the trunk leans forward at the
    most (95th percentile). ``start``, ``end``: degrees at both ends. ``pelvis``: leg lengths over the floor at its
    lowest. ``hands``: metres of the lower wrist over the floor at its lowest. ``knees``: degrees of the straighter
    knee at the deepest."""
    deep = body.bend >= np.percentile(body.bend, 90)
    return {
        "bend": float(np.percentile(body.bend, 95)),
        "start": abs(body.at_start(body.bend)),
        "end": abs(body.at_end(body.bend)),
        "pelvis": float(np.percentile(body.height, 5)),
        "hands": float(body.p[:, WRISTS, 1].min(axis=1).min()),
        "knees": float(np.median(body.knees.min(axis=1)[deep])),
        "stroke": float(np.percentile(body.hand_speed, 98)),
    }


def crawls(body: Body) -> Measures:
    """``all_fours``: share of the time with both knees below 25 cm, both wrists below 30 cm, the trunk within 45
    degrees of level and face down. ``way``: metres gone in the direction of the head; backwards is negative."""
    knees = (body.p[:, KNEES, 1] < 0.25).all(axis=1)
    wrists = (body.p[:, WRISTS, 1] < 0.3).all(axis=1)
    down = (body.front[:, 1] < -0.5) & (body.lean > 45)
    spine = ((body.p[:, 12] - body.p[:, 0]) * [1.0, 0.0, 1.0])[:-1]
    step = np.diff(body.p[:, 0], axis=0) * [1.0, 0.0, 1.0]
    way = (step * spine).sum(-1) / np.maximum(np.linalg.norm(spine, axis=-1), 1e-9)
    return {"all_fours": float((knees & wrists & down).mean()), "way": float(way.sum())}


def rolls(body: Body) -> Measures:
    """``rolled``: degrees the trunk turns over forwards. ``head``, ``pelvis``: metres over the floor at the lowest."""
    return {
        "rolled": float(body.spin(body.axis_across).max()),
        "head": float(body.p[:, 15, 1].min()),
        "pelvis": float(body.p[:, 0, 1].min()),
    }


def climbs(body: Body) -> Measures:
    """``rise``: metres both feet gained and kept for three quarters of a second. ``way``: metres the pelvis went over
    the ground, along the path. The next two while the pelvis rises, from a fifth of its rise to nine tenths.
    ``steepness``: its rise over the way it went across the ground. ``hands``: share of the time with a wrist 32 cm
    or more in front of the body and no lower than 35 cm below the shoulder. ``fastest``: most metres the pelvis
    gains within a second (recorded climbs: 0.6, hand-keyed ones 1.5)."""
    pelvis = ph.smooth(body.p[:, 0], ph.odd(body.fps / 2))
    top = int(np.argmax(pelvis[:, 1]))
    low = float(pelvis[: top + 1, 1].min())
    share = (pelvis[: top + 1, 1] - low) / max(float(pelvis[top, 1]) - low, 1e-6)
    first = int(np.flatnonzero(share <= 0.2)[-1])
    last = first + int(np.argmax(share[first:] >= 0.9))
    across = float(np.hypot(*(pelvis[last] - pelvis[first])[[0, 2]]))
    second = min(round(body.fps), len(pelvis) - 1)
    holds = (body.reach_up > -0.35) & (body.hands[..., 2] > 0.32)
    return {
        "rise": g.stance_rise(body.p, body.fps),
        "way": body.travel,
        "steepness": float(pelvis[last, 1] - pelvis[first, 1]) / max(across, 0.1),
        "hands": float(np.any(holds[first : last + 1], axis=1).mean()),
        "fastest": float((pelvis[second:, 1] - pelvis[: len(pelvis) - second, 1]).max()),
    }


def descends(body: Body) -> Measures:
    """``fall``: metres both feet lost, each height kept for three quarters of a second. ``way``: metres the pelvis went
    along the path. ``trunk``: degrees the trunk leans, 90th percentile. ``end``: leg lengths of the pelvis over the
    lower ankle at the end."""
    return {
        "fall": g.stance_rise(body.p[::-1], body.fps),
        "way": body.travel,
        "trunk": float(np.percentile(body.lean, 90)),
        "end": body.at_end(g.pelvis_height(body.p)),
    }


def repeats(body: Body) -> Measures:
    """``squats``: times the pelvis goes from below 0.8 leg lengths over the floor up to above 0.95. ``knees``: degrees
    of the straighter knee at the lowest."""
    low = body.height <= np.percentile(body.height, 10)
    return {"squats": times(body.height, 0.8, 0.95), "knees": float(np.median(body.knees.min(axis=1)[low]))}
