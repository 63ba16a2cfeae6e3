"""What is asked, read from the scene: armatures, a curve, empties, poses, words."""

import json

import bpy
import numpy as np
from mathutils.geometry import interpolate_bezier

from . import takes
from .bodies import Body, posed, sampled
from .client import Problem
from .jobs import Goal, Plan

AROUND = 10.0
"""Seconds of motion on either side of what is made anew that the server sees."""


def rate(scene):
    """Frames per second."""
    return scene.render.fps / scene.render.fps_base


def chosen(context):
    """The armature that moves: the active object, that of the active mesh, or a selected one. Raises `Problem`."""
    active = context.view_layer.objects.active
    selected = [thing for thing in context.view_layer.objects.selected if thing.type == "ARMATURE"]
    for thing in (active, active.find_armature() if active else None, *selected):
        if thing is not None and thing.type == "ARMATURE":
            return thing
    raise Problem("No armature is selected: select the one that is to move")


def plan_of(context):
    """The `Plan` of what the panel holds. Raises `Problem`."""
    scene, armature = context.scene, chosen(context)
    own, fps = scene.motionloom, rate(scene)
    words = [(" ".join(b.text.split()), " ".join(b.other.split()), b.seconds) for b in own.blocks]
    if not words or not all(text for text, *_ in words):
        raise Problem("There are no words: write in each block what the person does, such as 'a person walks'")
    armatures = [armature] + ([own.second] if own.second is not None and own.second != armature else [])
    plan = Plan([Body(one) for one in armatures], words, fps)
    if own.path is not None:
        plan.path, plan.closed = path_points(own.path)
        plan.facing = own.facing
    plan.goals = [_goal(scene, goal, plan.seconds) for goal in own.goals if goal.target is not None]
    plan.poses = [
        (_seconds(scene, pose.frame, plan.seconds, "a pose"), np.array(json.loads(pose.matrices)))
        for pose in sorted(own.poses, key=lambda pose: pose.frame)
        if pose.body == armature.name
    ]
    if len(words) > 1 and (plan.goals or plan.poses) and plan.path is None:
        raise Problem(
            "Goals and poses in several blocks need a path, which says where the person is: choose a curve, or put the "
            "words into one block"
        )
    plan.seed, plan.count, plan.loop, plan.steps = own.seed, own.count, own.loop, own.steps
    plan.guidance, plan.root = own.guidance, own.root
    return plan


def _seconds(scene, frame, length, what):
    """When a frame is, from the start of the motion. Raises `Problem` where that is outside of it."""
    time = (frame - scene.motionloom.start) / rate(scene)
    if not -1e-6 <= time <= length + 1e-6:
        first = scene.motionloom.start
        last = round(first + length * rate(scene))
        raise Problem(f"Frame {frame} of {what} is outside of the motion, which takes frames {first} to {last}")
    return max(time, 0.0)


def _goal(scene, goal, length):
    """Where the goal's object is, at its frame or at every moment from its first to its last."""
    what = f"the goal {goal.target.name!r}"
    first = _seconds(scene, goal.frame, length, what)
    last = max(first, _seconds(scene, goal.until, length, what) if goal.until > goal.frame else first)
    times = [first] if last == first else [t / 20 for t in range(round(first * 20), round(last * 20) + 1)]
    now, points = (scene.frame_current, scene.frame_subframe), []
    for time in times:
        at = scene.motionloom.start + time * rate(scene)
        scene.frame_set(int(at), subframe=at - int(at))
        points.append((time, np.array(goal.target.matrix_world.translation)))
    scene.frame_set(now[0], subframe=now[1])
    return Goal(goal.joint, points, goal.target.name)


def path_points(curve):
    """(points, 3) of the world along the first spline of a curve, and whether it is closed. Raises `Problem`."""
    splines = curve.data.splines
    if not splines:
        raise Problem(f"The curve {curve.name} has no points: draw the way over the ground")
    spline = splines[0]
    if spline.type == "BEZIER":
        knots = list(spline.bezier_points)
        points = [knots[0].co] if knots else []
        for a, b in zip(knots, knots[1:] + (knots[:1] if spline.use_cyclic_u else [])):
            points += interpolate_bezier(a.co, a.handle_right, b.handle_left, b.co, 13)[1:]
        points = points[:-1] if spline.use_cyclic_u else points
    elif spline.type == "POLY":
        points = [point.co.xyz for point in spline.points]
    else:
        shown = curve.evaluated_get(bpy.context.evaluated_depsgraph_get())
        points = [vertex.co.copy() for vertex in shown.to_mesh().vertices]
        shown.to_mesh_clear()
    world = np.array([curve.matrix_world @ point for point in points])
    if len(world) < 2 or np.ptp(world, axis=0)[:2].max() < 1e-3:
        raise Problem(f"The curve {curve.name} goes nowhere: draw the way over the ground")
    return world, bool(spline.use_cyclic_u)


def pose_now(armature):
    """The pose that an armature shows, as text for `settings.Pose`."""
    return json.dumps(posed(armature, Body(armature)).round(6).tolist())


def keyed_frames(settings, armature):
    """Frames of an armature's action at which something is keyed, rising."""
    from .actions import curves_of

    action = takes.shown(settings, armature)
    if action is None:
        raise Problem(f"{armature.name} plays no action: key poses first, or keep the pose of the current frame")
    return sorted({round(p.co.x) for curve in curves_of(action, armature) for p in curve.keyframe_points})


class Stretch:
    """Frames of an armature's motion that are to be made anew, and what is around them."""

    def __init__(self, context):
        """Raises `Problem` where there is no motion, or the frames are outside of it."""
        scene = context.scene
        own, fps = scene.motionloom, rate(scene)
        armature = chosen(context)
        action = takes.shown(own, armature)
        if action is None:
            raise Problem(f"{armature.name} has no motion that could be changed: generate one, or choose its action")
        begin, end = (round(at) for at in action.frame_range)
        self.action = action.name  # not itself: an undo meanwhile makes another of it
        self.first, self.last = own.redo_from, own.redo_to
        if not begin <= self.first < self.last <= end:
            raise Problem(
                f"Frames {self.first} to {self.last} are not inside of {action.name}, which has {begin} to {end}: "
                "choose a first and a later last frame of it"
            )
        around = round(AROUND * fps)
        self.begin, end = max(begin, self.first - around), min(end, self.last + around)
        self.body = Body(armature)
        self.poses = sampled(armature, self.body, range(self.begin, end + 1))
        self.span = ((self.first - self.begin) / fps, (self.last - self.begin) / fps)
