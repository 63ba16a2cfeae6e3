"""Where things lie in the 263 numbers of a HumanML3D frame, by name, so that nobody writes ``4:67``."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.skeleton import SMPL22

WIDTH = 263
"""Numbers per frame."""
FPS = 20.0
"""Frames per second of the representation."""
FEET: tuple[int, ...] = (7, 10, 8, 11)
"""Joints of the four contact flags: left ankle, left foot, right ankle, right foot."""

LAYOUT: dict[str, slice] = {
    "yaw_velocity": slice(0, 1),
    "root_velocity": slice(1, 3),
    "root_height": slice(3, 4),
    "ric": slice(4, 67),
    "rot6d": slice(67, 193),
    "joint_velocity": slice(193, 259),
    "contacts": slice(259, 263),
}
"""Blocks in order: half yaw angle per frame (rad), root x/z per frame (m), root y (m), places of joints 1..21 (m),
their rotations as the first two *columns* of a matrix, displacements of joints 0..21 per frame (m), foot flags."""


def ric(joint: int) -> slice:
    """The place of joint 1..21: x and z from the root, y above the floor, turned into the heading frame."""
    return slice(4 + 3 * (joint - 1), 4 + 3 * joint)


def rot(joint: int) -> slice:
    """The rotation of joint 1..21: two matrix columns."""
    return slice(67 + 6 * (joint - 1), 67 + 6 * joint)


def vel(joint: int) -> slice:
    """The displacement of joint 0..21 to the next frame, in the heading frame."""
    return slice(193 + 3 * joint, 193 + 3 * (joint + 1))


def mask(names: str | Iterable[str]) -> NDArray[np.bool_]:
    """(263,) True at the numbers that a named control fixes, as in the published control models.

    ``names`` is one string with commas or several: ``root`` (trajectory, height and root displacement),
    ``root_horizontal`` (trajectory only), ``lower_body``, ``upper_body`` (every block of those joints), or a joint or
    joint group of the skeleton, whose *places* are fixed (nothing for ``pelvis``, which has no place of its own).
    """
    names = names.split(",") if isinstance(names, str) else list(names)
    chosen = np.zeros(WIDTH, dtype=bool)
    for name in (n.strip() for n in names):
        chosen |= _one_mask(name)
    return chosen


def _one_mask(name: str) -> NDArray[np.bool_]:
    chosen = np.zeros(WIDTH, dtype=bool)
    if name in ("root", "root_horizontal"):
        chosen[0:3] = True
        if name == "root":
            chosen[LAYOUT["root_height"]] = chosen[vel(0)] = True
    elif name in ("lower_body", "upper_body"):
        chosen[0:4] = chosen[LAYOUT["contacts"]] = True
        for joint in SMPL22.groups["lower_body"]:
            chosen[vel(joint)] = True
            if joint:
                chosen[ric(joint)] = chosen[rot(joint)] = True
        chosen = chosen if name == "lower_body" else ~chosen
    elif name in SMPL22.names or name in SMPL22.groups:
        for joint in SMPL22.resolve([name]):
            if joint:
                chosen[ric(joint)] = True
    else:
        known = ("root", "root_horizontal", *SMPL22.groups, *SMPL22.names)
        raise MotionloomError(f"no control called {name!r}; the controls are {', '.join(known)}")
    return chosen
