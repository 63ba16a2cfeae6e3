"""Where a rig's joints were when its meshes were bound, whatever pose its nodes are in.

A skin's inverse bind matrices say where its joints were to each other, in the space of the mesh. Where that space is in
the world is said by nobody, and a topmost joint that was saved in the middle of an animation leans and sinks. So it is
looked for: the world itself, a node above the skeleton or the node of the mesh, in which the body stands on the floor.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.io.gltf_nodes import OpenedGlb, upwards

Array = NDArray[np.float64]
SAME_TURN = np.radians(0.5)
"""Turns that are nearer to each other are the same."""
SAME_PLACE = 1e-3
"""Likewise places, in heights of the body."""
_LEAN = np.cos(np.radians(75))
"""Nobody is saved leaning further; what is, was made with another axis up."""


def bind_pose(file: OpenedGlb, line: list[int], joints: set[int]) -> dict[int, tuple[Array, Array]]:
    """Places (3,) and turns (4,) in the world of those ``joints`` that skins hold, as their meshes were bound.

    ``line``: the nodes from the top down to all joints, parents first. Empty where no skin can be read.
    """
    inverses: dict[int, dict[int, Array]] = {}  # (4, 4) joint_from_mesh of each skin's joints
    for number, (skin, listed) in enumerate(zip(file.document.items("skins"), file.skins, strict=True)):
        matrices = file.document.matrices(skin.get("inverseBindMatrices"), "inverse bind matrices")
        if matrices is not None and len(matrices) >= len(listed):
            matrices[:, 3] = [0.0, 0.0, 0.0, 1.0]
            found = {n: m for n, m in zip(listed, matrices) if n in joints and turn_of(m) is not None}
            inverses |= {number: found} if found else {}
    saved, known = world_from_nodes(file, file.order, {}) if inverses else {}, dict[int, Array]()
    bound: dict[int, tuple[Array, Array]] = {}
    for number, inverse in sorted(inverses.items(), key=lambda skin: -len(skin[1])):
        tops = [n for n in line if n in inverse]
        shared = next((n for n in tops if n in known), None)
        if shared is not None:
            space = known[shared] @ inverse[shared]
        elif not known.keys().isdisjoint(above := upwards(tops[0], file.parents)[::-1]):
            space = world_from_nodes(file, above, known)[tops[0]] @ inverse[tops[0]]
        else:
            space = _space(file, saved, number, inverse, tops[0])
        for n in tops:
            if n not in known and (turn := turn_of(matrix := space @ np.linalg.inv(inverse[n]))) is not None:
                known[n], bound[n] = matrix, (matrix[:3, 3], turn)
    return bound


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


def transform(place: Array, turn: Array, scale: Array) -> Array:
    """(4, 4) of its parts."""
    found = np.eye(4)
    found[:3, :3] = rot.quat_to_matrix(turn) * scale
    found[:3, 3] = place
    return found


@np.errstate(over="ignore", invalid="ignore")  # of nodes above other nodes nobody checked the scales
def world_from_nodes(file: OpenedGlb, line: list[int], known: Mapping[int, Array]) -> dict[int, Array]:
    """(4, 4) of ``line``: nodes, parents first, from the top, as each hangs on what is ``known`` or on the world."""
    found: dict[int, Array] = {}
    for n in line:
        own, p = file.nodes[n], file.parents[n]
        if n in known:
            found[n] = known[n]
        else:
            local = transform(own.place, own.turn, own.scale)
            found[n] = found[p] @ local if p >= 0 else local
    return found


def on_floor(heights: Array) -> bool:
    """Whether somebody whose joints are so high at rest (joints,) stands with the soles at 0."""
    low, high = float(heights.min()), float(heights.max())
    return high > 0 and abs(low) < 0.1 * (high - low)


def _space(file: OpenedGlb, saved: dict[int, Array], skin: int, inverse: dict[int, Array], top: int) -> Array:
    """(4, 4) world_from_mesh when a skin was bound, ``top`` being its topmost joint; ``saved``: world_from_node."""
    standing = saved[top] @ inverse[top]
    if turn_of(standing) is None:
        return standing
    wearers = [k for k, entry in enumerate(file.document.items("nodes")) if entry.get("skin") == skin]
    above = [n for n in upwards(top, file.parents)[1:] if n not in inverse]
    tried = [np.eye(4), *(saved[n] for n in (*above, *wearers[:8]))]
    inside = np.array([np.linalg.inv(m) for m in inverse.values()])
    now, size = standing @ inside, float(np.cbrt(np.linalg.det(standing[:3, :3])))
    first = list(inverse).index(top)
    best, nearest = standing, -1.0
    for space in tried:
        if (turn := turn_of(space)) is None:
            continue
        if abs(float(np.cbrt(np.linalg.det(space[:3, :3]))) / size - 1.0) >= 0.02:
            # of another size than the mesh has: only its turn counts, around the topmost joint
            space = transform(np.zeros(3), turn, np.full(3, size))
            space[:3, 3] = now[first, :3, 3] - (space @ inside[first])[:3, 3]
        apart = standing @ np.linalg.inv(space)
        places = (space @ inside)[:, :3, 3]
        if apart[1, 1] > np.cos(SAME_TURN) and abs(now[0, 1, 3] - places[0, 1]) < SAME_PLACE * np.ptp(places[:, 1]):
            return standing  # turned and moved over the floor at most: that is where it stands
        turn = turn_of(apart)
        near = -1.0 if turn is None else min(abs(float(turn[0])), 1.0)
        if apart[1, 1] > _LEAN and near > nearest and on_floor(places[:, 1]):
            best, nearest = space, near
    return best
