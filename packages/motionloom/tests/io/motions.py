"""Random skeletons and motions, and forward kinematics written a second time, as plainly as possible."""

import numpy as np
from hypothesis import strategies as st

from motionloom.core.motion import Motion
from motionloom.core.rotations import normalize
from motionloom.core.skeleton import Skeleton

NAME = (
    st.text(st.sampled_from("abcXYZ019 :._-é"), min_size=1, max_size=8).map(lambda s: " ".join(s.split())).filter(bool)
)


@st.composite
def skeletons(draw: st.DrawFn) -> Skeleton:
    """1 to 8 joints with odd names; tips may be bone ends."""
    count = draw(st.integers(1, 8))
    names = draw(st.lists(NAME, min_size=count, max_size=count, unique=True))
    parents = [-1] + [draw(st.integers(0, j - 1)) for j in range(1, count)]
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    tips = [j for j in range(1, count) if j not in parents]
    ends = draw(st.sets(st.sampled_from(tips))) if tips else set()
    return Skeleton(tuple(names), tuple(parents), random.uniform(-1, 1, (count, 3)), frozenset(ends))


@st.composite
def motions(draw: st.DrawFn) -> Motion:
    """1 to 12 frames of a random skeleton; some have bones that change length."""
    skeleton = draw(skeletons())
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    frames, joints = draw(st.integers(1, 12)), len(skeleton)
    rotations = normalize(random.normal(size=(frames, joints, 4)))
    rotations[:, sorted(skeleton.ends)] = [1.0, 0.0, 0.0, 0.0]
    moved = random.uniform(-1, 1, (frames, joints, 3)) if draw(st.booleans()) else None
    fps = draw(st.sampled_from([12.5, 24.0, 29.97, 30.0, 60.0, 97.3, 120.0]))
    return Motion(skeleton, fps, random.uniform(-3, 3, (frames, 3)), rotations, moved)


def turn(axis: str, degrees: float) -> np.ndarray:
    """The 3 x 3 matrix of a right-handed turn about x, y or z."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    i, j = {"X": (1, 2), "Y": (2, 0), "Z": (0, 1)}[axis.upper()]
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def turns(axes: str, degrees: list[float]) -> np.ndarray:
    """Product of the turns from left to right."""
    product = np.eye(3)
    for axis, angle in zip(axes, degrees):
        product = product @ turn(axis, angle)
    return product


def largest_distance(a: Motion, b: Motion, names: dict[str, str] | None = None) -> float:
    """Largest distance of joints of the same name (or as ``names`` renames those of a) at any time, metres."""
    where = names or {}
    mine, other = a.positions(), b.positions()
    pairs = [(j, b.skeleton.index(where.get(n, n))) for j, n in enumerate(a.skeleton.names)]
    return max(float(np.abs(mine[:, i] - other[:, j]).max()) for i, j in pairs)
