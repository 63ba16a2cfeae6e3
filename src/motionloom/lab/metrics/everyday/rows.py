"""Two or three actions in a row: each is looked for in its own time, in the order that was asked."""

import numpy as np

from motionloom.kinematics import gestures as g
from motionloom.lab.metrics.everyday.arms import raises, waves
from motionloom.lab.metrics.everyday.body import WRISTS, Body
from motionloom.lab.metrics.everyday.check import Everyday, at_least, at_most, between
from motionloom.lab.metrics.everyday.exercise import kicks
from motionloom.lab.metrics.everyday.postures import seat
from motionloom.lab.metrics.obedience import Measures


def walks_then_sits(body: Body) -> Measures:
    """``walked``: metres gone forward while the pelvis was above 0.95 leg lengths. As `seat` at the end."""
    high = body.height > 0.95
    return {"walked": float(body.way[high, 2].sum() / body.fps), **seat(body)}


def stands_then_walks(body: Body) -> Measures:
    """As `seat` at the start. ``rest``: m/s of the pelvis then. ``walked``: metres gone forward after the last
    moment below 0.9 leg lengths. ``end``: leg lengths of the pelvis over the floor at the end."""
    low = np.flatnonzero(body.height < 0.9)
    after = body.way[int(low[-1]) + 1 if len(low) else 0 :, 2]
    rest = body.start(body.pace)
    return {
        **seat(body, at_end=False),
        "rest": rest,
        "walked": float(after.sum() / body.fps),
        "end": body.end(body.height),
    }


def walks_then_waves(body: Body) -> Measures:
    """Split where the way is done: when 90 % of it lies behind. ``walked``: metres gone forward before. ``swings``:
    to and fro of 4 cm or more of a raised hand after. ``drift``: metres gone after."""
    before, after = body.split(_done(body, 0.9))
    swings = waves(after, 0)
    return {"walked": before.advance, "swings": max(swings["swings"], swings["other"]), "drift": after.travel}


def picks_up_then_walks(body: Body) -> Measures:
    """Split where a wrist is lowest. ``hand``: metres over the floor then. ``pace``: m/s of the pelvis then.
    ``start``: leg lengths of the pelvis at the start. ``walked``: metres gone forward after. ``end``: leg lengths
    of the pelvis at the end."""
    wrists = body.p[:, WRISTS, 1].min(axis=1)
    _, after = body.split(int(np.argmin(wrists)))
    return {
        "start": body.start(body.height),
        "hand": float(wrists.min()),
        "pace": float(body.pace[int(np.argmin(wrists))]),
        "walked": after.advance,
        "end": body.end(body.height),
        "over": float(body.lean.max()),
    }


def back_and_forth(body: Body) -> Measures:
    """Split where the person is farthest back along the way that the chest points at the start. ``back``: metres gone
    backwards before. ``forth``: metres gone forwards after. ``turn``: degrees turned at the end, either way."""
    way = np.cumsum(body.way[:, 2]) / body.fps
    before, after = body.split(int(np.argmin(way)))
    return {"back": -before.advance, "forth": after.advance, "turn": abs(float(body.heading[-1]))}


def squats_then_jumps(body: Body) -> Measures:
    """``low``: leg lengths of the pelvis over the floor at the lowest before the best jump. ``rise``: metres the pelvis
    rises in that jump. ``clearance``: metres both feet are off the floor then."""
    best = max(body.flights, key=lambda f: f.rise, default=None)
    if best is None or best.start < 2:
        return {"low": 9.0, "rise": 0.0, "clearance": 0.0}
    return {"low": float(body.height[: best.start].min()), "rise": best.rise, "clearance": best.clearance}


def kick_then_punch(body: Body) -> Measures:
    """``kick``: leg lengths of the better kick's height. ``speed``: m/s of that foot. ``thrust``: m/s of the faster
    fist from 0.2 s after the foot is highest on."""
    sides = [kicks(body, side) for side in (0, 1)]
    side = int(np.argmax([found["height"] for found in sides]))
    ankles = body.ankles[:, side] - body.ankles[:, 1 - side]
    thrust = g.wrist_thrust(body.p, body.fps).max(axis=1)
    at = min(int(np.argmax(ankles)) + round(0.2 * body.fps), len(thrust) - 1)
    return {"kick": sides[side]["height"], "speed": sides[side]["speed"], "thrust": float(thrust[at:].max())}


def right_then_left(body: Body) -> Measures:
    """``right``, ``left``: seconds that hand stays at its shoulder or above while the other hangs 20 cm below its own.
    ``later``: seconds by which the left hand's middle time comes after the right one's."""
    up = body.reach_up
    masks = [(up[:, 1 - k] > 0.0) & (up[:, k] < -0.2) for k in (0, 1)]  # right alone, left alone
    middle = [float(np.flatnonzero(m).mean()) if m.any() else 0.0 for m in masks]
    return {
        "right": raises(body, 1)["held"],
        "left": raises(body, 0)["held"],
        "later": (middle[1] - middle[0]) / body.fps if masks[0].any() and masks[1].any() else -9.0,
    }


def jump_then_walk(body: Body) -> Measures:
    """``rise``: metres the pelvis rises in the first jump of 10 cm or more. ``walked``: metres gone forward after
    it."""
    jumps = [f for f in body.flights if f.rise > 0.1]
    if not jumps:
        return {"rise": 0.0, "clearance": 0.0, "walked": 0.0}
    _, after = body.split(jumps[0].stop)
    return {"rise": jumps[0].rise, "clearance": jumps[0].clearance, "walked": after.advance}


def _done(body: Body, share: float) -> int:
    way = np.cumsum(body.pace)
    return int(np.searchsorted(way, share * way[-1]))


_SEATED = (
    between("seat", 0.35, 0.85, "the hips are at the height of a seat"),
    at_most("trunk", 50, "the trunk is upright"),
    at_most("feet", 0.22, "both feet are on the floor"),
    at_least("feet_ahead", 0.12, "the feet are in front of the seat"),
)

CHECKS = (
    Everyday(
        "walk, then sit",
        "a person walks forward, then sits down",
        7.0,
        walks_then_sits,
        (at_least("walked", 0.8, "first a few steps"), *_SEATED),
    ),
    Everyday(
        "stand up and walk",
        "a man stands up from his chair and walks away",
        6.0,
        stands_then_walks,
        (
            *_SEATED,
            at_most("rest", 0.3, "he sits first"),
            at_least("walked", 0.8, "then a few steps"),
            at_least("end", 0.98, "on straight legs"),
        ),
    ),
    Everyday(
        "walk, then wave",
        "someone walks up, stops and waves",
        7.0,
        walks_then_waves,
        (
            at_least("walked", 0.7, "first a few steps"),
            at_least("swings", 3, "then a raised hand goes to and fro"),
            at_most("drift", 0.8, "standing"),
        ),
    ),
    Everyday(
        "pick up and walk",
        "she bends down, picks up a bag and walks on",
        7.0,
        picks_up_then_walks,
        (
            at_least("start", 0.95, "it begins standing"),
            at_most("hand", 0.35, "a hand gets to the floor"),
            at_most("pace", 0.8, "standing"),
            at_least("walked", 0.7, "then a few steps"),
            at_least("end", 0.98, "on straight legs"),
            at_most("over", 130, "it is no tumbling"),
        ),
    ),
    Everyday(
        "back, then forward",
        "a person walks backwards, stops, and then walks forward",
        8.0,
        back_and_forth,
        (
            at_least("back", 0.6, "first backwards"),
            at_least("forth", 0.6, "then forwards"),
            at_most("turn", 70, "without turning round"),
        ),
    ),
    Everyday(
        "squat, then jump",
        "someone squats down and then jumps up",
        5.0,
        squats_then_jumps,
        (
            at_most("low", 0.8, "first the hips come down"),
            at_least("rise", 0.1, "then the body flies"),
            at_least("clearance", 0.08, "with both feet"),
        ),
        grounded=False,
    ),
    Everyday(
        "kick, then punch",
        "a karate fighter kicks and then punches",
        4.0,
        kick_then_punch,
        (
            at_least("kick", 0.3, "first a foot goes up"),
            at_least("speed", 2.8, "fast"),
            at_least("thrust", 1.4, "then a fist shoots forward"),
        ),
    ),
    Everyday(
        "right, then left arm",
        "a person raises the right arm, then the left arm",
        6.0,
        right_then_left,
        (
            at_least("right", 0.3, "the right hand alone"),
            at_least("left", 0.3, "the left hand alone"),
            at_least("later", 0.3, "in this order"),
        ),
    ),
    Everyday(
        "jump, then walk",
        "a kid jumps once and then walks away",
        6.0,
        jump_then_walk,
        (
            at_least("rise", 0.1, "first a jump"),
            at_least("clearance", 0.06, "with both feet"),
            at_least("walked", 0.8, "then a few steps"),
        ),
        grounded=False,
    ),
)
