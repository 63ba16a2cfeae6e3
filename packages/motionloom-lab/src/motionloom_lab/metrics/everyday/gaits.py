"""Ways to get about, starts and stops."""

import numpy as np

from motionloom.kinematics import gestures as g
from motionloom_lab.metrics.actions import Measures
from motionloom_lab.metrics.everyday.body import Body


def gait(body: Body) -> Measures:
    """``pace``: m/s while moving, median. ``half``: m/s that half of the time exceeds. ``turn``: degrees turned at the
    end, either way. ``flights``: times both feet were off the floor. ``lowest_pelvis``: leg lengths over the floor,
    5th percentile."""
    return {
        "pace": body.moving_pace,
        "half": float(np.median(body.pace)),
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
    """``arms_ahead``: share of the time in which both wrists are at least 60 % of an arm in front of the shoulders and
    no lower than 30 cm below them."""
    arm = 0.75 * body.leg
    shoulders = body.own[:, (16, 17), 2]
    ahead = (body.hands[..., 2] - shoulders > 0.6 * 0.8 * arm) & (body.reach_up > -0.3)
    return {"arms_ahead": float(ahead.all(axis=1).mean())}


def carries(body: Body) -> Measures:
    """``hands_kept``: share of the time in which both wrists are in front of the body (12 cm or more), between hip and
    shoulder height, 15 to 100 cm apart. ``swing``: metres that the distance between left and right wrist along the
    way changes (10th to 90th percentile): arms that hold nothing swing."""
    hands = body.hands
    apart = np.linalg.norm(hands[:, 0] - hands[:, 1], axis=-1)
    level = (body.reach_up < 0.1) & (body.p[:, (20, 21), 1] > body.p[:, :1, 1] - 0.15)
    held = ((hands[..., 2] > 0.12) & level).all(axis=1) & (apart > 0.15) & (apart < 1.0)
    gap = hands[:, 0, 2] - hands[:, 1, 2]
    return {
        "hands_kept": float(held.mean()),
        "swing": float(np.percentile(gap, 90) - np.percentile(gap, 10)),
    }


def skips(body: Body) -> Measures:
    """``flights``: times both feet were 3 cm off the floor. ``bounce``: metres the pelvis goes up and down (10th to
    90th percentile)."""
    pelvis = body.p[:, 0, 1]
    return {
        "flights": len(g.airborne(body.p, clearance=0.03)),
        "bounce": float(np.percentile(pelvis, 90) - np.percentile(pelvis, 10)),
    }


def stops(body: Body) -> Measures:
    """``pace_end``: m/s, mean of the last 0.6 s. ``height_end``: leg lengths of the pelvis over the floor at the end.
    ``flights``: times both feet were off the floor."""
    last = max(1, round(0.6 * body.fps))
    return {
        "pace_end": float(body.pace[-last:].mean()),
        "flights": len(body.flights),
        "height_end": body.at_end(body.height),
    }


def starts(body: Body) -> Measures:
    """``pace_start``: m/s, mean of the first 0.4 s. ``pace_end``: m/s, mean of the last second. ``height_start``: leg
    lengths of the pelvis over the floor at the start. ``flights``: times both feet were off the floor."""
    first, last = max(1, round(0.4 * body.fps)), max(1, round(body.fps))
    return {
        "pace_start": float(body.pace[:first].mean()),
        "pace_end": float(body.pace[-last:].mean()),
        "top": float(np.percentile(body.pace, 95)),
        "height_start": body.at_start(body.height),
        "flights": len(body.flights),
    }


def changes_pace(body: Body) -> Measures:
    """``first``, ``last``: m/s over the first and the last second, mean. ``gain``: the last over the first, m/s.
    ``walks``: seconds between 0.4 and 1.9 m/s."""
    n = max(1, round(body.fps))
    first, last = float(body.pace[:n].mean()), float(body.pace[-n:].mean())
    strolls = (body.pace > 0.4) & (body.pace < 1.9)
    return {
        "first": first,
        "last": last,
        "gain": last - first,
        "walks": float(strolls.mean() * body.seconds),
    }
