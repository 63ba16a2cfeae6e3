"""People on the joints of a prediction network (`features.positions.Layout`): from the 22 joints, and as motions.

Networks of benchmarks see other joints than the uniform person has, 17 of Human3.6M for example, and places only.
`places_on_layout` gives them the person of any clip, joint by joint by name; `body_of_places` turns places into a
motion with a rotation for every joint, which files of skeletons hold.
"""

import numpy as np
from numpy.typing import NDArray

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.features.positions import Layout, bone_lengths
from motionloom.core.motion import Motion, local_rotations
from motionloom.core.skeleton import SMPL22, Skeleton

Array = NDArray[np.float64]
OTHER_NAMES = {
    "hip": ("pelvis",),
    "hips": ("pelvis",),
    "root": ("pelvis",),
    "spine": ("spine1", "spine2"),
    "thorax": ("spine3",),
}
"""Joints that benchmarks name otherwise, and the joints of the 22 in whose middle they lie."""


def smpl_joints(layout: Layout) -> tuple[tuple[int, ...], ...]:
    """For each joint of a layout the numbers of the 22 in whose middle it lies; raises MotionloomError for joints of
    other names."""
    names = [OTHER_NAMES.get(name, (name,)) for name in layout.names]
    unknown = [name for name, parts in zip(layout.names, names) if not set(parts) <= set(SMPL22.names)]
    if unknown:
        raise MotionloomError(
            f"the network sees a joint {unknown[0]!r} that corresponds to none of the 22; give it motion as places of "
            f"its {layout.joints} joints"
        )
    return tuple(tuple(map(SMPL22.index, parts)) for parts in names)


def places_on_layout(layout: Layout, positions: np.ndarray) -> Array:
    """(..., 22, 3) metres to the places (..., joints, 3) of a layout's joints, by their names: left stays left."""
    p = np.asarray(positions, dtype=np.float64)
    return np.stack([p[..., list(joints), :].mean(axis=-2) for joints in smpl_joints(layout)], axis=-2)


def layout_skeleton(layout: Layout, positions: np.ndarray) -> Skeleton:
    """The skeleton of a layout with the mean bone lengths of places (frames, joints, 3) metres.

    At rest its bones point as those of the 22 joints do at rest; where a layout's joints have other names, as in the
    first frame.
    """
    try:
        rest = places_on_layout(layout, SMPL22.rest_positions())
    except MotionloomError:
        rest = np.asarray(positions, dtype=np.float64)[0]
    bones = rest[1:] - rest[list(layout.parents[1:])]
    size = np.linalg.norm(bones, axis=-1, keepdims=True)
    directions = np.where(size > 1e-9, bones / np.maximum(size, 1e-9), [0.0, 1.0, 0.0])
    lengths = bone_lengths(positions, layout.parents)[1:, None]
    return Skeleton(layout.names, layout.parents, np.concatenate([np.zeros((1, 3)), lengths * directions]))


def body_of_places(positions: np.ndarray, skeleton: Skeleton, fps: float) -> Motion:
    """The motion of a skeleton that takes places (frames, joints, 3) metres exactly.

    Every joint turns so that the bones below it point as they do in the places, joints with one child the shortest way
    from how their parent is turned. Where several bones below a joint do not move as one, the offsets of their joints
    change. Raises MotionloomError for places that do not fit the skeleton or are not finite.
    """
    goal = np.asarray(positions, dtype=np.float64)
    if goal.ndim != 3 or not len(goal) or goal.shape[1:] != (len(skeleton), 3) or not np.isfinite(goal).all():
        raise MotionloomError(
            f"places of this skeleton are finite numbers (frames, {len(skeleton)}, 3); got the shape {goal.shape}"
        )
    world = np.tile(rot.IDENTITY, (*goal.shape[:2], 1))
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            world[:, joint] = world[:, parent]
        children = list(skeleton.children(joint))
        if children:
            world[:, joint] = _turned(world[:, joint], skeleton.offsets[children], goal[:, children] - goal[:, [joint]])
    offsets, above = np.tile(skeleton.offsets, (len(goal), 1, 1)), list(skeleton.parents[1:])
    offsets[:, 1:] = rot.rotate(rot.inverse(world[:, above]), goal[:, 1:] - goal[:, above])
    return Motion(skeleton, fps, goal[:, 0].copy(), local_rotations(skeleton, world), offsets)


def _turned(before: Array, rest: Array, bones: Array) -> Array:
    """World orientations (frames, 4) that turn ``rest`` (children, 3) into the directions of ``bones`` (frames,
    children, 3): the nearest to ``before`` where they do not show all of it (Kabsch 1976)."""
    lengths = np.linalg.norm(bones, axis=-1, keepdims=True)
    now = rot.rotate(before[:, None], np.broadcast_to(rest, bones.shape))
    aims = np.where(lengths > 1e-9, bones / np.maximum(lengths, 1e-9), 0.0)
    size = np.linalg.norm(now, axis=-1, keepdims=True)
    units = now / np.maximum(size, 1e-9)
    if len(rest) == 1:
        arcs = rot.shortest_arc(units[:, 0], np.where(lengths[:, 0] > 1e-9, aims[:, 0], units[:, 0]))
        return rot.normalize(rot.multiply(arcs, before))
    correlation = np.einsum("fki,fkj->fij", aims, units) + 1e-3 * np.eye(3)
    u, _, vt = np.linalg.svd(correlation)
    signs = np.ones((len(bones), 3))
    signs[:, 2] = np.linalg.det(u @ vt)
    return rot.normalize(rot.multiply(rot.matrix_to_quat((u * signs[:, None]) @ vt), before))
