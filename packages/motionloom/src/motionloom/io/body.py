"""A simple body for a skeleton: one rounded piece per bone, fixed rigidly to the joint that carries it.

Sizes come from `figure`. Pieces are measured in the joints' own frames over the whole motion, so a rest pose
that is no natural pose (all bones along one axis, say) gives the same body.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.viz.figure import Figure, figure

Array = NDArray[np.float64]
SIDES = 10
_LIFT = np.array([-90.0, -50.0, 0.0, 0.0, 50.0, 90.0]) * np.pi / 180  # rings from pole to pole
MAX_FRAMES = 400
DEEPEST = 0.04
"""Body heights by which a foot's piece is in the floor at most, where the floor is the one it stands on."""
MATERIALS = {
    1: ("left", (0.82, 0.17, 0.05)),
    -1: ("right", (0.03, 0.17, 0.60)),
    0: ("middle", (0.16, 0.19, 0.24)),
    2: ("skin", (0.76, 0.51, 0.35)),
}
"""Name and linear colour for each `Piece.side`."""


@dataclass(frozen=True)
class Piece:
    """A closed surface carried by one joint."""

    joint: int
    side: int
    """+1 left, -1 right, 0 middle, 2 skin."""
    points: Array
    """(vertices, 3) metres in the joint's frame."""
    normals: Array
    """(vertices, 3) of unit length."""
    triangles: NDArray[np.int64]
    """(triangles, 3), counter-clockwise from outside."""


def check_people(motions: Sequence[Motion], names: Sequence[str] | None) -> None:
    """Refuse to write nobody, and people with names of another count."""
    if not motions:
        raise MotionloomError("there is no motion to save; give at least one")
    if names is not None and len(names) != len(motions):
        raise MotionloomError(f"{len(motions)} motions need as many names; got {len(names)}")


def body(motion: Motion) -> list[Piece]:
    """The pieces of a person for a motion's skeleton; none for a skeleton without bones."""
    step = max(1, len(motion) // MAX_FRAMES)
    short = motion.frames(0, len(motion), step)
    shape = figure(short)
    world = short.world_rotations()
    limbs = [i for i, (_, child) in enumerate(shape.bones) if child not in shape.trunk]
    pieces = [_bone(motion, shape, world, i) for i in limbs]
    for joints, wide in ((shape.chest, 0.042), (shape.hips, 0.05)):
        pieces += [_trunk(shape, world, joints, wide)] if joints else []
    if shape.chest and shape.hips:
        pieces.append(_between(shape, world))
    pieces.append(_head(shape, world))
    return [p for p in pieces if p is not None]


def _local(world: Array, joint: int, target: Array) -> Array:
    """A moving point or direction (frames, 3) as it usually lies in a joint's frame."""
    return np.median(rot.rotate(rot.inverse(world[:, joint]), target), axis=0)


def _local_to(shape: Figure, world: Array, joint: int, point: Array) -> Array:
    return _local(world, joint, point - shape.places[:, joint])


def _bone(motion: Motion, shape: Figure, world: Array, i: int) -> Piece | None:
    parent, child = shape.bones[i]
    tip = _local_to(shape, world, parent, shape.places[:, child])
    radii = np.repeat(shape.radii[i], 2).reshape(2, 2)
    piece = _loft(parent, shape.sides[child], np.stack([np.zeros(3), tip]), radii)
    below = motion.skeleton.children(child)
    foot = set(below) <= motion.skeleton.ends and set(shape.hips[:-1]) & set(motion.skeleton.ancestors(parent))
    return _with_sole(piece, shape, world, child) if piece and foot else piece


def _with_sole(piece: Piece, shape: Figure, world: Array, toe: int) -> Piece:
    """A piece of a foot flattened where it would be in the floor while its ``toe`` stands there."""
    standing = shape.contacts[:, toe]
    if not standing.any():
        return piece
    up = _local(world[standing], piece.joint, np.array([0.0, 1.0, 0.0]))
    up = up / max(float(np.linalg.norm(up)), 1e-9)
    sole = float(np.median(shape.floor - shape.places[standing, piece.joint, 1]))
    under = np.maximum(sole - piece.points @ up, 0.0)
    if under.max() > DEEPEST * shape.height:
        return piece  # no foot that stands on this floor
    points = piece.points + under[:, None] * up
    return replace(piece, points=points, normals=_normals(points, piece.triangles))


def _trunk(shape: Figure, world: Array, joints: tuple[int, ...], wide: float) -> Piece | None:
    """Chest or pelvis: from the joint that carries it to the line between its two limbs."""
    base, height = joints[-1], shape.height
    left = [j for j in joints if shape.sides[j] > 0]
    right = [j for j in joints if shape.sides[j] < 0]
    if not left or not right:
        return None
    a, b = (_local_to(shape, world, base, shape.places[:, j[0]]) for j in (left, right))
    across, middle = a - b, (a + b) / 2
    up = _local(world, base, np.broadcast_to([0.0, 1.0, 0.0], (len(world), 3)))
    half = float(np.linalg.norm(across)) / 2
    if half < 1e-4 * height:
        return None
    chest = joints is shape.chest
    low = -0.03 * height * up if chest else middle - 0.02 * height * up
    top = middle if chest else np.maximum(0.03 * height, 0.0) * up
    wides = [0.62 * half + wide * height, 0.92 * half + 0.5 * wide * height]
    if not chest:
        wides = [half + 0.75 * wide * height, 0.6 * half + 0.9 * wide * height]
    rings = np.array([[wides[0], 1.2 * wide * height], [wides[1], wide * height]])
    return _loft(base, 0, np.stack([low, top]), rings, across=across)


def _between(shape: Figure, world: Array) -> Piece | None:
    """The belly, carried by the pelvis."""
    tip = _local_to(shape, world, shape.centre, shape.places[:, shape.chest[-1]])
    middle = shape.places[:, shape.centre]  # for a leg that is no leg: poses decide which limbs are
    hips = {shape.sides[j]: shape.places[:, j] for j in reversed(shape.hips)}
    across = _local(world, shape.centre, hips.get(1, middle) - hips.get(-1, middle))
    rings = shape.height * np.array([[0.075, 0.055], [0.078, 0.055]])
    return _loft(shape.centre, 0, np.stack([np.zeros(3), tip]), rings, across=across)


def _head(shape: Figure, world: Array) -> Piece | None:
    if shape.head is None:
        return None
    below, joint = shape.head
    carrier = below if shape.head_is_tip else joint
    direction = shape.places[:, joint] - shape.places[:, below]
    up = _local(world, carrier, direction)
    up = up / max(float(np.linalg.norm(up)), 1e-9)
    tip = _local_to(shape, world, carrier, shape.places[:, joint])
    radius = 0.055 * shape.height
    middle = tip - 0.75 * radius * up if shape.head_is_tip else tip + 0.85 * radius * up
    ends = np.stack([middle - 0.3 * radius * up, middle + 0.3 * radius * up])
    front = _local(world, carrier, shape.gaze)
    across = np.cross(up, front)
    return _loft(carrier, 2, ends, radius * np.array([[0.8, 0.95], [0.95, 1.1]]), across=across)


def _loft(joint: int, side: int, ends: Array, radii: Array, *, across: Array | None = None) -> Piece | None:
    """A rounded tube between two centres: radii [[width, depth] at the first, [width, depth] at the second end]."""
    axis = ends[1] - ends[0]
    length = float(np.linalg.norm(axis))
    if length < 1e-6 or not np.isfinite(length):
        return None
    axis = axis / length
    hint = np.eye(3)[np.argmin(np.abs(axis))] if across is None else across
    wide = hint - axis * (hint @ axis)
    if np.linalg.norm(wide) < 1e-6:
        wide = np.eye(3)[np.argmin(np.abs(axis))]
        wide = wide - axis * (wide @ axis)
    wide = wide / np.linalg.norm(wide)
    deep = np.cross(axis, wide)
    turn = np.linspace(0, 2 * np.pi, SIDES, endpoint=False)
    points: list[Array] = []
    for k, lift in enumerate(_LIFT):
        end = 0 if k < len(_LIFT) // 2 else 1
        width, depth = radii[end]
        middle = ends[end] + np.sin(lift) * min(width, depth) * axis
        ring = np.cos(lift) * (np.outer(width * np.cos(turn), wide) + np.outer(depth * np.sin(turn), deep))
        points.append(middle[None] if abs(lift) > 1.5 else middle + ring)
    vertices = np.concatenate(points)
    triangles = _stitch(len(_LIFT) - 2)
    return Piece(joint, side, vertices, _normals(vertices, triangles), triangles)


def _stitch(rings: int) -> NDArray[np.int64]:
    """Triangles of a pole, rings of `SIDES` vertices, and a pole."""
    ring = np.arange(SIDES)
    after = (ring + 1) % SIDES
    last = 1 + rings * SIDES
    faces = [(np.zeros_like(ring), 1 + after, 1 + ring)]
    for a in range(1, last - SIDES, SIDES):
        b = a + SIDES
        faces += [(a + ring, a + after, b + after), (a + ring, b + after, b + ring)]
    top = last - SIDES
    faces.append((top + ring, top + after, np.full_like(ring, last)))
    return np.concatenate([np.stack(face, axis=-1) for face in faces])


def _normals(points: Array, triangles: NDArray[np.int64]) -> Array:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    normals = np.zeros_like(points)
    for k in range(3):
        np.add.at(normals, triangles[:, k], faces)
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.where(length > 0, normals / np.where(length > 0, length, 1.0), [0.0, 1.0, 0.0])
