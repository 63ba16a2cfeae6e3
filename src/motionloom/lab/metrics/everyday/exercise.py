"""Exercise and fighting: counted, sided, fast."""

import numpy as np

from motionloom.kinematics import gestures as g
from motionloom.kinematics import physics as ph
from motionloom.lab.metrics.everyday.body import ANKLES, HIPS, KNEES, SHOULDERS, WRISTS, Body, times
from motionloom.lab.metrics.everyday.check import Everyday, at_least, at_most
from motionloom.lab.metrics.obedience import Measures


def pushups(body: Body) -> Measures:
    """``wander``: metres from where it began. ``times``: how often the chest comes up from within 4 cm of its
    lowest by 12 cm or more. ``plank``: share of the time face down with the trunk 50 degrees or more from upright.
    ``wrists``: metres of the higher wrist over the floor, 90th percentile. ``hips``: metres of the pelvis over the
    floor at the most."""
    chest = body.p[:, 12, 1]
    low = float(np.percentile(chest, 3))
    return {
        "times": times(chest, low + 0.05, low + 0.12),
        "plank": float(((body.front[:, 1] < -0.5) & (body.lean > 50)).mean()),
        "wrists": float(np.percentile(body.p[:, WRISTS, 1].max(axis=1), 90)),
        "hips": float(np.percentile(body.p[:, 0, 1], 95)),
        "wander": body.wander,
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
    """``lunges``: times the lower knee comes down from 38 cm to 30 cm over the floor. ``split``: leg lengths
    between the ankles along the way the chest faces when the knee is lowest. ``trunk``: degrees the trunk leans,
    90th percentile."""
    knee = body.p[:, KNEES, 1].min(axis=1)
    gap = np.abs(body.own[:, ANKLES[0], 2] - body.own[:, ANKLES[1], 2]) / body.leg
    low = knee <= np.percentile(knee, 10)
    return {
        "lunges": times(-knee, -0.38, -0.3),
        "split": float(np.median(gap[low])),
        "trunk": float(np.percentile(body.lean, 90)),
        "wander": body.wander,
    }


def side_lunge(body: Body, side: int) -> Measures:
    """The feet count as wide when the ankles are 0.6 leg lengths or more apart across the chest. ``held``: seconds
    the wanted knee is bent by 50 degrees or more and the other by 30 degrees less, the feet wide. ``other``:
    seconds of the same with the sides exchanged. ``feet``: metres the middle of the ankles goes over the ground.
    ``trunk``: degrees the trunk leans, median."""
    wide = np.abs(body.own[:, ANKLES[0], 0] - body.own[:, ANKLES[1], 0]) > 0.6 * body.leg
    lunges = [wide & (body.knees[:, s] > 50) & (body.knees[:, 1 - s] < body.knees[:, s] - 30) for s in (side, 1 - side)]
    return {
        "held": body.held(lunges[0]),
        "other": body.held(lunges[1]),
        "feet": body.feet_travel,
        "trunk": float(np.median(body.lean)),
    }


def leg_raise(body: Body, side: int) -> Measures:
    """``height``: leg lengths the wanted ankle is above the other at the most, in front of the body with the knee
    bent by less than 50 degrees. ``other``: the same of the other one. ``speed``: m/s of that ankle against the
    body, 95th percentile: a leg that is raised is no kick."""
    found = []
    for foot in (side, 1 - side):
        height = (body.ankles[:, foot] - body.ankles[:, 1 - foot]) / body.leg
        good = (body.knees[:, foot] < 50) & (body.own[:, ANKLES[foot], 2] > 0.15)
        found.append(float(np.where(good, height, 0.0).max()))
    speed = ph.smooth(g.limb_speed(body.p, body.fps, (ANKLES[side],)), 3)
    return {"height": found[0], "other": found[1], "speed": float(np.percentile(speed, 95)), "wander": body.wander}


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
        "wander": body.wander,
    }


def kicks(body: Body, side: int) -> Measures:
    """``height``: leg lengths the wanted ankle is above the other at the most while it is 0.35 leg lengths or more
    away from below the pelvis. ``speed``: m/s of that ankle against the body in the half second before, at the
    most. ``other``: the height of the other ankle in the same way. ``hands``: metres of the lower wrist over the
    floor at its lowest."""
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
    """``held``: seconds both wrists stay in front of the body (5 cm or more), from 25 cm below the neck to the
    crown, and within 60 cm of each other. ``upright``: leg lengths of the pelvis over the floor, median."""
    hands = body.p[:, WRISTS, 1]
    high = (hands > body.p[:, 12:13, 1] - 0.25) & (hands < body.p[:, 15:16, 1] + 0.25)
    near = np.linalg.norm(body.p[:, WRISTS[0]] - body.p[:, WRISTS[1]], axis=-1) < 0.6
    return {
        "held": body.held((high & (body.hands[..., 2] > 0.1)).all(axis=1) & near),
        "upright": float(np.median(body.height)),
        "wander": body.wander,
    }


def ducks(body: Body) -> Measures:
    """``drop``: metres the head is below its place at the start, at the most. ``back``: metres it is below that
    place at the end. ``seconds``: time it spends below half of the drop. ``feet``: m both feet stay (wander).
    ``start``: leg lengths of the pelvis at the start."""
    head = body.p[:, 15, 1]
    drop = body.start(head) - head
    return {
        "drop": float(drop.max()),
        "back": body.end(drop),
        "seconds": float((drop > drop.max() / 2).sum() / body.fps),
        "start": body.start(body.height),
        "hand": float(body.p[:, WRISTS, 1].min()),
    }


def _kick(side: int):
    word = ("left", "right")[side]
    return (
        at_least("height", 0.25, f"the {word} foot leaves the floor by more than a step does"),
        at_least("speed", 2.8, "a kick is faster than a step"),
        at_most("other", 0.2, "the other foot stays low"),
        at_most("pace", 1.8, "it is no run"),
    )


def _punch(side: int):
    word = ("left", "right")[side]
    return (
        at_least("thrust", 1.4, f"the {word} fist shoots forward"),
        at_least("more", 0.25, "the other one does less"),
        at_least("stretched", 0.12, "the arm stretches"),
        at_most("pace", 1.5, "it is no run"),
    )


CHECKS = (
    Everyday(
        "push-ups",
        "a soldier does push-ups",
        6.0,
        pushups,
        (
            at_least("times", 2, "again and again"),
            at_least("plank", 0.8, "the body is stretched out face down"),
            at_most("wrists", 0.25, "the hands are on the floor"),
            at_most("hips", 0.6, "so is the rest, nearly"),
            at_most("wander", 0.5, "nobody crawls away"),
        ),
    ),
    Everyday(
        "jumping jacks",
        "a person is doing jumping jacks",
        5.0,
        jumping_jacks,
        (
            at_least("arms", 2, "the arms go up again and again"),
            at_least("legs", 2, "so the legs apart"),
            at_least("together", 0.3, "in the same rhythm"),
        ),
        grounded=False,
    ),
    Everyday(
        "lunges",
        "a woman doing lunges",
        6.0,
        lunges,
        (
            at_least("lunges", 1, "a knee goes down close to the floor"),
            at_least("split", 0.5, "one foot is far ahead of the other"),
            at_most("trunk", 60, "the trunk stays up"),
            at_most("wander", 2.5, "a few steps at the most"),
        ),
    ),
    Everyday(
        "side lunge right",
        "someone does a side lunge to the right",
        4.0,
        lambda b: side_lunge(b, 1),
        (
            at_least("held", 0.2, "the right knee bends, the left leg is straighter, the feet are wide apart"),
            at_most("feet", 1.0, "a step at the most"),
            at_most("other", 0.2, "not to the left"),
        ),
    ),
    Everyday(
        "left leg raise",
        "a person slowly lifts the straight left leg up to the front",
        5.0,
        lambda b: leg_raise(b, 0),
        (
            at_least("height", 0.28, "the left foot is far above the floor in front"),
            at_most("other", 0.2, "the right one is not"),
            at_most("speed", 4.0, "slower than a kick"),
            at_most("wander", 0.8, "on the spot"),
        ),
    ),
    Everyday(
        "right knee up",
        "standing on the left leg, he pulls his right knee up to hip height",
        4.0,
        lambda b: knee_raise(b, 1),
        (
            at_least("knee", -0.12, "the right knee is about level with the hip"),
            at_most("other", -0.2, "the left one stays down"),
            at_least("bent", 45, "the knee is bent"),
            at_least("standing", 0.9, "standing"),
            at_most("wander", 0.8, "on the spot"),
        ),
    ),
    Everyday("kick left", "a footballer kicks with the left foot", 3.0, lambda b: kicks(b, 0), _kick(0)),
    Everyday("kick right", "someone kicks hard with their right leg", 3.0, lambda b: kicks(b, 1), _kick(1)),
    Everyday("punch left", "a boxer throws a left punch", 3.0, lambda b: punches(b, 0), _punch(0)),
    Everyday("punch right", "he punches with his right fist", 3.0, lambda b: punches(b, 1), _punch(1)),
    Everyday(
        "guard",
        "a fighter holds up both fists to protect the face",
        4.0,
        guards,
        (
            at_least("held", 1.0, "both hands stay in front of face and chest"),
            at_least("upright", 0.85, "standing"),
            at_most("wander", 2.0, "more or less on the spot"),
        ),
    ),
    Everyday(
        "duck",
        "a person quickly ducks and straightens up again",
        3.0,
        ducks,
        (
            at_least("drop", 0.25, "the head goes down by more than a hand's length"),
            at_most("back", 0.15, "and comes back up"),
            at_most("seconds", 2.5, "quickly"),
            at_least("start", 0.9, "it begins standing"),
            at_least("hand", 0.2, "nothing is picked up"),
        ),
    ),
)
