"""Lines of the panel's lists: added, removed, moved; poses that are kept."""

import bpy
from bpy.props import EnumProperty, IntProperty

from . import actions, scene
from .client import Problem

LISTS = {"blocks": "block_at", "goals": "goal_at", "poses": "pose_at", "takes": "take_at"}
"""The scene's lists, and what says which line is chosen."""
MOST_POSES = 40


class Listing:
    """An operator on one of the lists."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    which: EnumProperty(items=[(name, name, "") for name in LISTS], options={"HIDDEN"})


class MOTIONLOOM_OT_add(Listing, bpy.types.Operator):
    """Add a line"""

    bl_idname, bl_label = "motionloom.add", "Add"

    def execute(self, context):
        """A block of words, a goal at the active empty, or the pose of now."""
        own = context.scene.motionloom
        if self.which == "poses":
            return _keep(self, context, None)
        line = getattr(own, self.which).add()
        if self.which == "goals":
            line.frame = context.scene.frame_current
            active = context.view_layer.objects.active
            line.target = active if active is not None and active.type == "EMPTY" else None
        setattr(own, LISTS[self.which], len(getattr(own, self.which)) - 1)
        return {"FINISHED"}


class MOTIONLOOM_OT_remove(Listing, bpy.types.Operator):
    """Remove the chosen line; a take's action goes with it"""

    bl_idname, bl_label = "motionloom.remove", "Remove"

    def execute(self, context):
        """The line before it is chosen then."""
        own = context.scene.motionloom
        lines, at = getattr(own, self.which), getattr(own, LISTS[self.which])
        if not 0 <= at < len(lines):
            return {"CANCELLED"}
        if self.which == "takes":
            for part in lines[at].parts:
                if part.armature is not None:
                    actions.clear_strips(part.armature)
                if part.action is not None:
                    bpy.data.actions.remove(part.action)
        lines.remove(at)
        setattr(own, LISTS[self.which], max(0, at - 1))
        return {"FINISHED"}


class MOTIONLOOM_OT_move(Listing, bpy.types.Operator):
    """Move the chosen line"""

    bl_idname, bl_label = "motionloom.move", "Move"
    by: IntProperty(default=1)

    def execute(self, context):
        """Up or down by one."""
        own = context.scene.motionloom
        lines, at = getattr(own, self.which), getattr(own, LISTS[self.which])
        if 0 <= at + self.by < len(lines):
            lines.move(at, at + self.by)
            setattr(own, LISTS[self.which], at + self.by)
        return {"FINISHED"}


class MOTIONLOOM_OT_keyed(bpy.types.Operator):
    """Keep the pose of every frame at which the armature's action has keys"""

    bl_idname, bl_label = "motionloom.keyed", "Keyed poses"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def execute(self, context):
        """They become lines of the list."""
        try:
            frames = scene.keyed_frames(context.scene.motionloom, scene.chosen(context))
        except Problem as problem:
            self.report({"ERROR"}, str(problem))
            return {"CANCELLED"}
        if len(frames) > MOST_POSES:
            self.report(
                {"ERROR"}, f"The action has keys on {len(frames)} frames; at most {MOST_POSES} are taken as poses"
            )
            return {"CANCELLED"}
        return _keep(self, context, frames)


def _keep(operator, context, frames):
    """Poses of the armature as lines: on frames of its action, or (None) as it is shown now, keyed or not."""
    view, own = context.scene, context.scene.motionloom
    try:
        armature, now = scene.chosen(context), view.frame_current
        if frames is None:
            found = [(now, scene.pose_now(armature))]
        else:
            found = []
            for frame in frames:
                view.frame_set(frame)
                found.append((frame, scene.pose_now(armature)))
            view.frame_set(now)
    except Problem as problem:
        operator.report({"ERROR"}, str(problem))
        return {"CANCELLED"}
    for frame, matrices in found:
        line = own.poses.add()
        line.frame, line.matrices, line.body = frame, matrices, armature.name
    own.pose_at = len(own.poses) - 1
    return {"FINISHED"}


CLASSES = (MOTIONLOOM_OT_add, MOTIONLOOM_OT_remove, MOTIONLOOM_OT_move, MOTIONLOOM_OT_keyed)
