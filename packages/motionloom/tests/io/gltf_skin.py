"""A glTF file's meshes at given times, computed from the specification alone and with nothing of the package."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

_KINDS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Scene:
    """The JSON of a .glb, its binary part, and what moves in it."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        (length,) = struct.unpack_from("<I", data, 12)
        self.json: dict[str, Any] = json.loads(data[20 : 20 + length])
        self.binary = data[28 + length :]
        self.nodes = self.json["nodes"]
        self.parents = {c: i for i, node in enumerate(self.nodes) for c in node.get("children", [])}

    def clip(self, name: str) -> dict[str, Any]:
        return next(a for a in self.json["animations"] if a.get("name") == name)

    def values(self, number: int) -> np.ndarray:
        accessor = self.json["accessors"][number]
        view = self.json["bufferViews"][accessor["bufferView"]]
        dtype, width = np.dtype(_KINDS[accessor["componentType"]]), _WIDTHS[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        stride, row = view.get("byteStride") or dtype.itemsize * width, dtype.itemsize * width
        raw = np.frombuffer(self.binary, np.uint8, stride * (accessor["count"] - 1) + row, start)
        rows = np.lib.stride_tricks.as_strided(raw, (accessor["count"], row), (stride, 1))
        found = np.ascontiguousarray(rows).view(dtype).reshape(accessor["count"], width).astype(float)
        if accessor.get("normalized"):
            found = np.maximum(found / np.iinfo(dtype).max, -1.0)
        return found

    def span(self, clip: dict[str, Any]) -> tuple[float, float]:
        ends = [self.values(s["input"])[[0, -1], 0] for s in clip["samplers"]]
        return min(e[0] for e in ends), max(e[1] for e in ends)

    def worlds(self, clip: dict[str, Any] | None, times: np.ndarray) -> np.ndarray:
        """(frames, nodes, 4, 4)."""
        moved: dict[tuple[int, str], np.ndarray] = {}
        for channel in clip["channels"] if clip else []:
            if channel["target"]["path"] != "weights":
                sampler = clip["samplers"][channel["sampler"]]  # type: ignore[index]
                key = (channel["target"]["node"], channel["target"]["path"])
                moved[key] = _sampled(
                    self.values(sampler["input"])[:, 0], self.values(sampler["output"]), sampler, times
                )
        local = np.zeros((len(times), len(self.nodes), 4, 4))
        for i, node in enumerate(self.nodes):
            if "matrix" in node:
                local[:, i] = np.array(node["matrix"]).reshape(4, 4).T
                continue
            turn = moved.get((i, "rotation"), np.array([node.get("rotation", [0, 0, 0, 1])], float))
            scale = moved.get((i, "scale"), np.array([node.get("scale", [1, 1, 1])], float))
            local[:, i, :3, :3] = _matrix(turn) * scale[:, None, :]
            local[:, i, :3, 3] = moved.get((i, "translation"), np.array([node.get("translation", [0, 0, 0])], float))
            local[:, i, 3, 3] = 1
        world = local.copy()
        done: set[int] = set()

        def finish(i: int) -> None:
            if i not in done:
                done.add(i)
                if i in self.parents:
                    finish(self.parents[i])
                    world[:, i] = world[:, self.parents[i]] @ local[:, i]

        for i in range(len(self.nodes)):
            finish(i)
        return world

    def vertices(self, world: np.ndarray, *, at_most: int = 500) -> dict[int, np.ndarray]:
        """(frames, vertices, 3) of some vertices of each node with a mesh: skinned, or as their node moves."""
        found: dict[int, np.ndarray] = {}
        for i, node in enumerate(self.nodes):
            if "mesh" not in node:
                continue
            pieces = []
            for primitive in self.json["meshes"][node["mesh"]]["primitives"]:
                attributes = primitive["attributes"]
                points = self.values(attributes["POSITION"])
                points = np.concatenate([points, np.ones((len(points), 1))], axis=1)
                step = max(1, len(points) // at_most)
                if "skin" not in node:
                    pieces.append(np.einsum("fab,vb->fva", world[:, i], points[::step]))
                    continue
                skin = self.json["skins"][node["skin"]]
                binds = self.values(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
                bones = world[:, skin["joints"]] @ binds
                weights = self.values(attributes["WEIGHTS_0"])[::step]
                joints = self.values(attributes["JOINTS_0"])[::step].astype(int)
                mixed = np.zeros((len(world), len(weights), 4))
                for k in range(4):
                    moved = np.einsum("fvab,vb->fva", bones[:, joints[:, k]], points[::step])
                    mixed += weights[:, k, None] * moved
                pieces.append(mixed / weights.sum(axis=1)[:, None])
            found[i] = np.concatenate(pieces, axis=1)[..., :3]
        return found

    def used(self, node: int) -> np.ndarray:
        """Numbers of the vertices of `vertices` (all of them) that triangles name, in their order."""
        pieces, start = [], 0
        for primitive in self.json["meshes"][self.nodes[node]["mesh"]]["primitives"]:
            count = self.json["accessors"][primitive["attributes"]["POSITION"]]["count"]
            named = self.values(primitive["indices"])[:, 0] if "indices" in primitive else np.arange(count)
            pieces.append(start + np.unique(named.astype(int)))
            start += count
        return np.concatenate(pieces)

    def weight_of(self, node: int, joints: set[int], *, at_most: int = 500) -> np.ndarray:
        """(vertices,) how much of each vertex of `vertices` follows the given joints."""
        pieces = []
        for primitive in self.json["meshes"][self.nodes[node]["mesh"]]["primitives"]:
            attributes = primitive["attributes"]
            count = self.json["accessors"][attributes["POSITION"]]["count"]
            step = max(1, count // at_most)
            if "skin" not in self.nodes[node]:
                line = node
                while line in self.parents and line not in joints:
                    line = self.parents[line]
                pieces.append(np.full(len(range(0, count, step)), float(line in joints)))
                continue
            mine = np.isin(self.json["skins"][self.nodes[node]["skin"]]["joints"], list(joints))
            weights = self.values(attributes["WEIGHTS_0"])[::step]
            chosen = mine[self.values(attributes["JOINTS_0"])[::step].astype(int)]
            pieces.append((weights * chosen).sum(axis=1) / weights.sum(axis=1))
        return np.concatenate(pieces)


def _sampled(keys: np.ndarray, values: np.ndarray, sampler: dict[str, Any], times: np.ndarray) -> np.ndarray:
    mode = sampler.get("interpolation", "LINEAR")
    low = np.clip(np.searchsorted(keys, times + 1e-6, side="right") - 1, 0, len(keys) - 1)
    high = np.minimum(low + 1, len(keys) - 1)
    gap = np.where(high > low, keys[high] - keys[low], 1.0)
    s = np.clip((times - keys[low]) / gap, 0, 1)[:, None] * (high > low)[:, None]
    if mode == "CUBICSPLINE":
        arrive, at, leave = values[0::3], values[1::3], values[2::3]
        g = gap[:, None]
        found = (2 * s**3 - 3 * s**2 + 1) * at[low] + (s**3 - 2 * s**2 + s) * g * leave[low]
        found = found + (3 * s**2 - 2 * s**3) * at[high] + (s**3 - s**2) * g * arrive[high]
    elif mode == "STEP":
        found = values[low]
    elif values.shape[1] == 4:
        a, b = values[low], values[high]
        dot = (a * b).sum(axis=1, keepdims=True)
        b = np.where(dot < 0, -b, b)
        angle = np.arccos(np.clip(np.abs(dot), 0, 1))
        sine = np.maximum(np.sin(angle), 1e-12)
        near = angle < 1e-6
        found = np.where(near, a * (1 - s) + b * s, (np.sin((1 - s) * angle) * a + np.sin(s * angle) * b) / sine)
    else:
        found = values[low] * (1 - s) + values[high] * s
    return found / np.linalg.norm(found, axis=1, keepdims=True) if values.shape[1] == 4 else found


def _matrix(q: np.ndarray) -> np.ndarray:
    x, y, z, w = np.moveaxis(q, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))
