"""What the panel holds: in the scene, so that it is saved with the file, and in the add-on's preferences."""

import os

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from . import takes
from .client import Client

JOINTS = (
    ("left_wrist", "Left hand", "The wrist of the left hand"),
    ("right_wrist", "Right hand", "The wrist of the right hand"),
    ("left_ankle", "Left foot", "The ankle of the left foot"),
    ("right_ankle", "Right foot", "The ankle of the right foot"),
    ("left_foot", "Left toes", "Where the toes of the left foot begin"),
    ("right_foot", "Right toes", "Where the toes of the right foot begin"),
    ("left_elbow", "Left elbow", ""),
    ("right_elbow", "Right elbow", ""),
    ("left_knee", "Left knee", ""),
    ("right_knee", "Right knee", ""),
    ("head", "Head", "Where the head begins"),
    ("pelvis", "Hips", ""),
)


def _is_armature(self, thing):
    return thing.type == "ARMATURE"


def _is_curve(self, thing):
    return thing.type == "CURVE"


class Block(bpy.types.PropertyGroup):
    """Some seconds with words of their own."""

    text: StringProperty(name="Words", description="What the person does, such as 'a person walks forward'")
    other: StringProperty(
        name="Second person", description="What the second person does; empty: the words are for both"
    )
    seconds: FloatProperty(name="Seconds", default=4.0, min=0.2, max=60.0, description="Length of this block", step=50)


class Goal(bpy.types.PropertyGroup):
    """Where a hand, a foot or another joint is to be."""

    target: PointerProperty(type=bpy.types.Object, name="Empty", description="The object whose place the joint reaches")
    joint: EnumProperty(items=JOINTS, name="Joint")
    frame: IntProperty(name="From", default=1, description="The frame at which the joint is there")
    until: IntProperty(name="To", default=0, description="Last frame; the same as the first, or less: that frame alone")


class Pose(bpy.types.PropertyGroup):
    """A pose that the motion passes through."""

    frame: IntProperty(name="Frame", description="When the motion passes through the pose")
    matrices: StringProperty(description="The bones in the world, as JSON")
    body: StringProperty(description="The armature that it was read from")


class TakePart(bpy.types.PropertyGroup):
    """What a take does to one armature."""

    armature: PointerProperty(type=bpy.types.Object)
    action: PointerProperty(type=bpy.types.Action)


class Take(bpy.types.PropertyGroup):
    """One motion that was made."""

    seed: IntProperty(name="Seed")
    parts: CollectionProperty(type=TakePart)
    remark: StringProperty(name="Remark")
    pieces: StringProperty(description="JSON: name, first and last frame of each block")


class Settings(bpy.types.PropertyGroup):
    """Of a scene."""

    blocks: CollectionProperty(type=Block)
    block_at: IntProperty()
    second: PointerProperty(
        type=bpy.types.Object, name="Second person", poll=_is_armature, description="Two people move together"
    )
    path: PointerProperty(
        type=bpy.types.Object, name="Path", poll=_is_curve, description="A curve that the hips follow"
    )
    facing: EnumProperty(
        name="Facing",
        items=(
            ("along", "Along the path", "The person faces where the path goes"),
            ("free", "As the words say", "Such as for somebody who walks sideways"),
        ),
    )
    goals: CollectionProperty(type=Goal)
    goal_at: IntProperty()
    poses: CollectionProperty(type=Pose)
    pose_at: IntProperty()
    start: IntProperty(name="First frame", default=1, description="The frame at which new motion begins")
    seed: IntProperty(name="Seed", default=1, min=0, description="The same seed makes the same motion")
    count: IntProperty(name="Takes", default=1, min=1, max=8, description="Motions to make, with the next seeds")
    loop: BoolProperty(name="Loop", description="The end meets the beginning")
    steps: IntProperty(name="Steps", default=24, min=2, max=200, description="Network calls: fewer is faster")
    guidance: FloatProperty(name="Guidance", default=2.5, min=0, max=20, description="How firmly the words are obeyed")
    root: EnumProperty(
        name="Root bone",
        description="What carries the way over the ground, where a bone on the ground is above the hips",
        items=(
            ("motion", "Moves", "The root bone carries the way"),
            ("hips", "Stays", "The hips carry the way"),
            ("in-place", "In place", "The way is left out"),
        ),
    )
    output: EnumProperty(
        name="As",
        items=(
            ("ACTION", "Action", "The armature plays the take as its action"),
            ("NLA", "NLA strips", "A track with a strip for each block of words"),
        ),
    )
    redo_text: StringProperty(
        name="Words", description="What happens in the frames that are made anew; empty: anything"
    )
    redo_from: IntProperty(name="From", default=20, description="First frame that is made anew")
    redo_to: IntProperty(name="To", default=40, description="Last frame that is made anew")
    takes: CollectionProperty(type=Take)
    take_at: IntProperty(update=lambda self, context: takes.show(self))


class Preferences(bpy.types.AddonPreferences):
    """Where the server is."""

    bl_idname = __package__

    address: StringProperty(name="Server", default="http://127.0.0.1:8020", description="Address of 'motionloom serve'")
    token: StringProperty(name="Token", subtype="PASSWORD", description="What a server for other computers asks for")
    command: StringProperty(
        name="Program",
        default="motionloom",
        subtype="FILE_PATH",
        description="What 'Start' runs: the motionloom command",
    )
    folder: StringProperty(
        name="Project folder",
        default=os.path.join(os.path.expanduser("~"), "motionloom-blender"),
        subtype="DIR_PATH",
        description="Where a server that is started here keeps its motions",
    )

    def draw(self, context):
        """The fields in the preferences window."""
        for name in ("address", "token", "command", "folder"):
            self.layout.prop(self, name)


def preferences():
    """The add-on's own."""
    return bpy.context.preferences.addons[__package__].preferences


def client():
    """The server that the preferences name."""
    own = preferences()
    return Client(own.address, own.token)


CLASSES = (Block, Goal, Pose, TakePart, Take, Settings, Preferences)
