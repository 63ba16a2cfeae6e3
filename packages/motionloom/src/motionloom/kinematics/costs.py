"""What it costs a body to move its joints, and how far its limbs reach: tables by the names of joints.

A name without a side, such as ``knee``, is for both sides. What solves for poses reads these tables by joint number
(`by_number`); everything about one quantity is in one table.
"""

from collections.abc import Mapping
from typing import TypeVar

from motionloom.core.skeleton import SMPL22

T = TypeVar("T")

BALL_TURN: Mapping[str, float] = {
    "pelvis": 0.15,
    "hip": 0.5,
    "spine1": 0.15,
    "spine2": 0.15,
    "spine3": 0.15,
    "neck": 0.2,
    "collar": 0.1,
    "shoulder": 0.6,
    "ankle": 0.3,
}
"""Radians by which joints that turn freely usually may, when a pose is fitted."""
HINGE_TURN: Mapping[str, float] = {"knee": 0.6, "elbow": 0.8}
"""The same of joints that bend about one axis."""
BONE_SWING: Mapping[str, float] = {
    "spine1": 0.05,
    "spine2": 0.05,
    "spine3": 0.05,
    "neck": 0.2,
    "collar": 0.15,
    "shoulder": 0.5,
    "elbow": 0.5,
    "hip": 0.35,
    "knee": 0.5,
    "ankle": 0.3,
    "pelvis": 0.02,
}
"""Radians by which the bones beyond a joint may be off in what is sampled."""
SLACK: Mapping[str, float] = {"elbow": 0.15, "wrist": 0.25, "knee": 0.15, "ankle": 0.3, "foot": 0.3}
"""Metres that a joint can go before the root must come along; `TRUNK_SLACK` for all others."""
TRUNK_SLACK = 0.1
REACH: Mapping[str, tuple[str, float]] = {
    "wrist": ("shoulder", 0.48),
    "elbow": ("shoulder", 0.25),
    "ankle": ("hip", 0.79),
    "foot": ("hip", 0.85),
}
"""Where limbs begin, and metres that they reach without being quite straight."""
BASE: Mapping[str, str] = {
    "spine1": "pelvis",
    "spine2": "pelvis",
    "spine3": "pelvis",
    "neck": "pelvis",
    "head": "pelvis",
    "collar": "pelvis",
    "shoulder": "pelvis",
    "knee": "hip",
    "ankle": "hip",
    "foot": "hip",
    "elbow": "shoulder",
    "wrist": "shoulder",
}
"""The joint from which another's reach is measured."""
LEG = ("knee", "ankle", "foot")


def numbers(name: str) -> tuple[int, ...]:
    """Numbers of a joint of `SMPL22`: of the left and the right one for a name without a side."""
    if name in SMPL22.names:
        return (SMPL22.index(name),)
    return SMPL22.index(f"left_{name}"), SMPL22.index(f"right_{name}")


def by_number(table: Mapping[str, T]) -> dict[int, T]:
    """A table by joint number, in its own order, the left side before the right."""
    return {number: value for name, value in table.items() for number in numbers(name)}


def beside(joint: int, name: str) -> int:
    """The number of the joint of that name on the side of another; the only one where there is one."""
    return numbers(name)[-1 if SMPL22.names[joint].startswith("right_") else 0]


LEGS: tuple[tuple[int, int, int], ...] = tuple(zip(*map(numbers, LEG), strict=True))
"""Knee, ankle and foot, the left leg before the right: in the order of the contacts."""
