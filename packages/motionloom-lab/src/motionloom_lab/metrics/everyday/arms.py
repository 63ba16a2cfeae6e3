"""What arms and hands do: raised, clapping, pointing, and everyday gestures."""

import numpy as np

from motionloom.kinematics import gestures as g
from motionloom.kinematics import physics as ph
from motionloom_lab.metrics.actions import Measures
from motionloom_lab.metrics.everyday.body import ELBOWS, HIPS, SHOULDERS, WRISTS, Body, times


def raises(body: Body, side: int) -> Measures:
    """``held``: seconds the wanted wrist stays at its shoulder or higher while the other hangs 20 cm below its own.
    ``other``: seconds the other wrist does so. ``times``: how often the wanted wrist comes up from 25 cm below the
    shoulder to its height."""
    own, other = body.reach_up[:, side], body.reach_up[:, 1 - side]
    return {
        "held": body.held((own > 0.0) & (other < -0.2)),
        "other": body.held(other > 0.0),
        "times": times(own, -0.25, 0.0),
    }


def both_up(body: Body) -> Measures:
    """``held``: seconds both wrists stay above the head's joint."""
    over = body.p[:, WRISTS, 1] - body.p[:, 15:16, 1]
    return {"held": body.held((over > 0.0).all(axis=1))}


def claps(body: Body) -> Measures:
    """``claps``: times the wrists come together, from 10 cm more than at their closest to 5 cm more. ``closest``:
    metres between the wrists at the closest. ``where``: share of the claps' time (wrists within 7 cm of their
    closest) in which they are in front of the body between hip and head."""
    gap = np.linalg.norm(body.p[:, WRISTS[0]] - body.p[:, WRISTS[1]], axis=-1)
    closest = float(np.percentile(gap, 3))
    near = gap < closest + 0.07
    hands = body.p[:, WRISTS, 1].mean(axis=1)
    front = (body.hands[..., 2].mean(axis=1) > 0.1) & (hands > body.p[:, 0, 1]) & (hands < body.p[:, 15, 1] + 0.15)
    return {
        "claps": times(-gap, -(closest + 0.10), -(closest + 0.05)),
        "closest": closest,
        "where": float(front[near].mean()),
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
    """``held``: seconds both wrists stay within 22 cm of the hip joints or the waist beside them, the elbows 8 cm or
    more farther out than the wrists."""
    waist = body.p[:, HIPS] + [0.0, 0.12, 0.0]
    near = np.linalg.norm(body.p[:, WRISTS] - waist, axis=-1) < 0.22
    out = np.abs(body.own[:, ELBOWS, 0]) - np.abs(body.own[:, WRISTS, 0]) > 0.06
    return {"held": body.held((near & out).all(axis=1))}


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
    return {"held": body.held(((side > 0.35) & level).all(axis=1))}


def waves(body: Body, side: int) -> Measures:
    """``swings``: to and fro of 4 cm or more of the wanted hand while it is above the chest. ``other``: the same of the
    other hand. ``height``: metres of the wanted wrist over the neck at the most."""
    swings = g.wrist_swings(body.p, body.fps, amplitude=0.04)
    return {
        "swings": swings[side],
        "other": swings[1 - side],
        "height": float(body.p[:, WRISTS[side], 1].max() - np.median(body.p[:, 12, 1])),
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
    crown. ``from``: metres that wrist was below the neck at its lowest, before or after."""
    mouth = body.p[:, 15] + 0.1 * body.front
    gap = np.linalg.norm(body.p[:, WRISTS] - mouth[:, None], axis=-1)
    near = (gap < 0.28) & (body.p[:, WRISTS, 1] < body.p[:, 15:16, 1] + 0.15)
    side = max((0, 1), key=lambda s: body.held(near[:, s]))
    drop = body.p[:, 12, 1] - body.p[:, WRISTS[side], 1]
    return {
        "held": body.held(near[:, side]),
        "from": float(np.percentile(drop, 97)),
        "lean": float(np.percentile(body.lean, 95)),
    }


def picks_up(body: Body) -> Measures:
    """``hand``: metres of the lower wrist over the floor at its lowest. ``after``: the same in the last half second.
    ``over``: degrees the trunk leans at the most."""
    wrists = body.p[:, WRISTS, 1]
    side = int(np.argmin(wrists.min(axis=0)))
    return {
        "hand": float(wrists[:, side].min()),
        "after": body.at_end(wrists[:, side]),
        "over": float(body.lean.max()),
    }


def throws(body: Body) -> Measures:
    """The stroke in which a wrist goes forward fastest. ``speed``: m/s of that wrist forward against the body.
    ``back``: metres that the same wrist was behind its place in that moment, within 0.6 s before. ``height``: metres
    that wrist was above its shoulder at the most, from 0.6 s before to the stroke. ``lean``: degrees the trunk leans
    at the most. ``pace``: m/s of the pelvis, median."""
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
    ``reach``: metres in front of the pelvis then. ``start``: metres in front at the start. ``moved``: metres it goes
    over the ground plane in the body's frame while it stays 15 cm in front. ``rise``: metres it goes up and down
    then. ``pace``: m/s of the pelvis at that moment. ``stroke``: m/s of that wrist against the body at the most."""
    level = (body.p[:, WRISTS, 1] > body.p[:, :1, 1] - 0.05) & (body.reach_up < 0.1)
    ahead = np.where(level, body.hands[..., 2], 0.0)
    frame, side = np.unravel_index(int(np.argmax(ahead)), ahead.shape)
    after = slice(frame, frame + max(2, round(body.fps)))
    path, out = body.hands[after, side][:, [0, 2]], ahead[after, side] > 0.15
    moved = np.linalg.norm(path - path[0], axis=-1)
    return {
        "reach": float(ahead[frame, side]),
        "start": body.at_start(body.hands[:, side, 2]),
        "moved": float(moved[out].max()) if out.any() else 0.0,
        "rise": float(np.ptp(body.p[after, WRISTS[side], 1][out])) if out.any() else 9.0,
        "pace": float(body.pace[frame]),
        "stroke": float(body.hand_speed[:, side].max()),
    }
