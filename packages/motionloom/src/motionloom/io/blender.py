"""FBX, in and out, through Blender: an installed program, or the Python package bpy. Nothing else here reads FBX.

Blender runs as a process of its own, without a window and without the user's settings, and turns one file into
another: FBX into a GLB, which is read as any other, or a GLB into FBX.
"""

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from motionloom.core.errors import MotionloomError, one_line
from motionloom.core.files.atomic import atomic_path

VARIABLE = "MOTIONLOOM_BLENDER"
"""Environment variable with the place of Blender, or of a Python that can import bpy."""
SECONDS = 600.0
"""Longest conversion."""
_CHOSEN: ContextVar[Path | None] = ContextVar("blender", default=None)

# Runs inside Blender. Rates are whole numbers there, over a base.
_SCRIPT = """
import sys
import bpy
source, target, fps = sys.argv[-3], sys.argv[-2], float(sys.argv[-1])
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
if fps:
    scene.render.fps, scene.render.fps_base = max(1, round(fps)), max(1, round(fps)) / fps
if source.lower().endswith(".fbx"):
    bpy.ops.import_scene.fbx(filepath=source)
    for action in bpy.data.actions:
        action.name = action.name.split("|")[-1]
    bpy.ops.export_scene.gltf(filepath=target, export_format="GLB", export_animations=True, export_yup=True,
                              export_frame_range=False, export_force_sampling=True,
                              export_optimize_animation_size=False)
else:
    bpy.ops.import_scene.gltf(filepath=source)
    drawn = {bone.custom_shape for thing in bpy.data.objects if thing.pose for bone in thing.pose.bones}
    for shape in drawn - {None}:  # the importer's ball, which it draws bones with
        bpy.data.objects.remove(shape)
    ends = [a.frame_range[1] for a in bpy.data.actions] or [1]
    scene.frame_start, scene.frame_end = 0, max(1, round(max(ends)))
    bpy.ops.export_scene.fbx(filepath=target, object_types={"ARMATURE", "MESH", "EMPTY"}, add_leaf_bones=False,
                             bake_anim=True, bake_anim_use_nla_strips=False, bake_anim_use_all_actions=True,
                             bake_anim_force_startend_keying=True, bake_anim_simplify_factor=0.0,
                             apply_scale_options="FBX_SCALE_ALL", path_mode="COPY", embed_textures=True)
"""


@contextmanager
def using(blender: Path | None) -> Iterator[None]:
    """Within the block this Blender (None: one that is found) does the conversions."""
    token = _CHOSEN.set(blender)
    try:
        yield
    finally:
        _CHOSEN.reset(token)


def find_blender() -> list[str]:
    """The command that runs a script in Blender: the chosen one, `VARIABLE`'s, one on the path, or bpy here.

    Raises `MotionloomError` where there is none.
    """
    chosen = _CHOSEN.get() or (Path(os.environ[VARIABLE]) if os.environ.get(VARIABLE) else None)
    if chosen is not None:
        place = shutil.which(str(chosen))
        if place is None:
            raise MotionloomError(f"there is no program {chosen}; --blender names Blender, or a Python with bpy")
        return _command(place)
    if (place := shutil.which("blender")) is not None:
        return _command(place)
    if importlib.util.find_spec("bpy") is not None:
        return [sys.executable]
    raise MotionloomError(
        "FBX needs Blender, and none was found: name one with --blender PATH, install bpy (pip install bpy), or go by "
        "way of a .glb, which Blender imports and exports (docs/blender.md)"
    )


def _command(place: str) -> list[str]:
    if "python" in Path(place).name.lower():
        return [place]
    return [place, "--background", "--factory-startup", "--python-exit-code", "1", "--python"]


def fbx_to_glb(source: Path, folder: Path) -> Path:
    """The GLB in ``folder`` that Blender makes of an FBX; raises `MotionloomError` where it makes none."""
    if not source.is_file():
        raise MotionloomError(f"there is no file {source}")
    glb = folder / f"{source.stem}.glb"
    _convert(source, glb, fps=0.0)
    return glb


def glb_to_fbx(source: Path, path: Path, *, fps: float) -> Path:
    """Write a GLB's people as FBX, their keys at ``fps``; raises `MotionloomError` where Blender makes none."""
    with atomic_path(path) as temporary:
        _convert(source, temporary, fps=fps)
    return path


def _convert(source: Path, target: Path, *, fps: float) -> None:
    command = find_blender()
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "convert.py"
        script.write_text(_SCRIPT, encoding="utf-8")
        words = [*command, str(script), *(("--",) if len(command) > 1 else ())]
        try:
            run = subprocess.run(
                [*words, str(source.resolve()), str(target.resolve()), repr(fps)],
                check=False,
                capture_output=True,
                text=True,
                timeout=SECONDS,
                errors="replace",
                stdin=subprocess.DEVNULL,
            )
        except subprocess.TimeoutExpired:
            raise MotionloomError(f"Blender took more than {SECONDS:.0f} s for {source}; convert it by hand") from None
        except OSError as error:
            raise MotionloomError(f"{command[0]} cannot be run: {error.strerror or error}") from None
    if run.returncode or not target.is_file() or not target.stat().st_size:
        output = run.stdout + run.stderr
        lines = [line for line in output.splitlines() if "rror" in line]
        line = one_line(lines[-1])[:200] if lines else f"it ended with {run.returncode}"
        raise MotionloomError(f"Blender could not convert {source}: {line}")
