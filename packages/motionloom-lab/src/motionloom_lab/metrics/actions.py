"""One clip of motion as a row of named numbers, which the obedience checks compare.

``positions`` (frames, 22, 3) metres on the uniform person, SMPL order, the floor near y = 0.
"""

import numpy as np

from motionloom.core.reading import read_table
from motionloom.kinematics import gestures as g
from motionloom.kinematics import physics as ph
from motionloom.kinematics.physics import Array, J
from motionloom.kinematics.wholeness import wholeness

Measures = dict[str, float]

MEANING: dict[str, str] = read_table("motionloom_lab.suites", "actions.toml")
"""What each number is."""


def measure(positions: np.ndarray, fps: float) -> Measures:
    """All numbers of `MEANING` for one clip, rounded to four places."""
    p = np.asarray(positions, dtype=np.float64)
    values = {**_path(p, fps), **_legs(p, fps), **_arms(p, fps), **_posture(p, fps), "whole": wholeness(p)}
    return {name: round(float(value), 4) for name, value in values.items()}


def _path(p: Array, fps: float) -> Measures:
    own = ph.smooth(ph.root_velocity_in_heading(p, fps), ph.odd(fps / 4))
    left, _, forward = own.mean(axis=0) * (len(p) - 1) / fps
    travel = ph.travel(p, fps)
    turning = np.abs(ph.velocity(ph.smooth(ph.heading(p), ph.odd(fps / 4)), fps))
    pace = ph.speed(p, fps)
    return {
        "travel": travel,
        "pace": float(np.median(pace[pace > 0.3])) if (pace > 0.3).any() else 0.0,
        "gap": float(np.linalg.norm(p[-1, 0, [0, 2]] - p[0, 0, [0, 2]])) / max(travel, 0.3),
        "advance": forward,
        "sidestep": abs(left),
        "facing_share": forward / max(travel, 0.3),
        "side_share": abs(left) / max(travel, 0.3),
        "top_pace": float(np.percentile(pace, 90)),
        "turn": float(np.degrees(ph.turn(p))),
        "winding": float(abs(np.degrees(ph.winding(p, fps)))),
        "turning": float(np.degrees(turning.mean())),
        "rise": g.stance_rise(p, fps),
    }


def _legs(p: Array, fps: float) -> Measures:
    flights = [f for f in g.airborne(p) if f.stop - f.start < fps]  # longer is a ladder or a rope
    kick, kick_speed = g.kick_reach(p, fps)
    feet = ph.smooth(g.limb_speed(p, fps, ph.ANKLES), 3)
    apart = np.abs(p[:, ph.ANKLES[0], 1] - p[:, ph.ANKLES[1], 1])
    return {
        "flights": len(flights),
        "one_leg": g.longest(apart > 0.12) / fps,
        "steps": sum(g.foot_height_peaks(p)),
        "kick_height": float(apart.max() / g.leg_length(p)),
        "kick_snap": float(ph.smooth(g.foot_extension_speed(p, fps), 3).max()),
        "foot_speed": float(np.percentile(feet.max(axis=1), 98)),
        "jump_rise": max((f.rise for f in flights), default=0.0),
        "jump_clearance": max((f.clearance for f in flights), default=0.0),
        "hops": max(g.single_foot_hops(p)),
        "kick": kick,
        "kick_speed": kick_speed,
        "leg_energy": float(feet.mean()),
    }


def _arms(p: Array, fps: float) -> Measures:
    shoulders = p[:, ph.WRISTS, 1] - p[:, (J["left_shoulder"], J["right_shoulder"]), 1]
    hands = ph.smooth(g.limb_speed(p, fps, ph.WRISTS), 3)
    return {
        "hands_up": g.longest((g.hands_height(p, over="neck") > 0).all(axis=1)) / fps,
        "both_over_head": g.hands_height(p).min(axis=1).max(),
        # 5 cm below still counts: the wrist is not the hand
        "arms_raised": g.longest((shoulders > -0.05).all(axis=1)) / fps,
        "hand_over_neck": g.hands_height(p, over="neck").max(),
        "wave_swings": max(g.wrist_swings(p, fps, amplitude=0.04)),
        "punch_speed": g.wrist_thrust(p, fps).max(),
        "hand_speed": float(np.percentile(hands.max(axis=1), 98)),
        "arm_energy": float(hands.mean()),
    }


def _posture(p: Array, fps: float) -> Measures:
    height = ph.smooth(g.pelvis_height(p), 3)
    bend = np.degrees(ph.smooth(g.forward_bend(p), 3))
    stir = np.linalg.norm(ph.velocity(ph.smooth(p, 3), fps), axis=-1)
    low, lowest = np.asarray(height < 0.85), np.asarray(height <= np.percentile(height, 10))
    ahead = ph.in_body(p)[:, ph.ANKLES, 2].mean(axis=1) / g.leg_length(p)
    return {
        "pelvis_low": float(np.percentile(height, 2)),
        "low_seconds": g.longest(low) / fps,
        "low_still": float(np.median(ph.speed(p, fps)[low])) if low.any() else 9.0,
        "bend": float(np.percentile(bend, 98)),
        "bend_when_low": float(np.median(bend[lowest])),
        "feet_ahead_when_low": float(np.median(ahead[lowest])),
        "knees": float(np.percentile(np.degrees(ph.smooth(g.knee_bend(p), 3)).min(axis=1), 98)),
        "mean_stir": float(stir.mean()),
        "stir": float(np.percentile(stir.max(axis=1), 90)),
    }
