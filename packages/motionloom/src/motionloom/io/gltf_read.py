"""From a glTF document to a `Motion`: which nodes are a person, their rest pose, and their channels through time."""

import warnings
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from motionloom import rotations as rot
from motionloom.errors import MotionloomError
from motionloom.io.glb import Document, read_document
from motionloom.io.gltf_curves import Curve, Curves, channels_of, clock, declared_fps, read_curves
from motionloom.io.gltf_nodes import Node, downwards, printable, read_nodes, read_parents, upwards
from motionloom.io.gltf_rig import humanoid_nodes, posed, read_rig
from motionloom.motion import Motion

MAX_JOINTS = 10_000
MAX_SKINS = 64


def load_glb(path: str | Path, *, person: int = 0, clip: int | str | None = None) -> Motion:
    """Read the skeleton and animation of one person from a .glb or .vrm, or a .gltf with embedded buffers.

    A person is a skin's joints with everything animated above and below, or, in a file without skins, an animated
    tree of nodes. ``clip`` is the number, from 1, or the name of the animation to read; without it the newest that
    this program wrote is read, else the first that moves the person, with a warning where there are several. It is
    sampled at the frame rate of its keys; nodes that it leaves alone keep their rest; without animation the motion is
    one frame at rest. The skeleton's rest pose is the file's (`gltf_rig`). Transforms above the person's topmost joint
    are folded into the root, scales into the bones.
    Bone tips are leaves that nothing turns. Errors: `MotionloomError` for everything that is wrong with the file.
    """
    file = open_glb(path)
    if not 0 <= person < len(file.people):
        raise MotionloomError(f"{file.document.name} holds {len(file.people)} people; there is no number {person}")
    return _motion(file, person, file.chosen(clip, person))


def load_glb_people(path: str | Path, *, clip: int | str | None = None) -> list[Motion]:
    """Read everybody in a .glb, or a .gltf with embedded buffers, each as `load_glb` does, in the file's order."""
    file = open_glb(path)
    return [_motion(file, person, file.chosen(clip, person)) for person in range(len(file.people))]


@dataclass(frozen=True)
class OpenedGlb:
    """A file's nodes, what moves them, and the joints of each person."""

    document: Document
    nodes: list[Node]
    parents: list[int]
    channels: list[dict[tuple[int, str], dict[str, Any]]]
    people: list[frozenset[int]]

    @property
    def clips(self) -> list[str]:
        """The names of the animations, ``""`` where one has none."""
        return [printable(animation.get("name")) for animation in self.document.items("animations")]

    @property
    def lengths(self) -> list[tuple[str, float]]:
        """Name and seconds of each animation."""
        found = []
        for name, animation in zip(self.clips, self.document.items("animations")):
            ends = [self._end(sampler) for sampler in self.document.items("samplers", animation)]
            found.append((name, max(ends, default=0.0)))
        return found

    def _end(self, sampler: dict[str, Any]) -> float:
        """When the keys of a sampler end, as its accessor says."""
        accessors = self.document.items("accessors")
        bounds = accessors[self.document.index(sampler.get("input"), len(accessors), "accessors")].get("max")
        right = isinstance(bounds, list) and len(bounds) == 1 and isinstance(bounds[0], int | float)
        return float(bounds[0]) if isinstance(bounds, list) and right else 0.0

    def chosen(self, clip: int | str | None, person: int) -> int | None:
        """The number, from 0, of the animation to read; None where nothing moves the person."""
        clips = self.clips
        if clip is None:
            moving = [k for k, a in enumerate(self.channels) if any(node in self.people[person] for node, _ in a)]
            ours = [k for k in moving if declared_fps(self.document.items("animations")[k]) is not None]
            chosen = ours[-1:] or moving[:1]  # a character comes back with what was made last for it
            if len(moving) > 1:
                name = f"number {chosen[0] + 1}" + (f", {clips[chosen[0]]!r}" if clips[chosen[0]] else "")
                newest = ", the newest of this program's," if ours else ","
                warnings.warn(
                    f"{self.document.name} has {len(moving)} clips and none was chosen; {name}{newest} is read (--clip "
                    "picks another by its name or number, info lists them)",
                    stacklevel=3,
                )
            return chosen[0] if chosen else None
        if str(clip) in clips:
            return clips.index(str(clip))
        number = int(clip) if isinstance(clip, int) or (clip.isdecimal() and len(clip) < 9) else 0
        if not 1 <= number <= len(clips):
            listed = ", ".join(f"{k} {name!r}" for k, name in enumerate(clips[:20], start=1))
            more = f" and {len(clips) - 20} more" if len(clips) > 20 else ""
            near = get_close_matches(str(clip), clips, n=1)
            meant = f"did you mean {near[0]!r}? There" if near else "there"
            raise MotionloomError(f"{self.document.name} has no clip {clip!r}; {meant} are {listed or 'none'}{more}")
        return number - 1


def open_glb(path: str | Path) -> OpenedGlb:
    """Read a file up to its animations' keys; raises `MotionloomError` for everything that is wrong with it."""
    document = read_document(path)
    nodes = read_nodes(document)
    parents = read_parents(document, nodes)
    channels = channels_of(document, len(nodes))
    return OpenedGlb(document, nodes, parents, channels, _people(document, nodes, parents, channels))


def _motion(file: OpenedGlb, person: int, clip: int | None) -> Motion:
    document, parents = file.document, file.parents
    moved = {} if clip is None else file.channels[clip]
    joints = file.people[person]
    curves = read_curves(document, {key: sampler for key, sampler in moved.items() if key[0] in joints})
    nodes, joints, curves = without_still_armatures(file, person, curves)
    declared = None if clip is None else declared_fps(document.items("animations")[clip])
    fps, times = clock(document, curves, len(joints), declared)
    turned = {node for node, path in curves if path == "rotation"}
    tips = frozenset(n for n in joints if curves and not joints.intersection(nodes[n].children) and n not in turned)
    rig = read_rig(document, nodes, parents, joints=joints, tips=tips)
    return posed(rig, document, nodes, parents, curves=curves, fps=fps, times=times)


# --- who is a person ----------------------------------------------------------------------------------------------


def _people(
    document: Document, nodes: list[Node], parents: list[int], channels: list[dict[tuple[int, str], dict[str, Any]]]
) -> list[frozenset[int]]:
    """The joints of each person, the topmost included."""
    animated = {node for animation in channels for node, _ in animation}
    skins = _skins(document, len(nodes))
    known = set(humanoid_nodes(document, len(nodes)).values())
    order = downwards(nodes, parents)
    if skins:  # a skin in several trees is the person in the one with most of its joints
        groups = [max(_groups(set(skin), order, parents), key=len) for skin in skins]
    else:
        groups = _groups(animated | known, order, parents)
    if skins and known:
        groups = [max(_groups(known, order, parents), key=len), *groups]
    if not groups:
        raise document.bad("it holds neither a skeleton (skin) nor an animation of nodes; export it with its armature")
    marked = animated.union(*groups)
    people: dict[int, set[int]] = {}
    for group in groups:
        root = [n for n in upwards(group[0], parents) if n in marked or n == group[0]][-1]
        people.setdefault(root, {root}).update(group)
    return [_body(root, wanted | animated | known, nodes, whole=not skins) for root, wanted in people.items()]


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


def without_still_armatures(file: OpenedGlb, person: int, curves: Curves) -> tuple[list[Node], frozenset[int], Curves]:
    """Let go of armature objects over the skeleton that are keyed but never move: they become fixed transforms."""
    joints, parents = file.people[person], file.parents
    if len(joints) > MAX_JOINTS:
        raise file.document.bad(f"its skeleton has {len(joints)} joints; at most {MAX_JOINTS} can be read")
    kept = {j for skin in _skins(file.document, len(file.nodes)) for j in skin} or joints
    nodes = list(file.nodes)
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


def _body(root: int, wanted: set[int], nodes: list[Node], *, whole: bool) -> frozenset[int]:
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
