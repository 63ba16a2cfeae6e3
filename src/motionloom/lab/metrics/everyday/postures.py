"""Postures and their changes, all from before the change to after it; what happens on the ground; stairs and
ladders."""

import numpy as np

from motionloom.kinematics import gestures as g
from motionloom.kinematics import physics as ph
from motionloom.lab.metrics.everyday.body import ANKLES, KNEES, WRISTS, Body, times
from motionloom.lab.metrics.everyday.check import Everyday, at_least, at_most, between
from motionloom.lab.metrics.obedience import Measures


def seat(body: Body, *, at_end: bool = True) -> Measures:
    """How somebody sits in the last half second (or the first one). ``seat``: leg lengths of the pelvis over the lower
    ankle. ``trunk``: degrees the trunk leans. ``feet``: metres of the higher ankle over the floor. ``feet_ahead``: leg
    lengths of the ankles in front of the pelvis."""
    pick = body.end if at_end else body.start
    ahead = body.own[:, ANKLES, 2].mean(axis=1) / body.leg
    return {
        "seat": pick(g.pelvis_height(body.p)),
        "trunk": pick(body.lean),
        "feet": pick(body.ankles.max(axis=1)),
        "feet_ahead": pick(ahead),
    }


def sits_down(body: Body) -> Measures:
    """As `seat` at the end. ``start``: leg lengths of the pelvis over the floor at the start."""
    return {"start": body.start(body.height), **seat(body)}


def stands_up(body: Body) -> Measures:
    """As `seat` at the start. ``rest``: m/s of the pelvis then. ``end``: leg lengths of the pelvis over the floor
    at the end. ``upright``: degrees the trunk leans then. ``knees``: degrees of the knee that is bent more then."""
    return {
        "rest": body.start(body.pace),
        "end": body.end(body.height),
        "upright": body.end(body.lean),
        "knees": body.end(body.knees.max(axis=1)),
        **seat(body, at_end=False),
    }


def sits_and_stands(body: Body) -> Measures:
    """``start``, ``end``: leg lengths of the pelvis over the floor. ``seat``: at its lowest. ``feet_ahead``: leg
    lengths of the ankles in front of the pelvis then. ``sat``: seconds below 0.9 leg lengths without going anywhere
    (0.4 m/s)."""
    ahead = body.own[:, ANKLES, 2].mean(axis=1) / body.leg
    low = body.height <= np.percentile(body.height, 10)
    return {
        "start": body.start(body.height),
        "seat": float(np.percentile(body.height, 5)),
        "feet_ahead": float(np.median(ahead[low])),
        "sat": body.held((body.height < 0.9) & (body.pace < 0.4)),
        "end": body.end(body.height),
    }


def lying(body: Body, *, at_end: bool = True) -> Measures:
    """How somebody lies in the last half second (or the first one). ``pelvis``, ``chest``, ``head``: metres over the
    floor. ``trunk``: degrees between the trunk and the vertical."""
    pick = body.end if at_end else body.start
    return {
        "pelvis": pick(body.p[:, 0, 1]),
        "chest": pick(body.p[:, 9, 1]),
        "head": pick(body.p[:, 15, 1]),
        "trunk": pick(body.lean),
    }


def lies_down(body: Body) -> Measures:
    """As `lying` at the end. ``start``: leg lengths of the pelvis over the floor at the start. ``plunge``: m/s of the
    pelvis downwards at the most, averaged over a quarter of a second."""
    down = -ph.smooth(ph.velocity(body.p[:, 0, 1], body.fps), ph.odd(body.fps / 4))
    return {"start": body.start(body.height), "plunge": float(down.max()), **lying(body)}


def gets_up(body: Body) -> Measures:
    """As `lying` at the start. ``end``: leg lengths of the pelvis over the floor at the end. ``upright``: degrees the
    trunk leans then."""
    return {"end": body.end(body.height), "upright": body.end(body.lean), **lying(body, at_end=False)}


def lies_on_the_back(body: Body) -> Measures:
    """As `lying`, and ``face_up``: how far the chest faces up, median: 1 on the back, -1 face down. ``rest``: m/s
    of the joints, mean."""
    return {**lying(body), "face_up": float(np.median(body.front[:, 1])), "rest": float(body.stir.mean())}


def sits_on_the_floor(body: Body) -> Measures:
    """``pelvis``: metres over the floor, median. ``trunk``: degrees the trunk leans, median. ``held``: seconds below
    0.35 m with the trunk within 45 degrees of upright."""
    low = (body.p[:, 0, 1] < 0.35) & (body.lean < 45)
    return {"pelvis": float(np.median(body.p[:, 0, 1])), "held": body.held(low)}


def kneels_down(body: Body) -> Measures:
    """``start``: leg lengths of the pelvis over the floor at the start. ``knee``: metres of the lower knee over the
    floor at the lowest, held for half a second. ``pelvis``: metres over the floor then. ``trunk``: degrees the
    trunk leans then."""
    height = body.p[:, KNEES, 1].min(axis=1)
    at = height <= np.percentile(height, 12)
    return {
        "start": body.start(body.height),
        "knee": float(np.percentile(height, 12)),
        "pelvis": float(np.median(body.p[at, 0, 1])),
        "trunk": float(np.median(body.lean[at])),
    }


def goes_low(body: Body) -> Measures:
    """``start``, ``end``: leg lengths of the pelvis over the floor. ``low``: at its lowest (5th percentile). ``feet``:
    metres of the higher ankle then. ``feet_ahead``: leg lengths of the ankles in front of the pelvis then. ``knees``:
    degrees of the straighter knee then. ``trunk``: degrees the trunk leans then."""
    low = body.height <= np.percentile(body.height, 10)
    ahead = body.own[:, ANKLES, 2].mean(axis=1) / body.leg
    return {
        "start": body.start(body.height),
        "low": float(np.percentile(body.height, 5)),
        "end": body.end(body.height),
        "feet": float(np.median(body.ankles.max(axis=1)[low])),
        "feet_ahead": float(np.median(ahead[low])),
        "knees": float(np.median(body.knees.min(axis=1)[low])),
        "trunk": float(np.median(body.lean[low])),
        "travel": body.travel,
    }


def bows(body: Body) -> Measures:
    """``stroke``: m/s of the wrists against the body, 98th percentile. ``bend``: degrees the trunk leans forward at
    the most (95th percentile). ``start``, ``end``: degrees at both ends. ``pelvis``: leg lengths over the floor at
    its lowest. ``hands``: metres of the lower wrist over the floor at its lowest. ``knees``: degrees of the
    straighter knee at the deepest. ``wander``: metres from where it began."""
    deep = body.bend >= np.percentile(body.bend, 90)
    return {
        "bend": float(np.percentile(body.bend, 95)),
        "start": abs(body.start(body.bend)),
        "end": abs(body.end(body.bend)),
        "pelvis": float(np.percentile(body.height, 5)),
        "hands": float(body.p[:, WRISTS, 1].min(axis=1).min()),
        "knees": float(np.median(body.knees.min(axis=1)[deep])),
        "wander": body.wander,
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
    """``rolled``: degrees the trunk turns over forwards. ``low``: metres of the head over the floor at its lowest.
    ``flown``: metres the lowest joint is over the floor at the most."""
    return {
        "rolled": float(body.spin(body.axis_across).max()),
        "head": float(body.p[:, 15, 1].min()),
        "pelvis": float(body.p[:, 0, 1].min()),
    }


def climbs(body: Body) -> Measures:
    """``rise``: metres both feet gained and kept for three quarters of a second. ``way``: metres the pelvis went
    over the ground, along the path. The next two while the pelvis rises, from a fifth of its rise to nine tenths.
    ``steepness``: its rise over the way it went across the ground. ``hands``: share of the time with a wrist 32 cm
    or more in front of the body and no lower than 35 cm below the shoulder. ``fastest``: most metres the pelvis gains
    within a second (recorded climbs: 0.6, hand-keyed ones 1.5)."""
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
    """``fall``: metres both feet lost, each height kept for three quarters of a second. ``way``: metres the pelvis
    went along the path. ``trunk``: degrees the trunk leans, 90th percentile. ``end``: leg lengths of the pelvis
    over the lower ankle at the end."""
    return {
        "fall": g.stance_rise(body.p[::-1], body.fps),
        "way": body.travel,
        "ahead": body.ahead,
        "trunk": float(np.percentile(body.lean, 90)),
        "end": body.end(g.pelvis_height(body.p)),
    }


def repeats(body: Body) -> Measures:
    """``squats``: times the pelvis goes from below 0.8 leg lengths over the floor up to above 0.95. ``start``: leg
    lengths over the floor at the start. ``knees``: degrees of the straighter knee at the lowest. ``wander``: metres
    from where it began."""
    low = body.height <= np.percentile(body.height, 10)
    return {
        "squats": times(body.height, 0.8, 0.95),
        "start": body.start(body.height),
        "knees": float(np.median(body.knees.min(axis=1)[low])),
        "wander": body.wander,
    }


_STANDS = at_least("start", 0.98, "it begins standing")
_SEAT = (
    between("seat", 0.35, 0.85, "the hips are at the height of a seat"),
    at_most("trunk", 50, "the trunk is upright"),
    at_most("feet", 0.22, "both feet are on the floor"),
    at_least("feet_ahead", 0.12, "the feet are in front of the seat, not under the body"),
)
_LIES = (
    at_most("pelvis", 0.33, "the hips are on the floor"),
    at_most("chest", 0.35, "the chest is on the floor"),
    at_most("head", 0.4, "the head is on the floor"),
    at_least("trunk", 65, "the trunk is level"),
)

CHECKS = (
    Everyday("sit down from standing", "a person sits down on a chair", 5.0, sits_down, (_STANDS, *_SEAT)),
    Everyday(
        "stand up",
        "someone gets up from a chair",
        4.0,
        stands_up,
        (
            *_SEAT,
            at_most("rest", 0.3, "they sit first"),
            at_least("end", 0.98, "it ends standing"),
            at_most("upright", 35, "upright"),
            at_most("knees", 45, "on straight legs"),
        ),
    ),
    Everyday(
        "sit and stand up",
        "a man takes a seat and stands up again",
        7.0,
        sits_and_stands,
        (
            _STANDS,
            between("seat", 0.4, 0.9, "in between the hips are at the height of a seat"),
            at_least("feet_ahead", 0.12, "the feet are in front of the seat, not under the body"),
            at_least("sat", 0.5, "for a moment nobody moves"),
            at_least("end", 0.98, "it ends standing"),
        ),
    ),
    Everyday(
        "sit",
        "a woman is sitting on a chair",
        4.0,
        lambda b: {**seat(b), "start": b.start(b.height)},
        (*_SEAT, at_most("start", 0.95, "she sits from the start")),
    ),
    Everyday(
        "sit on the floor",
        "a child sits on the floor",
        4.0,
        sits_on_the_floor,
        (at_most("pelvis", 0.35, "the hips are on the floor"), at_least("held", 1.0, "and the trunk is upright")),
    ),
    Everyday("lie down", "somebody lies down on the floor", 7.0, lies_down, (_STANDS, *_LIES)),
    Everyday(
        "fall",
        "a man stumbles and falls to the ground",
        4.0,
        lies_down,
        (
            at_least("start", 0.8, "it begins on the feet"),
            at_most("pelvis", 0.35, "the hips end on the floor"),
            at_most("chest", 0.5, "the chest ends near the floor"),
            at_least("plunge", 0.9, "faster than somebody lies down"),
        ),
    ),
    Everyday(
        "get up",
        "a person who is lying on the ground gets back on their feet",
        6.0,
        gets_up,
        (
            at_most("pelvis", 0.35, "the hips begin on the floor"),
            at_most("chest", 0.5, "the chest begins near the floor"),
            at_least("trunk", 55, "the trunk begins level"),
            at_least("end", 0.86, "it ends on the feet"),
            at_most("upright", 45, "upright"),
        ),
    ),
    Everyday(
        "lie on the back",
        "someone is lying flat on their back",
        4.0,
        lies_on_the_back,
        (*_LIES, at_least("face_up", 0.6, "the chest faces up"), at_most("rest", 0.4, "nobody wriggles")),
    ),
    Everyday(
        "kneel down",
        "he kneels down",
        5.0,
        kneels_down,
        (
            at_least("start", 0.8, "it begins on the feet"),
            at_most("knee", 0.2, "a knee is on the floor"),
            at_least("pelvis", 0.25, "the hips are above it"),
            at_most("trunk", 60, "the trunk stays up"),
        ),
    ),
    Everyday(
        "crouch down",
        "a person crouches down low and stays there",
        4.0,
        goes_low,
        (
            at_least("start", 0.8, "it begins on the feet"),
            at_most("end", 0.75, "it stays down"),
            at_least("knees", 60, "the knees are bent"),
            at_most("feet_ahead", 0.3, "the feet are under the body, not in front of a seat"),
            at_least("low", 0.15, "it is no lying or sitting on the floor"),
        ),
    ),
    Everyday(
        "bow",
        "a gentleman bows politely",
        4.0,
        bows,
        (
            between("bend", 25, 115, "the trunk leans forward"),
            at_most("start", 25, "it begins upright"),
            at_most("end", 25, "it ends upright"),
            at_least("pelvis", 0.9, "the legs stay straight"),
            at_most("knees", 33, "and so do the knees"),
            at_least("hands", 0.3, "nothing is picked up"),
            at_most("stroke", 2.5, "nothing is thrown or struck"),
            at_most("wander", 1.2, "on the spot or with a few steps"),
        ),
    ),
    Everyday(
        "touch the toes",
        "someone bends over and touches their toes",
        5.0,
        bows,
        (
            at_least("bend", 60, "the trunk hangs"),
            at_most("hands", 0.35, "a hand is at the feet"),
            at_most("knees", 60, "the knees stay nearly straight"),
            at_least("pelvis", 0.8, "it is no crouching"),
        ),
    ),
    Everyday(
        "crawl",
        "a baby crawls forward on hands and knees",
        6.0,
        crawls,
        (
            at_least("all_fours", 0.6, "on hands and knees for most of the time"),
            at_least("way", 0.5, "forward, half a metre or more"),
        ),
    ),
    Everyday(
        "crawl backwards",
        "crawling backwards on all fours",
        6.0,
        crawls,
        (
            at_least("all_fours", 0.6, "on hands and knees for most of the time"),
            at_most("way", -0.4, "backwards, almost half a metre or more"),
        ),
    ),
    Everyday(
        "forward roll",
        "a person does a forward roll on the ground",
        3.0,
        rolls,
        (
            at_least("rolled", 240, "the body goes over forwards"),
            at_most("head", 0.45, "the head comes down to the floor"),
            at_most("pelvis", 0.45, "the hips come down to the floor"),
        ),
    ),
    Everyday(
        "up the stairs",
        "a man walks up a flight of stairs",
        5.0,
        climbs,
        (
            at_least("rise", 0.35, "both feet end up higher"),
            at_least("way", 0.8, "stairs lead somewhere"),
            at_most("steepness", 1.5, "less steep than a ladder"),
            at_most("fastest", 1.2, "step by step"),
        ),
        grounded=False,
    ),
    Everyday(
        "down the stairs",
        "someone walks down the stairs",
        5.0,
        descends,
        (
            at_least("fall", 0.35, "both feet end up lower"),
            at_least("way", 0.8, "stairs lead somewhere"),
            at_least("ahead", 0.3, "face forward"),
            at_most("trunk", 50, "upright"),
            at_least("end", 0.85, "on the feet"),
        ),
        grounded=False,
    ),
    Everyday(
        "climb a ladder",
        "a worker climbs a ladder",
        6.0,
        climbs,
        (
            at_least("rise", 0.4, "both feet end up higher"),
            at_least("steepness", 1.2, "a ladder is steep"),
            at_least("hands", 0.4, "the hands hold on in front"),
            at_most("fastest", 1.6, "rung by rung"),
        ),
        grounded=False,
    ),
    Everyday(
        "three squats",
        "an athlete does three squats",
        9.0,
        repeats,
        (
            between("squats", 3, 3, "three, neither two nor four"),
            at_least("start", 0.95, "it begins standing"),
            at_least("knees", 60, "the knees are bent"),
            at_most("wander", 0.7, "on the spot"),
        ),
    ),
    Everyday(
        "one squat",
        "a person squats down once and comes back up",
        5.0,
        lambda b: {**goes_low(b), **repeats(b)},
        (
            between("squats", 1, 1, "once"),
            _STANDS,
            at_least("end", 0.98, "it ends standing"),
            at_least("knees", 60, "the knees are bent"),
            at_most("wander", 0.8, "on the spot"),
        ),
    ),
)
