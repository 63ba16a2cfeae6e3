"""Draw the pictures of docs/blender.md with Blender itself (Cycles, on the processor): no window, no graphics card.

MOTIONLOOM_BLENDER_PYTHON=PYTHON python tools/make_blender_pictures.py [NAME ...]

PYTHON can import bpy. Shown are only bodies of our own making: the mannequin, which as a .glb is a character like any
other, and a person of ellipsoids with a rig that Rigify generates.

bvh       a BVH as it comes in: bones stand upright, on the floor, facing Blender's front
walking   a character's own file with a walk in it, at three moments
rigify    the walk on the controls of a generated Rigify rig, by the extension in `blender/`
"""

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1] / "packages/motionloom"))

from motionloom.core.motion import Motion
from motionloom.io import save
from motionloom.io.character import load_character
from motionloom.retarget import retarget
from tests.addon.studio import Studio, archive
from tests.io.rigify import make_rig
from tests.server.serving import running

ROOT = Path(__file__).parents[1]
PICTURES = ROOT / "docs" / "pictures"
SIZE = (360, 320)
# Runs inside Blender: files or a .blend, one picture per frame.
_SCRIPT = """
import json, math, sys
import bpy
from mathutils import Matrix, Vector

job = json.load(open(sys.argv[1]))
file = job["file"]

def material(colour, name):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = colour
    made.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.7
    return made

def bones_as_bodies(armature):
    # A cone along each bone, that follows it: bones themselves are not rendered.
    for bone in armature.pose.bones:
        length = max(bone.length, 0.01)
        bpy.ops.mesh.primitive_cone_add(vertices=6, radius1=0.1 * length + 0.012, radius2=0.008, depth=length)
        cone = bpy.context.object
        cone.data.transform(Matrix.Rotation(-math.pi / 2, 4, "X"))
        cone.parent, cone.parent_type, cone.parent_bone = armature, "BONE", bone.name
        cone.location = (0, -length / 2, 0)

if file.endswith(".blend"):
    bpy.ops.wm.open_mainfile(filepath=file)
    for thing in list(bpy.data.objects):  # the shapes of a rig's controls
        if thing.type == "MESH" and not thing.find_armature():
            bpy.data.objects.remove(thing)
else:
    bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps = job["fps"]
if file.endswith(".bvh"):
    bpy.ops.import_anim.bvh(filepath=file, update_scene_fps=True)
    bones_as_bodies(next(o for o in bpy.data.objects if o.type == "ARMATURE"))
elif file.endswith(".glb"):
    bpy.ops.import_scene.gltf(filepath=file)
paint = material((0.75, 0.36, 0.16, 1), "paint")
for thing in bpy.data.objects:
    if thing.type == "MESH":
        thing.data.materials.clear()
        thing.data.materials.append(paint)
        for face in thing.data.polygons:
            face.use_smooth = not file.endswith(".bvh")
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


@dataclass(frozen=True)
class View:
    """Which frames are drawn, and from where, in Blender's axes."""

    fps: int
    frames: list[int]
    target: tuple[float, float, float]
    camera: tuple[float, float, float]
    axes: tuple[float, float, float]


def view(motion: Motion) -> View:
    """Three moments of somebody who walks, from the front and the side."""
    path, last = motion.root[:, [0, 2]], len(motion) - 1
    middle = (path.min(axis=0) + path.max(axis=0)) / 2
    x, y = float(middle[0]), -float(middle[1])  # Blender's axes: ours x, -z, y
    moments = [round(last * share) for share in (0.15, 0.5, 0.85)]
    size = float(motion.root[:, 1].mean())
    camera = (x + 5.1 * size, y - 4.7 * size, 2.1 * size)
    return View(round(motion.fps), moments, (x, y, 0.95 * size), camera, (x - 1.2, y, 0.0))


def rendered(file: Path, seen: View, *, first: int = 0, samples: int = 24) -> Image.Image:
    """One row of pictures, one per moment, of a file or a .blend; ``first`` is the clip's first frame."""
    python = os.environ.get("MOTIONLOOM_BLENDER_PYTHON", sys.executable)
    with tempfile.TemporaryDirectory() as folder:
        job = asdict(seen) | {"lens": 70.0, "size": SIZE, "samples": samples, "out": folder}
        job |= {"file": str(file), "frames": [first + frame for frame in seen.frames]}
        (Path(folder) / "job.json").write_text(json.dumps(job))
        command = [python, "-W", "ignore", "-c", _SCRIPT, str(Path(folder) / "job.json")]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        parts = [Image.open(Path(folder) / f"{k}.png").convert("RGB") for k in range(len(seen.frames))]
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
    from motionloom.core.models.prior import Prior
    from motionloom.tasks.text import generate

    (motion,) = generate(Prior.load("default"), "a person walks forward", seconds=3.0, seed=1)
    return motion.resample(30.0)


def draw(names: list[str], folder: Path) -> None:
    motion = walk()
    if "bvh" in names:
        file = save(motion, folder / "walk.bvh")
        kept(rendered(file, view(motion), first=1), "bvh")
    if "walking" in names:
        hero = load_character(save(motion, folder / "hero.glb"))
        moving = hero.save(retarget(motion, hero.skeleton), folder / "moving.glb", name="walk", replace=True)
        kept(rendered(moving, view(motion)), "walking")
    if "rigify" in names:
        blend, out = make_rig(folder / "rig.blend"), folder / "moving_rig.blend"
        with running(folder / "project") as server:
            studio = Studio(server, archive(folder), folder)
            studio.play("saved", blend=str(blend), out=str(out), prompt="a person walks forward", seconds=3.0)
        kept(rendered(out, view(motion)), "rigify")


if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as made:
        draw(sys.argv[1:] or ["bvh", "walking", "rigify"], Path(made))
