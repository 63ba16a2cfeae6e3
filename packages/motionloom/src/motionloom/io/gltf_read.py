"""From a glTF document to a `Motion`: which nodes are a person, their rest pose, and their channels through time."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.io.glb import Document, read_document
from motionloom.io.gltf_curves import channels_of, clock, declared_fps, read_curves
from motionloom.io.gltf_nodes import Node, OpenedGlb, printable, read_nodes, read_parents, upwards
from motionloom.io.gltf_rig import Rig, humanoid_nodes, posed, read_rig

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


def open_glb(path: str | Path) -> OpenedGlb:
    """Read a file up to its animations' keys; raises `MotionloomError` for everything that is wrong with it."""
    document = read_document(path)
    nodes = read_nodes(document)
    parents, order = read_parents(document, nodes)
    channels = channels_of(document, len(nodes))
    skins, humanoid = _skins(document, len(nodes)), humanoid_nodes(document, len(nodes))
    clips = [printable(clip.get("name")) for clip in document.items("animations")]
    file = OpenedGlb(document, nodes, parents, order, channels, skins, humanoid, clips, [], [])
    people = _people(file)
    carriers = frozenset().union(*people)
    loose = [
        printable(entry.get("name")) or f"node_{number}"
        for number, entry in enumerate(document.items("nodes"))
        if entry.get("mesh") is not None and entry.get("skin") is None and carriers.isdisjoint(upwards(number, parents))
    ]
    return replace(file, people=people, loose=loose)


def read_rigs(path: str | Path) -> Iterator[Rig]:
    """Everybody in a file at rest, in its order; raises `MotionloomError` for everything that is wrong with it."""
    file = open_glb(path)
    for person in range(len(file.people)):
        yield read_rig(file, person, {})


def _motion(file: OpenedGlb, person: int, clip: int | None) -> Motion:
    document, joints = file.document, file.people[person]
    moved = {} if clip is None else file.channels[clip]
    curves = read_curves(document, {key: sampler for key, sampler in moved.items() if key[0] in joints})
    rig = read_rig(file, person, curves)
    nodes = set(rig.nodes)
    curves = {key: curve for key, curve in curves.items() if key[0] in nodes}
    rate = None if clip is None else declared_fps(document.items("animations")[clip])
    fps, times = clock(document, curves, len(rig.nodes), rate)
    return posed(rig, curves, fps=fps, times=times)


# --- who is a person ----------------------------------------------------------------------------------------------


def _people(file: OpenedGlb) -> list[frozenset[int]]:
    """The joints of each person, the topmost included."""
    order = file.order
    parents = file.parents
    skins = file.skins
    known = set(file.humanoid.values())
    animated = {node for animation in file.channels for node, _ in animation}
    if skins:  # one in several trees is a person in the tree with most of its joints
        groups = [max(_groups(set(skin), order, parents), key=len) for skin in skins]
    else:
        groups = _groups(animated | known, order, parents)
    if skins and known:
        groups = [max(_groups(known, order, parents), key=len), *groups]
    if not groups:
        raise file.document.bad(
            "it holds neither a skeleton (skin) nor an animation of nodes; export it with its armature"
        )
    marked = animated.union(*groups)
    people: dict[int, set[int]] = {}
    for group in groups:
        root = [n for n in upwards(group[0], parents) if n in marked][-1]
        people.setdefault(root, {root}).update(group)
    return [_body(root, members | animated | known, file.nodes, whole=not skins) for root, members in people.items()]


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
    """The given nodes by the tree they are in, each list headed by the lowest node above (or among) them all."""
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


def _body(root: int, members: set[int], nodes: list[Node], *, whole: bool) -> frozenset[int]:
    """The root and those below it that are members, or above one; all of them if ``whole``."""
    order = [root]
    for i in order:
        order.extend(nodes[i].children)
    if whole:
        return frozenset(order)
    body: set[int] = {root}
    for i in reversed(order):
        if i in members or any(c in body for c in nodes[i].children):
            body.add(i)
    return frozenset(body)
