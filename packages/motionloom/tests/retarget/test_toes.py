"""Toes of a skeleton with toe tips: they bend on the ground, and nothing else moves."""

import numpy as np

from motionloom.core import rotations as rot
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.retarget import retarget
from motionloom.retarget.anatomy import read_body
from motionloom.retarget.toes import bend_toes


def with_tips() -> Skeleton:
    """The uniform person with an End Site 8 cm ahead of each toe joint, and one beside it."""
    tips = {"a": 10, "b": 10, "c": 11}
    names = (*SMPL22.names, *tips)
    places = [[0.0, 0.0, 0.08], [0.03, 0.0, 0.06], [0.0, 0.0, 0.08]]
    offsets = np.concatenate([SMPL22.offsets, places])
    return Skeleton(names, (*SMPL22.parents, *tips.values()), offsets, ends=frozenset({22, 23, 24}))


def heels_up() -> Motion:
    """On the balls of both feet, from flat to 60 degrees; the left one then in the air."""
    turns = np.zeros((40, 22, 3))
    turns[:, [7, 8], 0] = np.linspace(0, np.pi / 3, 40)[:, None]
    still = Motion(SMPL22, 30.0, np.tile(SMPL22.offsets[0], (40, 1)), rot.rotvec_to_quat(turns))
    low = still.positions()[:, [10, 11], 1].min(axis=1)
    return Motion(SMPL22, 30.0, still.root - low[:, None] * [0.0, 1.0, 0.0], still.rotations)


def test_tips_stay_out_of_the_floor_and_all_else_where_it_is() -> None:
    skeleton = with_tips()
    moving = retarget(heels_up(), skeleton)
    bent = bend_toes(moving, read_body(skeleton))
    before, after = moving.positions(), bent.positions()
    assert before[:, 22:, 1].min() < -0.05
    floor = np.minimum(after[:, [10, 10, 11], 1], 0.0)
    assert (after[:, 22:, 1] > floor - 1e-3).all()
    np.testing.assert_array_equal(after[:, :22], before[:, :22])
    np.testing.assert_allclose(
        np.linalg.norm(after[:, 22] - after[:, 10], axis=-1), np.linalg.norm(skeleton.offsets[22]), atol=1e-9
    )


def test_toes_in_the_air_are_left() -> None:
    skeleton = with_tips()
    moving = retarget(heels_up(), skeleton)
    high = Motion(skeleton, 30.0, moving.root + np.array([0.0, 0.3, 0.0]), moving.rotations)
    np.testing.assert_array_equal(bend_toes(high, read_body(skeleton)).rotations, high.rotations)
