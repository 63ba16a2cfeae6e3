"""The goals of the suite `control`: kinds of goals, each taken out of a real motion.

A kind is known by its parts: ``trajectory``, a joint, or several with ``+`` between them, in every frame; ``keyframes``
and ``in_between`` are sparse. Each is given twice: as a goal in the world, and as the numbers of the representation
that the published way of control fixes (Shafir et al. 2024, section 3.3).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.layout import FPS, WIDTH, mask
from motionloom.core.ground import GroundPose
from motionloom.core.skeleton import SMPL22
from motionloom.goals.goal import Goal
from motionloom.kinematics.physics import Array

TRAJECTORY, WHOLE = "trajectory", "whole"
JOINTS = ("left_wrist", "right_wrist", "left_foot", "right_foot", "head")
SECOND = round(FPS)
DEFAULT = (
    TRAJECTORY,
    *JOINTS,
    *(f"{TRAJECTORY}+{joint}" for joint in JOINTS),
    "left_wrist+right_foot",
    "keyframes",
    "in_between",
)
"""Every kind of the paper's Table 4, each joint without and with the path, and two sparse ones."""
QUICK = (TRAJECTORY, f"{TRAJECTORY}+left_wrist")
"""One control and two of them, to see that everything works."""
MOST_KINDS = 50


@dataclass(frozen=True)
class Kind:
    """One kind of goal."""

    name: str
    parts: tuple[str, ...]
    when: Literal["always", "each second", "ends"] = "always"

    @property
    def title(self) -> str:
        """As the paper's table writes it: ``left wrist + trajectory``."""
        joints = [part for part in self.parts if part != TRAJECTORY]
        named = [*joints, TRAJECTORY] if TRAJECTORY in self.parts else joints
        return " + ".join(named).replace("_", " ") if self.when == "always" else self.name.replace("_", " ")

    @property
    def adapters(self) -> tuple[str, ...]:
        """Names of the controls that were trained for it; ``any`` is the one of random joints and frames."""
        return self.parts if self.when == "always" else ("any",)

    def frames(self, count: int) -> np.ndarray:
        """(count,) flags of the frames with a target."""
        at = np.arange(count)
        if self.when == "each second":
            return (at % SECOND == 0) & (at > 0)  # frame 0 would fix where the body is, which is no goal
        if self.when == "ends":
            edge = min(SECOND, count // 4)  # of a short motion half is left open
            return (at < edge) | (at >= count - edge)
        return np.ones(count, bool)


@dataclass(frozen=True, eq=False)
class Target:
    """The goal of one motion."""

    prompt: str
    goal: Goal
    """In the world in which the real motion starts at the origin and faces +Z; ``positions`` are all the real ones."""
    known: Array
    """(frames, 263) the real motion, not standardised."""
    mask: np.ndarray
    """(frames, 263) flags of the numbers that the published way of control fixes."""

    def __len__(self) -> int:
        return len(self.known)


def kind(name: str) -> Kind:
    """The kind of that name; MotionloomError for an unknown one."""
    if name == "keyframes":
        return Kind(name, ("left_wrist",), "each second")
    if name == "in_between":
        return Kind(name, (WHOLE,), "ends")
    parts = tuple(part.strip() for part in name.split("+"))
    if not set(parts) <= {TRAJECTORY, *JOINTS} or len(set(parts)) != len(parts):
        raise MotionloomError(
            f"there is no control {name[:80]!r}; it is keyframes, in_between, or of {TRAJECTORY}, {', '.join(JOINTS)} "
            "one or several with + between them"
        )
    return Kind("+".join(parts), parts)


def kinds(names: Sequence[str]) -> tuple[Kind, ...]:
    """The kinds of those names; MotionloomError for an unknown one, one that is there twice, and none at all."""
    result = tuple(kind(name) for name in names)
    titles = [one.title for one in result]
    if not 1 <= len(result) <= MOST_KINDS or len(set(titles)) != len(titles):
        raise MotionloomError(
            f"name 1 to {MOST_KINDS} different kinds of control; got {', '.join(names)[:200] or 'none'}"
        )
    return result


def target_of(one: Kind, features: np.ndarray, prompt: str) -> Target:
    """What a real motion (frames, 263), not standardised, as the target of another with the same words."""
    known = np.asarray(features, dtype=np.float64)
    positions = humanml.decode_positions(known)
    at = one.frames(len(known))
    flags = np.zeros(positions.shape, bool)
    fixed = np.zeros(known.shape, bool)
    for part in one.parts:
        if part == TRAJECTORY:
            flags[at, 0] |= np.array([True, False, True])  # on the ground
            fixed[at] |= mask("root_horizontal")
        elif part == WHOLE:
            flags[at], fixed[at] = True, np.ones(WIDTH, bool)
        else:
            flags[at, SMPL22.names.index(part)] = True
            fixed[at] |= mask(part)
    turns = at if {TRAJECTORY, WHOLE} & set(one.parts) else np.zeros(len(at), bool)
    return Target(prompt, Goal(positions, flags, facing(known), turns, start=GroundPose()), known, fixed)


def facing(features: np.ndarray) -> Array:
    """(frames,) radians: where a motion (frames, 263) faces in the world, 0 is +Z and a quarter turn +X."""
    quaternion, _ = humanml.recover_root(features)
    return np.unwrap(-2 * np.arctan2(quaternion[:, 2], quaternion[:, 0]))
