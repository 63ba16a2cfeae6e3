"""The nodes of a glTF file: their names, their tree and their transforms at rest."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom import rotations as rot
from motionloom.io.glb import Document
from motionloom.io.gltf_curves import unit_quaternions

Array = NDArray[np.float64]
MAX_NODES = 20_000


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
    return Node(printable(name) or f"node_{number}", below, place, turn, scale)


def printable(name: Any) -> str:
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


def read_parents(document: Document, nodes: list[Node]) -> list[int]:
    """The parent of each node, -1 at the top; raises `MotionloomError` where the nodes are no trees."""
    parents = [-1] * len(nodes)
    for i, node in enumerate(nodes):
        for child in node.children:
            if parents[child] != -1:
                raise document.bad(f"node {child} has two parents")
            parents[child] = i
    if len(downwards(nodes, parents)) != len(nodes):
        raise document.bad("its nodes form a circle")
    return parents


def downwards(nodes: list[Node], parents: list[int]) -> list[int]:
    """All nodes that hang on a top node, parents before children."""
    order = [i for i, p in enumerate(parents) if p == -1]
    for i in order:  # grows while it is walked
        order.extend(nodes[i].children)
    return order


def upwards(node: int, parents: list[int]) -> list[int]:
    """The node and everything above it."""
    line = [node]
    while parents[line[-1]] != -1:
        line.append(parents[line[-1]])
    return line
