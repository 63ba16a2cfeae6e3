"""Ways to get about, starts and stops."""

import numpy as np

from motionloom.kinematics import gestures as g
from motionloom.lab.metrics.everyday.body import Body
from motionloom.lab.metrics.everyday.check import Everyday, at_least, at_most, between
from motionloom.lab.metrics.obedience import Bound, Measures


def gait(body: Body) -> Measures:
    """``pace``: m/s while moving, median. ``top``, ``half``: m/s that a tenth and half of the time exceed.
    ``ahead``: share of the way that goes where the chest points. ``advance``: metres gone that way. ``turn``:
    degrees turned at the end, either way. ``flights``: times both feet were off the floor. ``lowest_pelvis``: leg
    lengths over the floor, 5th percentile."""
    return {
        "pace": body.moving_pace,
        "top": float(np.percentile(body.pace, 90)),
        "half": float(np.median(body.pace)),
        "ahead": body.ahead,
        "advance": body.advance,
        "turn": abs(float(body.heading[-1])),
        "flights": len(body.flights),
        "lowest_pelvis": float(np.percentile(body.height, 5)),
    }


def sidestep(body: Body, side: int) -> Measures:
    """``sideways``: metres gone to the wanted side of the chest. ``share``: of the whole way. ``turn``: degrees the
    body turned at the end, either way."""
    way = body.leftward * (1 if side == 0 else -1)
    return {"sideways": way, "share": way / max(body.travel, 0.3), "turn": abs(float(body.heading[-1]))}


def arms_ahead(body: Body) -> Measures:
    """``advance``: metres gone forward. ``arms_ahead``: share of the time in which both wrists are at least 60 % of an
    arm in front of the shoulders and no lower than 30 cm below them."""
    arm = 0.75 * body.leg
    shoulders = body.own[:, (16, 17), 2]
    ahead = (body.hands[..., 2] - shoulders > 0.6 * 0.8 * arm) & (body.reach_up > -0.3)
    return {"advance": body.advance, "arms_ahead": float(ahead.all(axis=1).mean())}


def carries(body: Body) -> Measures:
    """``advance``: metres gone forward. ``hands_kept``: share of the time in which both wrists are in front of the body
    (12 cm or more), between hip and shoulder height, 15 to 100 cm apart. ``swing``: metres that the distance between
    left and right wrist along the way changes (10th to 90th percentile): arms that hold nothing swing."""
    hands = body.hands
    apart = np.linalg.norm(hands[:, 0] - hands[:, 1], axis=-1)
    level = (body.reach_up < 0.1) & (body.p[:, (20, 21), 1] > body.p[:, :1, 1] - 0.15)
    kept = ((hands[..., 2] > 0.12) & level).all(axis=1) & (apart > 0.15) & (apart < 1.0)
    gap = hands[:, 0, 2] - hands[:, 1, 2]
    return {
        "advance": body.advance,
        "hands_kept": float(kept.mean()),
        "swing": float(np.percentile(gap, 90) - np.percentile(gap, 10)),
    }


def skips(body: Body) -> Measures:
    """``advance``: metres gone forward. ``flights``: times both feet were 3 cm off the floor. ``bounce``: metres
    the pelvis goes up and down (10th to 90th percentile). ``top``: m/s that a tenth of the time exceeds."""
    pelvis = body.p[:, 0, 1]
    return {
        "advance": body.advance,
        "flights": len(g.airborne(body.p, clearance=0.03)),
        "bounce": float(np.percentile(pelvis, 90) - np.percentile(pelvis, 10)),
        "top": float(np.percentile(body.pace, 90)),
    }


def stops(body: Body) -> Measures:
    """``top``: m/s that a tenth of the time exceeds. ``travel``: metres. ``pace_end``: m/s, mean of the last 0.6 s.
    ``height_end``: leg lengths of the pelvis over the floor at the end. ``flights``: times both feet were off the
    floor. ``ahead``: share of the way that goes where the chest points."""
    last = max(1, round(0.6 * body.fps))
    return {
        "top": float(np.percentile(body.pace, 90)),
        "ahead": body.ahead,
        "travel": body.travel,
        "pace_end": float(body.pace[-last:].mean()),
        "flights": len(body.flights),
        "height_end": body.end(body.height),
    }


def starts(body: Body) -> Measures:
    """``pace_start``: m/s, mean of the first 0.4 s. ``pace_end``: m/s, mean of the last second. ``advance``: metres
    gone forward. ``top``: m/s that a tenth of the time exceeds. ``height_start``: leg lengths of the pelvis over
    the floor at the start. ``flights``: times both feet were off the floor."""
    first, last = max(1, round(0.4 * body.fps)), max(1, round(body.fps))
    return {
        "pace_start": float(body.pace[:first].mean()),
        "pace_end": float(body.pace[-last:].mean()),
        "advance": body.advance,
        "top": float(np.percentile(body.pace, 95)),
        "height_start": body.start(body.height),
        "flights": len(body.flights),
    }


def changes_pace(body: Body) -> Measures:
    """``first``, ``last``: m/s over the first and the last second, mean. ``gain``: the last over the first, m/s.
    ``ahead``: share of the way that goes where the chest points. ``walks``: seconds between 0.4 and 1.9 m/s."""
    n = max(1, round(body.fps))
    first, last = float(body.pace[:n].mean()), float(body.pace[-n:].mean())
    strolls = (body.pace > 0.4) & (body.pace < 1.9)
    return {
        "first": first,
        "last": last,
        "gain": last - first,
        "ahead": body.ahead,
        "walks": float(strolls.mean() * body.seconds),
    }


_FORWARD = at_least("ahead", 0.75, "the way gone is where the chest points")
_BACKWARD = at_most("ahead", -0.5, "the way gone is away from the chest")
_UPRIGHT = at_least("lowest_pelvis", 0.9, "people walk on straight legs")


def _side(side: int) -> tuple[Bound, ...]:
    word = ("left", "right")[side]
    return (
        at_least("sideways", 0.5, f"a few steps to the {word} cover half a metre"),
        at_least("share", 0.6, "most of the way is across the chest"),
        at_most("turn", 60, "whoever steps sideways keeps facing the same way"),
    )


CHECKS = (
    Everyday(
        "walk slowly",
        "an old man is walking slowly",
        5.0,
        gait,
        (
            between("pace", 0.25, 1.0, "a slow walk is below a metre per second"),
            at_least("advance", 0.9, "it goes somewhere"),
            _FORWARD,
            _UPRIGHT,
        ),
    ),
    Everyday(
        "walk fast",
        "a woman walks very fast, she is in a hurry",
        4.0,
        gait,
        (
            between("pace", 1.4, 2.4, "faster than people stroll, slower than they run"),
            at_most("flights", 2, "walking keeps a foot on the floor"),
            at_most("top", 2.7, "nobody runs"),
            _FORWARD,
        ),
    ),
    Everyday(
        "run fast",
        "he sprints as fast as he can",
        3.0,
        gait,
        (
            at_least("top", 3.0, "a sprint is faster than a jog"),
            at_least("half", 2.2, "and it lasts"),
            _FORWARD,
        ),
    ),
    Everyday(
        "run backwards",
        "someone runs backwards",
        3.0,
        gait,
        (
            at_least("top", 1.4, "faster than people walk backwards"),
            at_most("advance", -1.2, "it goes somewhere"),
            _BACKWARD,
        ),
    ),
    Everyday(
        "steps back",
        "a man takes a few steps back",
        4.0,
        gait,
        (
            at_most("advance", -0.4, "a few steps back cover half a metre"),
            _BACKWARD,
            at_most("top", 1.6, "steps, not running"),
            at_least("lowest_pelvis", 0.8, "on the feet"),
            at_most("turn", 70, "the chest keeps facing the same way"),
        ),
    ),
    Everyday("sidestep left", "somebody sidesteps to the left", 4.0, lambda b: sidestep(b, 0), _side(0)),
    Everyday("sidestep right", "a girl steps sideways to the right", 4.0, lambda b: sidestep(b, 1), _side(1)),
    Everyday(
        "skip",
        "a child skips along happily",
        4.0,
        skips,
        (
            at_least("advance", 1.5, "skipping goes somewhere"),
            at_least("flights", 2, "every skip leaves the floor"),
            at_least("bounce", 0.08, "the body bounces"),
            at_most("top", 3.0, "slower than a run"),
        ),
        grounded=False,
    ),
    Everyday(
        "zombie",
        "walking like a zombie with both arms stretched out in front",
        5.0,
        arms_ahead,
        (
            at_least("advance", 0.8, "the zombie walks"),
            at_least("arms_ahead", 0.5, "the arms stay stretched out to the front"),
        ),
    ),
    Everyday(
        "carry a box",
        "a man carries a heavy box across the room",
        5.0,
        carries,
        (
            at_least("advance", 1.2, "he gets across"),
            at_least("hands_kept", 0.7, "both hands stay in front, where the box is"),
            at_most("swing", 0.25, "the arms do not swing"),
        ),
    ),
    Everyday(
        "walk and stop",
        "a guy walks a few steps and then stops",
        5.0,
        stops,
        (
            between("top", 0.5, 2.0, "there is walking"),
            at_least("travel", 0.8, "a few steps cover most of a metre"),
            at_least("ahead", 0.6, "the way gone is where the chest points"),
            at_most("pace_end", 0.2, "at the end nobody moves on"),
            at_least("height_end", 0.92, "it ends standing"),
            at_most("flights", 0, "walking keeps a foot on the floor"),
        ),
    ),
    Everyday(
        "run and stop",
        "she runs and then comes to a halt",
        4.0,
        stops,
        (
            at_least("top", 1.8, "there is running"),
            at_least("travel", 1.8, "the run covers two metres"),
            at_least("ahead", 0.6, "the way gone is where the chest points"),
            at_most("pace_end", 0.4, "at the end nobody moves on"),
        ),
    ),
    Everyday(
        "start walking",
        "a person is standing and then starts to walk",
        5.0,
        starts,
        (
            at_most("pace_start", 0.25, "it begins at rest"),
            at_least("pace_end", 0.55, "at the end there is walking"),
            at_least("advance", 0.9, "it goes somewhere"),
            at_most("top", 2.0, "walking, not running"),
            at_least("height_start", 0.92, "it begins standing"),
            at_most("flights", 0, "nobody jumps"),
        ),
    ),
    Everyday(
        "walk then run",
        "a person starts out walking and breaks into a run",
        5.0,
        changes_pace,
        (
            at_most("first", 1.9, "it does not begin with running"),
            at_least("walks", 0.5, "it begins with walking"),
            at_least("last", 2.0, "it ends with running"),
            at_least("gain", 0.8, "the run is clearly faster"),
            _FORWARD,
        ),
    ),
    Everyday(
        "run then walk",
        "the runner slows down to a walk",
        5.0,
        changes_pace,
        (
            at_least("first", 1.8, "it begins with running"),
            between("last", 0.2, 1.75, "it ends with walking"),
            at_most("gain", -0.6, "the walk is clearly slower"),
            _FORWARD,
        ),
    ),
)
