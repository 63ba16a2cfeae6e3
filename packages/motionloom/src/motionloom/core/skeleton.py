"""Skeletons are data: names, parents, rest offsets. A new skeleton is a new value, never a subclass.

The *rest pose* is what forward kinematics gives when every rotation is the identity. Units are metres,
+Y is up, a person in rest pose faces +Z and has the left side at +X.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.core.reading import check_text

LONGEST_NAME = 1000
"""Characters of a joint's name."""


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of a person on a skeleton."""

    root: NDArray[np.float64]
    """(poses, 3) metres: where joint 0 is."""
    rotations: NDArray[np.float64]
    """(poses, joints, 4) quaternions (w, x, y, z) of each joint in its parent's frame."""
    translations: NDArray[np.float64] | None = None
    """(poses, joints, 3) metres: offsets that change; None where the skeleton's hold."""

    def scaled(self, size: float) -> "Poses":
        """The same poses of a skeleton ``size`` times as large."""
        return Poses(self.root * size, self.rotations, None if self.translations is None else self.translations * size)


@dataclass(frozen=True, eq=False)
class Skeleton:
    """A tree of joints. Joint 0 is the root and parents come before their children."""

    names: tuple[str, ...]
    """One unique name per joint."""
    parents: tuple[int, ...]
    """Index of each joint's parent; -1 for joint 0 only."""
    offsets: NDArray[np.float64]
    """(joints, 3) metres: each joint in its parent's frame. Row 0 is where the file put the root at rest."""
    ends: frozenset[int] = frozenset()
    """Joints that are mere bone tips (BVH End Sites): they have a place and never a rotation of their own."""
    groups: dict[str, tuple[int, ...]] = field(default_factory=dict)
    """Named sets of joints, such as ``left_arm``."""
    humanoid: dict[str, str] = field(default_factory=dict)
    """The joints of body parts where the file names them (VRM): SMPL joint, such as ``left_knee``, to joint name."""
    on_floor: bool = False
    """Whether the rest pose stands on the ground y = 0, as modelled characters do; a recording's skeleton need not."""
    soles: dict[int, NDArray[np.float64]] = field(default_factory=dict)
    """(points, 3) metres in the frames of joints of the feet: corners of the mesh that must not go into the floor."""
    poses: Poses | None = None
    """Some poses out of the file, which say what a person looks like on a skeleton whose rest pose is no pose."""

    def __post_init__(self) -> None:
        offsets = np.asarray(self.offsets, dtype=np.float64)
        object.__setattr__(self, "offsets", offsets)
        if not (len(self.names) == len(self.parents) == len(offsets)) or not self.names:
            raise MotionloomError(
                f"a skeleton needs as many names as parents and offsets, at least one; "
                f"got {len(self.names)}, {len(self.parents)} and {len(offsets)}"
            )
        if len(set(self.names)) != len(self.names):
            twice = sorted(name for name, count in Counter(self.names).items() if count > 1)
            raise MotionloomError(f"joint names must be unique; {_some(twice)} appear more than once")
        for name in self.names:
            check_text(name, "a joint's name")
        longest = max(map(len, self.names))
        if longest > LONGEST_NAME:
            raise MotionloomError(f"a joint's name has {longest} characters; {LONGEST_NAME} are the most")
        if self.parents[0] != -1 or any(not 0 <= p < j for j, p in enumerate(self.parents[1:], start=1)):
            raise MotionloomError("the first joint must be the only root and parents must come before children")
        if not np.isfinite(offsets).all():
            raise MotionloomError("the skeleton's offsets must be finite numbers")

    def __len__(self) -> int:
        return len(self.names)

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Skeleton)
            and self.names == other.names
            and self.parents == other.parents
            and self.ends == other.ends
            and np.array_equal(self.offsets, other.offsets)
        )

    def index(self, name: str) -> int:
        """Number of the joint called ``name``; an error lists the joints there are."""
        if name not in self.names:
            raise MotionloomError(f"no joint {name[:80]!r}; the joints are {_some(self.names)}")
        return self.names.index(name)

    def children(self, joint: int) -> tuple[int, ...]:
        """Direct children of a joint."""
        return self._children[joint]

    @cached_property
    def _children(self) -> tuple[tuple[int, ...], ...]:
        below: list[list[int]] = [[] for _ in self.names]
        for j, p in enumerate(self.parents[1:], start=1):
            below[p].append(j)
        return tuple(map(tuple, below))

    def ancestors(self, joint: int) -> list[int]:
        """The joint and everything above it, the root last."""
        line = [joint]
        while self.parents[line[-1]] >= 0:
            line.append(self.parents[line[-1]])
        return line

    def below(self, *joints: int) -> list[int]:
        """The joints and everything under them, by number."""
        inside = set(joints)
        for j, parent in enumerate(self.parents):
            if parent in inside:
                inside.add(j)
        return sorted(inside)

    def resolve(self, names: Iterable[str]) -> tuple[int, ...]:
        """Joint numbers for a mix of joint and group names, in skeleton order."""
        chosen: set[int] = set()
        for name in names:
            chosen.update(self.groups[name] if name in self.groups else (self.index(name),))
        return tuple(sorted(chosen))

    def scaled(self, size: float) -> "Skeleton":
        """The same skeleton ``size`` times as large."""
        soles = {joint: points * size for joint, points in self.soles.items()}
        poses = None if self.poses is None else self.poses.scaled(size)
        return replace(self, offsets=self.offsets * size, soles=soles, poses=poses)

    def rest_positions(self) -> NDArray[np.float64]:
        """(joints, 3) metres: joint positions in rest pose, the root at its own offset."""
        places = self.offsets.copy()
        for j, p in enumerate(self.parents[1:], start=1):
            places[j] += places[p]
        return places

    def bone_lengths(self) -> NDArray[np.float64]:
        """(joints,) metres from each joint to its parent; 0 for the root."""
        lengths = np.linalg.norm(self.offsets, axis=-1)
        lengths[0] = 0.0
        return lengths

    def mirror_pairs(self) -> tuple[int, ...]:
        """For each joint the joint on the other side (itself on the middle line), found by name."""
        numbers = {name: number for number, name in enumerate(self.names)}
        return tuple(numbers[m] if (m := _other_side(n, numbers)) else j for j, n in enumerate(self.names))


_SIDES = (("left", "right"), ("Left", "Right"), ("LEFT", "RIGHT"))


def _some(names: Sequence[str]) -> str:
    """Names for a message: all of a person's, the first ones of very many."""
    return ", ".join(names[:40]) + (f" and {len(names) - 40} more" if len(names) > 40 else "")


def _other_side(name: str, names: Collection[str]) -> str | None:
    candidates = [name.replace(a, b, 1) for x, y in _SIDES for a, b in ((x, y), (y, x)) if a in name]
    for a, b in (("l", "r"), ("r", "l"), ("L", "R"), ("R", "L")):
        if name.startswith(a):
            candidates.append(b + name[1:])
        for glue in ("_", ".", "-", " "):
            candidates += _swaps(name, glue + a, glue + b) + _swaps(name, a + glue, b + glue)
    return next((c for c in candidates if c != name and c in names), None)


def _swaps(name: str, old: str, new: str) -> list[str]:
    """The name with one ``old`` replaced, for each place where it occurs: ``upper_leg_l`` has two ``_l``."""
    at = [i for i in range(len(name)) if name.startswith(old, i)]
    return [name[:i] + new + name[i + len(old) :] for i in at]


# Joint, parent, metres between the two of the uniform HumanML3D person (specs of the published data set), and the
# direction in a natural T-pose (the published rest directions are not a pose).
_SMPL22 = """
pelvis         -                   0     0     0     0
left_hip       pelvis         0.1031  0.62 -0.78     0
right_hip      pelvis         0.1099 -0.62 -0.78     0
spine1         pelvis         0.1316     0     1 -0.15
left_knee      left_hip       0.3936     0    -1     0
right_knee     right_hip      0.3902     0    -1     0
spine2         spine1         0.1432     0     1     0
left_ankle     left_knee      0.4324     0    -1 -0.06
right_ankle    right_knee     0.4256     0    -1 -0.06
spine3         spine2         0.0574     0     1  0.05
left_foot      left_ankle     0.1434   0.1 -0.42   0.9
right_foot     right_ankle    0.1494  -0.1 -0.42   0.9
neck           spine3         0.2194     0     1 -0.12
left_collar    spine3         0.1375  0.55  0.83 -0.08
right_collar   spine3         0.1434 -0.55  0.83 -0.08
head           neck           0.1030     0  0.86   0.5
left_shoulder  left_collar    0.1316     1  0.25  -0.1
right_shoulder right_collar   0.1230    -1  0.25  -0.1
left_elbow     left_shoulder  0.2568     1     0     0
right_elbow    right_shoulder 0.2631    -1     0     0
left_wrist     left_elbow     0.2660     1     0     0
right_wrist    right_elbow    0.2699    -1     0     0
"""
_ROWS = [row.split() for row in _SMPL22.strip().split("\n")]
HUMANML_BONE_LENGTHS: tuple[float, ...] = tuple(float(row[2]) for row in _ROWS[1:])
"""Metres of the uniform person's bones, by child joint 1..21."""

_SMPL22_GROUPS = {
    "left_leg": (1, 4, 7, 10),
    "right_leg": (2, 5, 8, 11),
    "left_arm": (13, 16, 18, 20),
    "right_arm": (14, 17, 19, 21),
    "torso": (0, 3, 6, 9),
    "head_neck": (12, 15),
    "feet": (7, 8, 10, 11),
    "hands": (20, 21),
    "lower_body": (0, 1, 2, 4, 5, 7, 8, 10, 11),
    "upper_body": (3, 6, 9, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21),
}


def _smpl22() -> Skeleton:
    names = tuple(row[0] for row in _ROWS)
    parents = tuple(-1 if row[1] == "-" else names.index(row[1]) for row in _ROWS)
    directions = np.array([row[3:] for row in _ROWS[1:]], dtype=np.float64)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    offsets = np.concatenate([np.zeros((1, 3)), directions * np.array(HUMANML_BONE_LENGTHS)[:, None]])
    offsets[0, 1] = -offsets[[1, 4, 7, 10], 1].sum()  # the toes are on the floor
    return Skeleton(names, parents, offsets, groups=_SMPL22_GROUPS, on_floor=True)


SMPL22: Skeleton = _smpl22()
"""The 22 body joints of SMPL in HumanML3D's order, the uniform person in a T-pose standing on the floor."""
