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

from motionloom import rotations as rot
from motionloom.io.glb import Document
from motionloom.io.gltf_bind import SAME_PLACE, SAME_TURN, bind_pose, on_floor
from motionloom.io.gltf_curves import Curves, sample
from motionloom.io.gltf_nodes import OpenedGlb, upwards
from motionloom.motion import Motion
from motionloom.retarget.names import parts_by_name
from motionloom.skeleton import Skeleton

Array = NDArray[np.float64]
MAX_JOINTS = 10_000
FAR = 1e6
"""Metres; nobody is further away."""
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
    found = Worlds({}, {}, {}) if above is None else above
    for n in line:
        node, p = file.nodes[n], file.parents[n]
        place = sampled.get((n, "translation"), node.place[None])
        turn = sampled.get((n, "rotation"), node.turn[None])
        scale = sampled.get((n, "scale"), node.scale[None])
        stretch = found.linear.get(p)
        if p in found.places:
            moved = (
                np.einsum("...ab,...b->...a", stretch, place)
                if stretch is not None
                else rot.rotate(found.turns[p], place)
            )
            place = found.places[p] + moved
        plain = stretch is None and np.abs(scale - 1.0).max() < 1e-9
        if not plain:
            own = rot.quat_to_matrix(turn) * scale[:, None, :]
            whole = rot.quat_to_matrix(found.turns[p]) if p in found.turns and stretch is None else stretch
            found.linear[n] = own if whole is None else whole @ own
        else:
            found.linear[n] = None
        found.places[n] = place
        found.turns[n] = rot.normalize(rot.multiply(found.turns[p], turn)) if p in found.turns else turn
    return found


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
    return Rig(file, skeleton, tuple(order), np.array([turns[n] for n in order]), moved)


def posed(rig: Rig, curves: Curves, *, fps: float, times: Array) -> Motion:
    """The rig moved by the curves, sampled at ``times`` (frames,) seconds."""
    parents = rig.file.parents
    line = [*upwards(rig.nodes[0], parents)[:0:-1], *parents_first(frozenset(rig.nodes), parents)]
    sampled = {key: sample(curve, times, fps, turn=key[1] == "rotation") for key, curve in curves.items()}
    moving = worlds(rig.file, line, sampled)
    frames, joints = len(times), len(rig.nodes)
    world, places = np.empty((frames, joints, 4)), np.empty((frames, joints, 3))
    for k, n in enumerate(rig.nodes):
        world[:, k], places[:, k] = rot.multiply(moving.turns[n], rot.inverse(rig.turns[k])), moving.places[n]
    if not np.abs(places).max() < FAR:
        raise rig.file.document.bad(f"a joint is more than {FAR:g} m away; check the units")
    above = list(rig.skeleton.parents[1:])
    rotations, inside = world.copy(), places.copy()
    if above:
        back = rot.inverse(world[:, above])
        rotations[:, 1:] = rot.multiply(back, world[:, 1:])
        inside[:, 1:] = rot.rotate(back, places[:, 1:] - places[:, above])
    stretched = np.abs(inside[:, 1:] - rig.skeleton.offsets[1:]).max(initial=0.0) > 1e-5
    return Motion(rig.skeleton, fps, places[:, 0], rotations, inside if stretched else None)


# --- rest ---------------------------------------------------------------------------------------------------------


def _without_still_armatures(file: OpenedGlb, person: int, curves: Curves) -> tuple[OpenedGlb, frozenset[int]]:
    """Let go of armature objects over the skeleton that are keyed but never move: they become fixed transforms."""
    nodes, joints = list(file.nodes), set(file.people[person])
    if len(joints) > MAX_JOINTS:
        raise file.document.bad(f"its skeleton has {len(joints)} joints; at most {MAX_JOINTS} can be read")
    kept = {j for skin in file.skins for j in skin} or file.people[person]
    root = next(n for n in joints if file.parents[n] not in joints)
    while root not in kept and len(inside := [c for c in nodes[root].children if c in joints]) == 1:
        own = {path: curves[root, path].values for path in nodes[root].rest if (root, path) in curves}
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
    bound = bind_pose(file, list(rest.turns), set(order))
    near = SAME_PLACE * float(np.ptp([place for place, _ in bound.values()], axis=0).max()) if bound else 0.0
    if any(
        abs(float(turn @ turns[n])) < np.cos(SAME_TURN / 2) or np.linalg.norm(place - places[n]) > near
        for n, (place, turn) in bound.items()
    ):
        for n in order:
            p, node = file.parents[n], file.nodes[n]
            if n != order[0]:
                linear = rest.linear[p]
                size = 1.0 if linear is None else float(np.cbrt(np.linalg.det(linear[0])))
                places[n] = places[p] + rot.rotate(turns[p], node.place * size)
                turns[n] = rot.multiply(turns[p], node.turn)
            if n in bound:
                place, turns[n] = bound[n]
                if n in body and np.linalg.norm(place - places[n]) > near:
                    places[n] = place
                    shifted.add(n)
    if not all(np.isfinite(p).all() and np.abs(p).max() < FAR for p in places.values()):
        raise file.document.bad(f"a joint is more than {FAR:g} m away; check the units")
    return turns, places, frozenset(shifted)


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
            bones = {name: bone for name, bone in listed.items() if isinstance(bone, dict)}
        if bones:
            break
    return {
        part: document.index(bones[bone].get("node"), count, "nodes")
        for bone, part in VRM_BONES.items()
        if bone in bones
    }


VRM_BONES = {
    "hips": "pelvis",
    "spine": "spine1",
    "chest": "spine2",
    "upperChest": "spine3",
    "neck": "neck",
    "head": "head",
    **{
        f"{side}{bone}": f"{side}_{part}"
        for side in ("left", "right")
        for bone, part in (
            ("UpperLeg", "hip"),
            ("LowerLeg", "knee"),
            ("Foot", "ankle"),
            ("Toes", "foot"),
            ("Shoulder", "collar"),
            ("UpperArm", "shoulder"),
            ("LowerArm", "elbow"),
            ("Hand", "wrist"),
        )
    },
}
"""VRM's names of the bones that are driven, and the joints of SMPL that they are."""


def unique_names(names: list[str]) -> tuple[str, ...]:
    """The second ``hand`` becomes ``hand_2``."""
    taken: set[str] = set()
    counts: dict[str, int] = {}
    result = []
    for name in names:
        unique = name
        while unique in taken:
            counts[name] = counts.get(name, 1) + 1
            unique = f"{name}_{counts[name]}"
        taken.add(unique)
        result.append(unique)
    return tuple(result)
