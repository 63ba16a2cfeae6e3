"""One person's nodes as a skeleton whose rest pose is the file's own: axes along the world's, limbs in one line.

A `Skeleton` is at rest where every rotation is the identity. In a glTF file bones have turned axes, so each joint
here is its node with the turn taken out that it has at rest, ``world_from_joint = world_from_node * inverse(turn)``;
so a bone keeps its roll. At rest means as the mesh was bound, or, without a mesh, as the nodes are.
"""

import heapq
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.files.text import unique_names
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.io.glb import Document
from motionloom.io.gltf_curves import Curves, sample
from motionloom.io.gltf_nodes import OpenedGlb, transform, upwards
from motionloom.retarget.named import joint_names
from motionloom.retarget.names import parts_by_name

Array = NDArray[np.float64]
Matrices = dict[int, Array]
"""(4, 4) by node."""
MAX_JOINTS = 10_000
FAR = 1e6
"""Metres; nobody is further away."""
_SAME_TURN = np.radians(0.5)
"""Turns that are nearer to each other are the same."""
_SAME_PLACE = 1e-3
"""Likewise places, in heights of the body."""
_LEAN = np.cos(np.radians(75))
"""Nobody is saved leaning further; what is, was made with another axis up."""
_LIMBS = (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist"))


@dataclass(frozen=True, eq=False)
class Rig:
    """One person of a file: a skeleton and the nodes that it is made of."""

    file: OpenedGlb
    """Nodes above the person that are keyed and never move are where they are kept."""
    skeleton: Skeleton
    nodes: tuple[int, ...]
    """For each joint the number of its node."""
    turns: Array
    """(joints, 4) at rest: world_from_node."""
    rest: Matrices
    """(4, 4) world_from_node at rest, of every node of the file."""
    shifted: frozenset[int]
    """Joints whose nodes are not where the mesh was bound, on what they hang on."""


@dataclass(frozen=True, eq=False)
class Worlds:
    """Where nodes are in the world, at rest (one frame) or through time."""

    places: dict[int, Array]
    """(frames or 1, 3) metres."""
    turns: dict[int, Array]
    """(frames or 1, 4) world_from_node without its scale."""
    linear: dict[int, Array | None]
    """(frames or 1, 3, 3) world_from_node with its scale; None where nothing is scaled."""


def worlds(
    file: OpenedGlb, line: list[int], sampled: Mapping[tuple[int, str], Array], above: Worlds | None = None
) -> Worlds:
    """Forward kinematics of ``line``: nodes, parents first, from the top; ``sampled`` (frames, width) replaces rest.

    They are added to ``above``, where what is over the line is known already.
    """
    world = Worlds({}, {}, {}) if above is None else above
    for n in line:
        node, p = file.nodes[n], file.parents[n]
        place = sampled.get((n, "translation"), node.place[None])
        turn = sampled.get((n, "rotation"), node.turn[None])
        scale = sampled.get((n, "scale"), node.scale[None])
        stretch = world.linear.get(p)
        if p in world.places:
            moved = (
                np.einsum("...ab,...b->...a", stretch, place)
                if stretch is not None
                else rot.rotate(world.turns[p], place)
            )
            place = world.places[p] + moved
        plain = stretch is None and np.abs(scale - 1.0).max() < 1e-9
        if not plain:
            own = rot.quat_to_matrix(turn) * scale[:, None, :]
            whole = rot.quat_to_matrix(world.turns[p]) if p in world.turns and stretch is None else stretch
            world.linear[n] = own if whole is None else whole @ own
        else:
            world.linear[n] = None
        world.places[n] = place
        if p in world.turns:
            turn = rot.normalize(rot.multiply(world.turns[p], turn))
        world.turns[n] = turn
    return world


def _size(worlds: Worlds, node: int) -> float:
    """How much larger than its own measures a node is at rest."""
    linear = worlds.linear[node]
    return 1.0 if linear is None else float(np.cbrt(np.linalg.det(linear[0])))


def read_rig(file: OpenedGlb, person: int, curves: Curves) -> Rig:
    """The skeleton of a person whom these curves move; leaves that they do not turn are mere bone tips."""
    file, joints = _without_still_armatures(file, person, curves)
    nodes, parents = file.nodes, file.parents
    turned = {node for node, path in curves if path == "rotation"}
    still = not any(node in joints for node, _ in curves)
    tips = {n for n in joints if not (still or n in turned or joints.intersection(nodes[n].children))}
    order = parents_first(joints, parents)
    above = upwards(parents[order[0]], parents)[::-1] if parents[order[0]] != -1 else []
    inner = {parents[n] for n in order}
    _check_scales(file, [*above, *(n for n in order if n in inner)])  # of a last bone nothing else depends
    rest = worlds(file, [*above, *order], {})
    names = dict(zip(order, unique_names([nodes[n].name for n in order])))
    parts = _parts(order, parents, names, {n: rest.places[n][0] for n in order}, file.humanoid)
    body = {n for part in parts.values() for n in upwards(part, parents)} or inner
    turns, places, shifted = _bound(file, order, rest, body=body)
    hung = _hung(parents, parts)
    order = parents_first(joints, hung)
    slots = {n: k for k, n in enumerate(order)}
    offsets = [places[n] - (places[hung[n]] if k else 0.0) for k, n in enumerate(order)]
    skeleton = Skeleton(
        tuple(names[n] for n in order),
        tuple(-1 if k == 0 else slots[hung[n]] for k, n in enumerate(order)),
        np.array(offsets),
        frozenset(slots[n] for n in tips if slots[n] > 0),
        humanoid={part: names[n] for part, n in file.humanoid.items() if n in names},
        on_floor=on_floor(np.array([places[n][1] for n in order])),
    )
    moved = frozenset(slots[n] for n in shifted)
    rest = worlds(file, [*above, *order], {})  # again: feet may hang elsewhere now
    known: dict[int, Array] = {}
    for n, place in zip(order, skeleton.rest_positions(), strict=True):
        known[n] = transform(place, turns[n], np.full(3, _size(rest, n)))
    matrices = world_from_nodes(file, file.order, known)
    resting = np.array([turns[n] for n in order])
    return Rig(file, skeleton, tuple(order), resting, matrices, moved)


def posed(rig: Rig, curves: Curves, *, fps: float, times: Array) -> Motion:
    """The rig moved by the curves, sampled at ``times`` (frames,) seconds."""
    parents = rig.file.parents
    line = [*upwards(rig.nodes[0], parents)[:0:-1], *parents_first(frozenset(rig.nodes), parents)]
    sampled = {key: sample(curve, times, fps, turn=key[1] == "rotation") for key, curve in curves.items()}
    moving = worlds(rig.file, line, sampled)
    frames, joints = len(times), len(rig.nodes)
    world, places = np.empty((frames, joints, 4)), np.empty((frames, joints, 3))
    for k, n in enumerate(rig.nodes):
        world[:, k] = rot.multiply(moving.turns[n], rot.inverse(rig.turns[k]))
        places[:, k] = moving.places[n]
    if not np.abs(places).max() < FAR:
        raise rig.file.document.bad(f"a joint is more than {FAR:g} m away; check the units")
    above = list(rig.skeleton.parents[1:])
    rotations, inside = world.copy(), places.copy()
    if above:
        back = rot.inverse(world[:, above])
        rotations[:, 1:] = rot.multiply(back, world[:, 1:])
        inside[:, 1:] = rot.rotate(back, places[:, 1:] - places[:, above])
    moved = np.abs(inside[:, 1:] - rig.skeleton.offsets[1:]).max(initial=0.0) > 1e-5
    return Motion(rig.skeleton, fps, places[:, 0], rotations, inside if moved else None)


# --- rest ---------------------------------------------------------------------------------------------------------


def _without_still_armatures(file: OpenedGlb, person: int, curves: Curves) -> tuple[OpenedGlb, frozenset[int]]:
    """Let go of armature objects over the skeleton that are keyed but never move: they become fixed transforms."""
    nodes, joints = list(file.nodes), set(file.people[person])
    if len(joints) > MAX_JOINTS:
        raise file.document.bad(f"its skeleton has {len(joints)} joints; at most {MAX_JOINTS} can be read")
    skinned = {j for skin in file.skins for j in skin} or file.people[person]
    root = next(n for n in joints if file.parents[n] not in joints)
    while root not in skinned and len(inside := [c for c in nodes[root].children if c in joints]) == 1:
        keyed = [path for path in nodes[root].rest if (root, path) in curves]
        own = {path: curves[root, path].values for path in keyed}
        if any(np.ptp(v, axis=0).max() >= 1e-6 * max(1.0, np.abs(v).max()) for v in own.values()):
            break
        nodes[root] = replace(
            nodes[root],
            place=own["translation"][0] if "translation" in own else nodes[root].place,
            turn=rot.normalize(own["rotation"][0] if "rotation" in own else nodes[root].turn),
            scale=own["scale"][0] if "scale" in own else nodes[root].scale,
        )
        joints.remove(root)
        root = inside[0]
    return replace(file, nodes=nodes), frozenset(joints)


def _check_scales(file: OpenedGlb, line: list[int]) -> None:
    size = 1.0
    for number in line:
        name, scale = file.nodes[number].name[:80], file.nodes[number].scale
        if not (scale > 1e-9).all() or np.ptp(scale) > 0.02 * scale.max():
            raise file.document.bad(
                f"node {number}, {name!r}, is scaled by {scale.tolist()}; only one positive scale "
                "for all axes is read: apply scales in the program that made it (in Blender Object, Apply, Scale)"
            )
        size = max(size, float(scale.max())) if size > 1 else float(scale.max()) * size
        if not 1e-9 < size < 1e9:
            raise file.document.bad("its scales are absurdly large or small")


def _bound(
    file: OpenedGlb, order: list[int], rest: Worlds, *, body: set[int]
) -> tuple[dict[int, Array], dict[int, Array], frozenset[int]]:
    """World turns (4,) and places (3,) as the mesh was bound, and the nodes that are elsewhere on what they hang on.

    Where no skin says otherwise they are as the nodes are; so are places of what is not the ``body``, such as fingers
    and tips, whose matrices are often mere dummies.
    """
    turns = {n: rest.turns[n][0] for n in order}
    places = {n: rest.places[n][0] for n in order}
    shifted: set[int] = set()
    bound = _bind_pose(file, list(rest.turns), set(order))
    near = _SAME_PLACE * float(np.ptp([p for p, _ in bound.values()], axis=0).max()) if bound else 0.0
    if any(
        abs(float(turn @ turns[n])) < np.cos(_SAME_TURN / 2) or np.linalg.norm(place - places[n]) > near
        for n, (place, turn) in bound.items()
    ):
        for n in order:
            p, own = file.parents[n], file.nodes[n]
            if n != order[0]:
                places[n] = places[p] + rot.rotate(turns[p], own.place * _size(rest, p))
                turns[n] = rot.multiply(turns[p], own.turn)
            if n in bound:
                place, turns[n] = bound[n]
                if n in body and np.linalg.norm(place - places[n]) > near:
                    places[n] = place
                    shifted.add(n)
    if not all(np.isfinite(p).all() and np.abs(p).max() < FAR for p in places.values()):
        raise file.document.bad(f"a joint is more than {FAR:g} m away; check the units")
    return turns, places, frozenset(shifted)


# --- where the mesh was bound --------------------------------------------------------------------------------------

# A skin's inverse bind matrices say where its joints were to each other, in the space of the mesh. Nothing says where
# that space is in the world, and a topmost joint that was saved in the middle of an animation leans and sinks. So the
# space is searched for in which the body stands on the floor: the world, a node above the skeleton, the mesh's node.


def _bind_pose(file: OpenedGlb, line: list[int], joints: set[int]) -> dict[int, tuple[Array, Array]]:
    """Places (3,) and turns (4,) in the world of those ``joints`` that skins hold, as their meshes were bound.

    ``line``: the nodes from the top down to all joints, parents first. Empty where no skin can be read.
    """
    inverses: dict[int, Matrices] = {}  # (4, 4) joint_from_mesh of each skin's joints
    for number, (skin, listed) in enumerate(zip(file.document.items("skins"), file.skins, strict=True)):
        matrices = file.document.matrices(skin.get("inverseBindMatrices"), "inverse bind matrices")
        if matrices is not None and len(matrices) >= len(listed):
            matrices[:, 3] = [0.0, 0.0, 0.0, 1.0]
            own = {n: m for n, m in zip(listed, matrices) if n in joints and _turn_of(m) is not None}
            inverses |= {number: own} if own else {}
    saved = world_from_nodes(file, file.order, {}) if inverses else {}
    known = Matrices()
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
            if n not in known and (turn := _turn_of(matrix := space @ np.linalg.inv(inverse[n]))) is not None:
                known[n], bound[n] = matrix, (matrix[:3, 3], turn)
    return bound


def _turn_of(matrix: Array) -> Array | None:
    """(4,) the rotation in a matrix (3 or 4 rows) that scales alike in all directions; None if it does more."""
    linear = matrix[:3, :3]
    size = np.linalg.norm(linear, axis=0)
    if not ((size > 1e-12) & (size < 1e12)).all():  # nor where it is not finite
        return None
    turn = linear / size
    if np.abs(turn.T @ turn - np.eye(3)).max() > 0.02 or np.linalg.det(turn) < 0:
        return None
    return rot.normalize(rot.matrix_to_quat(turn))


@np.errstate(over="ignore", invalid="ignore")  # of nodes above other nodes nobody checked the scales
def world_from_nodes(file: OpenedGlb, line: list[int], known: Mapping[int, Array]) -> Matrices:
    """(4, 4) of ``line``: nodes, parents first, from the top, as each hangs on what is ``known`` or on the world."""
    world: Matrices = {}
    for n in line:
        own, p = file.nodes[n], file.parents[n]
        world[n] = known[n] if n in known else world[p] @ own.matrix if p >= 0 else own.matrix
    return world


def on_floor(heights: Array) -> bool:
    """Whether somebody whose joints are so high at rest (joints,) stands with the soles at 0."""
    low, high = float(heights.min()), float(heights.max())
    return high > 0 and abs(low) < 0.1 * (high - low)


def _space(file: OpenedGlb, saved: Matrices, skin: int, inverse: Matrices, top: int) -> Array:
    """(4, 4) world_from_mesh when a skin was bound, ``top`` being its topmost joint; ``saved``: world_from_node."""
    standing = saved[top] @ inverse[top]
    if _turn_of(standing) is None:
        return standing
    entries = file.document.items("nodes")
    wearers = [k for k, entry in enumerate(entries) if entry.get("skin") == skin]
    above = [n for n in upwards(top, file.parents)[1:] if n not in inverse]
    spaces = [np.eye(4), *(saved[n] for n in (*above, *wearers[:8]))]
    inside = np.array([np.linalg.inv(m) for m in inverse.values()])
    now, size = standing @ inside, float(np.cbrt(np.linalg.det(standing[:3, :3])))
    first = list(inverse).index(top)
    best, nearest = standing, -1.0
    for space in spaces:
        if (turn := _turn_of(space)) is None:
            continue
        if abs(float(np.cbrt(np.linalg.det(space[:3, :3]))) / size - 1.0) >= 0.02:
            # of another size than the mesh has: only its turn counts, around the topmost joint
            space = transform(np.zeros(3), turn, np.full(3, size))
            space[:3, 3] = now[first, :3, 3] - (space @ inside[first])[:3, 3]
        apart = standing @ np.linalg.inv(space)
        places = (space @ inside)[:, :3, 3]
        if apart[1, 1] > np.cos(_SAME_TURN) and abs(now[0, 1, 3] - places[0, 1]) < _SAME_PLACE * np.ptp(places[:, 1]):
            return standing  # turned and moved over the floor at most: that is where it stands
        turn = _turn_of(apart)
        near = -1.0 if turn is None else min(abs(float(turn[0])), 1.0)
        if apart[1, 1] > _LEAN and near > nearest and on_floor(places[:, 1]):
            best, nearest = space, near
    return best


# --- who hangs on whom --------------------------------------------------------------------------------------------


def parents_first(joints: frozenset[int], parents: list[int]) -> list[int]:
    """Parents before children, otherwise in the file's order."""
    below: dict[int, list[int]] = {}
    for node in joints:
        below.setdefault(parents[node], []).append(node)
    ready = [node for node in joints if parents[node] not in joints]
    order: list[int] = []
    while ready:
        node = heapq.heappop(ready)
        order.append(node)
        for child in below.get(node, []):
            heapq.heappush(ready, child)
    return order


def _parts(
    order: list[int], parents: list[int], names: dict[int, str], places: dict[int, Array], known: dict[str, int]
) -> dict[str, int]:
    """The nodes of body parts, by what the file says of them and by their names."""
    slots = {n: k for k, n in enumerate(order)}
    plain = Skeleton(
        tuple(names[n] for n in order),
        tuple(-1 if k == 0 else slots[parents[n]] for k, n in enumerate(order)),
        np.array([places[n] for n in order]),
    )
    named = {part: order[k] for part, k in parts_by_name(plain).items()}
    return named | {part: n for part, n in known.items() if n in slots}


def _hung(parents: list[int], parts: dict[str, int]) -> list[int]:
    """The parents, with feet and hands on their limbs that the file hangs on a control instead."""
    hung = list(parents)
    for side in ("left", "right"):
        for limb in _LIMBS:
            for upper, lower in pairwise(limb):
                a, b = parts.get(f"{side}_{upper}"), parts.get(f"{side}_{lower}")
                if a is not None and b is not None and a not in upwards(b, hung) and b not in upwards(a, hung):
                    hung[b] = a
    return hung


_BONES = zip(joint_names("vrm"), SMPL22.names)
VRM_BONES = dict(sorted(_BONES, key=lambda b: ("right_" in b[1], "left_" in b[1])))
"""VRM's names of the bones that are driven, and the joints of SMPL that they are; the middle first, then each side."""


def humanoid_nodes(document: Document, count: int) -> dict[str, int]:
    """The nodes of body parts, as a VRM 0, a VRM 1 or a VRM animation names them; empty for other files."""
    extensions = document.json.get("extensions")
    if not isinstance(extensions, dict):
        return {}
    bones: dict[str, Any] = {}
    for key in ("VRMC_vrm", "VRMC_vrm_animation", "VRM"):
        extension = extensions.get(key)
        humanoid = extension.get("humanoid") if isinstance(extension, dict) else None
        listed = humanoid.get("humanBones") if isinstance(humanoid, dict) else None
        if isinstance(listed, list):
            bones = {b["bone"]: b for b in listed if isinstance(b, dict) and isinstance(b.get("bone"), str)}
        elif isinstance(listed, dict):
            bones = {name: b for name, b in listed.items() if isinstance(b, dict)}
        if bones:
            break
    return {
        part: document.index(bones[bone].get("node"), count, "nodes")
        for bone, part in VRM_BONES.items()
        if bone in bones
    }
