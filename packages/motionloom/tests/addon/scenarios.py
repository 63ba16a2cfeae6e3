"""Runs inside Blender: `python scenarios.py NAME in.json out.json`. Each scenario works as a user does, with operators.

`in.json`: zip (the extension), address (of the server), and what the scenario needs; `out.json`: what it returns.
"""

import json
import os
import sys

import bpy
import numpy as np
from mathutils import Matrix, Vector

UP = Matrix(((1, 0, 0), (0, 0, -1), (0, 1, 0)))
"""Turns +Y up, facing +Z to Blender's axes."""


def begin(given):
    """An empty scene with the extension installed from its zip, as a user installs it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.extensions.package_install_files(filepath=given["zip"], repo="user_default", enable_on_install=True)
    [name] = [name for name, _ in bpy.context.preferences.addons.items() if name.endswith(".motionloom")]
    bpy.context.preferences.addons[name].preferences.address = given["address"]
    return name


def armature(given, *, name="Hero", world=None, size=1.0):
    """An armature of joints in metres, +Y up, its bones ``1 / size`` as long and the object ``size`` times as large.

    Bones are rolled at random; those with one child end there, others end somewhere.
    """
    data = bpy.data.armatures.new(name)
    made = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    bpy.context.view_layer.objects.active = made
    made.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    random = np.random.default_rng(3)
    places = [UP @ Vector(place) / size for place in given["places"]]
    bones = []
    for joint, parent in enumerate(given["parents"]):
        bone = data.edit_bones.new(given["names"][joint])
        below = [places[k] for k, above in enumerate(given["parents"]) if above == joint]
        bone.head = places[joint]
        bone.tail = below[0] if len(below) == 1 else bone.head + Vector(random.normal(size=3)).normalized() * 0.1 / size
        bone.roll = random.uniform(-3, 3)
        if parent >= 0:
            bone.parent = bones[parent]
            bone.use_connect = (bone.head - bones[parent].tail).length < 1e-6 and bool(joint % 2) and parent > 0
        bones.append(bone)
    bpy.ops.object.mode_set(mode="OBJECT")
    made.matrix_world = (world or Matrix()) @ Matrix.Scale(size, 4)
    bpy.context.view_layer.update()
    for number, bone in enumerate(made.pose.bones):
        bone.rotation_mode = ("QUATERNION", "XYZ", "ZYX", "AXIS_ANGLE")[number % 4]
    return made


def shown(thing, names, frames):
    """(frames, names, 3) where bones begin, in the world."""
    found = []
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        found.append([list(thing.matrix_world @ thing.pose.bones[name].head) for name in names])
    return found


def write(*words, **options):
    """Blocks of words, (text, seconds) each, and settings of the panel."""
    own = bpy.context.scene.motionloom
    for text, seconds in words:
        bpy.ops.motionloom.add(which="blocks")
        own.blocks[-1].text, own.blocks[-1].seconds = text, seconds
    for name, value in options.items():
        setattr(own, name, value)
    return own


def characters(name):
    """The ids that the server gave to skeletons of this Blender."""
    return [answer["id"] for answer in sys.modules[f"{name}.bodies"].SENT.values()]


def empty(place, name="Target"):
    """An empty somewhere."""
    made = bpy.data.objects.new(name, None)
    made.location = place
    bpy.context.scene.collection.objects.link(made)
    bpy.context.view_layer.update()
    return made


def curve(points, name="Way"):
    """A curve over the ground, of straight lines."""
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new("POLY")
    spline.points.add(len(points) - 1)
    for point, place in zip(spline.points, points):
        point.co = (*place, 1.0)
    made = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    return made


def said(call, **options):
    """The sentence with which an operator refuses."""
    try:
        call(**options)
    except RuntimeError as error:
        return str(error).strip()
    return ""


# Scenarios ------------------------------------------------------------------------------------------------------------


def places(given):
    """A person of given joints on a turned, moved, scaled object; several takes; undo."""
    name = begin(given)
    bpy.context.scene.render.fps = given["fps"]
    world = Matrix.Translation((3, -2, 0.5)) @ Matrix.Rotation(np.radians(given["turn"]), 4, "Z")
    hero = armature(given, world=world, size=given["size"])
    own = write((given["prompt"], 2.0), steps=6, seed=4, count=2, root=given.get("root", "motion"))
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.motionloom.generate()
    bpy.ops.ed.undo_push(message="generated")
    takes = [(take.name, take.seed, len(take.parts[0].action.name)) for take in own.takes]
    frames = range(1, 1 + round(1.95 * given["fps"]) + 1)
    first = shown(hero, given["names"], frames)
    own.take_at = 1
    second = shown(hero, given["names"], frames)
    last = hero.animation_data.action.frame_range[1]
    bpy.ops.ed.undo()
    left = len(bpy.data.actions), len(bpy.context.scene.motionloom.takes)
    return {
        "takes": takes,
        "first": first,
        "second": second,
        "last": last,
        "left": left,
        "character": characters(name)[-1],
    }


def imported(given):
    """A file of others, brought in as a user does: where all bones are that the server knows."""
    name = begin(given)
    bpy.context.scene.render.fps = 20
    if given["file"].endswith(".bvh"):
        bpy.ops.import_anim.bvh(filepath=given["file"], global_scale=given.get("scale", 1.0))
    else:
        bpy.ops.import_scene.gltf(filepath=given["file"])
    bpy.context.scene.render.fps, bpy.context.scene.render.fps_base = 20, 1.0
    hero = next(thing for thing in bpy.data.objects if thing.type == "ARMATURE")
    bpy.context.view_layer.objects.active = hero
    own = write(("a person walks", 2.0), steps=6)
    bpy.ops.motionloom.generate()
    operators, bodies = sys.modules[f"{name}.operators"], sys.modules[f"{name}.bodies"]
    body = bodies.Body(hero)
    body.settle(operators.settings.client())
    joints = [
        bone for joint in ("wrist", "ankle") for side in ("left", "right") for bone in body.joints[f"{side}_{joint}"]
    ]
    return {
        "names": joints,
        "places": shown(hero, joints, range(1, 41)),
        "character": body.id,
        "turn": body.turn.tolist(),
        "origin": body.origin.tolist(),
        "takes": len(own.takes),
    }


def goals(given):
    """A path, a hand at an empty, a pose on the way, on a body of another size, which turned and moved."""
    begin(given)
    bpy.context.scene.render.fps = 30
    world = Matrix.Translation((1, 2, 0)) @ Matrix.Rotation(np.radians(90), 4, "Z")
    hero = armature(given, world=world, size=1.2)
    path = [world @ Vector(point) for point in ((0, 0, 0), (0, -1.5, 0), (0.8, -2.8, 0))]
    own = write(("a person walks", 2.0), ("a person walks on", 2.0), steps=8, path=curve(path))
    bpy.context.scene.frame_set(61)
    target = empty(world @ Vector(given["target"]))
    bpy.context.view_layer.objects.active = target
    bpy.ops.motionloom.add(which="goals")
    own.goals[0].joint, own.goals[0].until = "left_wrist", 70
    bpy.context.view_layer.objects.active = hero
    bpy.ops.motionloom.generate()
    ends = shown(hero, ["pelvis", "left_wrist"], [1, 61, 66, 70, 118])
    return {
        "ends": ends,
        "path": [list(point) for point in path],
        "target": list(target.location),
        "remark": own.takes[0].remark,
        "pieces": json.loads(own.takes[0].pieces),
    }


def poses(given):
    """Poses that somebody keyed by hand are passed through at their frames."""
    begin(given)
    bpy.context.scene.render.fps = 20
    world = Matrix.Translation((0, 5, 0)) @ Matrix.Rotation(np.radians(-50), 4, "Z")
    hero = armature(given, world=world)
    arm = hero.pose.bones["left_shoulder"]
    arm.rotation_mode = "XYZ"
    for frame, angle in ((1, 0.0), (31, 1.2)):
        arm.rotation_euler = (0.0, 0.0, angle)
        arm.keyframe_insert("rotation_euler", frame=frame)
    bpy.ops.motionloom.keyed()
    names = ["pelvis", "left_elbow", "left_wrist", "right_wrist", "left_ankle"]
    wanted = shown(hero, names, [1, 31])
    own = write(("a person stands", 2.5), steps=8)
    bpy.ops.motionloom.generate()
    return {"wanted": wanted, "got": shown(hero, names, [1, 31]), "frames": [pose.frame for pose in own.poses]}


def redo(given):
    """Frames of a motion are made anew; what an animator changed around them stays."""
    begin(given)
    bpy.context.scene.render.fps = 30
    hero = armature(given, world=Matrix.Rotation(np.radians(37), 4, "Z"), size=0.01)
    own = write(("a person walks forward", 3.0), steps=6)
    bpy.ops.motionloom.generate()
    head = hero.pose.bones["head"]
    path = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
    path = path.get(head.rotation_mode, "rotation_euler")
    for frame in (1, 88):
        bpy.context.scene.frame_set(frame)
        setattr(head, path, [0.3, 0.1, 0.2, 0.9][: len(getattr(head, path))])
        head.keyframe_insert(path, frame=frame)
    frames = range(1, 89)
    before = shown(hero, given["names"], frames)
    action = hero.animation_data.action
    own.redo_text, own.redo_from, own.redo_to, own.seed = "a person raises both hands", 30, 60, 9
    bpy.ops.motionloom.redo()
    after = shown(hero, given["names"], frames)
    kept = hero.animation_data.action != action
    own.take_at = 0
    again = shown(hero, given["names"], frames)
    own.redo_from, own.redo_to = 60, 400
    refused = said(bpy.ops.motionloom.redo)
    return {"before": before, "after": after, "again": again, "kept": kept, "refused": refused}


def pair(given):
    """Two armatures of different size; then the same as NLA strips."""
    begin(given)
    bpy.context.scene.render.fps = 20
    world = Matrix.Translation((2, 1, 0)) @ Matrix.Rotation(np.radians(90), 4, "Z")
    first = armature(given, name="First", world=world)
    second = armature(given, name="Second", world=Matrix.Translation((9, 9, 0)), size=1.0)
    bpy.context.view_layer.objects.active = first
    own = write(("two people shake hands", 2.0), steps=6, second=second, seed=2)
    bpy.ops.motionloom.generate()
    frames = range(1, 40)
    found = {"first": shown(first, given["names"], frames), "second": shown(second, given["names"], frames)}
    own.output, own.take_at = "NLA", 0
    strips = [
        [(s.name, s.frame_start, s.frame_end) for t in a.animation_data.nla_tracks for s in t.strips]
        for a in (first, second)
    ]
    return found | {"strips": strips, "nla": shown(first, given["names"], frames)}


def loop(given):
    """A loop of two blocks as strips: the end meets the beginning."""
    begin(given)
    bpy.context.scene.render.fps = 20
    hero = armature(given)
    own = write(("a person stands", 1.5), ("a person waves", 1.5), steps=6, loop=True, output="NLA")
    bpy.ops.motionloom.generate()
    cyclic = own.takes[0].parts[0].action.use_cyclic
    tracks = hero.animation_data.nla_tracks
    strips = [(strip.name, strip.frame_start, strip.frame_end) for track in tracks for strip in track.strips]
    whole = shown(hero, given["names"], range(1, 61))
    bpy.ops.motionloom.remove(which="takes")
    return {
        "cyclic": cyclic,
        "strips": strips,
        "whole": whole,
        "left": [len(own.takes), len(hero.animation_data.nla_tracks), len(bpy.data.actions)],
    }


def rig(given):
    """A generated Rigify rig: motion on its controls, some frames anew; deform bones are where the server has them."""
    name = begin(given)
    bpy.ops.wm.open_mainfile(filepath=given["blend"])
    bpy.context.preferences.addons[name].preferences.address = given["address"]
    bpy.context.scene.render.fps = 20
    hero = next(thing for thing in bpy.data.objects if thing.type == "ARMATURE")
    hero.matrix_world = Matrix.Translation((1, 1, 0)) @ Matrix.Rotation(np.radians(30), 4, "Z") @ Matrix.Scale(1.1, 4)
    bpy.context.view_layer.objects.active = hero
    own = write(("a person walks forward", 2.0), steps=6)
    bpy.ops.motionloom.generate()
    names = [bone.name for bone in hero.data.bones if bone.name.startswith("DEF-") and bone.use_deform]
    frames = [1, 10, 20, 30, 40]
    found = {"names": names, "first": shown(hero, names, frames)}
    keyed = {curve.split('"')[1] for curve in given_paths(own.takes[0].parts[0].action)}
    found["character"] = characters(name)[-1]
    own.redo_from, own.redo_to, own.redo_text = 12, 25, "a person jumps"
    bpy.ops.motionloom.redo()
    return found | {"keyed": sorted(keyed), "second": shown(hero, names, frames)}


def saved(given):
    """A .blend whose armature walks, as another .blend."""
    name = begin(given)
    bpy.ops.wm.open_mainfile(filepath=given["blend"])
    bpy.context.preferences.addons[name].preferences.address = given["address"]
    bpy.context.scene.render.fps = 30
    bpy.context.view_layer.objects.active = next(thing for thing in bpy.data.objects if thing.type == "ARMATURE")
    write((given["prompt"], given["seconds"]), start=0)
    bpy.ops.motionloom.generate()
    bpy.ops.wm.save_as_mainfile(filepath=given["out"])
    return {}


def given_paths(action):
    """The data paths of an action's curves."""
    return [
        curve.data_path
        for layer in action.layers
        for strip in layer.strips
        for bag in strip.channelbags
        for curve in bag.fcurves
    ]


def refusals(given):
    """What is wrong is said in one sentence, and nothing is changed."""
    name = begin(given)
    found = {"nothing": said(bpy.ops.motionloom.generate)}
    hero = armature(given)
    found["words"] = said(bpy.ops.motionloom.generate)
    own = write(("a person walks", 2.0), steps=4)
    hero.scale = (1, 2, 1)
    bpy.context.view_layer.update()
    found["stretched"] = said(bpy.ops.motionloom.generate)
    hero.scale = (1, 1, 1)
    bpy.context.view_layer.update()
    found["no_motion"] = said(bpy.ops.motionloom.redo)
    bpy.ops.motionloom.add(which="goals")
    own.goals[0].target, own.goals[0].frame = empty((0, 0, 9)), 10
    found["high"] = said(bpy.ops.motionloom.generate)
    own.goals[0].frame = 900
    found["late"] = said(bpy.ops.motionloom.generate)
    own.goals[0].frame = 10
    write(("a person waves", 2.0))
    found["no_path"] = said(bpy.ops.motionloom.generate)
    bpy.ops.motionloom.remove(which="blocks")
    bpy.ops.motionloom.remove(which="goals")
    bpy.ops.object.armature_add()
    found["nobody"] = said(bpy.ops.motionloom.generate)
    bpy.context.view_layer.objects.active = hero
    preferences = bpy.context.preferences.addons[name].preferences
    preferences.address = "http://127.0.0.1:9"
    found["away"] = said(bpy.ops.motionloom.generate)
    preferences.command = "/nowhere/motionloom"
    found["program"] = said(bpy.ops.motionloom.start)
    found["changed"] = [len(bpy.data.actions), len(own.takes)]
    return found


def serve(given):
    """The extension starts the server, and one job is cancelled in it."""
    name = begin(given)
    preferences = bpy.context.preferences.addons[name].preferences
    preferences.command, preferences.folder = given["command"], given["folder"]
    os.environ["PYTHONPATH"] = given["sources"]  # Blender's own packages are not the server's
    bpy.ops.motionloom.start()
    hero = armature(given)
    own = write(("a person walks", 30.0), steps=200, count=8)
    operators, jobs = sys.modules[f"{name}.operators"], sys.modules[f"{name}.jobs"]

    class Hasty(jobs.Job):
        """Cancelled as soon as the server works on it, as by the button."""

        def ask(self, body):
            own_json = self.client.json

            def json_of(method, path, body=None):
                answer = own_json(method, path, body)
                if method == "GET" and answer.get("state") == "running":
                    bpy.ops.motionloom.cancel()
                return answer

            self.client.json = json_of
            return super().ask(body)

    operators.jobs.Job = Hasty
    cancelled = said(bpy.ops.motionloom.generate)
    operators.jobs.Job = Hasty.__mro__[1]
    own.blocks[0].seconds, own.steps, own.count = 1.0, 2, 1
    bpy.ops.motionloom.generate()
    takes = len(own.takes)
    running = sys.modules[f"{name}.client"].SERVER.process
    bpy.ops.motionloom.stop()
    return {"cancelled": cancelled, "takes": takes, "ended": running.poll() is not None, "hero": hero.name}


SCENARIOS = {f.__name__: f for f in (places, imported, goals, poses, redo, pair, loop, rig, refusals, serve, saved)}

if __name__ == "__main__":
    with open(sys.argv[2]) as stream:
        found = SCENARIOS[sys.argv[1]](json.load(stream))
    with open(sys.argv[3], "w") as stream:
        json.dump(found, stream)
