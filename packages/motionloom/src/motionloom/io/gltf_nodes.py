"""The nodes of a glTF file: their names, their tree and their transforms at rest."""

import warnings
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.io.glb import Document
from motionloom.io.gltf_curves import declared_fps, unit_quaternions

Array = NDArray[np.float64]
MAX_NODES = 20_000


def transform(place: Array, turn: Array, scale: Array) -> Array:
    """(4, 4) of its parts."""
    matrix = np.eye(4)
    matrix[:3, :3] = rot.quat_to_matrix(turn) * scale
    matrix[:3, 3] = place
    return matrix


@dataclass(frozen=True)
class Node:
    """One node, its transform taken apart."""

    name: str
    children: tuple[int, ...]
    place: Array
    """(3,) in its parent's frame."""
    turn: Array
    """(4,) w, x, y, z."""
    scale: Array
    """(3,)"""
    matrix: Array = field(init=False)
    """(4, 4) the three in one."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrix", transform(self.place, self.turn, self.scale))

    @property
    def rest(self) -> dict[str, Array]:
        """The transform as glTF writes it, by the path of a channel."""
        return {"translation": self.place, "rotation": np.roll(self.turn, -1), "scale": self.scale}


@dataclass(frozen=True)
class OpenedGlb:
    """A file's nodes, what moves them, and the joints of each person."""

    document: Document
    nodes: list[Node]
    parents: list[int]
    order: list[int]
    """All nodes, parents before children."""
    channels: list[dict[tuple[int, str], dict[str, Any]]]
    skins: list[list[int]]
    """The joints of every skin."""
    humanoid: dict[str, int]
    """The nodes of body parts, in files that name them."""
    clips: list[str]
    """The names of the animations, ``""`` where one has none."""
    people: list[frozenset[int]]
    loose: list[str]
    """The names of meshes that hang on nobody."""

    @property
    def lengths(self) -> list[tuple[str, float]]:
        """Name and seconds of each animation."""
        lengths = []
        for name, animation in zip(self.clips, self.document.items("animations")):
            ends = map(self._end, self.document.items("samplers", animation))
            lengths.append((name, max(ends, default=0.0)))
        return lengths

    def _end(self, sampler: dict[str, Any]) -> float:
        """When the keys of a sampler end, as its accessor says."""
        bounds = self.document.item("accessors", sampler.get("input")).get("max")
        right = isinstance(bounds, list) and len(bounds) == 1 and isinstance(bounds[0], int | float)
        return float(bounds[0]) if isinstance(bounds, list) and right else 0.0

    def chosen(self, clip: int | str | None, person: int) -> int | None:
        """The number, from 0, of the animation to read; None where nothing moves the person."""
        clips = self.clips
        if clip is None:
            animations, who = self.document.items("animations"), self.people[person]
            moving = [k for k, a in enumerate(self.channels) if any(n in who for n, _ in a)]
            ours = [k for k in moving if declared_fps(animations[k]) is not None]
            chosen = ours[-1:] or moving[:1]  # of a character the clip written last
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
        behind = [k for k, name in enumerate(clips) if name.rpartition("|")[2] == clip]  # "Armature|walk", of Blender
        if len(behind) == 1:
            return behind[0]
        number = int(clip) if isinstance(clip, int) or (clip.isdecimal() and len(clip) < 9) else 0
        if not 1 <= number <= len(clips):
            listed = ", ".join(f"{k} {name!r}" for k, name in enumerate(clips[:20], start=1))
            more = f" and {len(clips) - 20} more" if len(clips) > 20 else ""
            near = get_close_matches(str(clip), clips, n=1)
            hint = f"did you mean {near[0]!r}? There" if near else "there"
            raise MotionloomError(f"{self.document.name} has no clip {clip!r}; {hint} are {listed or 'none'}{more}")
        return number - 1


def read_nodes(document: Document) -> list[Node]:
    """All nodes; raises `MotionloomError` for what is none."""
    entries = document.items("nodes")
    if not 1 <= len(entries) <= MAX_NODES:
        raise document.bad(f"it has {len(entries)} nodes; 1 to {MAX_NODES} can be read")
    return [_node(document, i, entry, len(entries)) for i, entry in enumerate(entries)]


def _node(document: Document, number: int, entry: dict[str, Any], count: int) -> Node:
    name = entry.get("name")
    what = f"node {number}"
    children = entry.get("children", [])
    if not isinstance(children, list):
        raise document.bad(f"the children of {what} are not a list")
    place, turn, scale = np.zeros(3), rot.IDENTITY, np.ones(3)
    if entry.get("matrix") is not None:
        values = document.numbers(entry["matrix"], 16, f"the matrix of {what}")
        place, turn, scale = _decompose(document, values, what)
    else:
        if entry.get("translation") is not None:
            place = document.numbers(entry["translation"], 3, f"the translation of {what}")
        if entry.get("rotation") is not None:
            xyzw = document.numbers(entry["rotation"], 4, f"the rotation of {what}")
            turn = unit_quaternions(document, xyzw[None], f"the rotation of {what}")[0]
        if entry.get("scale") is not None:
            scale = document.numbers(entry["scale"], 3, f"the scale of {what}")
    below = tuple(document.index(c, count, "nodes") for c in children)
    return Node(printable(name) or f"node_{number}", below, place, turn, scale)


def printable(name: Any) -> str:
    """A name that can be shown and written anywhere."""
    if isinstance(name, str):
        return "".join(c if c.isprintable() else "_" for c in name[:200]).strip()
    return ""


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


def read_parents(document: Document, nodes: list[Node]) -> tuple[list[int], list[int]]:
    """The parent of each node, -1 at the top, and all nodes, parents first; raises `MotionloomError` for no trees."""
    parents = [-1] * len(nodes)
    for i, node in enumerate(nodes):
        for child in node.children:
            if parents[child] != -1:
                raise document.bad(f"node {child} has two parents")
            parents[child] = i
    order = [i for i, p in enumerate(parents) if p == -1]
    for i in order:  # grows while it is walked
        order.extend(nodes[i].children)
    if len(order) != len(nodes):
        raise document.bad("its nodes form a circle")
    return parents, order


def upwards(node: int, parents: list[int]) -> list[int]:
    """The node and everything above it."""
    line = [node]
    while parents[line[-1]] != -1:
        line.append(parents[line[-1]])
    return line
