"""A root bone on the ground under the hips, as game engines want it: which bone it is, and what it carries."""

from dataclasses import replace
from itertools import pairwise
from typing import Literal

import numpy as np

from motionloom.core.motion import Motion
from motionloom.retarget.anatomy import Body

RootMode = Literal["motion", "hips", "in-place"]
LOW = 0.25
"""A root bone is at most so high above the soles, in heights of the pelvis."""


def ground_root(body: Body) -> int | None:
    """The joint above the pelvis that is on the ground at rest; None where the hips themselves are the root."""
    pelvis = body.drivers[0]
    if pelvis is None or not body.upright or body.up[1] < 0.9:
        return None
    heights = body.skeleton.rest_positions()[:, 1]
    soles = float(body.rest[:, 1].min())
    limit = soles + LOW * (float(body.rest[0, 1]) - soles)
    return next((j for j in body.skeleton.ancestors(pelvis)[1:] if heights[j] < limit), None)


def place_root(motion: Motion, body: Body, mode: RootMode) -> Motion:
    """The motion with its way over the ground on the root bone, on the hips, or left out.

    ``motion`` is on the body's skeleton with all joints above the pelvis unturned, as `retarget` makes it. The root
    bone stays on the ground in all three; without one, the hips carry the way and "in-place" takes it from them.
    """
    pelvis, root = body.drivers[0], ground_root(body)
    rest, places = body.skeleton.rest_positions(), motion.positions()
    if pelvis is None:
        return motion
    way = (places[:, pelvis] - rest[pelvis]) * np.array([1.0, 0.0, 1.0])
    hips = places[:, pelvis] - way if mode == "in-place" else places[:, pelvis]
    if root is None:
        return replace(motion, root=motion.root - way) if mode == "in-place" else motion
    ground = float(body.rest[10:12, 1].mean()) - body.toe_height  # of the soles at rest
    carried = way if mode == "motion" else np.zeros_like(way)
    line = body.skeleton.ancestors(pelvis)[::-1]
    above = {j: np.tile(rest[j] - [0.0, ground, 0.0], (len(motion), 1)) for j in line[:-1]}
    for j in line[line.index(root) : -1]:
        above[j] = above[j] + carried
    above[pelvis] = hips
    moved = np.tile(body.skeleton.offsets, (len(motion), 1, 1))
    for parent, j in pairwise(line):
        moved[:, j] = above[j] - above[parent]
    return replace(motion, root=above[line[0]], translations=moved)
