"""The sidebar of the 3D view: words on a strip list, goals, generate, takes, redo."""

import bpy

from . import scene
from .client import SERVER, Problem
from .operators import Running

WIDTH = 30
"""Letters in one line of a sentence."""


class MOTIONLOOM_UL_blocks(bpy.types.UIList):
    """Words with their lengths."""

    def draw_item(self, context, layout, data, item, icon, active, name, index):
        """Words and seconds on one line."""
        row = layout.row(align=True)
        row.prop(item, "text", text="", emboss=False)
        side = row.row(align=True)
        side.ui_units_x = 3
        side.prop(item, "seconds", text="")


class MOTIONLOOM_UL_goals(bpy.types.UIList):
    """Empties that hands and feet reach."""

    def draw_item(self, context, layout, data, item, icon, active, name, index):
        """Joint and object."""
        row = layout.row(align=True)
        row.prop(item, "joint", text="", emboss=False)
        row.label(text=item.target.name if item.target is not None else "no empty", icon="EMPTY_AXIS")


class MOTIONLOOM_UL_poses(bpy.types.UIList):
    """Poses that the motion passes through."""

    def draw_item(self, context, layout, data, item, icon, active, name, index):
        """Frame and armature."""
        row = layout.row(align=True)
        row.label(text=item.body, icon="ARMATURE_DATA")
        row.prop(item, "frame", text="")


class MOTIONLOOM_UL_takes(bpy.types.UIList):
    """Motions that were made."""

    def draw_item(self, context, layout, data, item, icon, active, name, index):
        """The name; the chosen one is played."""
        layout.prop(item, "name", text="", emboss=False, icon="ACTION")


class Side:
    """A part of the sidebar."""

    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Motionloom"


def listed(layout, own, which, at, *, move=False, rows=3):
    """A list with its buttons."""
    row = layout.row()
    row.template_list(f"MOTIONLOOM_UL_{which}", "", own, which, own, at, rows=rows)
    column = row.column(align=True)
    if which != "takes":
        column.operator("motionloom.add", text="", icon="ADD").which = which
    column.operator("motionloom.remove", text="", icon="REMOVE").which = which
    for by, icon in ((-1, "TRIA_UP"), (1, "TRIA_DOWN")) if move else ():
        button = column.operator("motionloom.move", text="", icon=icon)
        button.which, button.by = which, by


def sentence(layout, text, *, icon="NONE"):
    """A sentence on as many lines as it needs."""
    column, line = layout.column(align=True), ""
    for word in [*text.split(), ""]:
        if not word or len(line) + len(word) > WIDTH:
            column.label(text=line, icon=icon)
            line, icon = "", "BLANK1" if icon != "NONE" else "NONE"
        line = f"{line} {word}".strip()


class MOTIONLOOM_PT_main(Side, bpy.types.Panel):
    """Words and the button."""

    bl_label, bl_idname = "Motionloom", "MOTIONLOOM_PT_main"

    def draw(self, context):
        """What one needs first."""
        layout, own = self.layout, context.scene.motionloom
        try:
            layout.label(text=scene.chosen(context).name, icon="ARMATURE_DATA")
        except Problem:
            layout.label(text="Select an armature", icon="INFO")
        listed(layout, own, "blocks", "block_at", move=True)
        if 0 <= own.block_at < len(own.blocks):
            layout.prop(own.blocks[own.block_at], "text", text="")
            if own.second is not None:
                layout.prop(own.blocks[own.block_at], "other", text="")
        row = layout.row(align=True)
        row.prop(own, "seed")
        row.prop(own, "count")
        row = layout.row(align=True)
        row.prop(own, "start", text="From")
        row.prop(own, "loop", toggle=True)
        layout.row(align=True).prop(own, "output", expand=True)
        if Running.job is None:
            row = layout.row()
            row.scale_y = 1.4
            row.operator("motionloom.generate", icon="PLAY")
        else:
            row = layout.row(align=True)
            if hasattr(row, "progress"):
                row.progress(factor=Running.share, text=f"{100 * Running.share:.0f} %")
            else:
                row.label(text=f"{100 * Running.share:.0f} %")
            row.operator("motionloom.cancel", text="", icon="X")
        if Running.said:
            sentence(layout, Running.said, icon="ERROR" if Running.wrong else "INFO")
        row = layout.row()
        row.operator("motionloom.stop" if SERVER.running else "motionloom.start", icon="NETWORK_DRIVE")


class MOTIONLOOM_PT_takes(Side, bpy.types.Panel):
    """What was made."""

    bl_label, bl_parent_id = "Takes", "MOTIONLOOM_PT_main"

    def draw(self, context):
        """The list; choosing a line plays it."""
        own = context.scene.motionloom
        listed(self.layout, own, "takes", "take_at")
        if 0 <= own.take_at < len(own.takes) and own.takes[own.take_at].remark:
            sentence(self.layout, own.takes[own.take_at].remark, icon="INFO")


class MOTIONLOOM_PT_redo(Side, bpy.types.Panel):
    """Some frames anew."""

    bl_label, bl_parent_id = "Redo frames", "MOTIONLOOM_PT_main"

    def draw(self, context):
        """Words, range, button."""
        layout, own = self.layout, context.scene.motionloom
        layout.prop(own, "redo_text")
        row = layout.row(align=True)
        row.prop(own, "redo_from")
        row.prop(own, "redo_to")
        layout.operator("motionloom.redo", icon="FILE_REFRESH")


class MOTIONLOOM_PT_goals(Side, bpy.types.Panel):
    """Where it goes."""

    bl_label, bl_parent_id = "Path, goals, poses", "MOTIONLOOM_PT_main"

    def draw(self, context):
        """A curve, empties, poses."""
        layout, own = self.layout, context.scene.motionloom
        layout.prop(own, "path", icon="CURVE_DATA")
        if own.path is not None:
            layout.prop(own, "facing")
        layout.label(text="Goals of hands and feet")
        listed(layout, own, "goals", "goal_at", rows=2)
        if 0 <= own.goal_at < len(own.goals):
            goal = own.goals[own.goal_at]
            layout.prop(goal, "target")
            row = layout.row(align=True)
            row.prop(goal, "frame")
            row.prop(goal, "until")
        layout.label(text="Poses on the way")
        listed(layout, own, "poses", "pose_at", rows=2)
        layout.operator("motionloom.keyed", icon="KEYFRAME_HLT")


class MOTIONLOOM_PT_more(Side, bpy.types.Panel):
    """What is seldom changed."""

    bl_label, bl_parent_id = "More", "MOTIONLOOM_PT_main"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context):
        """Second person, root bone, sampling."""
        layout, own = self.layout, context.scene.motionloom
        for name in ("second", "root", "steps", "guidance"):
            layout.prop(own, name)


CLASSES = (
    MOTIONLOOM_UL_blocks,
    MOTIONLOOM_UL_goals,
    MOTIONLOOM_UL_poses,
    MOTIONLOOM_UL_takes,
    MOTIONLOOM_PT_main,
    MOTIONLOOM_PT_takes,
    MOTIONLOOM_PT_redo,
    MOTIONLOOM_PT_goals,
    MOTIONLOOM_PT_more,
)
