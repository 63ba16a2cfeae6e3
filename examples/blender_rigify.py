"""A generated Rigify rig out of Blender as a character for `--skeleton`, and its motion back onto the rig's controls.

    blender --background hero.blend --python blender_rigify.py -- out hero.glb
    motionloom generate a person walks --skeleton hero.glb --out moving.glb
    blender --background hero.blend --python blender_rigify.py -- in moving.glb moving.blend

Runs in Blender, not in motionloom's own Python. `out` writes the rig and its meshes with deform bones only. Rigify
hangs these on bones that are not exported, so that limbs, fingers and face would come out in pieces; here each hangs
on the deform bone it follows, and the .blend itself stays as it is. `in` lays keys on the FK controls and saves
another .blend: the limbs are switched to FK, the scene gets the clip's rate, every frame has a key.
"""

import sys

import bpy

CONTROLS = (
    "torso",
    "spine_fk",
    "shoulder.",
    "upper_arm_fk.",
    "forearm_fk.",
    "hand_fk.",
    "thigh_fk.",
    "shin_fk.",
    "foot_fk.",
)
LIMBS = ("upper_arm_parent", "thigh_parent")


def generated_rig():
    """The armature with Rigify's deform bones and controls."""
    rigs = [o for o in bpy.data.objects if o.type == "ARMATURE" and {"DEF-spine", "torso"} <= set(o.data.bones.keys())]
    if len(rigs) != 1:
        sys.exit(f"{len(rigs)} generated Rigify rigs are in this file; one is needed (armature, Rigify, Generate Rig)")
    return rigs[0]


def followed(bone, deforming):
    """The deform bone that a deform bone hangs on: its own above it, or that of the nearest ORG- bone."""
    for above in bone.parent_recursive:
        name = above.name.replace("ORG-", "DEF-")
        if name in deforming and name != bone.name:
            return name
    return None


def write(rig, path):
    """The rig and its meshes as a GLB whose deform bones are one tree."""
    deforming = {bone.name for bone in rig.data.bones if bone.use_deform}
    wanted = {name: followed(rig.data.bones[name], deforming) for name in deforming}
    bpy.ops.object.select_all(action="DESELECT")
    for thing in [rig, *(o for o in bpy.data.objects if o.type == "MESH" and o.find_armature() == rig)]:
        thing.hide_set(False)
        thing.select_set(True)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bones = rig.data.edit_bones
    for name, above in wanted.items():
        bones[name].use_connect = False
        bones[name].parent = bones[above] if above else None
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.export_scene.gltf(
        filepath=path, export_format="GLB", use_selection=True, export_def_bones=True, export_animations=False
    )


def read(rig, path):
    """Keys on the FK controls of the rig, from the deform bones of the moving character."""
    before, actions = set(bpy.data.objects), set(bpy.data.actions)
    bpy.context.scene.render.fps, bpy.context.scene.render.fps_base = clip_rate(path), 1.0
    bpy.ops.import_scene.gltf(filepath=path)
    new = [o for o in bpy.data.objects if o not in before]
    source = next(o for o in new if o.type == "ARMATURE")
    last = max(action.frame_range[1] for action in bpy.data.actions if action not in actions)
    for bone in rig.pose.bones:
        if bone.name.rpartition(".")[0] in LIMBS:
            bone["IK_FK"] = 1.0
    pairs = [(bone, driver) for bone in rig.pose.bones if (driver := driver_of(bone.name)) in source.data.bones]
    for frame in range(round(last) + 1):
        bpy.context.scene.frame_set(frame)
        moves = {name: deformation(source, name) for name in {driver for _, driver in pairs}}
        key(rig, [(bone, moves[driver]) for bone, driver in pairs], frame)
    for thing in new:
        bpy.data.objects.remove(thing)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 0, round(last)


def deformation(armature, name):
    """What a bone does to the skin that follows it, in the world: from rest to its pose."""
    world = armature.matrix_world
    return (
        world @ armature.pose.bones[name].matrix @ armature.data.bones[name].matrix_local.inverted() @ world.inverted()
    )


def key(rig, moves, frame):
    """Controls moved as skin would be, those above before those below, with a key each."""
    world = rig.matrix_world
    levels = {}
    for bone, move in moves:
        levels.setdefault(len(bone.parent_recursive), []).append((bone, move))
    for level in sorted(levels):
        for bone, move in levels[level]:
            bone.matrix = world.inverted() @ move @ world @ rig.data.bones[bone.name].matrix_local
            turn = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
            for path in ("location", turn.get(bone.rotation_mode, "rotation_euler")):
                bone.keyframe_insert(path, frame=frame)
        bpy.context.view_layer.update()


def driver_of(control):
    """The deform bone that a control follows; empty for other bones."""
    if control in ("neck", "head"):
        return {"neck": "DEF-spine.004", "head": "DEF-spine.006"}[control]
    if control == "torso":
        return "DEF-spine"
    if not control.startswith((*CONTROLS, "toe_fk.")):
        return ""
    return "DEF-" + control.replace("_fk", "")


def clip_rate(path):
    """Frames per second of the last animation in a GLB of ours; 30 where it does not say."""
    import json
    import struct

    with open(path, "rb") as stream:
        data = stream.read()
    (length,) = struct.unpack_from("<I", data, 12)
    animations = json.loads(data[20 : 20 + length]).get("animations", [])
    return round(animations[-1].get("extras", {}).get("fps", 30)) if animations else 30


if __name__ == "__main__":
    words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    if len(words) == 2 and words[0] == "out":
        write(generated_rig(), words[1])
    elif len(words) == 3 and words[0] == "in":
        read(generated_rig(), words[1])
        bpy.ops.wm.save_as_mainfile(filepath=words[2])
    else:
        sys.exit("after -- comes: out HERO.glb, or: in MOVING.glb NEW.blend")
