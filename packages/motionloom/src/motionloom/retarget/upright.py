"""Which way is up in a recording that does not say so: by the floor, by who stands, and by the rest pose.

What somebody does on the ground shows where it is: the lowest joints are at one height, which is the origin's in most
files, and those that touch it rest there for a while. People are upright more often than not, head above feet. A rest
pose that stands says how the file was meant, though some programs write one with another axis up than the motion's.
"""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Poses
from motionloom.retarget.anatomy import Body, read_body
from motionloom.retarget.axes import FEET, HEAD, unit
from motionloom.retarget.joint_map import Override

Array = NDArray[np.float64]

_HALF, _QUARTER = np.pi, np.pi / 2
AXES: Mapping[str, tuple[Array, Array]] = {
    name: (np.array(axis, dtype=np.float64), np.array(turn, dtype=np.float64))
    for name, axis, turn in (
        ("y", (0, 1, 0), (0, 0, 0)),
        ("z", (0, 0, 1), (-_QUARTER, 0, 0)),
        ("x", (1, 0, 0), (0, 0, _QUARTER)),
        ("y-down", (0, -1, 0), (_HALF, 0, 0)),
        ("z-down", (0, 0, -1), (_QUARTER, 0, 0)),
        ("x-down", (-1, 0, 0), (0, 0, -_QUARTER)),
    )
}
"""What may be up, by its name in ``--up``: the direction, and the rotation vector (radians) that turns it to +Y."""
_LEVEL, _TALL, _AT_REST, _UNEVEN = 3.5, 5.0, 0.85, -1.1
"""Weights of what is seen (`_look`): a logistic regression over 2,223 recordings, parts of them, and copies whose
origin is the pelvis, each against four wrong axes."""
_REST = 4.0
"""Weight of a rest pose that stands: more than what is seen of those who lie, less than of those who walk."""
_SELDOM = {"y": 0.5, "z": 0.0}
"""A format's usual axes, and how much more usual; the others are -3."""
SURE = 3.3
"""How far the best axis is ahead of the next where it is sure."""
_ENOUGH = 20_000
"""Frames, from all over the recording, that are looked at."""


@dataclass(frozen=True)
class Up:
    """Which way is up, as far as a recording shows it."""

    axis: str
    """One of `AXES`."""
    sure: bool
    """Whether all that is seen agrees; else another axis is nearly as likely, as where somebody lies all the time."""


def up_of(places: Array, fps: float, leg: float, rest: Array | None = None) -> Up:
    """Which way is up, by what the 22 joints do.

    Args:
        places: (frames, 22, 3) the joints of `SMPL22`, in any unit of length.
        fps: frames per second.
        leg: length of thigh and shin in that unit.
        rest: (3,) up in a rest pose that is a standing person; None where there is none.
    """
    places = places / max(leg, 1e-9)
    tall = unit(places[:, HEAD] - places[:, FEET].mean(axis=1)).mean(axis=0)
    steps = (
        np.linalg.norm(np.gradient(places, axis=0), axis=-1) * fps if len(places) > 1 else np.zeros(places.shape[:2])
    )
    seen = {name: _look(places @ axis, steps < 0.4, float(tall @ axis)) for name, (axis, _) in AXES.items()}
    scores = {name: one.score + _SELDOM.get(name, -3.0) for name, one in seen.items()}
    moving = max(scores, key=lambda name: scores[name])
    if rest is not None:
        scores = {name: score + _REST * max(0.0, float(rest @ AXES[name][0])) for name, score in scores.items()}
    best, second = sorted(scores, key=lambda name: -scores[name])[:2]
    lies = [name for name in _SELDOM if rest is None and seen[name].bears_instead_of(seen[best])]
    sure = best == moving and not lies and scores[best] - scores[second] > SURE
    flat = [name for name in lies if seen[name].level > 0.8 and seen[name].at_rest > 1.9 and seen[best].level < 0.1]
    return Up(flat[0] if flat else best, sure)


@dataclass(frozen=True)
class _Seen:
    """What is seen along one axis."""

    level: float
    """1 where the lowest joints are at the origin's height, 0 where they are far from it."""
    at_rest: float
    """How many joints rest on the floor, at most 4, the mean over time."""
    score: float
    """How much speaks for the axis."""

    def bears_instead_of(self, other: "_Seen") -> bool:
        """Whether who seems to stand along the other axis may as well lie on a floor that is square to this one."""
        return self.at_rest > 1 and self.level > other.level + 0.4


def _look(heights: Array, slow: NDArray[np.bool_], tall: float) -> _Seen:
    """heights: (frames, 22) along an axis, in legs; slow: (frames, 22) bool; tall: mean cosine between it and the
    person."""
    lowest = heights.min(axis=1)
    floor, low, high = np.percentile(lowest, [5, 10, 90])
    level = max(0.0, 1.0 - abs(float(floor)) / 0.3)
    at_rest = float(np.minimum((slow & (heights < floor + 0.12)).sum(axis=1), 4).mean())
    uneven = min(float(high - low), 0.6)
    return _Seen(level, at_rest, _LEVEL * level + _TALL * max(tall, -0.3) + _AT_REST * at_rest + _UNEVEN * uneven)


def leg_length(places: Array) -> float:
    """Length of thigh and shin, mean of both sides, the median over (frames, 22, 3)."""
    bones = [
        np.linalg.norm(places[:, low] - places[:, high], axis=-1) for high, low in ((1, 4), (4, 7), (2, 5), (5, 8))
    ]
    return float(np.median(np.sum(bones, axis=0))) / 2


def up_axis(motion: Motion, override: Override | None = None) -> Up:
    """Which way is up in a motion as its file has it; raises `MotionloomError` if the skeleton is no humanoid."""
    body, motion = read_body(motion.skeleton, override), motion.thinned(_ENOUGH)
    places = body.places(motion.positions(), motion.world_rotations())
    return up_of(places, motion.fps, body.leg, body.up if body.upright else None)


def set_upright(motion: Motion, path: Path | str, up: str | None = None, *, override: Override | None = None) -> Motion:
    """A motion as its file has it, with +Y up; warns where it was turned, and where it is not certain what is up.

    Args:
        motion: as read.
        path: its file, for the remarks.
        up: one of `AXES`, which is followed whatever is seen; None: what is seen. What is no person stays.
        override: which joints are which.
    """
    try:
        seen, body = up_axis(motion, override), read_body(motion.skeleton, override)
    except MotionloomError:  # no person: nothing is known
        return motion if up is None else _turned(motion, up, None)
    axis, stands = _decided(seen, path, up), not body.upright or float(body.up[1]) > 0.9
    return motion if axis == "y" and (up is None or stands) else _turned(motion, axis, body)


def upright_places(places: Array, fps: float, path: Path | str, up: str | None = None) -> Array:
    """The 22 joints (frames, 22, 3) of a file whose format has +Y up, turned where ``up`` says so.

    Warns where it is not certain that +Y is up; raises `MotionloomError` where another axis surely is.
    """
    seen = up_of(places, fps, leg_length(places))
    if up is None and seen.sure and seen.axis != "y":
        raise MotionloomError(
            f"{_words(seen.axis)} in {path}, as the person moves; say --up {seen.axis}, or --up y if it is not so"
        )
    axis = _decided(seen if up or seen.axis == "y" else Up("y", False), path, up)
    return rot.rotate(rot.rotvec_to_quat(AXES[axis][1]), places)


def _decided(seen: Up, path: Path | str, up: str | None) -> str:
    """The axis that is taken, with a warning where somebody may want another."""
    axis = seen.axis if up is None else up
    if up is not None and seen.sure and seen.axis != up:
        _warn(f"--up {up} is followed, though {_words(seen.axis)} in {path} as the person moves")
    elif up is None and not seen.sure:
        other = "y" if axis != "y" else "z"
        _warn(f"it is not certain which way is up in {path}; --up {axis} is assumed (else say --up {other})")
    elif up is None and axis != "y":
        _warn(f"{_words(axis)} in {path}, as the person moves; it was turned (--up y leaves it)")
    return axis


def _warn(message: str) -> None:
    warnings.warn(message, stacklevel=5)


def _words(axis: str) -> str:
    name, _, down = axis.partition("-")
    return f"{name.upper()} is {down or 'up'}"


def _turned(motion: Motion, axis: str, body: Body | None) -> Motion:
    """The motion as a file with +Y up would have it: a rest pose that stands is turned to stand along +Y as well."""
    turn = rot.rotvec_to_quat(AXES[axis][1])
    if body is None or not body.upright:
        rest = rot.IDENTITY
    elif float(AXES[axis][0] @ body.up) > 0.9:
        rest = turn
    else:
        rest = rot.shortest_arc(body.up, AXES["y"][0])
    skeleton, poses = motion.skeleton, Poses(motion.root, motion.rotations, motion.translations)
    skeleton = replace(
        skeleton,
        offsets=rot.rotate(rest, skeleton.offsets),
        soles={joint: rot.rotate(rest, points) for joint, points in skeleton.soles.items()},
        poses=None if skeleton.poses is None else _turned_poses(skeleton.poses, turn, rest),
    )
    return Motion(skeleton, motion.fps, **vars(_turned_poses(poses, turn, rest)))


def _turned_poses(poses: Poses, turn: Array, rest: Array) -> Poses:
    """Poses turned in the world, on a skeleton whose rest pose is turned."""
    rotations = rot.multiply(rot.multiply(rest, poses.rotations), rot.inverse(rest))
    rotations[:, 0] = rot.multiply(rot.multiply(turn, poses.rotations[:, 0]), rot.inverse(rest))
    moved = poses.translations
    return Poses(rot.rotate(turn, poses.root), rotations, None if moved is None else rot.rotate(rest, moved))
