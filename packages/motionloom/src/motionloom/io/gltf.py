"""glTF 2.0 binary files (GLB), in and out.

A file holds the skeleton as a tree of named nodes in rest pose, a skinned body that follows them, and one
animation in which everybody moves. glTF's conventions are ours: metres, +Y up, a person faces +Z; only
quaternions are (x, y, z, w) there.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.files.atomic import atomic_path
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Skeleton
from motionloom.io import body as bodies
from motionloom.io.body import MATERIALS, Piece, check_people
from motionloom.io.glb import add_channel, entry_of, new_animation, pack_glb
from motionloom.io.gltf_read import load_glb, load_glb_people

__all__ = ["load_glb", "load_glb_people", "save_glb"]

Array = NDArray[np.float64]
_LISTS = ("nodes", "skins", "meshes", "materials", "accessors", "bufferViews")
_VERTICES, _INDICES = 34962, 34963  # what a buffer view is for


class _File:
    """A glTF document under construction, with its binary data."""

    def __init__(self, fps: float) -> None:
        self.data = bytearray()
        self.scene: list[int] = []
        self.animation = new_animation("motion", fps)
        self.lists: dict[str, list[dict[str, Any]]] = {part: [] for part in _LISTS}

    def append(self, part: str, entry: dict[str, Any]) -> int:
        """Append to a list of the document; gives the entry's number."""
        self.lists[part].append(entry)
        return len(self.lists[part]) - 1

    def add(self, values: np.ndarray, kind: str = "<f4", *, target: int | None = None, bounds: bool = False) -> int:
        """Append an array (count, width) and describe it; gives the accessor's number."""
        array = np.ascontiguousarray(values, dtype=kind).reshape(len(values), -1)
        self.data.extend(bytes(-len(self.data) % 4))
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": array.nbytes}
        number = self.append("bufferViews", view | ({} if target is None else {"target": target}))
        self.data.extend(array.tobytes())
        ends = {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()} if bounds else {}
        return self.append("accessors", entry_of(array.dtype, array.shape, {"bufferView": number}) | ends)

    def key(self, node: int, path: str, clock: int, values: np.ndarray) -> None:
        """Let the animation move a node at the times of the accessor ``clock``."""
        add_channel(self.animation, node, path, clock, self.add(values))

    def packed(self) -> bytes:
        """The whole file."""
        self.data.extend(bytes(-len(self.data) % 4))
        document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "motionloom"},
            "scene": 0,
            "scenes": [{"nodes": self.scene}],
            "animations": [self.animation],
            "buffers": [{"byteLength": len(self.data)}],
        }
        lists = {part: entries for part, entries in self.lists.items() if entries}
        return pack_glb(document | lists, bytes(self.data))


def save_glb(
    motions: Sequence[Motion], path: str | Path, *, body: bool = True, names: Sequence[str] | None = None
) -> Path:
    """Write motions as one GLB: one tree of joints per person, one animation for all, a skinned mesh if ``body``.

    ``names`` of the people, one per motion, go to the nodes over their trees.

    Nodes are in rest pose (every rotation the identity); rotations are keyed for every joint but bone tips, places
    for the root and, where a motion has `Motion.translations`, for every joint.
    Errors: no motions, names of another count, or a path that cannot be written.
    """
    check_people(motions, names)
    with atomic_path(path) as temp:
        temp.write_bytes(glb_bytes(motions, body=body, names=names))
    return Path(path)


def glb_bytes(motions: Sequence[Motion], *, body: bool = True, names: Sequence[str] | None = None) -> bytes:
    """What `save_glb` writes."""
    file = _File(motions[0].fps)
    clocks: dict[tuple[float, int], int] = {}
    for number, motion in enumerate(motions):
        tail = "" if len(motions) == 1 else f"_{number + 1}"
        first = len(file.lists["nodes"]) + 1
        # A node of one's own over each tree: Blender makes one armature of all trees that are side by side.
        name = f"person{tail}" if names is None else names[number]
        file.scene.append(file.append("nodes", {"name": name, "children": [first]}))
        _add_nodes(file, motion.skeleton, first)
        clock = (motion.fps, len(motion))
        if clock not in clocks:
            clocks[clock] = file.add(np.arange(len(motion))[:, None] / motion.fps, bounds=True)
        _animate(file, motion, first=first, clock=clocks[clock])
        if body:
            file.scene += _dress(file, motion, first, name=f"body{tail}")
    return file.packed()


def _add_nodes(file: _File, skeleton: Skeleton, first: int) -> None:
    for j, name in enumerate(skeleton.names):
        children = [first + c for c in skeleton.children(j)]
        place = skeleton.offsets[j].astype("f4").astype(float).tolist()
        below = {"children": children} if children else {}
        file.append("nodes", {"name": name, "translation": place} | below)


def _animate(file: _File, motion: Motion, *, first: int, clock: int) -> None:
    turns = np.roll(rot.unroll(rot.normalize(motion.rotations)), -1, axis=-1)
    for j in range(len(motion.skeleton)):
        if j not in motion.skeleton.ends:
            file.key(first + j, "rotation", clock, turns[:, j])
        if j == 0:
            file.key(first, "translation", clock, motion.root)
        elif motion.translations is not None:
            file.key(first + j, "translation", clock, motion.translations[:, j])


def _dress(file: _File, motion: Motion, first: int, name: str) -> list[int]:
    """Add a skin and a skinned mesh; gives its node, which belongs at the top of the scene (glTF 2.0, 3.7.3.3)."""
    pieces = bodies.body(motion)
    if not pieces:
        return []
    skeleton = motion.skeleton
    rest = skeleton.rest_positions()
    binds = np.tile(np.eye(4), (len(skeleton), 1, 1))
    binds[:, 3, :3] = -rest  # column-major: the last column lies in the last row
    joints = list(range(first, first + len(skeleton)))
    matrices = file.add(binds.reshape(-1, 16))
    about = {"name": name, "joints": joints, "skeleton": first, "inverseBindMatrices": matrices}
    skin = file.append("skins", about)
    sides = sorted({p.side for p in pieces})
    primitives = [_primitive(file, [p for p in pieces if p.side == side], rest, side) for side in sides]
    mesh = file.append("meshes", {"name": name, "primitives": primitives})
    return [file.append("nodes", {"name": name, "mesh": mesh, "skin": skin})]


def _primitive(file: _File, pieces: list[Piece], rest: Array, side: int) -> dict[str, Any]:
    points = np.concatenate([p.points + rest[p.joint] for p in pieces])
    starts = np.cumsum([0, *(len(p.points) for p in pieces)])
    indices = np.concatenate([p.triangles.ravel() + start for p, start in zip(pieces, starts)])
    joints = np.zeros((len(points), 4), dtype=int)
    joints[:, 0] = np.repeat([p.joint for p in pieces], [len(p.points) for p in pieces])
    weights = np.tile([1.0, 0.0, 0.0, 0.0], (len(points), 1))
    attributes = {
        "POSITION": file.add(points, target=_VERTICES, bounds=True),
        "NORMAL": file.add(np.concatenate([p.normals for p in pieces]), target=_VERTICES),
        "JOINTS_0": file.add(joints, "<u1" if len(rest) <= 256 else "<u2", target=_VERTICES),
        "WEIGHTS_0": file.add(weights, target=_VERTICES),
    }
    faces = file.add(indices[:, None], "<u2" if len(points) < 65535 else "<u4", target=_INDICES)
    material = _material(file, side)
    return {"attributes": attributes, "indices": faces, "material": material}


def _material(file: _File, side: int) -> int:
    name, colour = MATERIALS[side]
    for number, material in enumerate(file.lists["materials"]):
        if material["name"] == name:
            return number
    surface = {"baseColorFactor": [*colour, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.75}
    return file.append("materials", {"name": name, "pbrMetallicRoughness": surface})
