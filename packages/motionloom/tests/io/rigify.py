"""A person with a generated Rigify rig, made in Blender: an ellipsoid of skin around each deform bone but the face's.

Needs bpy, as `in_blender` does.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from tests.io.in_blender import python_with_bpy

_MAKE = """
import sys
import bpy
import addon_utils
from mathutils import Matrix

THICK = {"spine": 0.1, "thigh": 0.075, "shin": 0.05, "foot": 0.04, "toe": 0.035, "shoulder": 0.05, "upper_arm": 0.045,
         "forearm": 0.04, "hand": 0.035, "f_index": 0.008, "f_middle": 0.008, "f_ring": 0.008, "f_pinky": 0.008,
         "thumb": 0.01}
bpy.ops.wm.read_factory_settings(use_empty=True)
addon_utils.enable("rigify", default_set=True)
bpy.ops.object.armature_human_metarig_add()
meta = bpy.context.object
bpy.ops.pose.rigify_generate()
rig = next(o for o in bpy.data.objects if o.type == "ARMATURE" and o != meta)
bpy.data.objects.remove(meta)
parts = []
for bone in rig.data.bones:
    thick = THICK.get(bone.name.removeprefix("DEF-").split(".")[0]) if bone.name.startswith("DEF-") else None
    if thick is None:
        continue
    thick = 0.05 if bone.name in ("DEF-spine.004", "DEF-spine.005") else thick
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8, radius=1)
    part = bpy.context.object
    for step in (Matrix.Diagonal((thick, (bone.length + thick) / 2, thick, 1)),
                 Matrix.Translation((0, bone.length / 2, 0)), bone.matrix_local):
        part.data.transform(step)
    part.vertex_groups.new(name=bone.name).add(range(len(part.data.vertices)), 1.0, "REPLACE")
    parts.append(part)
bpy.ops.object.select_all(action="DESELECT")
for part in parts:
    part.select_set(True)
bpy.context.view_layer.objects.active = parts[0]
bpy.ops.object.join()
parts[0].name, parts[0].parent = "body", rig
parts[0].modifiers.new("Armature", "ARMATURE").object = rig
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
"""


def make_rig(blend: Path) -> Path:
    """The person as a .blend."""
    _blender(_MAKE, str(blend))
    return blend


def _blender(script: str, *words: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "script.py"
        file.write_text(script)
        command = [python_with_bpy() or sys.executable, str(file), *words]
        ended = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0, ended.stderr[-2000:]
