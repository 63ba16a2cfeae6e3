"""Forward kinematics against a naive version; cutting, resampling and mirroring keep what they should."""

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton

EVEN = Skeleton(
    SMPL22.names, SMPL22.parents, (SMPL22.offsets + SMPL22.offsets[list(SMPL22.mirror_pairs())] * [-1, 1, 1]) / 2
)


def wild(frames: int = 7, skeleton: Skeleton = SMPL22, *, seed: int = 0) -> Motion:
    random = np.random.default_rng(seed)
    q = rot.rotvec_to_quat(random.normal(scale=0.7, size=(frames, len(skeleton), 3)))
    return Motion(skeleton, 30.0, random.normal(size=(frames, 3)), q)


def spin(frames: int, fps: float, *, speed: float) -> Motion:
    """The pelvis moves at 1 m/s along x and turns about y at constant speed (radians per second)."""
    time = np.arange(frames) / fps
    q = np.tile(rot.IDENTITY, (frames, 22, 1))
    q[:, 0] = rot.rotvec_to_quat(time[:, None] * np.array([0.0, speed, 0.0]))
    return Motion(SMPL22, fps, time[:, None] * np.array([1.0, 0.0, 0.0]), q)


def naive_positions(motion: Motion, frame: int) -> np.ndarray:
    """4x4 matrices, joint by joint, from the root each time."""
    places = []
    for joint in range(len(motion.skeleton)):
        chain = [joint]
        while chain[0] != 0:
            chain.insert(0, motion.skeleton.parents[chain[0]])
        total = np.eye(4)
        for j in chain:
            step = np.eye(4)
            step[:3, :3] = rot.quat_to_matrix(motion.rotations[frame, j])
            if j == 0:
                step[:3, 3] = motion.root[frame]
            else:
                moved = motion.translations
                step[:3, 3] = motion.skeleton.offsets[j] if moved is None else moved[frame, j]
            total = total @ step
        places.append(total[:3, 3])
    return np.array(places)


def test_forward_kinematics_is_the_product_of_matrices() -> None:
    motion = wild()
    assert np.allclose(motion.positions()[3], naive_positions(motion, 3))


def test_forward_kinematics_takes_translations_that_change() -> None:
    plain = wild()
    moved = np.random.default_rng(1).normal(size=(7, 22, 3))
    motion = Motion(SMPL22, 30.0, plain.root, plain.rotations, moved)
    assert np.allclose(motion.positions()[3], naive_positions(motion, 3))


def test_the_rest_pose_is_what_no_rotation_gives() -> None:
    still = Motion(SMPL22, 30.0, SMPL22.offsets[:1], np.tile(rot.IDENTITY, (1, 22, 1)))
    assert np.allclose(still.positions()[0], SMPL22.rest_positions())


def test_bones_keep_their_lengths() -> None:
    places = wild(20).positions()
    lengths = np.linalg.norm(places[:, 1:] - places[:, list(SMPL22.parents[1:])], axis=-1)
    assert np.allclose(lengths, SMPL22.bone_lengths()[1:], atol=1e-12)


def test_a_crop_is_by_seconds_and_half_open() -> None:
    motion = wild(60)
    part = motion.crop(0.5, 1.0)
    assert len(part) == 15
    assert np.array_equal(part.root, motion.root[15:30])
    assert part.seconds == pytest.approx(0.5)


@pytest.mark.parametrize(("start", "end"), [(1.0, 1.0), (-0.1, 1.0), (0.0, 2.1), (1.0, 0.5)])
def test_a_crop_outside_is_refused(start: float, end: float) -> None:
    with pytest.raises(MotionloomError, match=r"cannot crop .* both from 0 to 2\.000"):
        wild(60).crop(start, end)


def test_a_rate_that_asks_for_more_than_memory_holds_is_refused() -> None:
    with pytest.raises(MotionloomError, match="ask for a lower rate"):
        spin(2, 1e-4, speed=0.0).resample(1000.0)


@pytest.mark.parametrize("fps", [10.0, 20.0, 24.0, 30.0, 60.0, 120.0])
def test_resampling_a_steady_turn_gives_the_same_turn(fps: float) -> None:
    out = spin(61, 30.0, speed=2.0).resample(fps)
    exact = spin(len(out), fps, speed=2.0)
    assert len(out) == int(2.0 * fps) + 1
    assert np.allclose(out.root, exact.root)
    assert np.allclose(out.positions(), exact.positions())


def test_resampling_to_a_multiple_keeps_the_old_frames() -> None:
    motion = wild(10)
    out = motion.resample(90.0)
    assert np.allclose(out.positions()[::3], motion.positions())


def test_poses_between_frames_and_beyond_the_ends() -> None:
    motion = spin(5, 30.0, speed=2.0)
    out = motion.at(np.array([-1.0, 0.0, 1.5, 4.0, 7.0]), 30.0)
    assert np.allclose(out.positions()[[0, 1, 3, 4]], motion.positions()[[0, 0, 4, 4]])
    assert np.allclose(out.positions()[2], spin(10, 60.0, speed=2.0).positions()[3])


def test_resampling_goes_the_short_way_where_signs_flip() -> None:
    motion = spin(5, 30.0, speed=2.0)
    flipped = Motion(SMPL22, 30.0, motion.root, motion.rotations * np.array([1, -1, 1, -1, 1.0])[:, None, None])
    assert np.allclose(flipped.resample(77.0).positions(), motion.resample(77.0).positions())


@pytest.mark.parametrize("fps", [0.0, -1.0, np.nan, np.inf])
def test_an_impossible_rate_is_refused(fps: float) -> None:
    with pytest.raises(MotionloomError, match="frame rate"):
        wild().resample(fps)


def test_mirroring_reflects_the_places_and_swaps_the_sides() -> None:
    motion = wild(skeleton=EVEN)
    expected = motion.positions()[:, list(EVEN.mirror_pairs())] * [-1, 1, 1]
    assert np.allclose(motion.mirror().positions(), expected)


def test_mirroring_twice_changes_nothing() -> None:
    motion = wild()
    again = motion.mirror().mirror()
    assert np.allclose(again.positions(), motion.positions())


def test_a_motion_with_nan_or_wrong_shapes_is_refused() -> None:
    good = wild()
    with pytest.raises(MotionloomError, match="not finite"):
        Motion(SMPL22, 30.0, good.root * np.nan, good.rotations)
    with pytest.raises(MotionloomError, match="22 joints"):
        Motion(SMPL22, 30.0, good.root[:3], good.rotations)
    with pytest.raises(MotionloomError, match="at least one"):
        Motion(SMPL22, 30.0, np.zeros((0, 3)), np.zeros((0, 22, 4)))
    with pytest.raises(MotionloomError, match="translations"):
        Motion(SMPL22, 30.0, good.root, good.rotations, np.zeros((7, 3)))
    with pytest.raises(MotionloomError, match="frame rate"):
        Motion(SMPL22, 0.0, good.root, good.rotations)


def test_a_printed_motion_is_one_line_without_its_numbers() -> None:
    motion = Motion(SMPL22, 20.0, np.zeros((30, 3)), np.tile(rot.IDENTITY, (30, 22, 1)))
    assert repr(motion) == "Motion(22 joints, 30 frames, 1.50 s at 20 per second)"
