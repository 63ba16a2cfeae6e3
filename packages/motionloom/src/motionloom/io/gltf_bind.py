"""Where a rig's joints were when its meshes were bound, whatever pose its nodes are in.

A skin's inverse bind matrices say where its joints were to each other, in the space of the mesh. Where that space is in
the world is said by nobody, and a topmost joint that was saved in the middle of an animation leans and sinks. So it is
looked for: the world itself, a node above the skeleton or the node of the mesh, in which the body stands on the floor.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.io.glb import Document
from motionloom.io.gltf_nodes import Node, upwards

Array = NDArray[np.float64]
SAME_TURN = np.radians(0.5)
"""Turns that are nearer to each other are the same."""
SAME_PLACE = 1e-3
"""Likewise places, in heights of the body."""
_LEAN = np.cos(np.radians(75))
"""Nobody is saved leaning further; what is, was made with another axis up."""


@dataclass(frozen=True, eq=False)
class _Skin:
    number: int
    inverse: dict[int, Array]
    """(4, 4) by joint: joint_from_mesh when it was bound."""


def bind_pose(
    document: Document, nodes: list[Node], parents: list[int], line: list[int], joints: set[int]
) -> dict[int, Array]:
    """(4, 4) world_from_joint of those ``joints`` that skins hold, as their meshes were bound.

    ``line``: the nodes from the top down to all joints, parents first. Empty where no skin can be read.
    """
    skins = [_Skin(k, found) for k in range(len(document.items("skins"))) if (found := _inverse(document, k, joints))]
    known: dict[int, Array] = {}
    for skin in sorted(skins, key=lambda s: -len(s.inverse)):
        tops = [n for n in line if n in skin.inverse]
        shared = next((n for n in tops if n in known), None)
        if shared is not None:
            space = known[shared] @ skin.inverse[shared]
        elif any(n in known for n in upwards(tops[0], parents)):
            space = _hanging(nodes, parents, tops[0], known) @ skin.inverse[tops[0]]
        else:
            space = _space(document, nodes, parents, skin, tops[0])
        for n in tops:
            if n not in known and turn_of(bound := space @ np.linalg.inv(skin.inverse[n])) is not None:
                known[n] = bound
    return known


def _inverse(document: Document, number: int, joints: set[int]) -> dict[int, Array]:
    skin = document.items("skins")[number]
    count = len(document.items("nodes"))
    listed = [document.index(j, count, "nodes") for j in skin.get("joints", [])]
    matrices = document.matrices(skin.get("inverseBindMatrices"), "inverse bind matrices")
    if matrices is None or len(matrices) < len(listed):
        return {}
    matrices[:, 3] = [0.0, 0.0, 0.0, 1.0]
    return {n: m for n, m in zip(listed, matrices) if n in joints and turn_of(m) is not None}


def turn_of(matrix: Array) -> Array | None:
    """(4,) the rotation in a matrix (3 or 4 rows) that scales alike in all directions; None if it does more."""
    linear = matrix[:3, :3]
    size = np.linalg.norm(linear, axis=0)
    if not ((size > 1e-12) & (size < 1e12)).all():  # nor where it is not finite
        return None
    turn = linear / size
    if np.abs(turn.T @ turn - np.eye(3)).max() > 0.02 or np.linalg.det(turn) < 0:
        return None
    return rot.normalize(rot.matrix_to_quat(turn))


def angle(a: Array, b: Array) -> float:
    """Radians between two rotations (4,)."""
    return float(2 * np.arccos(np.clip(abs(float(a @ b)), 0.0, 1.0)))


def transform(place: Array, turn: Array, scale: Array) -> Array:
    """(4, 4) of its parts."""
    found = np.eye(4)
    found[:3, :3] = rot.quat_to_matrix(turn) * scale
    found[:3, 3] = place
    return found


def _hanging(nodes: list[Node], parents: list[int], node: int, known: dict[int, Array]) -> Array:
    """(4, 4) world_from_node, the way it hangs on what is ``known`` above it, or on the world."""
    found = np.eye(4)
    for n in upwards(node, parents):
        if n in known:
            return known[n] @ found
        found = transform(nodes[n].place, nodes[n].turn, nodes[n].scale) @ found
    return found


def on_floor(heights: Array) -> bool:
    """Whether somebody whose joints are so high at rest (joints,) stands with the soles at 0."""
    low, high = float(heights.min()), float(heights.max())
    return high > 0 and abs(low) < 0.1 * (high - low)


def _space(document: Document, nodes: list[Node], parents: list[int], skin: _Skin, top: int) -> Array:
    """(4, 4) world_from_mesh when a skin was bound, ``top`` being its topmost joint."""
    standing = _hanging(nodes, parents, top, {}) @ skin.inverse[top]
    if turn_of(standing) is None:
        return standing
    wearers = [k for k, entry in enumerate(document.items("nodes")) if entry.get("skin") == skin.number]
    above = [n for n in upwards(top, parents)[1:] if n not in skin.inverse]
    with np.errstate(over="ignore", invalid="ignore"):  # of nodes above other nodes nobody checked the scales
        tried = [np.eye(4), *(_hanging(nodes, parents, n, {}) for n in (*above, *wearers[:8]))]
    inside = np.array([np.linalg.inv(m) for m in skin.inverse.values()])
    best, nearest = standing, np.inf
    for candidate in tried:
        space = _of_size(candidate, standing, inside[list(skin.inverse).index(top)])
        if space is None:
            continue
        apart = standing @ np.linalg.inv(space)
        places = (space @ inside)[:, :3, 3]
        moved = (standing @ inside)[:, :3, 3] - places
        if apart[1, 1] > np.cos(SAME_TURN) and abs(moved[0, 1]) < SAME_PLACE * np.ptp(places[:, 1]):
            return standing  # turned and moved over the floor at most: that is where it stands
        turn = turn_of(apart)
        away = np.inf if turn is None else angle(turn, rot.IDENTITY)
        if apart[1, 1] > _LEAN and away < nearest and on_floor(places[:, 1]):
            best, nearest = space, away
    return best


def _of_size(candidate: Array, standing: Array, top: Array) -> Array | None:
    """A space of the size that the mesh has; of another size only its turn counts, around the topmost joint."""
    turn = turn_of(candidate)
    if turn is None:
        return None
    size = float(np.cbrt(np.linalg.det(standing[:3, :3])))
    if abs(float(np.cbrt(np.linalg.det(candidate[:3, :3]))) / size - 1.0) < 0.02:
        return candidate
    found = transform(np.zeros(3), turn, np.full(3, size))
    found[:3, 3] = (standing @ top)[:3, 3] - (found @ top)[:3, 3]
    return found
