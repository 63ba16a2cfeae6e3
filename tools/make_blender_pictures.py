"""Draw the pictures of docs/blender.md with Blender itself (Cycles, on the processor): no window, no graphics card.

MOTIONLOOM_BLENDER_PYTHON=PYTHON python tools/make_blender_pictures.py [NAME ...]

PYTHON can import bpy. Shown is only this project's own mannequin, which as a .glb is a character like any other.

bvh       a BVH as it comes in: bones stand upright, on the floor, facing Blender's front
walking   a character's own file with a walk in it, at three moments
rigify    the walk on a Rigify deform skeleton beside the mannequin it came from
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1]))

from motionloom.io import load, save
from motionloom.io.character import load_character
from motionloom.motion import Motion
from motionloom.retarget import retarget
from motionloom.retarget.named import named_skeleton

ROOT = Path(__file__).parents[1]
PICTURES = ROOT / "docs" / "pictures"
SIZE = (360, 320)
# Runs inside Blender: files side by side, one picture per frame.
_SCRIPT = """
import json, math, sys
import bpy
from mathutils import Vector

job = json.load(open(sys.argv[1]))
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps = job["fps"]
colours = [(0.75, 0.36, 0.16, 1), (0.16, 0.38, 0.7, 1), (0.2, 0.5, 0.3, 1)]

def material(colour, name):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = colour
    made.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.7
    return made

def bones_as_bodies(armature, paint):
    # A cone along each bone, that follows it: bones themselves are not rendered.
    for bone in armature.pose.bones:
        length = max(bone.length, 0.01)
        bpy.ops.mesh.primitive_cone_add(vertices=6, radius1=0.1 * length + 0.012, radius2=0.008, depth=length)
        cone = bpy.context.object
        cone.data.transform(__import__("mathutils").Matrix.Rotation(-math.pi / 2, 4, "X"))
        cone.data.materials.append(paint)
        cone.parent, cone.parent_type, cone.parent_bone = armature, "BONE", bone.name
        cone.location = (0, -length / 2, 0)

for number, (file, aside) in enumerate(job["files"]):
    before = set(bpy.data.objects)
    if file.endswith(".bvh"):
        bpy.ops.import_anim.bvh(filepath=file, update_scene_fps=True)
    else:
        bpy.ops.import_scene.gltf(filepath=file)
    paint = material(colours[number], f"paint {number}")
    new = [o for o in bpy.data.objects if o not in before]
    for thing in new:
        if thing.type == "ARMATURE" and file.endswith(".bvh"):
            bones_as_bodies(thing, paint)
        if thing.type == "MESH":
            thing.data.materials.clear()
            thing.data.materials.append(paint)
    for thing in new:
        if thing.parent is None:
            thing.location.x += aside

bpy.ops.mesh.primitive_plane_add(size=30)
bpy.context.object.data.materials.append(material((0.45, 0.45, 0.45, 1), "floor"))
for axis, colour in ((0, (0.8, 0.05, 0.05, 1)), (1, (0.1, 0.55, 0.1, 1)), (2, (0.05, 0.1, 0.8, 1))):
    bpy.ops.mesh.primitive_cylinder_add(radius=0.012, depth=0.6)
    rod = bpy.context.object
    rod.rotation_euler = ((0, math.pi / 2, 0), (math.pi / 2, 0, 0), (0, 0, 0))[axis]
    rod.location = [job["axes"][k] + (0.3 if k == axis else 0) for k in range(3)]
    rod.data.materials.append(material(colour, f"axis {axis}"))
sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
sun.data.energy, sun.data.angle, sun.rotation_euler = 1.6, 0.2, (0.7, 0.2, 0.5)
scene.collection.objects.link(sun)
scene.world = bpy.data.worlds.new("world")
scene.world.use_nodes = True
scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.9, 0.93, 1, 1)
scene.world.node_tree.nodes["Background"].inputs[1].default_value = 0.5
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
scene.collection.objects.link(camera)
scene.camera = camera
camera.location = job["camera"]
camera.rotation_euler = (Vector(job["target"]) - camera.location).to_track_quat("-Z", "Y").to_euler()
camera.data.lens = job["lens"]
scene.render.engine = "CYCLES"
scene.cycles.device, scene.cycles.samples, scene.cycles.use_denoising = "CPU", job["samples"], False
scene.cycles.max_bounces = 2
scene.view_settings.view_transform = "Standard"
scene.render.resolution_x, scene.render.resolution_y = job["size"]
scene.render.threads_mode, scene.render.threads = "FIXED", 1
for number, frame in enumerate(job["frames"]):
    scene.frame_set(frame)
    scene.render.filepath = f"{job['out']}/{number}.png"
    bpy.ops.render.render(write_still=True)
"""


def rendered(files: list[tuple[Path, float]], frames: list[int], *, fps: float, axes: tuple[float, float, float],
             camera: tuple[float, float, float], target: tuple[float, float, float], lens: float = 70.0,
             samples: int = 8) -> Image.Image:  # fmt: skip
    """One row of pictures, one per frame."""
    python = os.environ.get("MOTIONLOOM_BLENDER_PYTHON", sys.executable)
    with tempfile.TemporaryDirectory() as folder:
        job = {
            "files": [(str(file), aside) for file, aside in files], "frames": frames, "fps": round(fps), "axes": axes,
            "camera": camera, "target": target, "lens": lens, "size": SIZE, "samples": samples, "out": folder,
        }  # fmt: skip
        (Path(folder) / "job.json").write_text(json.dumps(job))
        command = [python, "-c", _SCRIPT, str(Path(folder) / "job.json")]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        parts = [Image.open(Path(folder) / f"{k}.png").convert("RGB") for k in range(len(frames))]
        whole = Image.new("RGB", (SIZE[0] * len(parts), SIZE[1]))
        for k, part in enumerate(parts):
            whole.paste(part, (k * SIZE[0], 0))
    return whole


def kept(picture: Image.Image, name: str) -> None:
    """As a PNG of few colours, which is small."""
    place = PICTURES / f"blender_{name}.png"
    picture.quantize(128, dither=Image.Dither.NONE).save(place, optimize=True)
    print(place.relative_to(ROOT), place.stat().st_size // 1000, "kB")


def walk() -> Motion:
    """A walk of the shipped weights, as `motionloom generate "a person walks forward" --seed 1` makes it."""
    from motionloom.tasks.text import generate
    from motionloom.weights.prior import Prior

    (motion,) = generate(Prior.load("default"), "a person walks forward", seconds=3.0, seed=1)
    return motion.resample(30.0)


def draw(names: list[str], folder: Path) -> None:
    motion = walk()
    path = motion.root[:, [0, 2]]
    middle = (path.min(axis=0) + path.max(axis=0)) / 2
    at = (float(middle[0]), -float(middle[1]), 0.85)  # Blender's axes: ours x, -z, y
    last = len(motion) - 1
    moments = [round(last * share) for share in (0.15, 0.5, 0.85)]
    view = {"camera": (at[0] + 4.6, at[1] - 4.2, 1.9), "target": at, "fps": motion.fps}
    if "bvh" in names:
        file = save(motion, folder / "walk.bvh")
        kept(rendered([(file, 0.0)], [m + 1 for m in moments], axes=(at[0] - 1.2, at[1], 0.0), **view), "bvh")
    if "walking" in names:
        hero = load_character(save(motion, folder / "hero.glb"))
        moving = hero.save(retarget(motion, hero.skeleton), folder / "moving.glb", name="walk", replace=True)
        kept(rendered([(moving, 0.0)], moments, axes=(at[0] - 1.2, at[1], 0.0), **view), "walking")
    if "rigify" in names:
        rig = save(retarget(motion, named_skeleton("rigify")), folder / "rigify.bvh")
        ours = save(motion, folder / "plain.bvh")
        assert np.isfinite(load(rig).root).all()
        frames = [m + 1 for m in moments]
        picture = rendered([(rig, 0.6), (ours, -0.6)], frames, axes=(at[0] - 1.4, at[1], 0.0), **view)
        kept(picture, "rigify")


if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as made:
        draw(sys.argv[1:] or ["bvh", "walking", "rigify"], Path(made))
