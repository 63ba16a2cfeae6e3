"""From a glTF document to a `Motion`: which nodes are a person, their rest pose, and their channels through time."""

import heapq
from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.errors import MotionloomError
from motionloom.io.glb import Document, read_document
from motionloom.io.gltf_curves import Curve, Curves, channels_of, clock, read_curves, sample, unit_quaternions
from motionloom.motion import Motion
from motionloom.skeleton import Skeleton

Array = NDArray[np.float64]
MAX_NODES = 20_000
MAX_JOINTS = 10_000
MAX_SKINS = 64
FAR = 1e6  # metres; nobody is further away


@dataclass(frozen=True)
class _Node:
    name: str
    children: tuple[int, ...]
    place: Array
    turn: Array
    """(4,) w, x, y, z."""
    scale: Array
    """(3,)"""


def load_glb(path: str | Path, *, person: int = 0) -> Motion:
    """Read the skeleton and animation of one person from a .glb, or a .gltf with embedded buffers.

    A person is a skin's joints with everything animated above and below, or, in a file without skins, an animated
    tree of nodes. The first animation that moves the person is sampled at the frame rate of its keys; nodes that it
    leaves alone keep their rest; without animation the motion is one frame at rest. Transforms above the person's
    topmost joint are folded into the root, uniform scales into the bones. Bone tips are leaves that nothing turns.
    Errors: `MotionloomError` for everything that is wrong with the file.
    """
    file = _open(path)
    if not 0 <= person < len(file.people):
        raise MotionloomError(f"{file.document.name} holds {len(file.people)} people; there is no number {person}")
    return _motion(file, person)


def load_glb_people(path: str | Path) -> list[Motion]:
    """Read everybody in a .glb, or a .gltf with embedded buffers, each as `load_glb` does, in the file's order."""
    file = _open(path)
    return [_motion(file, person) for person in range(len(file.people))]


@dataclass(frozen=True)
class _Opened:
    """A file's nodes, what moves them, and the joints of each person."""

    document: Document
    nodes: list[_Node]
    parents: list[int]
    channels: list[dict[tuple[int, str], dict[str, Any]]]
    people: list[frozenset[int]]


def _open(path: str | Path) -> _Opened:
    document = read_document(path)
    nodes = _nodes(document)
    parents = _parents(document, nodes)
    channels = channels_of(document, len(nodes))
    return _Opened(document, nodes, parents, channels, _people(document, nodes, parents, channels))


def _motion(file: _Opened, person: int) -> Motion:
    document, nodes, parents, channels = file.document, file.nodes, file.parents, file.channels
    joints = file.people[person]
    if len(joints) > MAX_JOINTS:
        raise document.bad(f"its skeleton has {len(joints)} joints; at most {MAX_JOINTS} can be read")
    moved = next((a for a in channels if any(node in joints for node, _ in a)), {})
    curves = read_curves(document, {key: sampler for key, sampler in moved.items() if key[0] in joints})
    kept = {j for skin in _skins(document, len(nodes)) for j in skin} or joints
    nodes, joints, curves = _settle(nodes, joints, curves, parents=parents, kept=kept)
    fps, times = clock(document, curves, len(joints))
    return _assemble(document, nodes, parents, joints=joints, curves=curves, fps=fps, times=times)


# --- nodes --------------------------------------------------------------------------------------------------------


def _nodes(document: Document) -> list[_Node]:
    entries = document.items("nodes")
    if not 1 <= len(entries) <= MAX_NODES:
        raise document.bad(f"it has {len(entries)} nodes; 1 to {MAX_NODES} can be read")
    return [_node(document, i, entry, len(entries)) for i, entry in enumerate(entries)]


def _node(document: Document, number: int, entry: dict[str, Any], count: int) -> _Node:
    name = entry.get("name")
    what = f"node {number}"
    children = entry.get("children", [])
    if not isinstance(children, list):
        raise document.bad(f"the children of {what} are not a list")
    place, turn, scale = np.zeros(3), rot.IDENTITY, np.ones(3)
    if entry.get("matrix") is not None:
        place, turn, scale = _decompose(document, document.numbers(entry["matrix"], 16, f"the matrix of {what}"), what)
    else:
        if entry.get("translation") is not None:
            place = document.numbers(entry["translation"], 3, f"the translation of {what}")
        if entry.get("rotation") is not None:
            xyzw = document.numbers(entry["rotation"], 4, f"the rotation of {what}")
            turn = unit_quaternions(document, xyzw[None], f"the rotation of {what}")[0]
        if entry.get("scale") is not None:
            scale = document.numbers(entry["scale"], 3, f"the scale of {what}")
    below = tuple(document.index(c, count, "nodes") for c in children)
    return _Node(_printable(name) or f"node_{number}", below, place, turn, scale)


def _printable(name: Any) -> str:
    """A name that can be shown and written anywhere."""
    return "".join(c if c.isprintable() else "_" for c in name[:200]).strip() if isinstance(name, str) else ""


def _decompose(document: Document, values: Array, what: str) -> tuple[Array, Array, Array]:
    matrix = values.reshape(4, 4).T
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    if (scale < 1e-9).any():
        raise document.bad(f"the matrix of {what} is flat")
    turn = matrix[:3, :3] / scale
    if np.abs(turn.T @ turn - np.eye(3)).max() > 1e-3 or np.linalg.det(turn) < 0:
        raise document.bad(
            f"the matrix of {what} is sheared or mirrored; only turns, moves and uniform scales are read"
        )
    return matrix[:3, 3].copy(), rot.matrix_to_quat(turn), scale


def _parents(document: Document, nodes: list[_Node]) -> list[int]:
    parents = [-1] * len(nodes)
    for i, node in enumerate(nodes):
        for child in node.children:
            if parents[child] != -1:
                raise document.bad(f"node {child} has two parents")
            parents[child] = i
    if len(_downwards(nodes, parents)) != len(nodes):
        raise document.bad("its nodes form a circle")
    return parents


def _downwards(nodes: list[_Node], parents: list[int]) -> list[int]:
    """All nodes that hang on a top node, parents before children."""
    order = [i for i, p in enumerate(parents) if p == -1]
    for i in order:  # grows while it is walked
        order.extend(nodes[i].children)
    return order


def _up(node: int, parents: list[int]) -> list[int]:
    """The node and everything above it."""
    line = [node]
    while parents[line[-1]] != -1:
        line.append(parents[line[-1]])
    return line


# --- who is a person ----------------------------------------------------------------------------------------------


def _people(
    document: Document, nodes: list[_Node], parents: list[int], channels: list[dict[tuple[int, str], dict[str, Any]]]
) -> list[frozenset[int]]:
    """The joints of each person, the topmost included."""
    animated = {node for animation in channels for node, _ in animation}
    skins = _skins(document, len(nodes))
    order = _downwards(nodes, parents)
    if skins:  # a skin in several trees is the person in the one with most of its joints
        groups = [max(_groups(set(skin), order, parents), key=len) for skin in skins]
    else:
        groups = _groups(animated, order, parents)
    if not groups:
        raise document.bad("it holds neither a skeleton (skin) nor an animation of nodes")
    marked = animated.union(*groups)
    people: dict[int, set[int]] = {}
    for group in groups:
        root = [n for n in _up(group[0], parents) if n in marked or n == group[0]][-1]
        people.setdefault(root, {root}).update(group)
    return [_body(root, wanted | animated, nodes, whole=not skins) for root, wanted in people.items()]


def _skins(document: Document, count: int) -> list[list[int]]:
    """The joints of every skin."""
    skins = document.items("skins")
    if len(skins) > MAX_SKINS:
        raise document.bad(f"it has {len(skins)} skins; at most {MAX_SKINS} can be read")
    result = []
    for skin in skins:
        joints = skin.get("joints")
        if not isinstance(joints, list) or not joints:
            raise document.bad("a skin has no joints")
        result.append([document.index(j, count, "nodes") for j in joints])
    return result


def _groups(nodes: set[int], order: list[int], parents: list[int]) -> list[list[int]]:
    """The given nodes by the tree they stand in, each list headed by the lowest node above (or among) them all."""
    tops: dict[int, int] = {}
    below = dict.fromkeys(order, 0)
    for node in order:
        tops[node] = node if parents[node] == -1 else tops[parents[node]]
    for node in reversed(order):
        below[node] += node in nodes
        if parents[node] != -1:
            below[parents[node]] += below[node]
    trees: dict[int, list[int]] = {}
    for node in sorted(nodes):
        trees.setdefault(tops[node], []).append(node)
    result = []
    for top, group in trees.items():
        root = group[0]
        while below[root] != below[top]:
            root = parents[root]
        result.append([root, *group])
    return result


def _settle(
    nodes: list[_Node], joints: frozenset[int], curves: Curves, *, parents: list[int], kept: Collection[int]
) -> tuple[list[_Node], frozenset[int], Curves]:
    """Let go of armature objects over the skeleton that are keyed but never move: they become fixed transforms."""
    nodes, kept = list(nodes), set(kept)
    by_node: dict[int, dict[str, Curve]] = {}
    for (node, path), curve in curves.items():
        by_node.setdefault(node, {})[path] = curve
    root = next(n for n in joints if parents[n] not in joints)
    gone: set[int] = set()
    while True:
        inside = [c for c in nodes[root].children if c in joints]
        own = by_node.get(root, {})
        still = all(np.ptp(c.values, axis=0).max() < 1e-6 * max(1.0, np.abs(c.values).max()) for c in own.values())
        if root in kept or len(inside) != 1 or not still:
            return nodes, joints - gone, {key: curve for key, curve in curves.items() if key[0] not in gone}
        held = {path: curve.values[0] for path, curve in own.items()}
        nodes[root] = replace(
            nodes[root],
            place=held.get("translation", nodes[root].place),
            turn=rot.normalize(held.get("rotation", nodes[root].turn)),
            scale=held.get("scale", nodes[root].scale),
        )
        gone.add(root)
        root = inside[0]


def _body(root: int, wanted: set[int], nodes: list[_Node], *, whole: bool) -> frozenset[int]:
    """Nodes below the root that are wanted or lead to wanted ones; all of them if ``whole``."""
    order = [root]
    for i in order:
        order.extend(nodes[i].children)
    if whole:
        return frozenset(order)
    kept: set[int] = {root}
    for i in reversed(order):
        if i in wanted or any(c in kept for c in nodes[i].children):
            kept.add(i)
    return frozenset(kept)


# --- the motion ---------------------------------------------------------------------------------------------------


def _assemble(
    document: Document,
    nodes: list[_Node],
    parents: list[int],
    *,
    joints: frozenset[int],
    curves: Curves,
    fps: float,
    times: Array,
) -> Motion:
    order = _order(joints, parents)
    slots = {node: k for k, node in enumerate(order)}
    above = _above(document, nodes, _up(order[0], parents)[1:])
    sizes = _sizes(document, nodes, order, curves=curves, parents=parents, first=above[2])
    offsets = np.array([nodes[n].place * sizes[k] for k, n in enumerate(order)])
    places = np.repeat(offsets[None], len(times), axis=0)
    turns = np.repeat(np.array([nodes[n].turn for n in order])[None], len(times), axis=0)
    for (node, path), curve in curves.items():
        if path == "translation":
            places[:, slots[node]] = sample(curve, times, fps, turn=False) * sizes[slots[node]]
        elif path == "rotation":
            turns[:, slots[node]] = sample(curve, times, fps, turn=True)
    stretched = np.abs(places[:, 1:] - offsets[1:]).max(initial=0.0) > 1e-5
    offsets[0] = above[0] + rot.rotate(above[1], offsets[0])
    places[:, 0] = above[0] + rot.rotate(above[1], places[:, 0])
    turns[:, 0] = rot.multiply(above[1], turns[:, 0])
    if not (np.abs(places).max() < FAR and np.abs(offsets).max() < FAR):
        raise document.bad(f"a joint is more than {FAR:g} m away; check the units")
    turned = {node for node, path in curves if path == "rotation"}
    tips = [k for k, n in enumerate(order) if curves and not joints.intersection(nodes[n].children) and n not in turned]
    skeleton = Skeleton(
        _names([nodes[n].name for n in order]),
        tuple(-1 if k == 0 else slots[parents[n]] for k, n in enumerate(order)),
        offsets,
        frozenset(k for k in tips if k > 0),
    )
    return Motion(skeleton, fps, places[:, 0], turns, places if stretched else None)


def _order(joints: frozenset[int], parents: list[int]) -> list[int]:
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


def _above(document: Document, nodes: list[_Node], line: list[int]) -> tuple[Array, Array, float]:
    """Place, turn and size of the fixed transforms over the root."""
    place, turn, size = np.zeros(3), rot.IDENTITY, 1.0
    for number in reversed(line):
        node = nodes[number]
        place = place + rot.rotate(turn, node.place * size)
        turn = rot.normalize(rot.multiply(turn, node.turn))
        size *= _uniform(document, node.scale, number)
    if not np.isfinite(place).all() or np.abs(place).max() > FAR or not 1e-9 < size < 1e9:
        raise document.bad("the transforms above its skeleton are absurdly large or small")
    return place, turn, size


def _uniform(document: Document, scale: Array, number: int) -> float:
    if not (scale > 1e-9).all() or np.ptp(scale) > 1e-3 * scale.max():
        raise document.bad(f"node {number} is scaled by {scale.tolist()}; only one positive scale for all axes is read")
    return float(scale.mean())


def _sizes(
    document: Document, nodes: list[_Node], order: list[int], *, curves: Curves, parents: list[int], first: float
) -> Array:
    """(joints,) factor of each joint's translation: the product of the scales above it."""
    sizes = np.full(len(order), first)
    slots = {node: k for k, node in enumerate(order)}
    for k, node in enumerate(order):
        if k > 0:
            parent = parents[node]
            scale = nodes[parent].scale
            if (parent, "scale") in curves:
                values = curves[parent, "scale"].values
                if np.ptp(values, axis=0).max() > 1e-3 * np.abs(values).max():
                    raise document.bad(f"the scale of node {parent} changes through time, which is not supported")
                scale = values[0]
            sizes[k] = sizes[slots[parent]] * _uniform(document, scale, parent)
    if not (np.isfinite(sizes).all() and (sizes < 1e9).all()):
        raise document.bad("its scales are absurdly large")
    return sizes


def _names(names: list[str]) -> tuple[str, ...]:
    """Unique names: the second ``hand`` becomes ``hand_2``."""
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
