"""Characters made by hand: glTF files of a person whose bones have turned axes, with a skinned mesh."""

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.skeleton import SMPL22


class Hero:
    """The uniform person as somebody else's character: every bone's axes turned, a prism of mesh around each bone."""

    def __init__(self, *, seed: int = 0, hang: dict[str, str] | None = None, size: float = 1.0) -> None:
        rng = np.random.default_rng(seed)
        self.size = size
        self.turns = rot.normalize(rng.normal(size=(22, 4)))
        """(22, 4) world_from_node at rest."""
        parents = list(SMPL22.parents)
        for child, parent in (hang or {}).items():
            parents[SMPL22.index(child)] = SMPL22.index(parent)
        places = SMPL22.rest_positions() * size
        self.parents = [-1 if p < 0 else p for p in parents]
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "by hand"},
            "scene": 0,
            "scenes": [{"nodes": [22, 24]}],
            "nodes": [],
            "extras": {"kept": [1.5, "ü", None, True]},
        }
        for j, name in enumerate(SMPL22.names):
            above = parents[j]
            base = np.zeros(3) if above < 0 else places[above]
            turn = rot.IDENTITY if above < 0 else self.turns[above]
            local = rot.multiply(rot.inverse(turn), self.turns[j])
            self.json["nodes"].append(
                {
                    "name": name,
                    "translation": rot.rotate(rot.inverse(turn), places[j] - base).tolist(),
                    "rotation": np.roll(local, -1).tolist(),
                    "children": [c for c in range(22) if parents[c] == j],
                    "extras": {"number": j},
                }
            )
        self.json["nodes"][20]["children"].append(23)
        for node in self.json["nodes"]:
            if not node["children"]:
                del node["children"]
        self.json["nodes"] += [
            {"name": "root", "children": [0]},
            {"name": "finger", "translation": [0.05, 0.02, 0.01], "rotation": [0.5, 0.5, 0.5, 0.5]},
            {"name": "body", "mesh": 0, "skin": 0},
        ]
        self.places = places
        self.data = bytearray()
        self.json |= {"bufferViews": [], "accessors": []}
        self._mesh()

    def add(self, values: np.ndarray, kind: int, form: str, **more: Any) -> int:
        array = np.ascontiguousarray(values, {5126: "<f4", 5121: "<u1", 5123: "<u2"}[kind])
        self.data += bytes(-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": array.nbytes}
        self.json["bufferViews"].append(view)
        self.data += array.tobytes()
        accessor = {"bufferView": len(self.json["bufferViews"]) - 1, "componentType": kind, "count": len(array)}
        self.json["accessors"].append(accessor | {"type": form} | more)
        return len(self.json["accessors"]) - 1

    def values(self, number: int, width: int) -> np.ndarray:
        """(count, width) of an accessor of floats."""
        view = self.json["bufferViews"][self.json["accessors"][number]["bufferView"]]
        data = self.data[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        return np.frombuffer(bytes(data), "<f4").reshape(-1, width)

    def _mesh(self) -> None:
        points, joints = [], []
        for j, p in enumerate(SMPL22.parents):
            start, end = self.places[max(p, 0)], self.places[j]
            for axis in np.concatenate([np.eye(3), -np.eye(3)]) * 0.05 * self.size:
                points += [start + axis, (start + end) / 2 + axis, end + axis]
                joints += [max(p, 0), max(p, 0), j]
        binds = np.tile(np.eye(4), (23, 1, 1))
        for j in range(22):
            binds[j, :3, :3] = rot.quat_to_matrix(self.turns[j])
            binds[j, :3, 3] = self.places[j]
        binds[22] = binds[20]
        corners = np.array(points)
        weights = np.tile([1.0, 0, 0, 0], (len(points), 1))
        indices = np.zeros((len(points), 4))
        indices[:, 0] = joints
        bounds = {"min": corners.astype("<f4").min(0).tolist(), "max": corners.astype("<f4").max(0).tolist()}
        attributes = {
            "POSITION": self.add(corners, 5126, "VEC3", **bounds),
            "JOINTS_0": self.add(indices, 5121, "VEC4"),
            "WEIGHTS_0": self.add(weights, 5126, "VEC4"),
        }
        faces = self.add(np.arange(len(points) - len(points) % 3), 5123, "SCALAR")
        self.json["meshes"] = [{"primitives": [{"attributes": attributes, "indices": faces}]}]
        inverse = np.linalg.inv(binds).transpose(0, 2, 1).reshape(-1, 16)
        inverse[:, [3, 7, 11]], inverse[:, 15] = 0.0, 1.0
        matrices = self.add(inverse, 5126, "MAT4")
        self.json["skins"] = [{"joints": [*range(22), 23], "inverseBindMatrices": matrices}]

    def clip(self, name: str, angles: np.ndarray, *, fps: float = 30.0) -> "Hero":
        """Add an animation that turns each bone by rotation vectors (frames, 22, 3) against its rest, world axes."""
        times = self.add(np.arange(len(angles)) / fps, 5126, "SCALAR", min=[0.0], max=[(len(angles) - 1) / fps])
        animation: dict[str, Any] = {"name": name, "samplers": [], "channels": []}
        for j in range(22):
            above = self.parents[j]
            base = rot.IDENTITY if above < 0 else self.turns[above]
            turn = rot.multiply(rot.rotvec_to_quat(angles[:, j]), self.turns[j])
            local = np.roll(rot.multiply(rot.inverse(base), turn), -1, axis=-1)
            animation["samplers"].append({"input": times, "output": self.add(local, 5126, "VEC4")})
            target = {"node": j, "path": "rotation"}
            animation["channels"].append({"sampler": len(animation["samplers"]) - 1, "target": target})
        self.json.setdefault("animations", []).append(animation)
        return self

    def write(self, path: Path, *, others: Sequence[tuple[bytes, bytes]] = ()) -> Path:
        content = self.json | {"buffers": [{"byteLength": len(self.data)}]}
        text = json.dumps(content, ensure_ascii=False).encode()
        text += b" " * (-len(text) % 4)
        body = b""
        for kind, part in [(b"JSON", text), (b"BIN\0", bytes(self.data) + bytes(-len(self.data) % 4)), *others]:
            body += struct.pack("<I", len(part)) + kind + part
        path.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body)
        return path


def wave(frames: int = 40, seed: int = 1) -> np.ndarray:
    """(frames, 22, 3) smooth rotation vectors of some tenths of a radian."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0, 2 * np.pi, frames)[:, None, None]
    angles = 0.35 * rng.normal(size=(1, 22, 3)) * np.sin(time + rng.uniform(0, 6, size=(1, 22, 1)))
    angles[:, 0] *= 0.3
    return angles
