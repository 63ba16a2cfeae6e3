"""Motionloom for Blender: words become motion of the selected armature, through `motionloom serve`.

Sidebar of the 3D view (N), Motionloom; docs/blender.md. Only the standard library, bpy, and the numpy it brings.
"""

import bpy

from . import lists, operators, panel, settings
from .client import SERVER

CLASSES = (*settings.CLASSES, *operators.CLASSES, *lists.CLASSES, *panel.CLASSES)


def register():
    """Called by Blender when the extension is enabled."""
    for one in CLASSES:
        bpy.utils.register_class(one)
    bpy.types.Scene.motionloom = bpy.props.PointerProperty(type=settings.Settings)


def unregister():
    """Called by Blender when it is disabled; a server that was started here ends."""
    SERVER.stop()
    del bpy.types.Scene.motionloom
    for one in reversed(CLASSES):
        bpy.utils.unregister_class(one)
