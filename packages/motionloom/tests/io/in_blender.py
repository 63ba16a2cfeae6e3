"""Files as Blender shows them: places of bones and of vertices, in metres with +Y up. Needs bpy.

``MOTIONLOOM_BLENDER_PYTHON`` names a Python interpreter that can import bpy; without it bpy is looked for in this one.
"""

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.io.gltf_skin import Scene

VARIABLE = "MOTIONLOOM_BLENDER_PYTHON"

# Runs inside Blender: import each file the way a user does, then write down bones and vertices on every asked frame.
_SCRIPT = """
import json, sys
import bpy
import numpy as np

def matrix(values):
    return np.array([list(row) for row in values])

def read(job):
    if job["file"].endswith(".blend"):
        bpy.ops.wm.open_mainfile(filepath=job["file"])
    else:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.context.scene.render.fps = max(1, round(job["fps"]))
        bpy.context.scene.render.fps_base = max(1, round(job["fps"])) / job["fps"]
    scene = bpy.context.scene
    if job["file"].endswith(".blend"):
        pass
    elif job["file"].endswith(".bvh"):
        bpy.ops.import_anim.bvh(filepath=job["file"], update_scene_fps=True, update_scene_duration=True)
    else:
        bpy.ops.import_scene.gltf(filepath=job["file"])
        for owner in bpy.data.objects:
            moved = owner.animation_data
            if moved:
                strips = [strip for track in moved.nla_tracks for strip in track.strips if track.name == job["clip"]]
                moved.action = strips[0].action if strips else None
                if strips:
                    moved.action_slot = strips[0].action_slot
                for track in moved.nla_tracks:
                    track.mute = True
    found = {"fps": np.array(scene.render.fps / scene.render.fps_base)}
    bones, meshes = {}, {}
    for number, frame in enumerate(job["frames"]):
        scene.frame_set(frame)
        graph = bpy.context.evaluated_depsgraph_get()
        for thing in scene.objects:
            if thing.type == "ARMATURE":
                for bone in thing.pose.bones:
                    bones.setdefault(bone.name, []).append(list(thing.matrix_world @ bone.head))
            elif thing.type == "MESH":
                solid = thing.evaluated_get(graph)
                points = np.empty(3 * len(solid.data.vertices), dtype=np.float32)
                solid.data.vertices.foreach_get("co", points)
                whole = matrix(solid.matrix_world)
                points = points.reshape(-1, 3) @ whole[:3, :3].T + whole[:3, 3]
                meshes.setdefault(thing.name, []).append(points)
    found |= {"bone " + name: np.array(places) for name, places in bones.items()}
    return found | {"mesh " + name: np.array(places) for name, places in meshes.items()}

for job in json.load(open(sys.argv[1])):
    try:
        found = read(job)
    except Exception as error:
        found = {"error": np.array(str(error))}
    np.savez(job["out"], **found)
"""


@dataclass(frozen=True, eq=False)
class Shown:
    """What Blender shows of one file."""

    fps: float
    bones: dict[str, np.ndarray]
    """(frames, 3) by name."""
    meshes: dict[str, np.ndarray]
    """(frames, vertices, 3) by the object's name."""
    error: str = ""


@dataclass(frozen=True)
class Job:
    """A file to import, the clip of it to play, and the frames to look at, at a rate."""

    file: Path
    frames: tuple[int, ...]
    fps: float = 30.0
    clip: str = ""


def python_with_bpy() -> str | None:
    """The interpreter to run; None where there is none."""
    named = os.environ.get(VARIABLE)
    return named or (sys.executable if importlib.util.find_spec("bpy") is not None else None)


def shown(jobs: list[Job], *, seconds: float = 600) -> list[Shown]:
    """Blender's view of files, all in one process."""
    python = python_with_bpy()
    assert python is not None
    with tempfile.TemporaryDirectory() as folder:
        outs = [Path(folder) / f"{number}.npz" for number in range(len(jobs))]
        written = [
            {"file": str(job.file), "frames": job.frames, "fps": job.fps, "clip": job.clip, "out": str(out)}
            for job, out in zip(jobs, outs)
        ]
        listed = Path(folder) / "jobs.json"
        listed.write_text(json.dumps(written))
        ended = subprocess.run(
            [python, "-c", _SCRIPT, str(listed)], check=False, capture_output=True, text=True, timeout=seconds
        )
        assert ended.returncode == 0, ended.stderr[-2000:]
        return [_read(out) for out in outs]


def _read(path: Path) -> Shown:
    with np.load(path, allow_pickle=False) as found:
        if "error" in found:
            return Shown(0.0, {}, {}, str(found["error"]))
        kinds = {
            kind: {key.removeprefix(kind): _upright(found[key]) for key in found.files if key.startswith(kind)}
            for kind in ("bone ", "mesh ")
        }
        return Shown(float(found["fps"]), kinds["bone "], kinds["mesh "])


def _upright(places: np.ndarray) -> np.ndarray:
    """Blender's Z up and front at -Y to ours."""
    return np.stack([places[..., 0], places[..., 2], -places[..., 1]], axis=-1)


def apart(file: Path, clip: str, frames: tuple[int, ...], fps: float, seen: Shown) -> tuple[float, int]:
    """Metres between vertices of Blender and those of the specification (`gltf_skin`), the largest, and their count.

    Vertices that no triangle names are not in Blender. Meshes are paired by how near they are.
    """
    scene = Scene(file)
    world = scene.worlds(scene.clip(clip), np.array(frames) / fps)
    largest, count, left = 0.0, 0, dict(seen.meshes)
    for node, places in scene.vertices(world, at_most=10**9).items():
        places = places[:, scene.used(node)]
        near = {
            name: float(np.linalg.norm(other - places, axis=-1).max())
            for name, other in left.items()
            if other.shape == places.shape
        }
        assert near, f"Blender has no mesh of {places.shape[1]} vertices for {scene.nodes[node].get('name')}"
        name = min(near, key=lambda n: near[n])
        del left[name]
        largest, count = max(largest, near[name]), count + places.shape[1]
    return largest, count
