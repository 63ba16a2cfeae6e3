"""Turning, spinning, jumping, balance and dance: what the whole body does."""

import numpy as np

from motionloom.kinematics import gestures as g
from motionloom_lab.metrics.actions import Measures
from motionloom_lab.metrics.everyday.body import ANKLES, Body


def turns(body: Body, side: int) -> Measures:
    """``turn``: degrees turned at the end, to the wanted side positive."""
    return {"turn": float(body.heading[-1]) * (1 if side == 0 else -1)}


def turns_round(body: Body) -> Measures:
    """``turn``: degrees turned at the end, either way. ``before``, ``after``: metres gone forward before and after half
    of the turn. ``back``: metres of the way after the turn that lie against the way before it."""
    goal = float(body.heading[-1])
    half = int(np.argmax(np.abs(body.heading) >= abs(goal) / 2)) if abs(goal) > 1 else len(body.p) // 2
    before, after = body.split(half)
    out = (before.p[-1, 0] - before.p[0, 0])[[0, 2]]
    home = (after.p[-1, 0] - after.p[0, 0])[[0, 2]]
    return {
        "turn": abs(goal),
        "before": before.advance,
        "after": after.advance,
        "back": -float(out @ home) / max(float(np.linalg.norm(out)), 0.1),
    }


def spins(body: Body) -> Measures:
    """``turned``: degrees between the farthest headings to the left and to the right. ``lean``: degrees the trunk
    leans, median."""
    return {"turned": float(np.ptp(body.heading)), "lean": float(np.median(body.lean))}


def hops_forward(body: Body) -> Measures:
    """``clearance``: metres both feet are off the floor at the most. ``leap``: metres the pelvis goes where the chest
    points in the longest leap, from 0.15 s before the feet leave the floor to 0.15 s after. ``run_up``: m/s of the
    pelvis in the second before it."""
    margin = round(0.15 * body.fps)
    best = {"clearance": 0.0, "leap": 0.0, "run_up": 0.0}
    for flight in body.flights:
        a, b = max(0, flight.start - margin), min(len(body.p), flight.stop + margin)
        leap = float(body.way[a:b, 2].sum() / body.fps)
        if leap > best["leap"]:
            before = body.pace[max(0, a - round(body.fps)) : a]
            pace = float(before.mean()) if len(before) else 0.0
            best = {"clearance": flight.clearance, "leap": leap, "run_up": pace}
    return best


def jumps_often(body: Body) -> Measures:
    """``jumps``: times both feet are 5 cm or more off the floor while the pelvis rises 8 cm or more."""
    return {"jumps": sum(f.rise > 0.08 for f in body.flights)}


def somersaults(body: Body) -> Measures:
    """``rolled``: degrees the trunk turns over its own left-right axis, forwards positive. ``over``: degrees it leans
    from the vertical at the most. ``hands``: metres of the lower wrist over the floor at its lowest. ``tumbled``:
    degrees the trunk turns over to a side (about the direction it faces), either way. ``flown``: metres the lowest
    joint is over the floor at the most."""
    rolled, tumbled = body.spin(body.axis_across), body.spin(body.front)
    return {
        "rolled": float(rolled[np.argmax(np.abs(rolled))]),
        "tumbled": float(np.abs(tumbled).max()),
        "over": float(body.lean.max()),
        "hands": float(body.p[:, (20, 21), 1].min()),
        "flown": float(body.lowest.max()),
    }


def one_leg(body: Body, side: int | None = None) -> Measures:
    """``held``: seconds one ankle stays 15 cm or more above the other one, which stays within 10 cm of its lowest place
    (``side``: the foot to stand on; None: either). ``wide``: share of that time in which both wrists are 35 cm or
    more out to their side and no lower than 35 cm below the shoulders."""
    down = body.ankles - np.percentile(body.ankles, 2, axis=0)
    up = body.ankles[:, ::-1] - body.ankles > 0.15  # the foot of this column carries
    carries = up & (down < 0.1)
    feet = (0, 1) if side is None else (side,)
    foot = max(feet, key=lambda f: body.held(carries[:, f]))
    mask = carries[:, foot]
    out = np.minimum(body.hands[:, 0, 0], -body.hands[:, 1, 0]) > 0.35
    wide = out & (body.reach_up > -0.35).all(axis=1)
    return {
        "held": body.held(mask),
        "other": body.held(carries[:, 1 - foot]) if side is not None else 0.0,
        "wide": float(wide[mask].mean()) if mask.any() else 0.0,
    }


def sways(body: Body) -> Measures:
    """``swings``: times the chest goes from side to side against the middle of the feet by 6 cm or more. ``feet``:
    metres the middle of the feet goes. ``turned``: degrees of heading between the farthest ways. ``ahead``: degrees
    the trunk leans to front or back, 90th percentile. ``lifted``: metres an ankle is lifted, 95th percentile.
    ``hands``: m/s of the wrists against the body, mean."""
    side = (body.p[:, 9] - body.feet) @ _left_at_start(body)
    return {
        "swings": g.oscillations(side, 0.06),
        "feet": body.feet_travel,
        "turned": float(np.ptp(body.heading)),
        "ahead": float(np.percentile(np.abs(body.bend), 90)),
        "lifted": float(np.percentile(body.ankles - np.percentile(body.ankles, 5, axis=0), 95)),
        "hands": float(body.hand_speed.mean()),
    }


def _left_at_start(body: Body) -> np.ndarray:
    across = np.median(body.across, axis=0) * [1.0, 0.0, 1.0]
    return across / max(float(np.linalg.norm(across)), 1e-9)


def dances(body: Body) -> Measures:
    """``feet``, ``hands``: m/s against the body, means. ``turning``: degrees per second of heading, either way, mean.
    ``ahead``: share of the way that goes where the chest points, either way. ``steps``: lifts of a foot by 4 cm, per
    second. ``lean``: degrees the trunk leans, 90th percentile. ``tempo``: times per second that the pelvis turns
    back by 4 cm along its own forward or sideways way."""
    turning = np.abs(np.gradient(body.heading)) * body.fps
    path = np.cumsum(body.way[:, [0, 2]], axis=0) / body.fps
    return {
        "feet": float(g.limb_speed(body.p, body.fps, ANKLES).mean()),
        "hands": float(g.limb_speed(body.p, body.fps, (20, 21)).mean()),
        "turning": float(turning.mean()),
        "ahead": abs(body.ahead),
        "steps": sum(g.foot_height_peaks(body.p, lift=0.04)) / body.seconds,
        "lean": float(np.percentile(body.lean, 90)),
        "tempo": max(g.oscillations(path[:, k], 0.04) for k in (0, 1)) / body.seconds,
    }


def ballet(body: Body) -> Measures:
    """``figure``: the larger of two shares: leg lengths that one ankle is above the other at the most, of 0.5; degrees
    of heading between the farthest ways, of 300. ``wide``: share of the time with a wrist no lower than 20 cm below
    the shoulder or 50 cm away from the middle of the body. ``speed``: m/s of all joints, mean. ``lean``: degrees the
    trunk leans, 95th percentile."""
    leg = float(np.abs(body.ankles[:, 0] - body.ankles[:, 1]).max() / body.leg)
    away = np.linalg.norm(body.hands[..., [0, 2]], axis=-1) > 0.5
    return {
        "figure": max(leg / 0.5, float(np.ptp(body.heading)) / 300.0),
        "wide": float(((body.reach_up > -0.2) | away).any(axis=1).mean()),
        "speed": float(body.stir.mean()),
        "lean": float(np.percentile(body.lean, 95)),
    }
