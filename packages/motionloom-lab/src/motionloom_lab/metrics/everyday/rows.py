"""Two or three actions in a row: each is looked for in its own time, in the order of the prompt."""

import numpy as np

from motionloom.kinematics import gestures as g
from motionloom_lab.metrics.actions import Measures
from motionloom_lab.metrics.everyday.arms import raises, waves
from motionloom_lab.metrics.everyday.body import WRISTS, Body
from motionloom_lab.metrics.everyday.exercise import kicks
from motionloom_lab.metrics.everyday.postures import seat


def walks_then_sits(body: Body) -> Measures:
    """``walked``: metres gone forward while the pelvis was above 0.95 leg lengths. As `seat` at the end."""
    high = body.height > 0.95
    return {"walked": float(body.way[high, 2].sum() / body.fps), **seat(body)}


def stands_then_walks(body: Body) -> Measures:
    """As `seat` at the start. ``rest``: m/s of the pelvis then. ``walked``: metres gone forward after the last moment
    below 0.9 leg lengths."""
    low = np.flatnonzero(body.height < 0.9)
    after = body.way[int(low[-1]) + 1 if len(low) else 0 :, 2]
    return {**seat(body, at_end=False), "rest": body.at_start(body.pace), "walked": float(after.sum() / body.fps)}


def walks_then_waves(body: Body) -> Measures:
    """Split where the way is done: when 90 % of it lies behind. ``walked``: metres gone forward before. ``swings``: to
    and fro of 4 cm or more of a raised hand after. ``drift``: metres gone after."""
    before, after = body.split(_frame_at(body, 0.9))
    swings = waves(after, 0)
    return {"walked": before.advance, "swings": max(swings["swings"], swings["other"]), "drift": after.travel}


def picks_up_then_walks(body: Body) -> Measures:
    """Split where a wrist is lowest. ``hand``: metres over the floor then. ``pace``: m/s of the pelvis then.
    ``walked``: metres gone forward after."""
    wrists = body.p[:, WRISTS, 1].min(axis=1)
    _, after = body.split(int(np.argmin(wrists)))
    return {
        "hand": float(wrists.min()),
        "pace": float(body.pace[int(np.argmin(wrists))]),
        "walked": after.advance,
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
    side = int(np.argmax([kick["height"] for kick in sides]))
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
    """``rise``: metres the pelvis rises in the first jump of 10 cm or more. ``walked``: metres gone forward after."""
    jumps = [f for f in body.flights if f.rise > 0.1]
    if not jumps:
        return {"rise": 0.0, "clearance": 0.0, "walked": 0.0}
    _, after = body.split(jumps[0].stop)
    return {"rise": jumps[0].rise, "clearance": jumps[0].clearance, "walked": after.advance}


def _frame_at(body: Body, share: float) -> int:
    way = np.cumsum(body.pace)
    return int(np.searchsorted(way, share * way[-1]))
