"""Motion of Rigify's deform bones on the controls that one animates by hand: torso, spine, and the limbs' FK."""

import bpy
import numpy as np
from mathutils import Matrix

from .actions import Keys, basis_of

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
    "toe_fk.",
)
LIMBS = ("upper_arm_parent", "thigh_parent")


def driver_of(control):
    """The deform bone that a control follows; empty for other bones."""
    if control in ("neck", "head"):
        return {"neck": "DEF-spine.004", "head": "DEF-spine.006"}[control]
    if control == "torso":
        return "DEF-spine"
    return "DEF-" + control.replace("_fk", "") if control.startswith(CONTROLS) else ""


def keys_of(armature, body, moves, first):
    """The `Keys` of a motion on the rig's controls, each moved as skin on its deform bone would be.

    A generator: it hands out a share of its work that is done, so that a window may show it, and returns the keys.
    Blender's own constraints are asked where controls hang, round by round; nothing may play meanwhile.
    """
    pairs = [(bone, moves.names.index(d)) for bone in armature.pose.bones if (d := driver_of(bone.name)) in moves.names]
    rounds = _rounds(bone for bone, _ in pairs)
    poses, rest = body.poses(moves), _rest(body, moves)
    moved = poses @ np.linalg.inv(rest)
    world = armature.matrix_world
    limbs = [bone for bone in armature.pose.bones if bone.name.rpartition(".")[0] in LIMBS and "IK_FK" in bone]
    for bone in limbs:
        bone["IK_FK"] = 1.0
    armature.update_tag()
    bpy.context.view_layer.update()
    found = {key: np.empty(len(moves)) for bone, _ in pairs for key, _ in _values(bone)}
    for frame in range(len(moves)):
        wanted = {
            bone.name: world.inverted() @ Matrix(moved[frame, driver].tolist()) @ world @ bone.bone.matrix_local
            for bone, driver in pairs
        }
        for number, controls in enumerate(rounds):
            if number:
                bpy.context.view_layer.update()
            for bone, free in controls:
                if free:
                    bone.matrix_basis = basis_of(bone.bone, wanted)
                else:
                    bone.matrix = wanted[bone.name]
        for bone, _ in pairs:
            for key, value in _values(bone):
                found[key][frame] = value
        yield frame / len(moves)
    found |= {(f'{bone.path_from_id()}["IK_FK"]', 0): np.ones(len(moves)) for bone in limbs}
    return Keys(first, found)


def _rounds(controls):
    """Controls in rounds: all of a round are set at once, once Blender has found where the round before puts what hangs
    on it. With each whether it hangs rigidly on one above it of the same round, so that nobody needs to be asked.
    """
    numbers, rounds = {}, {}
    for bone in sorted(controls, key=lambda bone: len(bone.bone.parent_recursive)):
        above, free = set(), bone.parent is not None
        between, seen = [bone.parent] if bone.parent is not None else [], set()
        while between:
            other = between.pop()
            if other.name in numbers:
                above.add(other.name)
            elif other.name not in seen:
                seen.add(other.name)
                pulls = [c for c in other.constraints if c.type != "COPY_SCALE"]
                free = free and not pulls and not other.name.startswith("tweak")
                names = {getattr(c, "subtarget", "") for c in pulls}
                between += [bone.id_data.pose.bones[name] for name in names if name in bone.id_data.pose.bones]
                between += [other.parent] if other.parent is not None else []
        free = free and len(above) == 1
        numbers[bone.name] = max((numbers[name] for name in above), default=-1) + (not free)
        rounds.setdefault(numbers[bone.name], []).append((bone, free))
    return [rounds[number] for number in sorted(rounds)]


def _rest(body, moves):
    """(joints, 4, 4) of Blender's world, unscaled."""
    still = type(moves)(moves.names, moves.parents, moves.fps, turns=moves.turns[:1].copy(), places=moves.places[:1])
    still.turns[:] = [1.0, 0.0, 0.0, 0.0]
    found = body.poses(still)[0]
    found[:, :3, 3] = body.rest_places[[body.names.index(name) for name in moves.names]]
    return found


def _values(bone):
    """((data path, index), value) of all that is keyed of a control."""
    path = bone.path_from_id()
    kind = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
    for name in ("location", kind.get(bone.rotation_mode, "rotation_euler")):
        for index, value in enumerate(getattr(bone, name)):
            yield (f"{path}.{name}", index), value
