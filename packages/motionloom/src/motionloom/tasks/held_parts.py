"""Parts of a prediction that are held to another motion."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.blending import smoothstep
from motionloom.errors import MotionloomError
from motionloom.features.humanml import positions_at
from motionloom.goals.hold import FixedJoints, FixedPart
from motionloom.motion import Motion
from motionloom.retarget import to_smpl22
from motionloom.skeleton import SMPL22
from motionloom.tasks.completion import Known
from motionloom.tasks.splice import concatenate, ground_pose_at, kept_parts, move_on_floor, overlay
from motionloom.tasks.windows import CONTEXT, Past
from motionloom.weights.predictor import Predictor

Array = NDArray[np.float64]

RAMP = 0.2
"""Seconds over which a part that is held for a while fades in and out."""
NEAR = (0.3, np.radians(20))
"""Metres and radians within which a source already goes on from the clip and is not moved there."""


@dataclass(frozen=True, eq=False)
class HeldParts:
    """A `FixedJoints`, ready: on the grid of the predictor for the network, on the past's skeleton for the result."""

    places: Array
    """(frames, 22, 3) the source as the uniform person at the predictor's rate, from the first frame to predict."""
    mask: NDArray[np.float32]
    """(frames, 22)"""
    source: Motion
    joints: Array
    """(frames, joints of the skeleton) weights."""
    way: Array
    """(frames,) weight of the place."""

    def known(self, first: int, last: int) -> Known | None:
        """What the network knows of the frames ``first`` to before ``last`` behind the past (1 is the first)."""
        frames = slice(first - 1, min(last - 1, len(self.places)))
        if first - 1 >= len(self.places) or not self.mask[frames].any():
            return None
        return Known(self.places[frames], self.mask[frames])

    def overlay_on(self, new: Motion, done: int) -> Motion:
        """A piece that begins ``done`` frames behind the past, with the held parts there."""
        count = min(len(new), len(self.source) - done)
        if count <= 0:
            return new
        here = slice(done, done + count)
        held = overlay(new.frames(0, count), self.source.frames(done, done + count), self.joints[here], self.way[here])
        return concatenate(held, new.frames(count, len(new))) if count < len(new) else held


def prepare_hold(predictor: Predictor, history: Past, hold: FixedJoints, seconds: float) -> HeldParts:
    """The held parts for a past and a horizon; raises MotionloomError for parts that cannot be held."""
    past = history.motion
    check_like(past, hold.source, "motion that parts are held to")
    _check_parts(hold, seconds)
    rate, total = history.rate, max(round(seconds * past.fps), 1)
    source = _moved_to_past(past, hold.source) if hold.align else hold.source
    source = source.frames(0, total + int(np.ceil(predictor.frames / rate)))  # the last window looks further
    end = len(source) / past.fps
    tail = past.frames(max(len(past) - round(CONTEXT * past.fps) - 2, 0), len(past))
    together = to_smpl22(concatenate(tail, source)).positions()
    together = together + (history.person[-1, 0] - together[len(tail) - 1, 0])
    count = int(len(source) * rate + 1e-6)
    places = positions_at(together, len(tail) - 1 + np.arange(1, count + 1) / rate)
    source = concatenate(source, *[source.frames(len(source) - 1, len(source))] * round(RAMP * past.fps))
    mask = np.zeros((count, predictor.layout.parts), dtype=np.float32)
    joints, way = np.zeros((len(source), len(past.skeleton))), np.zeros(len(source))
    for part in hold.parts:
        chosen, root = _resolve_joints(part)
        spans = [(begin, min(until, end)) for begin, until in part.spans if begin < end]
        inside = _weights(spans, np.arange(1, count + 1) / predictor.fps, 0.0) >= 1
        for joint in chosen | ({0} if root else set()):
            mask[inside, predictor.layout.part(joint)] = 1
        weight = _weights(spans, np.arange(1, len(source) + 1) / past.fps, RAMP)
        flags = _joint_flags(past, chosen)
        joints = np.maximum(joints, weight[:, None] * flags)
        way = np.maximum(way, weight * root)
    return HeldParts(places, mask, source, joints, way)


def _joint_flags(past: Motion, chosen: frozenset[int] | set[int]) -> Array:
    """(joints,) 1 for the past's joints that correspond to some of the 22, and for what hangs on them."""
    always = kept_parts(past.skeleton).joints
    flags = kept_parts(past.skeleton, frozenset(chosen)).joints & ~always
    for joint, parent in enumerate(past.skeleton.parents):
        flags[joint] |= always[joint] and parent >= 0 and flags[parent]
    return flags.astype(np.float64)


def _weights(spans: Sequence[tuple[float, float]], times: Array, ramp: float) -> Array:
    """1 within spans of seconds, falling to 0 within ``ramp`` seconds around them."""
    weight = np.zeros(len(times))
    for begin, end in spans:
        outside = (np.maximum(begin - times, times - end) - 1e-6).clip(0)
        weight = np.maximum(weight, smoothstep(1 - outside / ramp) if ramp else outside == 0)
    return weight


def _resolve_joints(part: FixedPart) -> tuple[set[int], bool]:
    joints = set(SMPL22.resolve(name for name in part.joints if name != "root"))
    return joints, "root" in part.joints or 0 in joints


def _moved_to_past(past: Motion, source: Motion) -> Motion:
    """The source where the past ends, if it is not there."""
    end, begin, before = (
        ground_pose_at(past, len(past) - 1),
        ground_pose_at(source, 0),
        ground_pose_at(past, max(len(past) - 2, 0)),
    )
    metres, radians = end.apart(begin)
    if radians < NEAR[1] and metres < NEAR[0]:
        return source
    return move_on_floor(source, begin, replace(end, x=2 * end.x - before.x, z=2 * end.z - before.z))


def check_like(past: Motion, other: Motion, what: str) -> None:
    """Raise MotionloomError unless both are of one skeleton and rate, and both with or without moving bones."""
    if other.skeleton != past.skeleton:
        raise MotionloomError(
            f"the {what} has another skeleton ({len(other.skeleton)} joints, the past {len(past.skeleton)}); "
            "retarget it to the past's first"
        )
    if (other.translations is None) != (past.translations is None):
        raise MotionloomError(
            f"the {what} and the past must both have bones of constant length, or both have moving ones"
        )
    if abs(other.fps - past.fps) > 1e-3 * past.fps:
        raise MotionloomError(f"the {what} has {other.fps:g} fps and the past {past.fps:g}; resample it first")


def _check_parts(hold: FixedJoints, seconds: float) -> None:
    known = ("root", *SMPL22.groups, *SMPL22.names)
    names = [name for part in hold.parts for name in part.joints]
    unknown = [name for name in names if name not in known]
    if unknown:
        raise MotionloomError(f"no part called {unknown[0]!r} to hold; the parts are {', '.join(known)}")
    if not names or not any(part.spans for part in hold.parts):
        raise MotionloomError(f"nothing to hold: no joint is named; the parts are {', '.join(known)}")
    for begin, end in (span for part in hold.parts for span in part.spans):
        _check_span(begin, end, hold.source, seconds)
    everywhere = [p for p in hold.parts if any(a <= 0 and b >= seconds for a, b in p.spans)]
    joints = set().union(*(_resolve_joints(part)[0] for part in everywhere)) if everywhere else set()
    if len(joints) == len(SMPL22):
        raise MotionloomError("nothing to predict: all joints are held; hold fewer")


def _check_span(begin: float, end: float, source: Motion, seconds: float) -> None:
    long = len(source) / source.fps
    if not 0 <= begin < end:
        raise MotionloomError(
            f"no stretch from {begin:g} to {end:g} s to hold; give a start of 0 or more below the end"
        )
    if begin >= min(seconds, long):
        raise MotionloomError(
            f"nothing to hold from {begin:g} s on: {seconds:g} s are predicted, and the motion that parts are held "
            f"to is {long:g} s long"
        )
    if np.isfinite(end) and min(end, seconds) > long + 0.5 / source.fps:
        raise MotionloomError(
            f"parts are held until {end:g} s and the motion they come from is {long:g} s long; hold them for less or "
            "give a longer one"
        )
