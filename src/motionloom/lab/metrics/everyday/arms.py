"""What arms and hands do: raised, clapping, pointing, and everyday gestures."""

import numpy as np

from motionloom.kinematics import gestures as g
from motionloom.kinematics import physics as ph
from motionloom.lab.metrics.everyday.body import ELBOWS, HIPS, SHOULDERS, WRISTS, Body, times
from motionloom.lab.metrics.everyday.check import Everyday, at_least, at_most, between
from motionloom.lab.metrics.obedience import Measures


def raises(body: Body, side: int) -> Measures:
    """``held``: seconds the wanted wrist stays at its shoulder or higher while the other hangs 20 cm below its own.
    ``other``: seconds the other wrist does so. ``times``: how often the wanted wrist comes up from 25 cm below the
    shoulder to its height. ``wander``: metres from where it began."""
    own, other = body.reach_up[:, side], body.reach_up[:, 1 - side]
    return {
        "held": body.held((own > 0.0) & (other < -0.2)),
        "other": body.held(other > 0.0),
        "times": times(own, -0.25, 0.0),
        "wander": body.wander,
    }


def both_up(body: Body) -> Measures:
    """``held``: seconds both wrists stay above the head's joint. ``wander``: metres from where it began."""
    over = body.p[:, WRISTS, 1] - body.p[:, 15:16, 1]
    return {"held": body.held((over > 0.0).all(axis=1)), "wander": body.wander}


def claps(body: Body) -> Measures:
    """``claps``: times the wrists come together, from 10 cm more than at their closest to 5 cm more. ``closest``:
    metres between the wrists at the closest. ``where``: share of the claps' time (wrists within 7 cm of their
    closest) in which they are in front of the body between hip and head. ``wander``: metres from where it began."""
    gap = np.linalg.norm(body.p[:, WRISTS[0]] - body.p[:, WRISTS[1]], axis=-1)
    closest = float(np.percentile(gap, 3))
    near = gap < closest + 0.07
    hands = body.p[:, WRISTS, 1].mean(axis=1)
    front = (body.hands[..., 2].mean(axis=1) > 0.1) & (hands > body.p[:, 0, 1]) & (hands < body.p[:, 15, 1] + 0.15)
    return {
        "claps": times(-gap, -(closest + 0.10), -(closest + 0.05)),
        "closest": closest,
        "where": float(front[near].mean()),
        "wander": body.wander,
    }


def points(body: Body, side: int) -> Measures:
    """``held``: seconds the wanted arm is stretched (wrist to shoulder 85 % of the arm or more) to the front, within 35
    degrees of level, the hand hardly moving (0.5 m/s). ``other``: seconds the other arm is stretched to the front."""
    arm = body.p[:, WRISTS] - body.p[:, SHOULDERS]
    length = np.linalg.norm(arm, axis=-1)
    bones = np.linalg.norm(body.p[:, ELBOWS] - body.p[:, SHOULDERS], axis=-1)
    bones = np.median(bones + np.linalg.norm(body.p[:, WRISTS] - body.p[:, ELBOWS], axis=-1), axis=0)
    forward = body.hands[..., 2] - body.own[:, SHOULDERS, 2]
    level = np.abs(arm[..., 1]) < 0.57 * length
    out = (length > 0.85 * bones) & level & (forward > 0.5 * bones)
    return {
        "held": body.held(out[:, side] & (body.hand_speed[:, side] < 0.5)),
        "other": body.held(out[:, 1 - side]),
    }


def hands_on_hips(body: Body) -> Measures:
    """``held``: seconds both wrists stay within 22 cm of the hip joints or the waist beside them, the elbows 8 cm
    or more farther out than the wrists. ``travel``: metres walked."""
    waist = body.p[:, HIPS] + [0.0, 0.12, 0.0]
    near = np.linalg.norm(body.p[:, WRISTS] - waist, axis=-1) < 0.22
    out = np.abs(body.own[:, ELBOWS, 0]) - np.abs(body.own[:, WRISTS, 0]) > 0.06
    return {"held": body.held((near & out).all(axis=1)), "travel": body.travel}


def arms_to_the_sides(body: Body) -> Measures:
    """``held``: seconds both wrists are within 25 cm of shoulder height and 40 cm or more out from their shoulders."""
    side = np.stack(
        [
            body.own[:, WRISTS[0], 0] - body.own[:, SHOULDERS[0], 0],
            body.own[:, SHOULDERS[1], 0] - body.own[:, WRISTS[1], 0],
        ],
        axis=-1,
    )
    level = np.abs(body.reach_up) < 0.25
    return {"held": body.held(((side > 0.35) & level).all(axis=1)), "wander": body.wander}


def waves(body: Body, side: int) -> Measures:
    """``swings``: to and fro of 4 cm or more of the wanted hand while it is above the chest. ``other``: the same of
    the other hand. ``height``: metres of the wanted wrist over the neck at the most. ``wander``: metres from where
    it began."""
    swings = g.wrist_swings(body.p, body.fps, amplitude=0.04)
    return {
        "swings": swings[side],
        "other": swings[1 - side],
        "height": float(body.p[:, WRISTS[side], 1].max() - np.median(body.p[:, 12, 1])),
        "wander": body.wander,
    }


def swings_arms(body: Body) -> Measures:
    """``swings``: to and fro of 20 cm or more of the hands along the way the chest faces, both sides together.
    ``feet``: metres the middle of the feet goes. ``upright``: degrees the trunk leans, 90th percentile. ``pelvis``:
    leg lengths over the floor, 5th percentile."""
    forward = body.hands[..., 2]
    return {
        "swings": min(g.oscillations(forward[:, 0], 0.2), g.oscillations(forward[:, 1], 0.2)),
        "feet": body.feet_travel,
        "upright": float(np.percentile(body.lean, 90)),
        "pelvis": float(np.percentile(body.height, 5)),
    }


def drinks(body: Body) -> Measures:
    """``held``: seconds a wrist stays within 28 cm of the mouth (10 cm in front of the head's joint) and below the
    crown. ``from``: metres that wrist was below the neck at its lowest, before or after. ``elsewhere``: seconds the
    other hand is there too."""
    mouth = body.p[:, 15] + 0.1 * body.front
    gap = np.linalg.norm(body.p[:, WRISTS] - mouth[:, None], axis=-1)
    near = (gap < 0.28) & (body.p[:, WRISTS, 1] < body.p[:, 15:16, 1] + 0.15)
    side = max((0, 1), key=lambda s: body.held(near[:, s]))
    drop = body.p[:, 12, 1] - body.p[:, WRISTS[side], 1]
    return {
        "held": body.held(near[:, side]),
        "from": float(np.percentile(drop, 97)),
        "wander": body.wander,
        "lean": float(np.percentile(body.lean, 95)),
    }


def picks_up(body: Body) -> Measures:
    """``start``, ``end``: leg lengths of the pelvis over the floor. ``hand``: metres of the lower wrist over the
    floor at its lowest. ``after``: metres that wrist is over the floor in the last half second. ``slow``: m/s of
    that wrist at its lowest. ``turned``: degrees the trunk turns over."""
    wrists = body.p[:, WRISTS, 1]
    side = int(np.argmin(wrists.min(axis=0)))
    return {
        "start": body.start(body.height),
        "hand": float(wrists[:, side].min()),
        "after": body.end(wrists[:, side]),
        "end": body.end(body.height),
        "over": float(body.lean.max()),
    }


def throws(body: Body) -> Measures:
    """The stroke in which a wrist goes forward fastest. ``speed``: m/s of that wrist forward against the body.
    ``back``: metres that the same wrist was behind its place in that moment, within 0.6 s before. ``height``:
    metres that wrist was above its shoulder at the most, from 0.6 s before to the stroke. ``lean``: degrees the
    trunk leans at the most. ``pace``: m/s of the pelvis, median."""
    hands = ph.smooth(ph.velocity(body.hands, body.fps), 3)
    forward = hands[..., 2]
    frame, side = np.unravel_index(int(np.argmax(forward)), forward.shape)
    first = max(0, frame - round(0.6 * body.fps))
    return {
        "speed": float(forward[frame, side]),
        "back": float(body.hands[frame, side, 2] - body.hands[first : frame + 1, side, 2].min()),
        "height": float(body.reach_up[first : frame + 2, side].max()),
        "lean": float(body.lean.max()),
        "pace": float(np.median(body.pace)),
    }


def opens(body: Body) -> Measures:
    """The wrist that gets farthest to the front between hip and shoulder height, and the second after that moment.
    ``reach``: metres in front of the pelvis then. ``start``: metres in front at the start. ``moved``: metres it
    goes over the ground plane in the body's frame while it stays 15 cm in front. ``rise``: metres it goes up and
    down then. ``pace``: m/s of the pelvis at that moment. ``stroke``: m/s of that wrist against the body at the
    most."""
    level = (body.p[:, WRISTS, 1] > body.p[:, :1, 1] - 0.05) & (body.reach_up < 0.1)
    ahead = np.where(level, body.hands[..., 2], 0.0)
    frame, side = np.unravel_index(int(np.argmax(ahead)), ahead.shape)
    after = slice(frame, frame + max(2, round(body.fps)))
    path, out = body.hands[after, side][:, [0, 2]], ahead[after, side] > 0.15
    moved = np.linalg.norm(path - path[0], axis=-1)
    return {
        "reach": float(ahead[frame, side]),
        "start": body.start(body.hands[:, side, 2]),
        "moved": float(moved[out].max()) if out.any() else 0.0,
        "rise": float(np.ptp(body.p[after, WRISTS[side], 1][out])) if out.any() else 9.0,
        "pace": float(body.pace[frame]),
        "stroke": float(body.hand_speed[:, side].max()),
    }


def _raising(side: int):
    word, away = ("left", "right")[side], ("right", "left")[side]
    return (
        at_least("held", 0.3, f"the {word} hand is up and the {away} one is not"),
        at_most("other", 0.2, f"the {away} hand stays down"),
        at_most("wander", 1.5, "on the spot or with a few steps"),
    )


def _waving(side: int):
    word, away = ("left", "right")[side], ("right", "left")[side]
    return (
        at_least("swings", 3, f"the {word} hand goes to and fro"),
        at_most("other", 1, f"the {away} hand does not"),
        at_least("height", -0.25, "the hand is about shoulder height or above"),
        at_most("wander", 1.5, "on the spot or with a few steps"),
    )


CHECKS = (
    Everyday("raise the left arm", "a student raises her left arm", 3.0, lambda b: raises(b, 0), _raising(0)),
    Everyday("raise the right hand", "someone puts up their right hand", 3.0, lambda b: raises(b, 1), _raising(1)),
    Everyday(
        "raise the right arm twice",
        "a person lifts the right arm twice",
        6.0,
        lambda b: raises(b, 1),
        (*_raising(1), between("times", 2, 2, "twice, neither once nor three times")),
    ),
    Everyday(
        "both hands over the head",
        "a man lifts both hands high above his head",
        3.0,
        both_up,
        (at_least("held", 0.3, "both wrists are above the head"), at_most("wander", 1.5, "more or less on the spot")),
    ),
    Everyday(
        "clap",
        "somebody claps their hands",
        4.0,
        claps,
        (
            at_least("claps", 2, "again and again"),
            at_most("closest", 0.25, "the hands meet"),
            at_least("where", 0.7, "in front of the body"),
            at_most("wander", 1.2, "more or less on the spot"),
        ),
    ),
    Everyday(
        "point",
        "a person points straight ahead with the right hand",
        4.0,
        lambda b: points(b, 1),
        (at_least("held", 0.4, "the right arm stays stretched out"), at_most("other", 0.3, "the left one does not")),
    ),
    Everyday(
        "hands on the hips",
        "a woman stands with her hands on her hips",
        4.0,
        hands_on_hips,
        (at_least("held", 0.8, "both hands rest there"), at_most("travel", 1.5, "she stands")),
    ),
    Everyday(
        "arms to the sides",
        "someone holds both arms straight out to the sides",
        4.0,
        arms_to_the_sides,
        (at_least("held", 0.5, "both arms are out, level"), at_most("wander", 1.5, "more or less on the spot")),
    ),
    Everyday("wave with the left hand", "a girl waves with her left hand", 4.0, lambda b: waves(b, 0), _waving(0)),
    Everyday(
        "wave with the right hand",
        "somebody waves hello, using the right hand",
        4.0,
        lambda b: waves(b, 1),
        _waving(1),
    ),
    Everyday(
        "swing the arms",
        "a man stands there swinging his arms back and forth",
        5.0,
        swings_arms,
        (
            at_least("swings", 4, "to and fro, twice"),
            at_most("feet", 0.3, "the feet stay"),
            at_most("upright", 40, "upright"),
            at_least("pelvis", 0.92, "the knees stay straight"),
        ),
    ),
    Everyday(
        "drink",
        "a person takes a sip from a bottle",
        5.0,
        drinks,
        (
            at_least("held", 0.35, "a hand stays at the mouth"),
            at_least("from", 0.2, "it comes from below"),
            at_most("wander", 1.0, "on the spot"),
            at_most("lean", 50, "upright"),
        ),
    ),
    Everyday(
        "pick up",
        "someone picks something up off the floor",
        5.0,
        picks_up,
        (
            at_least("start", 0.95, "it begins standing"),
            at_most("hand", 0.35, "a hand gets to the floor"),
            at_least("after", 0.55, "the hand comes up again"),
            at_least("end", 0.88, "it ends standing"),
            at_most("over", 130, "it is no tumbling"),
        ),
    ),
    Everyday(
        "throw",
        "a boy throws a ball",
        3.0,
        throws,
        (
            at_least("speed", 2.4, "faster than a hand is moved without need"),
            at_least("back", 0.22, "the arm is drawn back before"),
            at_least("height", 0.05, "the hand comes over the shoulder"),
            at_most("pace", 1.5, "it is no run"),
            at_most("lean", 80, "it is no tumbling"),
        ),
    ),
    Everyday(
        "open a door",
        "he opens a door",
        4.0,
        opens,
        (
            at_least("reach", 0.38, "a hand goes to the handle"),
            at_least("moved", 0.15, "and moves the door"),
            at_most("rise", 0.33, "a door moves on a level"),
            at_most("pace", 0.7, "he stops to do it"),
            at_most("start", 0.3, "the hand is not there from the start"),
            at_most("stroke", 3.0, "it is no blow"),
        ),
    ),
)
