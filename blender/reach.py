"""Hands and feet brought to their goals on the armature itself, whose limbs are not those of the server's person."""

from itertools import pairwise

import numpy as np

from . import quaternions as quat

CHAINS = {
    f"{side}_{end}": tuple(f"{side}_{part}" for part in chain)
    for side in ("left", "right")
    for end, chain in {
        "wrist": ("shoulder", "elbow", "wrist"),
        "ankle": ("hip", "knee", "ankle"),
        "foot": ("hip", "knee", "ankle"),
    }.items()
}
"""Joint to the three that bend a limb."""
EASE = 0.5
"""Seconds before the first and behind the last goal over which a limb comes and goes."""
MISSED = 0.02
"""Metres beyond which it is said that a goal was missed."""


def reached(body, moves, goals):
    """The motion (of the scene's frames) with its limbs bent to their goals, and sentences about what is still missed.

    body: a settled `Body`. moves: a `Moves` of it, changed in place. goals: of `jobs.Goal`.
    """
    for joint in {goal.joint for goal in goals} & CHAINS.keys():
        chain = [body.bone(part) for part in CHAINS[joint]]
        if None not in chain and all(bone in moves.names for bone in chain):
            _bend(body, moves, joint, chain, goals)
    sentences = []
    for goal in goals:
        apart = [
            np.linalg.norm(wanted - _place(body, moves, goal.joint)[at]) for at, wanted in _wanted(body, moves, [goal])
        ]
        worst = max(apart, default=0.0)
        if worst > MISSED:
            sentences.append(f"{goal.label}: {goal.joint.replace('_', ' ')} is up to {worst:.2f} m away from it")
    return moves, sentences


def _wanted(body, moves, goals):
    """(frame, (3,) in the server's world) of goals, rising."""
    found = {}
    for goal in goals:
        for time, place in goal.points:
            found[min(round(time * moves.fps), len(moves) - 1)] = body.inside(place)
    return sorted(found.items())


def _place(body, moves, joint):
    """(frames, 3) of a joint of the server's."""
    return np.mean([moves.places[:, moves.names.index(bone)] for bone in body.joints[joint]], axis=0)


def _bend(body, moves, joint, chain, goals):
    """Bend one limb so that its joint is where its goals are, and near them in time nearly so."""
    wanted = _wanted(body, moves, [goal for goal in goals if goal.joint == joint])
    offsets = _eased(wanted, _place(body, moves, joint), round(EASE * moves.fps))
    upper, lower, end = (moves.names.index(bone) for bone in chain)
    below = [_below(moves.parents, top) for top in (upper, lower, end)]
    for frame in np.flatnonzero(np.linalg.norm(offsets, axis=1) > 1e-5):
        places, turns = moves.places[frame], moves.turns[frame]
        a, b, c = places[upper], places[lower], places[end].copy()
        held, apart = turns[below[2]].copy(), places[below[2]] - c
        target = c + offsets[frame]
        lengths = np.linalg.norm(b - a), np.linalg.norm(c - b)
        _turn(places, turns, below[0], quat.arc(b - a, _middle(a, b, target, lengths=lengths) - a))
        _turn(places, turns, below[1], quat.arc(places[end] - places[lower], target - places[lower]))
        turns[below[2]], places[below[2]] = held, apart + places[end]  # hands and feet keep their direction


def _below(parents, top):
    """A joint and all that hang on it, itself first."""
    found = [top]
    for joint in range(top + 1, len(parents)):
        if parents[joint] in found:
            found.append(joint)
    return found


def _turn(places, turns, joints, turn):
    """Turn joints about the first of them, in place."""
    centre = places[joints[0]].copy()
    places[joints] = quat.rotate(turn[None], places[joints] - centre) + centre
    turns[joints] = quat.multiply(turn[None], turns[joints])


def _middle(a, b, target, *, lengths):
    """(3,) where the elbow or knee is that bends as b does now between a and a target."""
    upper, lower = lengths
    along = target - a
    far = float(np.clip(np.linalg.norm(along), abs(upper - lower) * 1.001, (upper + lower) * 0.9999))
    along = along / np.linalg.norm(along)
    out = (b - a) - ((b - a) @ along) * along
    if np.linalg.norm(out) < 1e-6:
        out = np.cross(along, [along[2], along[0], along[1]])
    near = (far * far + upper * upper - lower * lower) / (2 * far)
    return a + near * along + np.sqrt(max(upper * upper - near * near, 0.0)) * out / np.linalg.norm(out)


def _eased(wanted, places, ease):
    """(frames, 3) metres by which a joint is moved: all that lacks at its goals, and smoothly less around them."""
    offsets = np.zeros_like(places)
    lacks = [(frame, place - places[frame]) for frame, place in wanted]
    first, last = lacks[0], lacks[-1]
    lacks = [(first[0] - ease, np.zeros(3)), *lacks, (last[0] + ease, np.zeros(3))]
    for (begin, a), (end, b) in pairwise(lacks):
        for frame in range(max(begin, 0), min(end, len(places) - 1) + 1):
            share = (frame - begin) / max(end - begin, 1)
            offsets[frame] = a + (b - a) * share * share * (3 - 2 * share)
    return offsets
