"""A body that goes on from frames that were shown, on a skeleton of other proportions."""

from dataclasses import replace

import numpy as np

from motionloom.core.body.feet import clean_feet, planted_feet
from motionloom.core.features.layout import FEET
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.live.body import transfer
from motionloom.retarget.transfer import joints22, move_feet
from tests.kinematics.test_feet import slider

FPS, PAST = 20, 10


def long_legged() -> Skeleton:
    offsets = SMPL22.offsets.copy()
    offsets[[4, 5, 7, 8]] *= 1.35
    offsets[[1, 2]] *= 1.6
    return Skeleton(SMPL22.names, SMPL22.parents, offsets)


def test_feet_that_stand_stand_on_another_skeleton_too_and_what_was_shown_stays() -> None:
    motion = clean_feet(slider())
    before = transfer(motion, long_legged(), None).frames(0, PAST)
    past = replace(before, root=before.root + np.linspace([0.0, 0, 0], [0.03, 0, 0.02], PAST))
    moved = transfer(motion, long_legged(), past)
    assert np.array_equal(moved.root[:PAST], past.root)
    assert np.array_equal(moved.rotations[:PAST], past.rotations)
    planted, places = planted_feet(motion.positions(), FPS), joints22(moved)
    toes = places[:, [FEET[1], FEET[3]]][..., [0, 2]]
    planted_pairs = (planted[1:] & planted[:-1])[:, [1, 3]]
    steps = np.linalg.norm(np.diff(toes, axis=0), axis=-1)
    assert planted_pairs[PAST - 1 :].sum() > 20
    assert np.median(steps[PAST - 1 :][planted_pairs[PAST - 1 :]]) < 1e-3
    assert steps[PAST - 1 :][planted_pairs[PAST - 1 :]].mean() < 2e-3
    usual = np.diff(joints22(transfer(motion, long_legged(), None)), axis=0)
    extra = np.linalg.norm(np.diff(places, axis=0) - usual, axis=-1)[PAST - 1]
    assert extra.max() < 0.03, "no jump where the shown frames end"


def test_one_frame_that_was_shown_is_enough_to_go_on_from() -> None:
    motion = clean_feet(slider())
    past = transfer(motion, long_legged(), None).frames(0, 1)
    past = replace(past, root=past.root + np.array([0.03, 0.0, 0.02]))
    moved = transfer(motion, long_legged(), past)
    assert np.array_equal(moved.root[:1], past.root)
    assert np.linalg.norm(moved.root[1] - moved.root[0]) < 0.03


def test_a_foot_goes_where_it_is_moved_and_nothing_above_the_hips_does() -> None:
    motion = transfer(clean_feet(slider()), long_legged(), None)
    shift = np.zeros((len(motion), 2, 3))
    shift[:, 0, 0] = 0.03
    old, new = joints22(motion), joints22(move_feet(motion, shift))
    np.testing.assert_allclose(new[:, 8], old[:, 8], atol=1e-6)
    np.testing.assert_allclose(new[:, [0, 9, 15, 20]], old[:, [0, 9, 15, 20]], atol=1e-9)
    moved = new[:, 7] - old[:, 7]
    assert np.median(moved[:, 0]) > 0.029
