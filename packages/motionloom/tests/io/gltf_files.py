"""Motions to write as GLB, and glTF files of other people put together by hand."""

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton


def random_motion(seed: int, *, joints: int = 6, frames: int = 7, fps: float = 30.0, moving: bool = False) -> Motion:
    rng = np.random.default_rng(seed)
    parents = (-1, *(int(rng.integers(0, j)) for j in range(1, joints)))
    leaves = [j for j in range(1, joints) if j not in parents]
    ends = frozenset(leaves[: len(leaves) // 2])
    names = tuple(f"joint {j} ü" for j in range(joints))
    skeleton = Skeleton(names, parents, rng.normal(size=(joints, 3)), ends)
    turns = rot.normalize(rng.normal(size=(frames, joints, 4)))
    turns[:, list(ends)] = rot.IDENTITY
    moves = skeleton.offsets + rng.normal(size=(frames, joints, 3)) if moving else None
    return Motion(skeleton, fps, 10 * rng.normal(size=(frames, 3)), turns, moves)


def person(frames: int = 31, fps: float = 30.0) -> Motion:
    """Somebody who walks forward at 1 m/s without moving legs and lifts the left arm."""
    time = np.arange(frames) / fps
    turned = np.zeros((frames, 22, 3))
    turned[:, SMPL22.index("left_shoulder"), 2] = time
    root = np.stack([0 * time, np.full(frames, SMPL22.offsets[0, 1]), time], axis=-1)
    return Motion(SMPL22, fps, root, rot.rotvec_to_quat(turned))


class Foreign:
    """A small .gltf with embedded data, put together by hand."""

    def __init__(self, nodes: list[dict[str, Any]]) -> None:
        self.data = b""
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "nodes": nodes,
            "accessors": [],
            "bufferViews": [],
            "animations": [{"samplers": [], "channels": []}],
        }

    def add(self, values: Any, *, dtype: str = "<f4", **more: Any) -> int:
        array = np.asarray(values, dtype=dtype)
        array = array[:, None] if array.ndim == 1 else array
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": array.nbytes}
        kind = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[array.shape[1]]
        component = {"<f4": 5126, "<i2": 5122}[dtype]
        self.json["accessors"].append(
            {"bufferView": len(self.json["bufferViews"]), "componentType": component, "count": len(array), "type": kind}
            | more
        )
        self.json["bufferViews"].append(view)
        self.data += array.tobytes() + b"\0" * (-array.nbytes % 4)
        return len(self.json["accessors"]) - 1

    def key(self, node: int, path: str, times: Any, values: Any, *, mode: str = "LINEAR", **more: Any) -> "Foreign":
        animation = self.json["animations"][0]
        sampler = {"input": self.add(times), "output": self.add(values, **more), "interpolation": mode}
        animation["samplers"].append(sampler)
        target = {"node": node, "path": path}
        animation["channels"].append({"sampler": len(animation["samplers"]) - 1, "target": target})
        return self

    def write(self, folder: Path) -> Path:
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        path = folder / "foreign.gltf"
        path.write_text(json.dumps(self.json | {"buffers": [{"byteLength": len(self.data), "uri": uri}]}))
        return path


HALF = float(np.sqrt(0.5))
CHAIN = [{"name": "hip", "children": [1]}, {"name": "knee", "translation": [0, -1, 0]}]
