"""A character's meshes at rest, with the joints that carry them: for files that are not the character's own."""

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError
from motionloom.io.glb import Document
from motionloom.io.gltf_nodes import printable
from motionloom.io.gltf_rig import Rig

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
MAX_PIECES = 4096
MAX_VERTICES = 2_000_000
GREY = (0.6, 0.6, 0.6)
Rest = dict[int, tuple[int | None, Array]]
"""Of every node the joint that carries it, None for what does not hang on the skeleton, and (4, 4) world_from_node."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles that follow a skeleton: linear blend skinning from the rest pose."""

    name: str
    points: Array
    """(vertices, 3) metres in the world, at rest."""
    normals: Array | None
    """(vertices, 3) of unit length."""
    texture: Array | None
    """(vertices, 2) texture coordinates as glTF has them, from the upper left."""
    triangles: Whole
    """(triangles, 3) counter-clockwise from outside."""
    joints: Whole
    """(vertices, influences) numbers of the skeleton's joints."""
    weights: Array
    """(vertices, influences), each row adding up to 1."""
    colour: tuple[float, ...] = GREY
    """Red, green, blue, linear, 0 to 1."""


def read_surfaces(rig: Rig, *, remark: bool = False) -> list[Surface]:
    """The meshes that hang on a rig, skinned or not, in the rig's rest pose.

    What is compressed (Draco, meshopt) or stored in another unusual way is left out, so that the list may be empty;
    ``remark``: with a warning.
    Raises `MotionloomError` for a file that declares more than memory should hold.
    """
    file, document = rig.file, rig.file.document
    joints: dict[int, int | None] = {n: k for k, n in enumerate(rig.nodes)}
    for n in file.order:
        joints.setdefault(n, joints.get(file.parents[n]))
    rest = {n: (joints[n], matrix) for n, matrix in rig.rest.items()}
    surfaces: list[Surface] = []
    pieces = vertices = unread = 0
    for number, entry in enumerate(document.items("nodes")):
        if entry.get("mesh") is None:
            continue
        mesh = document.item("meshes", entry["mesh"])
        for piece in document.items("primitives", mesh):
            pieces += 1
            try:
                surface = _Wearer(document, rest, number, entry).surface(piece)
            except MotionloomError:
                unread += 1
                continue  # compressed, sparse or damaged: what moves does not depend on it
            if surface is not None:
                surfaces.append(surface)
                vertices += len(surface.points)
            if pieces > MAX_PIECES or vertices > MAX_VERTICES:
                raise document.bad(f"it has more than {MAX_PIECES} pieces of mesh or {MAX_VERTICES:,} vertices")
    if remark and unread:
        warnings.warn(
            f"{document.name}: {unread} of its {pieces} pieces of mesh are left out (compressed, sparse or damaged)",
            stacklevel=2,
        )
    return surfaces


@dataclass(frozen=True)
class _Wearer:
    """A node that has a mesh."""

    document: Document
    rest: Rest
    number: int
    entry: dict[str, Any]

    def surface(self, piece: dict[str, Any]) -> Surface | None:
        """A piece of its mesh; None for what is no triangles, or hangs on nobody."""
        document = self.document
        attributes = piece.get("attributes")
        if not isinstance(attributes, dict) or piece.get("mode", 4) != 4:
            return None
        points = document.accessor(attributes.get("POSITION"), "VEC3", "the places of a mesh")
        if len(points) > MAX_VERTICES:
            raise document.bad(f"a mesh has {len(points):,} vertices")
        carried = self.influences(attributes, len(points))
        if carried is None:
            return None
        joints, weights, moves = carried
        blend = np.einsum("vk,vkab->vab", weights, moves)
        normals = _optional(document, attributes.get("NORMAL"), "VEC3", len(points))
        if normals is not None:
            normals = np.einsum("vab,vb->va", blend[:, :3, :3], normals)
            normals = normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
        return Surface(
            printable(self.entry.get("name")) or f"mesh_{self.number}",
            np.einsum("vab,vb->va", blend[:, :3, :3], points) + blend[:, :3, 3],
            normals,
            _optional(document, attributes.get("TEXCOORD_0"), "VEC2", len(points)),
            _triangles(document, piece.get("indices"), len(points)),
            joints,
            weights,
            _colour(document, piece.get("material")),
        )

    def influences(self, attributes: dict[str, Any], count: int) -> tuple[Whole, Array, Array] | None:
        """Joints, weights (vertices, k), and world_from_mesh at rest (vertices, k, 4, 4) as each joint carries it."""
        document, rest = self.document, self.rest
        if self.entry.get("skin") is None:
            joint, matrix = rest[self.number]
            if joint is None:
                return None
            moves = np.broadcast_to(matrix, (count, 1, 4, 4))
            return np.full((count, 1), joint), np.ones((count, 1)), moves
        skin = document.item("skins", self.entry["skin"])
        listed = [document.index(n, len(rest), "nodes") for n in skin.get("joints", [])]
        carriers = [rest[n][0] for n in listed]
        if not listed or None in carriers:
            return None
        binds = np.tile(np.eye(4), (len(listed), 1, 1))
        if skin.get("inverseBindMatrices") is not None:
            flat = document.accessor(skin["inverseBindMatrices"], "MAT4", "inverse bind matrices")
            binds = flat.reshape(-1, 4, 4).transpose(0, 2, 1)[: len(listed)]
            if len(binds) < len(listed):
                raise document.bad(f"a skin has {len(listed)} joints and {len(binds)} inverse bind matrices")
        moves = np.array([rest[n][1] @ bind for n, bind in zip(listed, binds, strict=True)])
        sets = [k for k in range(8) if f"JOINTS_{k}" in attributes]
        which = [document.accessor(attributes[f"JOINTS_{k}"], "VEC4", "the joints of a mesh") for k in sets]
        shares = [document.accessor(attributes.get(f"WEIGHTS_{k}"), "VEC4", "the weights of a mesh") for k in sets]
        if not sets or any(len(part) != count for part in (*which, *shares)):
            return None
        numbers = np.concatenate(which, axis=1).astype(np.int64)
        weights = np.concatenate(shares, axis=1)
        total = weights.sum(axis=1, keepdims=True)
        if numbers.max() >= len(listed) or not (total > 0).all():
            return None
        joints = np.array(carriers, dtype=np.int64)[numbers]
        return joints, weights / total, moves[numbers]


def _optional(document: Document, number: Any, kind: str, count: int) -> Array | None:
    if number is None:
        return None
    values = document.accessor(number, kind, "a mesh's attributes")
    return values if len(values) == count else None


def _triangles(document: Document, number: Any, count: int) -> Whole:
    flat = np.arange(count) if number is None else document.accessor(number, "SCALAR", "the triangles of a mesh")[:, 0]
    indices = flat[: len(flat) - len(flat) % 3].astype(np.int64).reshape(-1, 3)
    if len(indices) and (indices.max() >= count or indices.min() < 0):
        raise document.bad("a triangle names a vertex that is not there")
    return indices


def _colour(document: Document, number: Any) -> tuple[float, ...]:
    """The base colour of a material, without its textures."""
    materials = document.items("materials")
    if number is None:
        return GREY
    surface = materials[document.index(number, len(materials), "materials")].get("pbrMetallicRoughness")
    factor = surface.get("baseColorFactor") if isinstance(surface, dict) else None
    if isinstance(surface, dict) and surface.get("baseColorTexture") is not None and factor is None:
        return GREY
    if factor is not None:
        return tuple(document.numbers(factor, 4, "a colour")[:3].clip(0, 1).tolist())
    return GREY
