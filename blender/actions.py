"""Motion as actions and NLA strips: curves of Blender 4.2 and of the layered actions that came after it."""

import bpy
import numpy as np
from mathutils import Matrix, Quaternion

from . import quaternions as quat
from .client import Problem

STILL, FREE = 2e-4, 5e-3
"""Metres up to which a bone counts as not moved against the one above, and beyond which a connected one cannot be."""
SAME_TURN = 1e-8
"""Likewise one minus the cosine of half a turn."""
LINEAR = 1
TRACK = "Motionloom"


class Keys:
    """Values of properties of an armature on every frame from a first one: (data path, index) to (frames,)."""

    def __init__(self, first, curves):
        self.first, self.curves = first, curves


def keys_of(armature, body, moves, first):
    """The `Keys` of a motion on the bones that it moves.

    moves: a `Moves` of the settled body, one pose for each frame from ``first`` on.
    """
    bones, found = armature.data.bones, {}
    inverse = np.linalg.inv(np.array(armature.matrix_world))
    size = np.linalg.norm(np.array(armature.matrix_world)[:3, 0])
    poses = inverse @ body.poses(moves)
    poses[..., :3, :3] *= size
    at = {name: number for number, name in enumerate(moves.names)}
    order = [bone for bone in _parents_first(bones) if bone.name in at]
    basis = {bone.name: np.empty((len(moves), 7)) for bone in order}
    for frame in range(len(moves)):
        shown = {name: Matrix(poses[frame, number].tolist()) for name, number in at.items()}
        for bone in order:
            place, turn, _ = basis_of(bone, shown).decompose()
            basis[bone.name][frame] = (*place, *turn)
    metre = 1 / (size * body.unit)
    before, mapped = _moved_before(armature), {name for names in body.joints.values() for name in names}
    moving = {name for name, values in basis.items() if not _rests(values, STILL * metre)}
    wanted = moving | mapped | {name for name in basis if before & _paths(armature.pose.bones[name])}
    wanted |= {parent.name for name in wanted for parent in bones[name].parent_recursive}
    still = np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (len(moves), 1))
    for name in sorted(wanted):
        bone, values = armature.pose.bones[name], basis.get(name, still)
        always = name not in moving or bool(before & _paths(bone))
        _add_places(found, bone, values[:, :3], metre, always=always)
        _add_turns(found, bone, quat.unroll(values[:, 3:]))
    return Keys(first, found)


def _rests(basis, still):
    """Whether a bone, (frames, 7) of places and turns, is at rest all the time.

    It is left alone then, such as fingers that somebody posed, if no animation moved it and it is none of the person's
    joints.
    """
    return np.abs(basis[:, :3]).max() < still and (1 - np.abs(basis[:, 3])).max() < SAME_TURN


def _moved_before(armature):
    """Data paths that the armature's action and strips move: what a new action leaves out stays where these had it."""
    own = armature.animation_data
    played = [own.action] if own is not None else []
    played += [strip.action for track in own.nla_tracks for strip in track.strips] if own is not None else []
    return {curve.data_path for action in played if action is not None for curve in curves_of(action, armature)}


def _paths(bone):
    """The data paths of a pose bone that a pose has."""
    kinds = ("location", "rotation_quaternion", "rotation_euler", "rotation_axis_angle")
    return {f"{bone.path_from_id()}.{kind}" for kind in kinds}


def _parents_first(bones):
    return sorted(bones, key=lambda bone: len(bone.parent_recursive))


def basis_of(bone, shown):
    """The matrix of a pose bone's own properties that shows it where ``shown`` has it; by name, in armature space."""
    if bone.parent is None:
        return bone.convert_local_to_pose(shown[bone.name], bone.matrix_local, invert=True)
    return bone.convert_local_to_pose(
        shown[bone.name],
        bone.matrix_local,
        parent_matrix=shown_at(bone.parent, shown),
        parent_matrix_local=bone.parent.matrix_local,
        invert=True,
    )


def shown_at(bone, shown):
    """Where a bone is; one that nothing moves but what is above it is where its rest has it there."""
    if bone.name in shown:
        return shown[bone.name]
    if bone.parent is None:
        return bone.matrix_local
    return shown_at(bone.parent, shown) @ bone.parent.matrix_local.inverted() @ bone.matrix_local


def _add_places(found, bone, places, metre, *, always):
    """The curves of a pose bone's own place (frames, 3), where it moves against the one above or did before."""
    far, path = np.abs(places).max() / metre, bone.path_from_id()
    if not bone.bone.use_connect:
        if always or far > STILL or bone.location.length > STILL * metre:
            found |= {(f"{path}.location", axis): places[:, axis] for axis in range(3)}
    elif far > FREE:
        raise Problem(
            f"The bone {bone.name} is connected to {bone.parent.name} and has to move against it: clear 'Connected' in "
            "its relations (edit mode)"
        )


def _add_turns(found, bone, turns):
    """The curves of a pose bone's own turn (frames, 4)."""
    path = bone.path_from_id()
    if bone.rotation_mode == "QUATERNION":
        found |= {(f"{path}.rotation_quaternion", axis): turns[:, axis] for axis in range(4)}
    elif bone.rotation_mode == "AXIS_ANGLE":
        axes = [Quaternion(turn).to_axis_angle() for turn in turns]
        values = np.array([(angle, *axis) for axis, angle in axes])
        found |= {(f"{path}.rotation_axis_angle", axis): values[:, axis] for axis in range(4)}
    else:
        eulers = [Quaternion(turns[0]).to_euler(bone.rotation_mode)]
        for turn in turns[1:]:
            eulers.append(Quaternion(turn).to_euler(bone.rotation_mode, eulers[-1]))
        values = np.array(eulers)
        found |= {(f"{path}.rotation_euler", axis): values[:, axis] for axis in range(3)}


# Curves ---------------------------------------------------------------------------------------------------------------


def curves_of(action, owner):
    """The collection of an action's curves of an object, made if it is not there."""
    if not hasattr(action, "slots"):
        return action.fcurves
    slot = next((slot for slot in action.slots if slot.target_id_type in ("OBJECT", "UNSPECIFIED")), None)
    slot = slot or action.slots.new("OBJECT", owner.name)
    layer = action.layers[0] if action.layers else action.layers.new("Layer")
    strip = layer.strips[0] if layer.strips else layer.strips.new(type="KEYFRAME")
    return strip.channelbag(slot, ensure=True).fcurves


def new_action(armature, name, keys):
    """An action of these keys, that nothing plays yet."""
    action = bpy.data.actions.new(name)
    action.use_fake_user = True  # other takes stay in the file though nothing plays them
    curves = curves_of(action, armature)
    for (path, index), values in keys.curves.items():
        _write(curves.new(path, index=index), keys.first, values)
    return action


def _write(curve, first, values):
    points = curve.keyframe_points
    if hasattr(points, "clear"):
        points.clear()
    points.add(len(values))
    points.foreach_set("co", np.stack([np.arange(len(values)) + first, values], axis=-1).astype(np.float32).ravel())
    points.foreach_set("interpolation", np.full(len(values), LINEAR, dtype=np.int32))
    curve.update()


def replaced(armature, action, name, keys):
    """A copy of an action whose frames in the range of the keys are theirs, with a key on every frame.

    What moves there and had no curve keeps its value of now outside of the range.
    """
    made = action.copy()
    made.name, made.use_fake_user = name, True
    curves = curves_of(made, armature)
    count = len(next(iter(keys.curves.values()))) if keys.curves else 0
    begin, end = (round(at) for at in action.frame_range)
    begin, end = min(begin, keys.first), max(end, keys.first + count - 1)
    for (path, index), values in keys.curves.items():
        curve = next((c for c in curves if c.data_path == path and c.array_index == index), None)
        if curve is None:
            curve = curves.new(path, index=index)
            whole = np.full(end - begin + 1, _now(armature, path, index))
        else:
            whole = np.array([curve.evaluate(frame) for frame in range(begin, end + 1)])
        at = keys.first - begin
        whole[at : at + count] = values
        _write(curve, begin, whole)
    return made


def _now(armature, path, index):
    value = armature.path_resolve(path)
    return value[index] if hasattr(value, "__len__") else value


def alike(armature, action, keys):
    """The keys with quaternions of the same sign as the action's own just before them."""
    curves, found = curves_of(action, armature), dict(keys.curves)
    for path in {path for path, _ in found if path.endswith("rotation_quaternion")}:
        own = [next((c for c in curves if c.data_path == path and c.array_index == axis), None) for axis in range(4)]
        if None not in own:
            before = np.array([curve.evaluate(keys.first) for curve in own])
            if before @ [found[path, axis][0] for axis in range(4)] < 0:
                found |= {(path, axis): -found[path, axis] for axis in range(4)}
    return Keys(keys.first, found)


# What plays -----------------------------------------------------------------------------------------------------------


def play(armature, action):
    """Make an action the armature's own."""
    moved = armature.animation_data_create()
    moved.action = action
    if action is not None and hasattr(moved, "action_slot") and action.slots:
        moved.action_slot = action.slots[0]


def strips(armature, action, pieces):
    """The action as NLA strips on a new track, one for each piece: (name, first frame, last frame)."""
    moved = armature.animation_data_create()
    moved.action = None
    track = moved.nla_tracks.new()
    track.name = f"{TRACK}: {action.name}"
    for name, first, last in pieces:
        strip = track.strips.new(name, int(first), action)
        if hasattr(strip, "action_slot") and action.slots:
            strip.action_slot = action.slots[0]
        strip.name, strip.extrapolation = name, "HOLD_FORWARD" if first == pieces[0][1] else "NOTHING"
        strip.action_frame_start, strip.action_frame_end = first, last
        strip.frame_start, strip.frame_end = first, last
    return track


def clear_strips(armature):
    """Remove the tracks that `strips` made."""
    moved = armature.animation_data
    for track in [track for track in moved.nla_tracks if track.name.startswith(TRACK)] if moved else []:
        moved.nla_tracks.remove(track)


class Still:
    """Nothing plays on an armature inside of the block."""

    def __init__(self, armature):
        self.moved = armature.animation_data_create()

    def __enter__(self):
        self.action, self.nla = self.moved.action, self.moved.use_nla
        self.slot = getattr(self.moved, "action_slot", None)
        self.moved.action, self.moved.use_nla = None, False

    def __exit__(self, *_):
        self.moved.action, self.moved.use_nla = self.action, self.nla
        if self.slot is not None:
            self.moved.action_slot = self.slot
